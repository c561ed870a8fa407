//! The rule that decides which hit of a ray counts: the oracle and every kernel share it.

use super::ray::{Hit, MISS, Ray};

/// The closest hit so far.
#[derive(Clone, Copy, Debug)]
pub struct Closest {
    hit: Hit,
    t_min: f32,
}

impl Closest {
    /// Nothing hit yet. Hits at infinity do not count, so the limit is finite; that lets culling tell
    /// boxes at infinity, where rays never arrive, from all others.
    #[inline(always)]
    pub fn new(ray: &Ray) -> Closest {
        Closest { hit: Hit { t: ray.t_max.min(f32::MAX), ..Hit::NONE }, t_min: ray.t_min.max(0.0) }
    }

    /// Farthest `t` that still counts.
    #[inline(always)]
    pub fn t_max(&self) -> f32 {
        self.hit.t
    }

    /// Takes the hit if it is closer, or as close and of a smaller primitive: no order of visits can matter.
    #[inline(always)]
    pub fn offer(&mut self, hit: Hit) {
        if closer(&hit, self.t_min, &self.hit) {
            self.hit = hit;
        }
    }

    /// The outcome.
    #[inline(always)]
    pub fn hit(&self) -> Hit {
        if self.hit.prim == MISS { Hit::NONE } else { self.hit }
    }
}

/// Whether `hit` counts (beyond `t_min`) and comes before `closest`: it is closer, or as close and of a smaller primitive.
#[inline(always)]
pub fn closer(hit: &Hit, t_min: f32, closest: &Hit) -> bool {
    hit.t > t_min && (hit.t < closest.t || (hit.t == closest.t && hit.prim < closest.prim))
}
