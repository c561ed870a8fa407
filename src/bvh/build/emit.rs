//! Writing the planned tree: nodes depth-first, leaf blocks in the order in which the nodes refer to them.

use rayon::prelude::*;

use super::bvh2::Binary;
use super::collapse::{Collapse, Part};
use crate::bvh::aabb::Aabb;
use crate::bvh::child::Child;
use crate::bvh::node4::Node4;
use crate::bvh::shared_tri4::SharedTri4;
use crate::bvh::sphere4::Sphere4;
use crate::bvh::tri4::Tri4;
use crate::scene::shapes::Shapes;
use crate::system::Buffer;

/// Up to four consecutive entries of the leaf order, for one leaf block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    first: u32,
    count: u32,
}

/// The tree without the contents of its leaves.
#[derive(Debug, Default)]
pub struct Skeleton {
    /// Nodes; the root first.
    pub nodes: Vec<Node4>,
    /// What the triangle blocks will hold.
    pub triangles: Vec<Block>,
    /// What the sphere blocks will hold.
    pub spheres: Vec<Block>,
    /// Levels of nodes.
    pub depth: u32,
}

/// Subtrees of no more primitives than this are laid out by one thread.
const PIECE: u32 = 1 << 14;

/// What to do with subtrees of at most [`PIECE`] primitives.
enum Small {
    /// Lay them out in place.
    Emit,
    /// Write down which they are.
    Note(Vec<Part>),
    /// Take the next one that has been laid out.
    Take(std::vec::IntoIter<Skeleton>),
}

impl Skeleton {
    /// Lays out nodes and leaves: small subtrees in parallel, and then what is above them.
    pub fn new(binary: &Binary, plan: &Collapse) -> Skeleton {
        let root = Part { node: 0, first: 0 };
        let pieces = match Skeleton::of(binary, plan, root, Small::Note(Vec::new())).1 {
            Small::Note(parts) => {
                parts.into_par_iter().map(|part| Skeleton::of(binary, plan, part, Small::Emit).0).collect()
            }
            _ => Vec::new(),
        };
        Skeleton::of(binary, plan, root, Small::Take(pieces.into_iter())).0
    }

    /// Lays out a subtree on this thread.
    fn of(binary: &Binary, plan: &Collapse, part: Part, mut small: Small) -> (Skeleton, Small) {
        let mut skeleton = Skeleton::default();
        skeleton.emit(binary, plan, part, 1, &mut small);
        (skeleton, small)
    }

    /// Takes over a subtree that was laid out on its own.
    fn append(&mut self, piece: Skeleton, depth: u32) -> Child {
        let index = self.nodes.len() as u32;
        let (triangles, spheres) = (self.triangles.len() as u32, self.spheres.len() as u32);
        self.nodes.extend(piece.nodes.into_iter().map(|mut node| {
            for child in &mut node.children {
                *child = child.moved(index, triangles, spheres);
            }
            node
        }));
        self.triangles.extend(piece.triangles);
        self.spheres.extend(piece.spheres);
        self.depth = self.depth.max(depth - 1 + piece.depth);
        Child::inner(index)
    }

