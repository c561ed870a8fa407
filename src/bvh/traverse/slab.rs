//! The conservative ray–box test, four boxes at once.
//!
//! After Ize, "Robust BVH Ray Traversal" (JCGT 2013): a box is never missed that holds a hit. What may go wrong
//! and what covers it:
//!
//! - Reciprocals, products and differences, here and in the shear of the watertight triangle test, each err by half
//!   an ulp of the result, so that distances err in proportion to themselves; [`SLACK`] is some three times the sum.
//!   (Hence `(plane − origin)·scale`: the fused `plane·scale − origin·scale` errs in proportion to the origin.)
//! - A zero direction component would make 0·∞ = NaN for a ray in a box's face. Components count as at least
//!   [`STEEPEST`] of the largest one, which keeps every product a number; and boxes are strictly larger than what
//!   they hold, so that such a ray lies strictly between the planes.
//! - Errors in proportion to the size of a primitive are in its box: [`crate::bvh::Aabb::padded`].

use glam::{BVec4A, Vec3, Vec4};

use crate::bvh::node4::Node4;
use crate::bvh::ray::Ray;

/// How much earlier than computed a box may be entered: 32 half-ulps.
const SLACK: f32 = 1.0 / (1 << 19) as f32;
/// Smallest direction component that counts, relative to the largest.
const STEEPEST: f32 = 1.0 / (1u64 << 60) as f32;

/// A ray as the box test needs it, splatted.
#[derive(Clone, Copy, Debug)]
pub struct SlabRay {
    origin: [Vec4; 3],
    scale: [Vec4; 3],
}

impl SlabRay {
    /// Prepares a traceable ray.
    #[inline(always)]
    pub fn new(ray: &Ray) -> SlabRay {
        let magnitude = ray.direction.abs();
        let magnitude = magnitude.max(Vec3::splat(magnitude.max_element() * STEEPEST));
        let scale = magnitude.recip().copysign(ray.direction);
        SlabRay { origin: ray.origin.to_array().map(Vec4::splat), scale: scale.to_array().map(Vec4::splat) }
    }

    /// Entry distances into the four children, at least 0, and which children the ray meets before `t_max`.
    ///
    /// Tried: choosing near and far planes by the signs of the direction, and fused offsets. The addresses and the
    /// twelve vectors of the ray then live on the stack: 69 instructions a node instead of 48.
    #[inline(always)]
    pub fn enter(&self, node: &Node4, t_max: f32) -> (Vec4, BVec4A) {
        let low = |k: usize| (node.planes[0][k] - self.origin[k]) * self.scale[k];
        let high = |k: usize| (node.planes[1][k] - self.origin[k]) * self.scale[k];
        let (x, y, z) = ((low(0), high(0)), (low(1), high(1)), (low(2), high(2)));
        let entry = x.0.min(x.1).max(y.0.min(y.1)).max(z.0.min(z.1).max(Vec4::ZERO)) * (1.0 - SLACK);
        let exit = x.0.max(x.1).min(y.0.max(y.1)).min(z.0.max(z.1).min(Vec4::splat(t_max)));
        (entry, entry.cmple(exit))
    }
}
