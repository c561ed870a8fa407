//! Triangles that a ray may hit, one at a time.

use super::slot::Slot;
use crate::bvh::block::TriangleBlock;
use crate::bvh::closest::closer;
use crate::bvh::intersect::Intersect;
use crate::bvh::ray::Hit;

/// Settles whether the ray in `slot` hits the triangle in one lane of a block. Gives the top of its stack then.
#[inline(always)]
pub fn settle<I: Intersect, const ANY: bool>(block: &impl TriangleBlock, lane: usize, slot: &mut Slot, top: u8) -> u8 {
    let Some(crossing) = I::crossing(&slot.ray.triangle, block, lane) else { return top };
    let (prim, geom) = (block.prims()[lane & 3], block.geom(lane & 3));
    let hit = Hit { t: crossing.t, u: crossing.u, v: crossing.v, prim, geom };
    if closer(&hit, slot.t_min(), &slot.closest()) { slot.hit_at::<ANY>(hit, top) } else { top }
}
