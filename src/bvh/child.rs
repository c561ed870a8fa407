//! References from a node to its children.

use bytemuck::{Pod, Zeroable};

/// What a child slot of a node points at, in 32 bits.
///
/// | bits | inner node | leaf |
/// |---|---|---|
/// | 31 | 0 | 1 |
/// | 30 | – | 0 triangles, 1 spheres |
/// | 27–29 | – | blocks, minus one |
/// | rest | node index | index of the first block |
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Pod, Zeroable)]
#[repr(transparent)]
pub struct Child(u32);

const LEAF: u32 = 1 << 31;
const SPHERES: u32 = 1 << 30;
const COUNT_SHIFT: u32 = 27;
const INDEX: u32 = (1 << COUNT_SHIFT) - 1;

/// Blocks that one leaf may hold.
pub const MAX_LEAF_BLOCKS: u32 = 8;

impl Child {
    /// No child. Its box is empty too, so no ray ever follows it.
    pub const EMPTY: Child = Child(u32::MAX);
    /// The root.
    pub const ROOT: Child = Child(0);
    /// Node and block indices stay below this.
    pub const MAX_INDEX: u32 = INDEX;

    /// An inner node.
    pub fn inner(node: u32) -> Child {
        debug_assert!(node < INDEX);
        Child(node)
    }

    /// A leaf of `blocks` blocks from `first`.
    pub fn leaf(first: u32, blocks: u32, spheres: bool) -> Child {
        debug_assert!(first < INDEX && (1..=MAX_LEAF_BLOCKS).contains(&blocks));
        Child(LEAF | if spheres { SPHERES } else { 0 } | (blocks - 1) << COUNT_SHIFT | first)
    }

    /// The same child after everything it may refer to has moved up by so many nodes and blocks.
    pub fn moved(self, nodes: u32, triangle_blocks: u32, sphere_blocks: u32) -> Child {
        match self {
            Child::EMPTY => self,
            _ if !self.is_leaf() => Child::inner(self.0 + nodes),
            _ => Child(self.0 + if self.is_spheres() { sphere_blocks } else { triangle_blocks }),
        }
    }

    /// The reference as stored on a traversal stack.
    #[inline(always)]
    pub fn bits(self) -> u32 {
        self.0
    }

    /// The inverse of [`Child::bits`].
    #[inline(always)]
    pub fn from_bits(bits: u32) -> Child {
        Child(bits)
    }

    /// Whether it is a leaf; otherwise it is an inner node.
    #[inline(always)]
    pub fn is_leaf(self) -> bool {
        self.0 & LEAF != 0
    }

    /// Whether this leaf holds spheres; otherwise it holds triangles.
    #[inline(always)]
    pub fn is_spheres(self) -> bool {
        self.0 & SPHERES != 0
    }

    /// The bits of a child with that of [`Child::is_spheres`] in the highest place.
    #[inline(always)]
    pub fn spheres_in_front(bits: u32) -> u32 {
        bits << 1
    }

    /// Index of the node, for inner nodes.
    #[inline(always)]
    pub fn node(self) -> usize {
        self.0 as usize
    }

    /// Index of the first block, for leaves.
    #[inline(always)]
    pub fn first_block(self) -> usize {
        (self.0 & INDEX) as usize
    }

    /// Whether a leaf is a single block.
    #[inline(always)]
    pub fn is_one_block(self) -> bool {
        self.0 >> COUNT_SHIFT & (MAX_LEAF_BLOCKS - 1) == 0
    }

    /// A leaf of several blocks without the first of them.
    #[inline(always)]
    pub fn without_first_block(self) -> Child {
        Child(self.0.wrapping_add(1).wrapping_sub(1 << COUNT_SHIFT))
    }

    /// The blocks of a leaf.
    #[inline(always)]
    pub fn blocks(self) -> std::ops::Range<usize> {
        let first = (self.0 & INDEX) as usize;
        first..first + ((self.0 >> COUNT_SHIFT & (MAX_LEAF_BLOCKS - 1)) + 1) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_keep_their_parts() {
        for spheres in [false, true] {
            for blocks in 1..=MAX_LEAF_BLOCKS {
                let child = Child::leaf(12_345_678, blocks, spheres);
                assert!(child.is_leaf());
                assert_eq!(child.is_spheres(), spheres);
                assert_eq!(child.blocks(), 12_345_678..12_345_678 + blocks as usize);
                assert_ne!(child, Child::EMPTY);
            }
        }
        assert!(!Child::inner(7).is_leaf());
        assert_eq!(Child::inner(7).node(), 7);
    }
}
