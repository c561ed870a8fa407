//! From the binary tree to the cheapest four-wide one: the dynamic programme of Ylitie, Karras and Laine,
//! "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs" (2017), §3.1, for width four.
//!
//! For each binary node and each `i`, it finds the cheapest way to represent the subtree by at most `i` children of
//! some wide node: by one leaf, by one wide node, or by what the two halves need at best for `j` and `i − j`.

use smallvec::SmallVec;

use super::bvh2::{Binary, Node2, filled};
use super::packing::Packing;
use crate::bvh::child::MAX_LEAF_BLOCKS;

/// Cost of visiting a wide node.
pub const NODE_COST: f32 = 1.0;
/// Cost of testing a leaf block.
pub const BLOCK_COST: f32 = 1.0;

/// Leaves wider than this many blocks are never tried.
const MOST_BLOCKS: u32 = MAX_LEAF_BLOCKS;

/// How to represent a subtree by at most one, two, three children.
#[derive(Clone, Copy, Debug, Default)]
struct Choice {
    cost: [f32; 3],
    /// For two and three: how many of them the left half gets; 0: use one fewer.
    left: [u8; 3],
    /// As a wide node: how many of its four children the left half gets.
    inner_left: u8,
    /// As one child: a leaf rather than a wide node.
    leaf: bool,
    /// Which kinds of primitives are below: 1 triangles, 2 spheres, 3 both.
    kinds: u8,
}

/// The plan of the four-wide tree.
#[derive(Debug)]
pub struct Collapse<'a> {
    choices: Vec<Choice>,
    /// How the primitives of leaves come in blocks.
    pub packing: Packing<'a>,
}

/// A child of a wide node, as it stands in the binary tree.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Binary node.
    pub node: usize,
    /// Its first fragment.
    pub first: u32,
}

impl<'a> Collapse<'a> {
    /// Plans. `triangles`: primitives below this are triangles; `scale` keeps areas finite.
    pub fn plan(binary: &Binary, triangles: u32, scale: f32, packing: Packing<'a>) -> Collapse<'a> {
        let mut choices = filled(Choice::default(), binary.nodes.len());
        Planner { triangles, scale, packing }.plan(&binary.nodes, &binary.order, &mut choices);
        Collapse { choices, packing }
    }

    /// Whether the subtree is one leaf; otherwise it is a wide node.
    pub fn is_leaf(&self, node: usize) -> bool {
        self.choices[node].leaf
    }

    /// Whether spheres are below.
    pub fn has_spheres(&self, node: usize) -> bool {
        self.choices[node].kinds & 2 != 0
    }

    /// The children of a wide node.
    pub fn children(&self, nodes: &[Node2], part: Part) -> SmallVec<[Part; 4]> {
        let mut parts = SmallVec::new();
        match nodes[part.node].children(part.node) {
            // A tree of one leaf: the root is a wide node all the same.
            None => parts.push(part),
            Some(halves) => {
                let left = self.choices[part.node].inner_left;
                self.gather(nodes, part.first, halves, left, 4 - left, &mut parts);
            }
        }
        parts
    }

    fn gather(
        &self,
        nodes: &[Node2],
        first: u32,
        (left, right): (usize, usize),
        for_left: u8,
        for_right: u8,
        parts: &mut SmallVec<[Part; 4]>,
    ) {
        self.gather_one(nodes, Part { node: left, first }, for_left, parts);
        self.gather_one(nodes, Part { node: right, first: first + nodes[left].count }, for_right, parts);
    }

    fn gather_one(&self, nodes: &[Node2], part: Part, mut most: u8, parts: &mut SmallVec<[Part; 4]>) {
        let choice = &self.choices[part.node];
        while most > 1 && choice.left[most as usize - 1] == 0 {
            most -= 1;
        }
        match nodes[part.node].children(part.node) {
            Some(halves) if most > 1 => {
                let left = choice.left[most as usize - 1];
                self.gather(nodes, part.first, halves, left, most - left, parts);
            }
            _ => parts.push(part),
        }
    }
}

/// Subtrees of more nodes than this are planned in parallel halves.
const PARALLEL: usize = 1 << 13;

/// What all subtrees share.
struct Planner<'a> {
    triangles: u32,
    scale: f32,
    packing: Packing<'a>,
}

