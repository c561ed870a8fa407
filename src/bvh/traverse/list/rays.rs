//! 64 rays that are tested together, as columns.

use super::planes;
use crate::bvh::aabb::Aabb;
use crate::bvh::closest::closer;
use crate::bvh::columns::RayColumns;
use crate::bvh::ray::{Hit, MISS, Ray};
use crate::simd::wide::{MOST_LANES, Wide};

/// Rays that are tested together: a bit of a word each.
pub const RAYS: usize = 64;

/// One number of all rays, and room for the widest vector beyond the last.
type Column = [f32; RAYS + MOST_LANES];

/// Rays and what they hit so far.
pub struct Rays {
    pub origin: [Column; 3],
    pub direction: [Column; 3],
    t_min: Column,
    /// −1 for rays that hit nothing, whatever there is.
    t_max: Column,
    /// [`planes::slack`].
    slack: [Column; 2],
    /// The closest hits so far; their `t` is where the ray ends.
    closest: [Hit; RAYS],
    /// How many.
    pub len: usize,
}

impl Rays {
    /// None.
    pub fn new() -> Rays {
        let zero = [0.0; RAYS + MOST_LANES];
        Rays {
            origin: [zero; 3],
            direction: [zero; 3],
            t_min: zero,
            t_max: zero,
            slack: [zero; 2],
            closest: [Hit::NONE; RAYS],
            len: 0,
        }
    }

    /// Takes the rows from `first` on, as many as there is room for. The triangles they are to be tested against lie in `bounds`.
    #[inline(always)]
    pub fn load(&mut self, rays: &RayColumns<'_>, first: usize, bounds: &Aabb) {
        let len = (rays.len() - first).min(RAYS);
        let (o, d) = (&mut self.origin, &mut self.direction);
        for (to, from) in o.iter_mut().chain(d).zip([rays.ox, rays.oy, rays.oz, rays.dx, rays.dy, rays.dz]) {
            to[..len].copy_from_slice(&from[first..first + len]);
        }
        for (to, from, without) in [(&mut self.t_min, rays.t_min, 0.0), (&mut self.t_max, rays.t_max, f32::INFINITY)] {
            match from {
                Some(from) => to[..len].copy_from_slice(&from[first..first + len]),
                None => to.fill(without),
            }
        }
        for row in 0..RAYS {
            let ray = self.ray(row);
            let traceable = ray.is_traceable();
            // Hits at infinity do not count, so the limit is finite.
            self.t_max[row] = if traceable { ray.t_max.min(f32::MAX) } else { -1.0 };
            self.t_min[row] = ray.t_min.max(0.0);
            let slack = planes::slack(ray.origin, ray.direction, bounds);
            (self.slack[0][row], self.slack[1][row]) = (slack[0], slack[1]);
            self.closest[row] = Hit { t: self.t_max[row], ..Hit::NONE };
        }
        self.len = len;
    }

    /// One ray, as it was loaded, but for its ends.
    #[inline(always)]
    pub fn ray(&self, row: usize) -> Ray {
        let [ox, oy, oz] = &self.origin;
        let [dx, dy, dz] = &self.direction;
        Ray {
            t_min: self.t_min[row],
            t_max: self.t_max[row],
            ..Ray::new([ox[row], oy[row], oz[row]].into(), [dx[row], dy[row], dz[row]].into())
        }
    }

    /// As many rays as a vector has lanes, from the `first` on.
    #[inline(always)]
    pub fn lanes<W: Wide>(&self, wide: W, first: usize) -> planes::Rays<W::Lanes> {
        let [[ox, oy, oz], [dx, dy, dz]] = [&self.origin, &self.direction];
        planes::Rays {
            origin: [load(wide, ox, first), load(wide, oy, first), load(wide, oz, first)],
            direction: [load(wide, dx, first), load(wide, dy, first), load(wide, dz, first)],
            t_max: load(wide, &self.t_max, first),
            slack: [load(wide, &self.slack[0], first), load(wide, &self.slack[1], first)],
        }
    }

    /// How far a ray goes: to its end, or to its closest hit so far.
    #[inline(always)]
    pub fn reach(&self, ray: usize) -> f32 {
        self.closest[ray % RAYS].t
    }

    /// Takes the hit if it comes before the closest so far.
    #[inline(always)]
    pub fn offer(&mut self, ray: usize, hit: Hit) {
        let ray = ray % RAYS;
        if closer(&hit, self.t_min[ray], &self.closest[ray]) {
            self.closest[ray] = hit;
        }
    }

    /// What each ray hit.
    #[inline(always)]
    pub fn hits(&self) -> impl Iterator<Item = Hit> {
        self.closest[..self.len].iter().map(|hit| if hit.prim == MISS { Hit::NONE } else { *hit })
    }
}

/// A vector of a column.
#[inline(always)]
fn load<W: Wide>(wide: W, column: &Column, first: usize) -> W::Lanes {
    wide.load(column[first % RAYS..].first_chunk().expect("there is room beyond the last ray"))
}
