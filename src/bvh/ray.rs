//! A ray and what it hit: the two values that every traversal kernel takes and gives.

use crate::sampling::v3::V3;
use crate::scene::origin::Origin;
use glam::Vec3;

/// Shortest direction, by its largest component: below, reciprocals overflow.
pub const SHORTEST: f32 = 1.0 / (1u64 << 60) as f32;

/// A ray, world space. Hits count for `t_min < t <= t_max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Origin.
    pub origin: Vec3,
    /// Direction; `t` is in units of its length.
    pub direction: Vec3,
    /// Nearest `t` that does not count yet; below 0 is as good as 0.
    pub t_min: f32,
    /// Farthest `t` that counts; may be infinite.
    pub t_max: f32,
    /// What single precision leaves of the origin. Only the tree in double precision looks at it.
    pub low: Vec3,
}

impl Ray {
    /// A ray from its origin to infinity.
    #[inline(always)]
    pub fn new(origin: Vec3, direction: Vec3) -> Ray {
        Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY, low: Vec3::ZERO }
    }

    /// A ray that leaves a point, to infinity.
    #[inline(always)]
    pub fn leaving(origin: Origin, direction: V3) -> Ray {
        Ray { low: origin.low.map_or(Vec3::ZERO, Vec3::from), ..Ray::new(origin.high.into(), direction.into()) }
    }

    /// Whether the ray can hit anything: origin and direction finite, the direction not (nearly) zero, `t_max`
    /// above `t_min` and 0. A ray that fails this misses everything, whatever the structure.
    #[inline(always)]
    pub fn is_traceable(&self) -> bool {
        self.origin.is_finite()
            && self.direction.is_finite()
            && self.direction.abs().max_element() >= SHORTEST
            && self.t_min < f32::INFINITY
            && self.t_max > self.t_min.max(0.0)
    }
}

/// `prim` of a ray that hit nothing.
pub const MISS: u32 = u32::MAX;

/// The closest hit of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in units of the ray's direction; infinite for a miss.
    pub t: f32,
    /// Barycentric weight of the second corner; 0 for spheres.
    pub u: f32,
    /// Barycentric weight of the third corner; 0 for spheres.
    pub v: f32,
    /// Primitive, or [`MISS`]. Of primitives hit at the same `t`, the smallest.
    pub prim: u32,
    /// Geometry of the primitive; [`MISS`] for a miss.
    pub geom: u32,
}

impl Hit {
    /// Nothing hit.
    pub const NONE: Hit = Hit { t: f32::INFINITY, u: 0.0, v: 0.0, prim: MISS, geom: MISS };

    /// Whether anything was hit.
    pub fn is_some(&self) -> bool {
        self.prim != MISS
    }
}
