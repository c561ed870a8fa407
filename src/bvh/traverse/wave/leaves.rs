//! Blocks of leaves.

use super::IN_FLIGHT;
use super::queue::{Steps, vectors};
use super::slot::Slot;
use crate::bvh::intersect::Intersect;
use crate::bvh::tri4::Tri4;
use crate::simd::wide::Wide;

/// A block that a ray may hit.
#[derive(Clone, Copy, Debug)]
pub struct Candidate {
    /// The ray's slot.
    pub slot: u32,
    /// The block.
    pub block: u32,
    /// One bit for each triangle that it may hit.
    pub lanes: u32,
}

/// Room for a candidate a ray.
pub type Candidates = [Candidate; IN_FLIGHT];

/// None.
pub const NO_CANDIDATES: Candidates = [Candidate { slot: 0, block: 0, lanes: 0 }; IN_FLIGHT];

/// Tests the first block of the leaf of each of the first `len` steps, all of triangles, and takes it off the stack. Gives
/// the number of candidates.
#[inline(always)]
pub fn visit<W: Wide, I: Intersect>(
    wide: W,
    triangles: &[Tri4],
    steps: &mut Steps,
    len: usize,
    slots: &mut [Slot; IN_FLIGHT],
    candidates: &mut Candidates,
) -> usize {
    let (mut found, mut left) = (0, len);
    for steps in vectors(steps, len, W::RAYS) {
        let block = |ray: usize| &triangles[steps[ray].child().first_block()];
        let rays = |ray: usize| &slots[steps[ray].slot()].ray.triangle;
        let lanes = wide.bits(I::candidates(wide, rays, block));
        for (ray, step) in steps.iter().enumerate().take(left) {
            slots[step.slot()].leave_block(step.child());
            let lanes = lanes >> (4 * ray) & 15;
            let (slot, block) = (step.slot() as u32, step.child().first_block() as u32);
            candidates[found % IN_FLIGHT] = Candidate { slot, block, lanes };
            found += usize::from(lanes != 0);
        }
        left = left.saturating_sub(W::RAYS);
    }
    found
}
