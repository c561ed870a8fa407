//! Every triangle and every sphere against every ray: for scenes of so few that a tree gains nothing.
//!
//! 64 rays at a time, a ray a lane, as they come; no node, no stack, and the same instructions for all rays, whichever way
//! they go.
//!
//! ```text
//!    rays ─→ planes ──→ crossings ─→ closest hit
//!       └──→ spheres ──────────────────↗
//! ```
//!
//! A bound in single precision ([`planes`], [`spheres`]) tells which rays may hit a primitive; the test itself is asked of those alone.

mod planes;
mod rays;
mod spheres;
mod swept;

use super::Tree;
use super::crossings::Crossings;
use super::leaf::{count_block, count_vectors};
use crate::bvh::aabb::Aabb;
use crate::bvh::block::TriangleBlock;
use crate::bvh::columns::{RayColumns, TraversalCounts};
use crate::bvh::intersect::Intersect;
use crate::bvh::node::Node;
use crate::bvh::ray::{Hit, MISS};
use crate::bvh::sphere;
use crate::simd::wide::Wide;
use planes::Plane;
use rays::{RAYS, Rays};
use smallvec::SmallVec;
use swept::Swept;

/// Triangles tested before their candidates are.
const TRIANGLES: usize = 20;

/// Traces all rays, and calls `finish` with the row and the hit of each, in order. `ANY`: the caller asks only whether there is a hit.
/// `SPHERES`: there are some. `COUNT`: count what is tested.
#[inline(always)]
pub fn trace<W: Wide, N: Node, I: Intersect, const SPHERES: bool, const COUNT: bool>(
    wide: W,
    tree: &Tree<'_, N, impl TriangleBlock>,
    rays: RayColumns<'_>,
    mut finish: impl FnMut(usize, Hit),
) -> TraversalCounts {
    let mut counts = TraversalCounts { rays: rays.len() as u64, ..Default::default() };
    let planes: SmallVec<[Plane; TRIANGLES]> = tree.triangles.iter().flat_map(Plane::of).collect();
    let bounds = planes.iter().fold(Aabb::EMPTY, |bounds, plane| bounds.union(plane.bounds()));
    let (mut at_hand, mut crossings) = (Rays::new(), Crossings::new());
    for first in (0..rays.len()).step_by(RAYS) {
        let swept = Swept::of(&rays, first, &bounds);
        let near: SmallVec<[&Plane; TRIANGLES]> = planes.iter().filter(|plane| plane.may_be_met(&swept)).collect();
        if !SPHERES && !COUNT && near.is_empty() {
            (first..rays.len().min(first + RAYS)).for_each(|row| finish(row, Hit::NONE));
            continue;
        }
        at_hand.load(&rays, first, &bounds);
        for planes in near.chunks(TRIANGLES) {
            triangles::<W, I>(wide, planes, &mut at_hand, &mut crossings);
        }
        if SPHERES {
            for block in tree.spheres {
                for lane in (0..4).filter(|&lane| block.prim[lane] != MISS) {
                    let mut rest = 0;
                    for first in (0..at_hand.len).step_by(4 * W::RAYS) {
                        let lanes = at_hand.lanes(wide, first);
                        let may = spheres::candidates(wide, lanes.origin, lanes.direction, block, lane);
                        rest |= u64::from(may) << first;
                    }
                    rest &= u64::MAX >> (RAYS - at_hand.len);
                    while rest != 0 {
                        let ray = rest.trailing_zeros() as usize;
                        rest &= rest - 1;
                        let (whole, reach) = (at_hand.ray(ray), at_hand.reach(ray));
                        if let Some(t) = sphere::intersect(&whole, block.center(lane), block.radius[lane], reach) {
                            let (prim, geom) = (block.prim[lane], block.geom[lane]);
                            at_hand.offer(ray, Hit { t, u: 0.0, v: 0.0, prim, geom });
                        }
                    }
                }
            }
        }
        if COUNT {
            let prims =
                tree.triangles.iter().map(|block| block.prims()).chain(tree.spheres.iter().map(|block| &block.prim));
            for prim in prims {
                count_block(&mut counts, prim, at_hand.len as u32);
                count_vectors(&mut counts.primitive_lanes, at_hand.len, W::RAYS);
            }
        }
        for (row, hit) in at_hand.hits().enumerate() {
            finish(first + row, hit);
        }
    }
    counts
}

/// Tests all rays against some triangles.
#[inline(always)]
fn triangles<W: Wide, I: Intersect>(wide: W, planes: &[&Plane], rays: &mut Rays, crossings: &mut Crossings) {
    let mut may = [0u64; TRIANGLES];
    for first in (0..rays.len).step_by(4 * W::RAYS) {
        let lanes = rays.lanes(wide, first);
        for (may, plane) in may.iter_mut().zip(planes) {
            *may |= u64::from(plane.candidates(wide, &lanes)) << first;
        }
    }
    for (may, plane) in may.iter().zip(planes) {
        let mut rest = may & u64::MAX >> (RAYS - rays.len);
        if crossings.room() < RAYS {
            crossings.settle::<I>(|ray, hit| rays.offer(ray, hit));
        }
        while rest != 0 {
            let ray = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            crossings.push::<I, _>(ray, [&rays.origin, &rays.direction], &plane.triangle);
        }
    }
    crossings.settle::<I>(|ray, hit| rays.offer(ray, hit));
}
