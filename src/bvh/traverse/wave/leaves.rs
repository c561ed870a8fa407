//! Blocks of leaves.

use super::IN_FLIGHT;
use super::queue::Steps;
use super::slot::Slot;
use crate::bvh::block::TriangleBlock;
use crate::bvh::intersect::Intersect;
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
    triangles: &[impl TriangleBlock],
    steps: &mut Steps,
    len: usize,
    slots: &mut [Slot; IN_FLIGHT],
    candidates: &mut Candidates,
) -> usize {
    let mut found = 0;
    let end = steps.fill(len, W::RAYS);
    for first in (0..end).step_by(W::RAYS) {
        let number: [usize; 4] = std::array::from_fn(|ray| steps.slot(first + ray));
        let visited: [usize; 4] = std::array::from_fn(|ray| steps.child(first + ray).first_block());
        let lanes =
            wide.bits(I::candidates(wide, |ray| &slots[number[ray]].ray.triangle, |ray| &triangles[visited[ray]]));
        for ray in 0..W::RAYS.min(len - first) {
            slots[number[ray]].leave_block(steps.child(first + ray));
            let lanes = lanes >> (4 * ray) & 15;
            candidates[found % IN_FLIGHT] = Candidate { slot: number[ray] as u32, block: visited[ray] as u32, lanes };
            found += usize::from(lanes != 0);
        }
    }
    found
}
