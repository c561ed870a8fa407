//! The traversal stack.

use crate::bvh::child::Child;

/// Most levels of inner nodes that a tree may have. The builder keeps to it by switching to median splits.
pub const MAX_DEPTH: u32 = 80;

/// Each level leaves at most three children behind. A power of two, so that a mask replaces the bounds check.
const CAPACITY: usize = 256;
const _: () = assert!(3 * (MAX_DEPTH as usize) < CAPACITY);

/// Children still to visit, with the distances at which the ray enters them.
///
/// One a batch rather than one a ray: clearing it costs more than a short traversal.
#[derive(Clone, Debug)]
pub struct Stack {
    entries: [Entry; CAPACITY],
    len: usize,
}

/// An entry distance (not negative, so that its bits sort like its value) above a child reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Entry(u64);

impl Entry {
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
        Stack { entries: [Entry(0); CAPACITY], len: 0 }
    }

    /// Forgets what an earlier ray left.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Adds an entry.
    #[inline(always)]
    pub fn push(&mut self, entry: Entry) {
        debug_assert!(self.len < CAPACITY);
        self.entries[self.len % CAPACITY] = entry;
        self.len += 1;
    }

    /// Takes the entry added last.
    #[inline(always)]
    pub fn pop(&mut self) -> Option<Entry> {
        if self.len == 0 {
            return None;
        }
        self.len -= 1;
        Some(self.entries[self.len % CAPACITY])
    }
}
