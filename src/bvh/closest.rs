//! The rule that decides which hit of a ray counts: the oracle and every kernel share it.

use super::ray::{Hit, MISS};

/// The closest hit so far.
#[derive(Clone, Copy, Debug)]
pub struct Closest {
    hit: Hit,
}

impl Closest {
    /// Nothing hit up to `t_max`. Hits at infinity do not count, so the limit is finite; that lets culling tell
    /// boxes at infinity, where rays never arrive, from all others.
    #[inline(always)]
    pub fn new(t_max: f32) -> Closest {
        Closest { hit: Hit { t: t_max.min(f32::MAX), ..Hit::NONE } }
    }

    /// Farthest `t` that still counts.
    #[inline(always)]
    pub fn t_max(&self) -> f32 {
        self.hit.t
    }

    /// Takes the hit if it is closer, or as close and of a smaller primitive: no order of visits can matter.
    #[inline(always)]
    pub fn offer(&mut self, hit: Hit) {
        if hit.t > 0.0 && (hit.t < self.hit.t || (hit.t == self.hit.t && hit.prim < self.hit.prim)) {
            self.hit = hit;
        }
    }

    /// The outcome.
    #[inline(always)]
    pub fn hit(&self) -> Hit {
        if self.hit.prim == MISS { Hit::NONE } else { self.hit }
    }
}
