//! Blocks that a ray may hit, one triangle at a time.

use super::leaves::Candidate;
use super::slot::Slot;
use crate::bvh::block::TriangleBlock;
use crate::bvh::closest::closer;
use crate::bvh::intersect::Intersect;
use crate::bvh::ray::Hit;

/// Settles what the ray in `slot` hits of a block.
#[inline(always)]
pub fn settle<I: Intersect, const ANY: bool>(triangles: &[impl TriangleBlock], candidate: &Candidate, slot: &mut Slot) {
    let block = &triangles[candidate.block as usize];
    let mut rest = candidate.lanes;
    let before = slot.t_max();
    while rest != 0 {
        let lane = rest.trailing_zeros() as usize & 3;
        rest &= rest - 1;
        if let Some(crossing) = I::crossing(&slot.ray.triangle, block, lane) {
            let hit =
                Hit { t: crossing.t, u: crossing.u, v: crossing.v, prim: block.prims()[lane], geom: block.geom(lane) };
            if closer(&hit, slot.t_min(), &slot.closest()) {
                slot.set_closest(hit);
            }
        }
    }
    slot.settle::<ANY>(before);
}
