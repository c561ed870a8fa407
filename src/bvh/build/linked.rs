//! A binary tree that can be changed: its upper part as nodes that know their parent, and below it whole subtrees that
//! stay as they are.

use rayon::prelude::*;

use super::bvh2::{Binary, Node2};
use super::fragment::WideBox;
use crate::bvh::traverse::stack::MAX_DEPTH;

/// No node.
pub const NONE: u32 = u32::MAX;

/// A node, 64 bytes.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Link {
    bounds: WideBox,
    parent: u32,
    /// The nodes below, or for a subtree that stays as it is, [`NONE`] and its number.
    children: [u32; 2],
}

/// A subtree that stays as it is, in the tree that this one was made of.
#[derive(Clone, Copy, Debug)]
struct Subtree {
    /// Where its nodes lie.
    node: usize,
    nodes: usize,
    /// Where its primitives lie.
    prim: usize,
    prims: usize,
}

impl Subtree {
    /// Levels of inner nodes.
    fn height(&self, nodes: &[Node2]) -> u32 {
        let nodes = &nodes[self.node..][..self.nodes];
        let mut heights = vec![0u32; nodes.len()];
        for (index, node) in nodes.iter().enumerate().rev() {
            if let Some((left, right)) = node.children(index) {
                heights[index] = 1 + heights[left].max(heights[right]);
            }
        }
        heights[0]
    }
}

/// The tree. Node 0 is the root.
#[derive(Debug)]
pub struct Linked {
    links: Vec<Link>,
    subtrees: Vec<Subtree>,
}

impl Linked {
    /// Of the nodes with the largest boxes, `most` of them or, where many are as large as each other, fewer, and of their
    /// children. They are the upper part of a tree: no box is larger than the one around it.
    pub fn of_largest(nodes: &[Node2], most: usize, scale: f32) -> Linked {
        let least = least_of_largest(nodes.par_iter().map(|node| node.aabb().half_area(scale)).collect(), most);
        let mut linked = Linked { links: Vec::new(), subtrees: Vec::new() };
        let all = Subtree { node: 0, nodes: nodes.len(), prim: 0, prims: nodes[0].count as usize };
        let mut waiting = vec![(all, NONE)];
        while let Some((part, parent)) = waiting.pop() {
            let (node, slot) = (&nodes[part.node], linked.links.len() as u32);
            if parent != NONE {
                let children = &mut linked.links[parent as usize].children;
                children[usize::from(children[0] != NONE)] = slot;
            }
            let mut children = [NONE; 2];
            match node.children(part.node) {
                Some((left, right)) if node.aabb().half_area(scale) > least => {
                    let prims = nodes[left].count as usize;
                    let left = Subtree { node: left, nodes: right - left, prims, ..part };
                    let right = Subtree {
                        node: right,
                        nodes: part.nodes - 1 - left.nodes,
                        prim: part.prim + prims,
                        prims: part.prims - prims,
                    };
                    waiting.extend([(right, slot), (left, slot)]);
                }
                _ => {
                    children[1] = linked.subtrees.len() as u32;
                    linked.subtrees.push(part);
                }
            }
            linked.links.push(Link { bounds: node.bounds(), parent, children });
        }
        linked
    }

    /// How many nodes there are.
    pub fn len(&self) -> usize {
        self.links.len()
    }

    /// The box.
    #[inline(always)]
    pub fn bounds(&self, node: u32) -> WideBox {
        self.links[node as usize].bounds
    }

    /// The node above, [`NONE`] for the root.
    #[inline(always)]
    pub fn parent(&self, node: u32) -> u32 {
        self.links[node as usize].parent
    }

    /// The nodes below.
    #[inline(always)]
    pub fn children(&self, node: u32) -> Option<[u32; 2]> {
        let children = self.links[node as usize].children;
        (children[0] != NONE).then_some(children)
    }

    /// The other child of the node above; the node must not be the root.
    #[inline(always)]
    pub fn sibling(&self, node: u32) -> u32 {
        let [left, right] = self.links[self.parent(node) as usize].children;
        if left == node { right } else { left }
    }

    /// Whether `node` is `above` or below it.
    pub fn is_below(&self, mut node: u32, above: u32) -> bool {
        while node != above && node != NONE {
            node = self.parent(node);
        }
        node == above
    }

