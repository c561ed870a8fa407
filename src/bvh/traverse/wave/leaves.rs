//! Blocks of leaves.

use super::IN_FLIGHT;
use super::queue::Steps;
use super::slot::Slot;
use crate::bvh::block::TriangleBlock;
use crate::bvh::intersect::Intersect;
use crate::simd::wide::Wide;

/// Steps that a word has room for.
const STEPS: usize = 16;

/// Which triangles of its block the ray of each step may hit: four bits a step.
#[derive(Clone, Copy, Debug)]
pub struct Candidates([u64; IN_FLIGHT / STEPS]);

impl Candidates {
    /// Calls `settle` with the step and the lane of each.
    #[inline(always)]
    pub fn each(self, mut settle: impl FnMut(usize, usize)) {
        for (word, mut rest) in self.0.into_iter().enumerate() {
            while rest != 0 {
                let bit = rest.trailing_zeros() as usize;
                rest &= rest - 1;
                settle(word * STEPS + bit / 4, bit % 4);
            }
        }
    }
}

/// Tests the first block of the leaf of each of the first `len` steps, all of triangles, and takes it off the stack.
#[inline(always)]
pub fn visit<W: Wide, I: Intersect>(
    wide: W,
    triangles: &[impl TriangleBlock],
    steps: &mut Steps,
    len: usize,
    slots: &mut [Slot; IN_FLIGHT],
) -> Candidates {
    let mut candidates = [0; IN_FLIGHT / STEPS];
    let end = steps.fill(len, W::RAYS);
    for first in (0..end).step_by(W::RAYS) {
        let number: [usize; 4] = std::array::from_fn(|ray| steps.slot(first + ray));
        let visited: [usize; 4] = std::array::from_fn(|ray| steps.child(first + ray).first_block());
        let lanes =
            wide.bits(I::candidates(wide, |ray| &slots[number[ray]].ray.triangle, |ray| &triangles[visited[ray]]));
        candidates[first / STEPS % candidates.len()] |= u64::from(lanes) << (4 * (first % STEPS));
    }
    // What the last vector was filled with does not count.
    for (word, bits) in candidates.iter_mut().enumerate() {
        let steps = len.saturating_sub(word * STEPS).min(STEPS);
        *bits &= u64::MAX.checked_shr(64 - 4 * steps as u32).unwrap_or(0);
    }
    steps.leave_blocks(len, |slot, top, rest| slots[slot].set_child(top, rest));
    Candidates(candidates)
}