    /// Recursion is as deep as the tree, and so bounded.
    fn emit(&mut self, binary: &Binary, plan: &Collapse, part: Part, depth: u32, small: &mut Small) -> Child {
        let nodes = &binary.nodes[..];
        if nodes[part.node].count <= PIECE {
            match small {
                Small::Emit => {}
                Small::Note(parts) => {
                    parts.push(part);
                    return Child::ROOT;
                }
                Small::Take(pieces) => {
                    return self.append(pieces.next().expect("as many as were noted"), depth);
                }
            }
        }
        self.depth = self.depth.max(depth);
        let index = self.nodes.len();
        self.nodes.push(Node4::new(&[]));
        let mut parts = plan.children(nodes, part);
        // Largest first: any-hit traversal takes the first child that the ray meets, and the largest box is the
        // likeliest to hold an occluder (SATO, Nah and Manocha 2014).
        let area = |part: &Part| nodes[part.node].aabb().half_area(1.0);
        parts.sort_by(|a, b| area(b).total_cmp(&area(a)));
        // Leaves before inner nodes: their blocks then lie together, next to those of the parent's other leaves.
        let mut children: [(Child, Aabb); 4] = [(Child::EMPTY, Aabb::EMPTY); 4];
        for leaves in [true, false] {
            for (slot, part) in children.iter_mut().zip(&parts) {
                let leaf = plan.is_leaf(part.node);
                if leaf == leaves {
                    let child = if leaf {
                        self.leaf(binary, plan, *part)
                    } else {
                        self.emit(binary, plan, *part, depth + 1, small)
                    };
                    *slot = (child, nodes[part.node].aabb());
                }
            }
        }
        self.nodes[index] = Node4::new(&children[..parts.len()]);
        Child::inner(index as u32)
    }

    fn leaf(&mut self, binary: &Binary, plan: &Collapse, part: Part) -> Child {
        let spheres = plan.has_spheres(part.node);
        let blocks = if spheres { &mut self.spheres } else { &mut self.triangles };
        let first_block = blocks.len();
        let end = part.first + binary.nodes[part.node].count;
        let mut first = part.first;
        while first < end {
            let count = plan.packing.first_block(&binary.order[first as usize..end as usize]) as u32;
            blocks.push(Block { first, count });
            first += count;
        }
        Child::leaf(first_block as u32, (blocks.len() - first_block) as u32, spheres)
    }
}

/// Fills the triangle blocks. `order`: the primitives in the order of the leaves.
pub fn triangle_blocks(blocks: &[Block], order: &[u32], shapes: &Shapes) -> Buffer<Tri4> {
    Buffer::from_par_iter(blocks.par_iter().map(|block| {
        let mut tri4 = Tri4::EMPTY;
        for (lane, &prim) in block.prims(order).iter().enumerate() {
            tri4.set(lane, shapes.corners(prim), prim, shapes.geometry_of(prim));
        }
        tri4
    }))
}

/// As [`triangle_blocks`], of compact ones: they were packed for them.
pub fn shared_blocks(blocks: &[Block], order: &[u32], shapes: &Shapes) -> Buffer<SharedTri4> {
    Buffer::from_par_iter(blocks.par_iter().map(|block| {
        SharedTri4::new(block.prims(order).iter().map(|&prim| (prim, shapes.geometry_of(prim), shapes.corners(prim))))
    }))
}

/// Fills the sphere blocks.
pub fn sphere_blocks(blocks: &[Block], order: &[u32], shapes: &Shapes) -> Buffer<Sphere4> {
    let first_sphere = shapes.triangles.len();
    Buffer::from_par_iter(blocks.par_iter().map(|block| {
        let mut sphere4 = Sphere4::EMPTY;
        for (lane, &prim) in block.prims(order).iter().enumerate() {
            sphere4.set(lane, &shapes.spheres[prim as usize - first_sphere], prim, shapes.geometry_of(prim));
        }
        sphere4
    }))
}

impl Block {
    fn prims<'a>(&self, order: &'a [u32]) -> &'a [u32] {
        &order[self.first as usize..][..self.count as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::build::packing::Packing;
    use crate::bvh::build::tests::random_tree;

    #[test]
    fn pieces_give_what_one_thread_would() {
        let (binary, triangles) = random_tree(100_000);
        let plan = Collapse::plan(&binary, triangles, 1.0, Packing::Fours);
        let pieces = Skeleton::new(&binary, &plan);
        let whole = Skeleton::of(&binary, &plan, Part { node: 0, first: 0 }, Small::Emit).0;
        assert_eq!(pieces.nodes, whole.nodes);
        assert_eq!((pieces.triangles, pieces.spheres), (whole.triangles, whole.spheres));
        assert_eq!(pieces.depth, whole.depth);
    }
}
