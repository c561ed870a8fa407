//! Slots that wait for the same kind of work.

use super::IN_FLIGHT;
use crate::bvh::child::Child;
use crate::simd::wide::{MOST_LANES, Wide};
use std::ops::Range;

/// Room for [`IN_FLIGHT`] steps, and for a vector beyond the last.
const ROOM: usize = IN_FLIGHT + MOST_LANES;

type Column = [u32; ROOM];

/// Rays' slots, where the tops of their stacks are, and what each visits next. How many there are is kept beside it, by who uses it: in one
/// structure with the arrays it would be a number in memory, and not in a register.
#[derive(Clone, Copy, Debug)]
pub struct Steps {
    /// The slots.
    slots: Column,
    /// Which of a slot's children is next.
    tops: Column,
    /// That child.
    children: Column,
}

/// Which steps are meant. (No closure: those with vectors in them must be inlined.)
#[derive(Clone, Copy, Debug)]
pub enum Which {
    /// Those that visit nodes.
    AtNodes,
    /// Those that visit leaves, or nothing more.
    AtLeaves,
    /// Those that visit leaves of spheres, of the latter.
    AtSpheres,
    /// Those that visit nothing more.
    Done,
    /// All.
    All,
}

impl Which {
    /// One bit a child.
    #[inline(always)]
    fn bits<W: Wide>(self, wide: W, children: &[u32; MOST_LANES]) -> u32 {
        match self {
            Which::AtNodes => !wide.negative(children),
            Which::AtLeaves => wide.negative(children),
            Which::AtSpheres => wide.negative(&children.map(Child::spheres_in_front)),
            Which::Done => wide.equal(children, Child::EMPTY.bits()),
            Which::All => u32::MAX,
        }
    }
}

impl Steps {
    /// None.
    pub const NONE: Steps = Steps { slots: [0; ROOM], tops: [0; ROOM], children: [0; ROOM] };

    /// The slot of one step.
    #[inline(always)]
    pub fn slot(&self, step: usize) -> usize {
        self.slots[step] as usize % IN_FLIGHT
    }

    /// The top of its stack: a byte, so that no index needs a check.
    #[inline(always)]
    pub fn top(&self, step: usize) -> u8 {
        self.tops[step] as u8
    }

    /// Its stack is another.
    #[inline(always)]
    pub fn set_top(&mut self, step: usize, top: u8) {
        self.tops[step] = top.into();
    }

    /// What it visits.
    #[inline(always)]
    pub fn child(&self, step: usize) -> Child {
        Child::from_bits(self.children[step])
    }

    /// It visits something else next.
    #[inline(always)]
    pub fn set_child(&mut self, step: usize, child: Child) {
        self.children[step] = child.bits();
    }

    /// The children of some steps.
    #[inline(always)]
    pub fn children(&self, steps: Range<usize>) -> impl ExactSizeIterator<Item = Child> {
        let end = steps.end.min(IN_FLIGHT);
        self.children[steps.start.min(end)..end].iter().map(|&bits| Child::from_bits(bits))
    }

    /// Adds a step. There is room: each slot stands in one queue at most.
    #[inline(always)]
    pub fn push(&mut self, len: &mut usize, slot: usize, top: u8, child: Child) {
        let step = *len % IN_FLIGHT;
        (self.slots[step], self.tops[step], self.children[step]) = (slot as u32, top.into(), child.bits());
        *len += 1;
    }

    /// Fills the last of the vectors that the first `len` steps take up with the last step, whose work is then done twice,
    /// alike. Gives their number of steps, a multiple of `rays`.
    #[inline(always)]
    pub fn fill(&mut self, len: usize, rays: usize) -> usize {
        let len = len.min(IN_FLIGHT);
        let last = len.saturating_sub(1);
        for column in [&mut self.slots, &mut self.tops, &mut self.children] {
            let value = column[last];
            column[len..len + 4].fill(value);
        }
        len.next_multiple_of(rays)
    }

    /// In each of the steps of the vector from `first` on, the topmost child has made way for as many as its quad of `met` has bits.
    #[inline(always)]
    pub fn climb<W: Wide>(&mut self, wide: W, first: usize, met: u32) {
        wide.climb(&mut self.tops[first..][..4], met);
    }

    /// The first `len` steps have visited the first block of their leaf: its other blocks are next, or what is below. `stay` takes the slot and the
    /// top of each that has other blocks, and these.
    #[inline(always)]
    pub fn leave_blocks(&mut self, len: usize, mut stay: impl FnMut(usize, u8, Child)) {
        let len = len.min(IN_FLIGHT);
        let mut all = 0;
        for (top, child) in self.tops[..len].iter_mut().zip(&self.children[..len]) {
            *top = top.wrapping_sub(1);
            all |= child;
        }
        // Leaves of several blocks are rare.
        if !Child::from_bits(all).is_one_block() {
            for step in 0..len {
                let child = self.child(step);
                if !child.is_one_block() {
                    self.tops[step] = self.tops[step].wrapping_add(1);
                    stay(self.slot(step), self.top(step), child.without_first_block());
                }
            }
        }
    }

    /// Moves `which` of the first `len` steps to the end of `others`, and the rest to the front. Gives the number of the rest. Both keep
    /// their order.
    #[inline(always)]
    pub fn part<W: Wide>(
        &mut self,
        wide: W,
        len: usize,
        which: Which,
        others: &mut Steps,
        at_others: &mut usize,
    ) -> usize {
        let mut kept = 0;
        for from in (0..len.min(IN_FLIGHT)).step_by(4 * W::RAYS) {
            // What is written does not reach what is still to be read: no more is kept than was read.
            let vector = self.vector(from);
            let among = among::<W>(len.min(IN_FLIGHT) - from);
            let moved = which.bits(wide, &vector[2]) & among;
            others.pack(wide, at_others, &vector, moved);
            self.pack(wide, &mut kept, &vector, !moved & among);
        }
        kept
    }

    /// Adds those steps of a vector that `keep` has a bit for.
    #[inline(always)]
    fn pack<W: Wide>(&mut self, wide: W, len: &mut usize, vector: &[[u32; MOST_LANES]; 3], keep: u32) {
        let end = (*len).min(IN_FLIGHT);
        wide.pack(&vector[0], keep, &mut self.slots[end..][..MOST_LANES]);
        wide.pack(&vector[1], keep, &mut self.tops[end..][..MOST_LANES]);
        wide.pack(&vector[2], keep, &mut self.children[end..][..MOST_LANES]);
        *len += keep.count_ones() as usize;
    }

    /// As many steps as the widest vector has lanes, from `first` on.
    #[inline(always)]
    fn vector(&self, first: usize) -> [[u32; MOST_LANES]; 3] {
        let first = first.min(IN_FLIGHT);
        let [mut slots, mut tops, mut children] = [[0; MOST_LANES]; 3];
        slots.copy_from_slice(&self.slots[first..][..MOST_LANES]);
        tops.copy_from_slice(&self.tops[first..][..MOST_LANES]);
        children.copy_from_slice(&self.children[first..][..MOST_LANES]);
        [slots, tops, children]
    }
}

/// The lanes of a vector of steps of which `left` are left.
#[inline(always)]
fn among<W: Wide>(left: usize) -> u32 {
    u32::MAX >> (32 - (4 * W::RAYS).min(left))
}
