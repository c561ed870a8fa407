//! The binary tree.

use glam::Vec3;
use rayon::prelude::*;

use super::fragment::WideBox;
use crate::bvh::aabb::Aabb;

/// A node of the binary tree, 32 bytes. Depth-first: the left child of node `i` is `i + 1`.
#[derive(Clone, Copy, Debug)]
pub struct Node2 {
    min: Vec3,
    /// Distance from this node to its right child in the array; 0 for leaves.
    right: u32,
    max: Vec3,
    /// Fragments below. They are consecutive, the left child's first.
    pub count: u32,
}

const _: () = assert!(size_of::<Node2>() == 32);

impl Node2 {
    /// A leaf, until it is given children.
    #[inline(always)]
    pub fn leaf(bounds: &WideBox, count: usize) -> Node2 {
        let Aabb { min, max } = bounds.aabb();
        Node2 { min, right: 0, max, count: count as u32 }
    }

    /// An inner node whose right child is `right` behind it.
    #[inline(always)]
    pub fn inner(bounds: &WideBox, count: usize, right: usize) -> Node2 {
        Node2 { right: right as u32, ..Node2::leaf(bounds, count) }
    }

    /// The box.
    #[inline(always)]
    pub fn aabb(&self) -> Aabb {
        Aabb { min: self.min, max: self.max }
    }

    /// The box, to be grown.
    #[inline(always)]
    pub fn bounds(&self) -> WideBox {
        WideBox { min: self.min.extend(0.0), max: self.max.extend(0.0) }
    }

    /// The children of this node, which is number `index`; `None` for leaves.
    #[inline(always)]
    pub fn children(&self, index: usize) -> Option<(usize, usize)> {
        (self.right != 0).then(|| (index + 1, index + self.right as usize))
    }

    /// Makes the box hold those of both children.
    #[inline(always)]
    pub fn refit(&mut self, left: &Node2, right: &Node2) {
        self.min = left.min.min(right.min);
        self.max = left.max.max(right.max);
    }

    /// Says that the right child is `right` behind.
    #[inline(always)]
    pub fn set_right(&mut self, right: usize) {
        self.right = right as u32;
    }
}

/// The binary tree and the primitives in the order of its leaves.
#[derive(Debug)]
pub struct Binary {
    /// Depth-first.
    pub nodes: Vec<Node2>,
    /// Primitives. Those of a subtree are consecutive.
    pub order: Vec<u32>,
}

impl Binary {
    /// Room for a tree of this many nodes and primitives.
    pub fn filled(nodes: usize, prims: usize) -> Binary {
        Binary { nodes: filled(Node2::leaf(&WideBox::EMPTY, 0), nodes), order: filled(0, prims) }
    }
}

/// A binary tree in pieces, as parallel builders make it.
pub enum Forest {
    /// All nodes of a subtree, depth-first.
    Piece(Vec<Node2>),
    /// A node above two subtrees, and how many nodes there are in all.
    Join(Box<(Node2, Forest, Forest)>, usize),
}

impl Forest {
    /// A node above two subtrees.
    pub fn join(count: usize, left: Forest, right: Forest) -> Forest {
        let bounds = left.bounds().union(right.bounds());
        let (below, all) = (left.len(), 1 + left.len() + right.len());
        Forest::Join(Box::new((Node2::inner(&bounds, count, 1 + below), left, right)), all)
    }

    /// The box around everything.
    pub fn bounds(&self) -> WideBox {
        match self {
            Forest::Piece(nodes) => nodes[0].bounds(),
            Forest::Join(parts, _) => parts.0.bounds(),
        }
    }

    fn len(&self) -> usize {
        match self {
            Forest::Piece(nodes) => nodes.len(),
            Forest::Join(_, len) => *len,
        }
    }

    /// The whole tree in one array. Pieces are freed as they are copied.
    pub fn flatten(self) -> Vec<Node2> {
        match self {
            Forest::Piece(nodes) => nodes,
            Forest::Join(_, len) => {
                let mut nodes = filled(Node2::leaf(&WideBox::EMPTY, 0), len);
                self.write(&mut nodes);
                nodes
            }
        }
    }

    fn write(self, nodes: &mut [Node2]) {
        match self {
            Forest::Piece(piece) => nodes.copy_from_slice(&piece),
            Forest::Join(parts, _) => {
                let (node, left, right) = *parts;
                let (own, below) = nodes.split_at_mut(1);
                own[0] = node;
                let (left_nodes, right_nodes) = below.split_at_mut(left.len());
                rayon::join(|| left.write(left_nodes), || right.write(right_nodes));
            }
        }
    }
}

/// A vector of copies. All threads touch its memory first, which shares out the page faults.
pub fn filled<T: Copy + Send + Sync>(value: T, len: usize) -> Vec<T> {
    rayon::iter::repeat_n(value, len).collect()
}
