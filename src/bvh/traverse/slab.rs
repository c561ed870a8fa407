//! The conservative ray–box test, four boxes at once.
//!
//! After Ize, "Robust BVH Ray Traversal" (JCGT 2013): a box is never missed that holds a hit. What may go wrong
//! and what covers it:
//!
//! - Reciprocals, products and differences, here and in the shear of the watertight triangle test, each err by half
//!   an ulp of the result, so that distances err in proportion to themselves; [`SLACK`](crate::bvh::node::SLACK) is some three times the sum.
//!   (Hence `(plane − origin)·scale`: the fused `plane·scale − origin·scale` errs in proportion to the origin.)
//! - A zero direction component would make 0·∞ = NaN for a ray in a box's face. Components count as at least
//!   [`STEEPEST`](crate::bvh::rays4::STEEPEST) of the largest one, which keeps every product a number; and boxes are strictly larger than what
//!   they hold, so that such a ray lies strictly between the planes.
//! - Errors in proportion to the size of a primitive are in its box: [`crate::bvh::Aabb::padded`].

use glam::{BVec4A, Vec3, Vec4};

use crate::bvh::node::{Node, SLACK};
use crate::bvh::ray::Ray;
use crate::bvh::rays4::STEEPEST;

/// A ray as the box test needs it, splatted, in the space of a tree's nodes.
#[derive(Clone, Copy, Debug)]
pub struct SlabRay {
    origin: [Vec4; 3],
    scale: [Vec4; 3],
    t_min: Vec4,
}

impl SlabRay {
    /// Prepares a traceable ray.
    #[inline(always)]
    pub fn new<N: Node>(frame: &N::Frame, ray: &Ray) -> SlabRay {
        let magnitude = ray.direction.abs();
        let magnitude = magnitude.max(Vec3::splat(magnitude.max_element() * STEEPEST));
        let scale = N::scale(frame, magnitude.recip().copysign(ray.direction));
        let origin = N::point(frame, ray.origin);
        SlabRay {
            origin: origin.to_array().map(Vec4::splat),
            scale: scale.to_array().map(Vec4::splat),
            t_min: Vec4::splat(ray.t_min.max(0.0)),
        }
    }

    /// Entry distances into the four children, at least `t_min`, and which children the ray meets before `t_max`.
    ///
    /// Tried: choosing near and far planes by the signs of the direction, and fused offsets. The addresses and the
    /// twelve vectors of the ray then live on the stack: 69 instructions a node instead of 48.
    #[inline(always)]
    pub fn enter<N: Node>(&self, node: &N, t_max: f32) -> (Vec4, BVec4A) {
        let planes = node.planes();
        let low = |k: usize| (planes[0][k] - self.origin[k]) * self.scale[k];
        let high = |k: usize| (planes[1][k] - self.origin[k]) * self.scale[k];
        let (x, y, z) = ((low(0), high(0)), (low(1), high(1)), (low(2), high(2)));
        let entry = x.0.min(x.1).max(y.0.min(y.1)).max(z.0.min(z.1).max(self.t_min)) * (1.0 - SLACK);
        let exit = x.0.max(x.1).min(y.0.max(y.1)).min(z.0.max(z.1).min(Vec4::splat(t_max)));
        (entry, entry.cmple(exit))
    }
}