impl Planner<'_> {
    /// Plans a subtree, bottom-up.
    fn plan(&self, nodes: &[Node2], order: &[u32], choices: &mut [Choice]) {
        match nodes[0].children(0) {
            Some((_, right)) if nodes.len() > PARALLEL => {
                let (order_left, order_right) = order.split_at(nodes[1].count as usize);
                let (own_and_left, choices_right) = choices.split_at_mut(right);
                let (own, choices_left) = own_and_left.split_at_mut(1);
                rayon::join(
                    || self.plan(&nodes[1..right], order_left, choices_left),
                    || self.plan(&nodes[right..], order_right, choices_right),
                );
                own[0] = self.inner(&nodes[0], order, &choices_left[0], &choices_right[0]);
            }
            _ => {
                // Children follow their parents, so backwards is bottom-up, and leaves come in falling order of
                // primitives.
                let mut end = order.len();
                for (index, node) in nodes.iter().enumerate().rev() {
                    choices[index] = match node.children(index) {
                        Some((left, right)) => self.inner(node, &order[end..], &choices[left], &choices[right]),
                        None => {
                            end -= node.count as usize;
                            self.leaf(node, &order[end..])
                        }
                    };
                }
            }
        }
    }

    /// `order` begins with its primitives.
    fn leaf(&self, node: &Node2, order: &[u32]) -> Choice {
        let blocks = self.packing.blocks(&order[..node.count as usize]);
        let cost = node.aabb().half_area(self.scale) * blocks as f32 * BLOCK_COST;
        let kinds = if order[0] < self.triangles { 1 } else { 2 };
        Choice { cost: [cost; 3], leaf: true, kinds, ..Choice::default() }
    }

    /// `order` begins with its primitives.
    #[inline(always)]
    fn inner(&self, node: &Node2, order: &[u32], left: &Choice, right: &Choice) -> Choice {
        let area = node.aabb().half_area(self.scale);
        let leaf_cost = |blocks: u32| area * blocks as f32 * BLOCK_COST;
        let (four, inner_left) = distribute(left, right, 4);
        let (three, left_of_three) = distribute(left, right, 3);
        let two = left.cost[0] + right.cost[0];
        let kinds = left.kinds | right.kinds;
        let inner_cost = area * NODE_COST + four;
        // As few blocks as there may be first: counting them takes a while, and they are few nodes that this lets through.
        let may_be_leaf = |blocks: u32| blocks <= MOST_BLOCKS && kinds != 3 && leaf_cost(blocks) <= inner_cost;
        let mut blocks = node.count.div_ceil(4);
        let mut leaf = may_be_leaf(blocks);
        if leaf {
            blocks = self.packing.blocks(&order[..node.count as usize]);
            leaf = may_be_leaf(blocks);
        }
        let mut choice = Choice {
            cost: [if leaf { leaf_cost(blocks) } else { inner_cost }; 3],
            inner_left,
            leaf,
            kinds,
            ..Choice::default()
        };
        if two < choice.cost[0] {
            choice.cost[1..].fill(two);
            choice.left[1] = 1;
        }
        if three < choice.cost[1] {
            choice.cost[2] = three;
            choice.left[2] = left_of_three;
        }
        choice
    }
}

/// The cheapest way to give `most` children to two halves: its cost, and how many go left.
#[inline(always)]
fn distribute(left: &Choice, right: &Choice, most: usize) -> (f32, u8) {
    let mut best = (f32::INFINITY, 1);
    for for_left in 1..most {
        let cost = left.cost[for_left - 1] + right.cost[most - for_left - 1];
        if cost < best.0 {
            best = (cost, for_left as u8);
        }
    }
    best
}