    /// The sum of the areas of all nodes with children.
    pub fn area(&self, scale: f32) -> f64 {
        // In chunks, so that rounding does not depend on the number of threads.
        let chunk = |links: &[Link]| -> f64 {
            let inner = links.iter().filter(|link| link.children[0] != NONE);
            inner.map(|link| f64::from(link.bounds.half_area(scale))).sum()
        };
        self.links.par_chunks(1 << 12).map(chunk).collect::<Vec<f64>>().into_iter().sum()
    }

    /// Takes a node, whose parent must not be the root, out of its place, and makes it the sibling of `to`, which must
    /// be neither below it, nor its parent, nor its sibling.
    pub fn reinsert(&mut self, node: u32, to: u32) {
        let (parent, sibling) = (self.parent(node), self.sibling(node));
        let grandparent = self.parent(parent);
        self.replace(grandparent, parent, sibling);
        self.refit(grandparent);
        let above = self.parent(to);
        self.replace(above, to, parent);
        self.links[parent as usize].children = [to, node];
        self.links[to as usize].parent = parent;
        self.refit(parent);
    }

    fn replace(&mut self, parent: u32, old: u32, new: u32) {
        let children = &mut self.links[parent as usize].children;
        children[usize::from(children[0] != old)] = new;
        self.links[new as usize].parent = parent;
    }

    fn refit(&mut self, mut node: u32) {
        while node != NONE {
            let [left, right] = self.links[node as usize].children;
            let bounds = self.bounds(left).union(self.bounds(right));
            self.links[node as usize].bounds = bounds;
            node = self.parent(node);
        }
    }

    /// The whole tree, depth-first, with the subtrees of the tree that it was made of; `None` if it is deeper than
    /// traversal allows.
    pub fn unlink(&self, source: &Binary) -> Option<Binary> {
        let heights: Vec<u32> = self.subtrees.par_iter().map(|part| part.height(&source.nodes)).collect();
        let mut depth_first = Vec::with_capacity(self.len());
        let mut waiting = vec![(0, 0)];
        while let Some((node, depth)) = waiting.pop() {
            depth_first.push(node);
            match self.children(node) {
                Some([left, right]) => waiting.extend([(right, depth + 1), (left, depth + 1)]),
                None if depth + heights[self.subtree_number(node)] > MAX_DEPTH => return None,
                None => {}
            }
        }
        // Nodes and primitives below each node, bottom-up.
        let mut sizes = vec![(0, 0); self.len()];
        for &node in depth_first.iter().rev() {
            sizes[node as usize] = match self.children(node) {
                Some([left, right]) => {
                    let (left, right) = (sizes[left as usize], sizes[right as usize]);
                    (1 + left.0 + right.0, left.1 + right.1)
                }
                None => {
                    let part = &self.subtrees[self.subtree_number(node)];
                    (part.nodes, part.prims)
                }
            };
        }
        let mut binary = Binary::filled(source.nodes.len(), source.order.len());
        let (mut nodes, mut order) = (&mut binary.nodes[..], &mut binary.order[..]);
        let mut copies = Vec::with_capacity(self.subtrees.len());
        for node in depth_first {
            let (here, prims) = sizes[node as usize];
            match self.children(node) {
                Some([left, _]) => {
                    let own;
                    (own, nodes) = nodes.split_at_mut(1);
                    own[0] = Node2::inner(&self.bounds(node), prims, 1 + sizes[left as usize].0);
                }
                None => {
                    let (own_nodes, own_order);
                    (own_nodes, nodes) = nodes.split_at_mut(here);
                    (own_order, order) = order.split_at_mut(prims);
                    copies.push((&self.subtrees[self.subtree_number(node)], own_nodes, own_order));
                }
            }
        }
        copies.into_par_iter().for_each(|(part, nodes, order)| {
            nodes.copy_from_slice(&source.nodes[part.node..][..part.nodes]);
            order.copy_from_slice(&source.order[part.prim..][..part.prims]);
        });
        Some(binary)
    }

    fn subtree_number(&self, node: u32) -> usize {
        self.links[node as usize].children[1] as usize
    }
}

/// The least of the `most` largest areas.
fn least_of_largest(mut areas: Vec<f32>, most: usize) -> f32 {
    if most >= areas.len() {
        return f32::NEG_INFINITY;
    }
    *areas.select_nth_unstable_by(most.max(1) - 1, |a, b| b.total_cmp(a)).1
}
