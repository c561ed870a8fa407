//! Axis-aligned boxes.

use glam::Vec3;
use serde::Serialize;

use crate::scene::shapes::Sphere;

/// A box, closed on all sides. Empty when any `min` exceeds its `max`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Aabb {
    /// Smallest corner.
    pub min: Vec3,
    /// Largest corner.
    pub max: Vec3,
}

impl Aabb {
    /// Contains nothing; the neutral element of [`Aabb::union`].
    pub const EMPTY: Aabb = Aabb { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The smallest box around both.
    #[inline]
    pub fn union(self, other: Aabb) -> Aabb {
        Aabb { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The smallest box around some points.
    #[inline(always)]
    pub fn around(points: [Vec3; 3]) -> Aabb {
        Aabb { min: points[0].min(points[1]).min(points[2]), max: points[0].max(points[1]).max(points[2]) }
    }

    /// The box of a sphere.
    pub fn of_sphere(sphere: &Sphere) -> Aabb {
        let r = Vec3::splat(sphere.radius);
        Aabb { min: sphere.center - r, max: sphere.center + r }
    }

    /// Whether it contains nothing.
    pub fn is_empty(&self) -> bool {
        !(self.min.x <= self.max.x && self.min.y <= self.max.y && self.min.z <= self.max.z)
    }

    /// Half the surface area of the box scaled by `scale`, which keeps huge scenes from overflowing.
    #[inline(always)]
    pub fn half_area(&self, scale: f32) -> f32 {
        let e = (self.max - self.min) * scale;
        e.x * e.y + e.y * e.z + e.z * e.x
    }

    /// The box that traversal must use for a primitive that this box fits tightly.
    ///
    /// The slab test of a ray errs by a few ulp of the distance, which the ray's own slack covers (see
    /// `traverse::slab`). The primitive's test errs by a few ulp of the primitive's *size* as well, where the
    /// primitive extends behind the ray's origin: without this margin, a ray that starts close to an edge could
    /// pass between two boxes whose triangles would have caught it. The step to the next float makes every box
    /// strictly larger than what it holds, so that rays in its faces hit.
    #[inline(always)]
    pub fn padded(&self) -> Aabb {
        const MARGIN: f32 = 1.0 / (1 << 20) as f32;
        let margin = Vec3::splat((self.max - self.min).max_element() * MARGIN);
        let (min, max) = (self.min - margin, self.max + margin);
        Aabb {
            min: Vec3::new(min.x.next_down(), min.y.next_down(), min.z.next_down()),
            max: Vec3::new(max.x.next_up(), max.y.next_up(), max.z.next_up()),
        }
    }
}
