//! The conservative ray–box test, four boxes at once.
//!
//! After Ize, "Robust BVH Ray Traversal" (JCGT 2013): a box is never missed that holds a hit. What may go wrong
//! and what covers it:
//!
//! - Reciprocals, products and differences, here and in the shear of the watertight triangle test, each err by half
//!   an ulp: at most ten of them meet in one comparison, and [`SLACK`] widens the interval by sixteen.
//! - `plane·scale − origin·scale` saves a subtraction an axis (and fuses, where the tier can), but rounds
//!   `origin·scale` on its own: the origin moves apart by [`SHIFT`] of itself for the near and the far planes.
//! - A zero direction component would make 0·∞ = NaN for a ray in a box's face. Components count as at least
//!   [`STEEPEST`] of the largest one, which keeps every product finite; and boxes are strictly larger than what they
//!   hold, so that such a ray lies strictly between the planes.
//! - Errors in proportion to the size of a primitive are in its box: [`crate::bvh::Aabb::padded`].

use glam::{Vec3, Vec4};

use crate::bvh::node4::Node4;
use crate::bvh::ray::Ray;
use crate::simd::Lanes;

/// Relative widening of the interval at each end: 16 half-ulps.
const SLACK: f32 = 1.0 / (1 << 20) as f32;
/// Relative shift of the origin: the roundings of `origin·scale` and of the unfused `plane·scale`.
const SHIFT: f32 = 1.0 / (1 << 22) as f32;
/// Smallest direction component that counts, relative to the largest.
const STEEPEST: f32 = 1.0 / (1u64 << 60) as f32;

/// A ray as the box test needs it.
#[derive(Clone, Copy, Debug)]
pub struct SlabRay {
    x: Axis,
    y: Axis,
    z: Axis,
}

/// One axis: entry distance = near plane · `near_scale` − `near_offset`, and so for the exit. Splatted.
#[derive(Clone, Copy, Debug)]
struct Axis {
    near_scale: Vec4,
    near_offset: Vec4,
    far_scale: Vec4,
    far_offset: Vec4,
    /// Which of the two planes is met first: 0 the low one.
    near_side: usize,
}

impl SlabRay {
    /// Prepares a traceable ray.
    #[inline(always)]
    pub fn new(ray: &Ray) -> SlabRay {
        let magnitude = ray.direction.abs();
        let magnitude = magnitude.max(Vec3::splat(magnitude.max_element() * STEEPEST));
        let scale = magnitude.recip().copysign(ray.direction);
        let (near_scale, far_scale) = (scale * (1.0 - SLACK), scale * (1.0 + SLACK));
        let shift = (ray.origin.abs() * SHIFT).copysign(ray.direction);
        let near_offset = (ray.origin + shift) * near_scale;
        let far_offset = (ray.origin - shift) * far_scale;
        let axis = |k: usize| Axis {
            near_scale: Vec4::splat(near_scale[k]),
            near_offset: Vec4::splat(near_offset[k]),
            far_scale: Vec4::splat(far_scale[k]),
            far_offset: Vec4::splat(far_offset[k]),
            near_side: (ray.direction[k].to_bits() >> 31) as usize,
        };
        SlabRay { x: axis(0), y: axis(1), z: axis(2) }
    }

    /// Entry distances into the four children, at least 0, and a bit for each child that the ray meets before
    /// `t_max`.
    #[inline(always)]
    pub fn enter<L: Lanes>(&self, lanes: L, node: &Node4, t_max: f32) -> (Vec4, u32) {
        // The mask spares a bounds check.
        let near = |axis: &Axis, k: usize| {
            lanes.mul_sub(node.planes[axis.near_side & 1][k], axis.near_scale, axis.near_offset)
        };
        let far = |axis: &Axis, k: usize| {
            lanes.mul_sub(node.planes[(axis.near_side & 1) ^ 1][k], axis.far_scale, axis.far_offset)
        };
        let entry = near(&self.x, 0).max(near(&self.y, 1)).max(near(&self.z, 2).max(Vec4::ZERO));
        let exit = far(&self.x, 0).min(far(&self.y, 1)).min(far(&self.z, 2).min(Vec4::splat(t_max)));
        (entry, entry.cmple(exit).bitmask())
    }
}
