//! Slots that wait for the same kind of work.

use super::IN_FLIGHT;
use crate::bvh::child::Child;
use crate::simd::wide::{MOST_LANES, Wide};

/// Room for [`IN_FLIGHT`] steps, and for a vector beyond the last.
const ROOM: usize = IN_FLIGHT + MOST_LANES;

/// Rays' slots and what each visits next. How many there are is kept beside it, by who uses it: in one structure with the arrays it would
/// be a number in memory, and not in a register.
#[derive(Clone, Copy, Debug)]
pub struct Steps {
    /// The slots.
    slots: [u32; ROOM],
    /// What they visit.
    children: [u32; ROOM],
}

impl Steps {
    /// None.
    pub const NONE: Steps = Steps { slots: [0; ROOM], children: [0; ROOM] };

    /// The slot of one step.
    #[inline(always)]
    pub fn slot(&self, step: usize) -> usize {
        self.slots[step] as usize % IN_FLIGHT
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

    /// Adds a step if `wanted`, without a branch. There is room: each slot stands in one queue at most.
    #[inline(always)]
    pub fn push_if(&mut self, len: &mut usize, slot: usize, child: Child, wanted: bool) {
        self.slots[*len % IN_FLIGHT] = slot as u32;
        self.children[*len % IN_FLIGHT] = child.bits();
        *len += usize::from(wanted);
    }

    /// Fills the last of the vectors that the first `len` steps take up with the last step, whose work is then done twice,
    /// alike. Gives their number of steps, a multiple of `rays`.
    #[inline(always)]
    pub fn fill(&mut self, len: usize, rays: usize) -> usize {
        let len = len.min(IN_FLIGHT);
        let last = len.saturating_sub(1);
        let (slot, child) = (self.slots[last], self.children[last]);
        self.slots[len..len + 4].fill(slot);
        self.children[len..len + 4].fill(child);
        len.next_multiple_of(rays)
    }

    /// Moves those of the first `len` steps that visit leaves to the end of `leaves`, and the others to the front. Gives the
    /// number of the others. Both keep their order.
    #[inline(always)]
    pub fn part<W: Wide>(&mut self, wide: W, len: usize, leaves: &mut Steps, at_leaves: &mut usize) -> usize {
        let (mut kept, mut left) = (0, len.min(IN_FLIGHT));
        let mut from = 0;
        while left > 0 {
            // What is written does not reach what is still to be read: no more is kept than was read.
            let slots: [u32; MOST_LANES] = lanes(&self.slots, from);
            let children: [u32; MOST_LANES] = lanes(&self.children, from);
            let among = u32::MAX >> (32 - (4 * W::RAYS).min(left));
            let at_leaf = wide.negative(&children);
            let (to_leaves, to_front) = (at_leaf & among, !at_leaf & among);
            let end = *at_leaves;
            wide.pack(&slots, to_leaves, lanes_mut(&mut leaves.slots, end));
            wide.pack(&children, to_leaves, lanes_mut(&mut leaves.children, end));
            wide.pack(&slots, to_front, lanes_mut(&mut self.slots, kept));
            wide.pack(&children, to_front, lanes_mut(&mut self.children, kept));
            *at_leaves += to_leaves.count_ones() as usize;
            kept += to_front.count_ones() as usize;
            from += 4 * W::RAYS;
            left = left.saturating_sub(4 * W::RAYS);
        }
        kept
    }

    /// Moves those of the first `len` steps that visit leaves to the end of `leaves`, and the others to the end of `nodes`, of which
    /// there were `at_nodes`; gives how many there are then.
    #[inline(always)]
    pub fn part_to<W: Wide>(
        &mut self,
        wide: W,
        len: usize,
        nodes: &mut Steps,
        mut at_nodes: usize,
        leaves: &mut Steps,
        at_leaves: &mut usize,
    ) -> usize {
        let kept = self.part(wide, len, leaves, at_leaves);
        for step in 0..kept.min(IN_FLIGHT) {
            nodes.push_if(&mut at_nodes, self.slot(step), self.child(step), true);
        }
        at_nodes
    }
}

/// As many numbers as the widest vector has lanes, from `first` on.
#[inline(always)]
fn lanes(numbers: &[u32; ROOM], first: usize) -> [u32; MOST_LANES] {
    let mut lanes = [0; MOST_LANES];
    lanes.copy_from_slice(&numbers[first.min(IN_FLIGHT)..][..MOST_LANES]);
    lanes
}

#[inline(always)]
fn lanes_mut(numbers: &mut [u32; ROOM], first: usize) -> &mut [u32] {
    &mut numbers[first.min(IN_FLIGHT)..][..MOST_LANES]
}
