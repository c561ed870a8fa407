//! Where many rays pass between their ends: which planes none of them meets.
//!
//! Rays that all begin and end on the same side of a plane do not meet it, and shadow rays between points of a room never meet its walls. A box
//! around the ends of 64 rays tells that for all of them, before anything else is looked at: CBspheres_lambertian renders in 0.93 of the time, and
//! where walls are a list beside a tree, most of the links of path reuse come to nothing here.
//!
//! **Bounds**, as in [`super::planes`]: what [`NEAR`] covers, the box needs too, and what its own coordinates err by. These are ends, off by
//! 3 half-ulps of R and 1 of their magnitude, and their middle, by 2 more of that. The sums at the box's corners err by no more than n·r of a ray.

use super::planes::{HALF_ULP, LEAST, NEAR};
use super::rays::RAYS;
use crate::bvh::aabb::Aabb;
use crate::bvh::columns::RayColumns;
use crate::simd::wide::MOST_LANES;
use glam::Vec3;

/// By how much the box may be off, besides: relative to the way to the farthest corner, and to its own coordinates.
const AROUND: [f32; 2] = [6.0 * HALF_ULP, 4.0 * HALF_ULP];

/// What holds rays from their origins to their ends.
#[derive(Clone, Copy, Debug)]
pub struct Swept {
    /// The middle of the box.
    pub center: Vec3,
    /// Half its extent.
    pub half: Vec3,
    /// By how much distances from planes may be off.
    pub off: f32,
}

impl Swept {
    /// Of rays that may pass anywhere.
    const EVERYWHERE: Swept = Swept { center: Vec3::ZERO, half: Vec3::INFINITY, off: f32::INFINITY };

    /// Of the rows from `first` on, at most [`RAYS`]; `bounds` hold all that they may meet.
    #[inline(always)]
    pub fn of(rays: &RayColumns<'_>, first: usize, bounds: &Aabb) -> Swept {
        // Rays without ends pass everywhere.
        let Some(t_max) = rays.t_max else { return Swept::EVERYWHERE };
        let rows = first..(first + RAYS).min(rays.len());
        let ends = &t_max[rows.clone()];
        let mut around = Aabb::EMPTY;
        for (axis, (origin, direction)) in
            [(rays.ox, rays.dx), (rays.oy, rays.dy), (rays.oz, rays.dz)].into_iter().enumerate()
        {
            let (low, high) = span(&origin[rows.clone()], &direction[rows.clone()], ends);
            (around.min[axis], around.max[axis]) = (low, high);
        }
        Swept::around(around, bounds)
    }

    fn around(around: Aabb, bounds: &Aabb) -> Swept {
        let reach = (bounds.max - around.min).max(around.max - bounds.min).max_element();
        let size = around.min.abs().max(around.max.abs()).max_element();
        let half = (around.max - around.min) * 0.5;
        let off = reach * (NEAR + AROUND[0]) + size * AROUND[1] + LEAST;
        Swept { center: around.min + half, half, off }
    }
}

/// The least and the greatest coordinate of rays on an axis. Rays that end before they begin are nowhere, and so are those that cannot be
/// traced: comparisons with what is not a number do not hold.
#[inline(always)]
fn span(origin: &[f32], direction: &[f32], ends: &[f32]) -> (f32, f32) {
    // So many at a time, as vectors have lanes.
    let (mut low, mut high) = ([f32::INFINITY; MOST_LANES], [f32::NEG_INFINITY; MOST_LANES]);
    let mut widen = |lane: usize, origin: f32, direction: f32, t_max: f32| {
        let end = origin + direction * t_max.min(f32::MAX);
        let (least, most) = if origin < end { (origin, end) } else { (end, origin) };
        let goes = t_max >= 0.0;
        low[lane] = if goes && least < low[lane] { least } else { low[lane] };
        high[lane] = if goes && most > high[lane] { most } else { high[lane] };
    };
    let mut chunks =
        origin.chunks_exact(MOST_LANES).zip(direction.chunks_exact(MOST_LANES)).zip(ends.chunks_exact(MOST_LANES));
    for ((origin, direction), ends) in &mut chunks {
        for lane in 0..MOST_LANES {
            widen(lane, origin[lane], direction[lane], ends[lane]);
        }
    }
    for row in origin.len() / MOST_LANES * MOST_LANES..origin.len() {
        widen(0, origin[row], direction[row], ends[row]);
    }
    (low.into_iter().fold(f32::INFINITY, f32::min), high.into_iter().fold(f32::NEG_INFINITY, f32::max))
}
