//! The traversal stack.

use crate::bvh::child::Child;

/// Most levels of inner nodes that a tree may have. The builder keeps to it by switching to median splits.
pub const MAX_DEPTH: u32 = 80;

/// Each level leaves at most three children behind. A power of two, so that a mask replaces the bounds check.
const CAPACITY: usize = 256;
/// Entries written at once, of which only those that count are kept.
const WIDTH: usize = 4;
const _: () = assert!(1 + 3 * (MAX_DEPTH as usize) + WIDTH < CAPACITY);

/// Children still to visit, the next one last, with the distances at which the ray enters them. Below them lies
/// [`Child::EMPTY`], which says that nothing is left.
#[derive(Clone, Debug)]
pub struct Stack {
    entries: [Entry; CAPACITY + WIDTH],
    len: usize,
}

/// An entry distance (not negative, so that its bits sort like its value) above a child reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Entry(u64);

impl Entry {
    /// Sorts before all children: nothing points back at the root.
    pub const NONE: Entry = Entry(0);

    /// A child and where the ray enters it.
    #[inline(always)]
    pub fn new(distance: f32, child: Child) -> Entry {
        Entry(u64::from(distance.to_bits()) << 32 | u64::from(child.bits()))
    }

    /// Where the ray enters.
    #[inline(always)]
    pub fn distance(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }

    /// The child.
    #[inline(always)]
    pub fn child(self) -> Child {
        Child::from_bits(self.0 as u32)
    }
}

impl Stack {
    /// An empty stack.
    pub fn new() -> Stack {
        Stack { entries: [Entry::new(0.0, Child::EMPTY); CAPACITY + WIDTH], len: 1 }
    }

    /// Forgets what an earlier ray left.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.entries[0] = Entry::new(0.0, Child::EMPTY);
        self.len = 1;
    }

    /// Adds the first `count` entries. Writes all four, which spares a branch.
    #[inline(always)]
    pub fn push(&mut self, entries: [Entry; WIDTH], count: u32) {
        debug_assert!(self.len + WIDTH <= CAPACITY);
        self.entries[self.len % CAPACITY..][..WIDTH].copy_from_slice(&entries);
        self.len += count as usize;
    }

    /// Adds one child.
    #[inline(always)]
    pub fn push_one(&mut self, entry: Entry) {
        debug_assert!(self.len < CAPACITY);
        self.entries[self.len % CAPACITY] = entry;
        self.len += 1;
    }

    /// Takes the child added last; [`Child::EMPTY`] when there is none.
    #[inline(always)]
    pub fn pop(&mut self) -> Entry {
        debug_assert!(self.len > 0);
        self.len = self.len.wrapping_sub(1);
        self.entries[self.len % CAPACITY]
    }
}
