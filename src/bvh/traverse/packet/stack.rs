//! What a packet has still to visit.

use crate::bvh::child::Child;
use crate::bvh::traverse::stack::{Entry, MAX_DEPTH};

/// Each level leaves at most three children behind. A power of two, so that a mask replaces the bounds check.
const CAPACITY: usize = 256;
const _: () = assert!(1 + 3 * (MAX_DEPTH as usize) + 4 < CAPACITY);

/// Children, the next one last, and which rays meet them. Below them lies [`Child::EMPTY`].
pub struct PacketStack {
    entries: [(Entry, u64); CAPACITY],
    len: usize,
}

impl PacketStack {
    /// Nothing.
    pub fn new() -> PacketStack {
        PacketStack { entries: [(Entry::new(0.0, Child::EMPTY), 0); CAPACITY], len: 0 }
    }

    /// Forgets what an earlier packet left.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.entries[0] = (Entry::new(0.0, Child::EMPTY), 0);
        self.len = 1;
    }

    /// Adds a child if any ray meets it, without a branch.
    #[inline(always)]
    pub fn push_if(&mut self, entry: Entry, rays: u64) {
        debug_assert!(self.len < CAPACITY);
        self.entries[self.len % CAPACITY] = (entry, rays);
        self.len += usize::from(rays != 0);
    }

    /// How many there are.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Takes the child added last.
    #[inline(always)]
    pub fn pop(&mut self) -> (Entry, u64) {
        self.len = self.len.wrapping_sub(1);
        self.entries[self.len % CAPACITY]
    }
}
