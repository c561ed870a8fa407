//! The four-wide tree itself. `build` makes it, `traverse` asks it.

use std::hash::{Hash, Hasher};

use super::aabb::Aabb;
use super::child::Child;
use super::grid_node4::{Grid, GridNode4};
use super::intersect::Intersect;
use super::node::Node;
use super::node4::Node4;
use super::sphere4::Sphere4;
use super::stats::BvhStats;
use super::traverse::{Tree, TreeKernel};
use super::tri4::Tri4;
use crate::options::Intersection;
use crate::system::Buffer;

/// The inner nodes, in one of their formats: the root first, then depth-first; none if there are no primitives.
#[derive(Clone, Debug)]
pub(super) enum Nodes {
    /// Planes in single precision.
    Full(Buffer<Node4>),
    /// Planes on a grid.
    Grid(Buffer<GridNode4>, Grid),
}

/// A four-wide BVH over triangles and spheres. It owns all it needs.
#[derive(Clone, Debug)]
pub struct Bvh4 {
    pub(super) nodes: Nodes,
    pub(super) triangles: Buffer<Tri4>,
    pub(super) spheres: Buffer<Sphere4>,
    pub(super) bounds: Aabb,
    pub(super) intersection: Intersection,
    pub(super) stats: BvhStats,
}

impl Default for Bvh4 {
    fn default() -> Self {
        Bvh4 {
            nodes: Nodes::Full(Buffer::default()),
            triangles: Buffer::default(),
            spheres: Buffer::default(),
            bounds: Aabb::EMPTY,
            intersection: Intersection::default(),
            stats: BvhStats::default(),
        }
    }
}

impl Bvh4 {
    /// The box of all primitives.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Figures.
    pub fn stats(&self) -> BvhStats {
        self.stats
    }

    /// How large a node is, and why.
    pub fn node_format(&self) -> (&'static str, &'static str) {
        match (&self.nodes, self.intersection) {
            (Nodes::Grid(..), _) => ("64-byte", "a 16-bit grid makes boxes hardly larger, or was asked for"),
            (Nodes::Full(_), Intersection::Watertight) => {
                ("128-byte", "a 16-bit grid is too coarse, or was not wanted")
            }
            (Nodes::Full(_), Intersection::Fast) => ("128-byte", "the fast test needs full nodes"),
        }
    }

    /// Bytes of a node, and of a block of triangles.
    pub fn row_bytes(&self) -> [usize; 2] {
        let node = match &self.nodes {
            Nodes::Full(_) => size_of::<Node4>(),
            Nodes::Grid(..) => size_of::<GridNode4>(),
        };
        [node, size_of::<Tri4>()]
    }

    /// Memory of nodes and blocks.
    pub fn bytes(&self) -> usize {
        self.nodes.bytes() + size_of_val(&self.triangles[..]) + size_of_val(&self.spheres[..])
    }

    /// The boxes of one level: 0 is the whole scene, 1 the root's children, and so on.
    pub fn boxes_at_depth(&self, depth: u32) -> Vec<Aabb> {
        struct Level(u32, Aabb);
        impl TreeKernel for Level {
            type Output = Vec<Aabb>;

            fn run<N: Node, I: Intersect>(self, tree: Tree<'_, N>) -> Vec<Aabb> {
                let Level(depth, bounds) = self;
                if tree.nodes.is_empty() {
                    return Vec::new();
                }
                let mut level = vec![(Child::ROOT, bounds)];
                for _ in 0..depth {
                    let inner = level.iter().filter(|(child, _)| !child.is_leaf());
                    level = inner.flat_map(|(child, _)| tree.children(child.node())).collect();
                }
                level.into_iter().map(|(_, aabb)| aabb).collect()
            }
        }
        self.with_tree(Level(depth, self.bounds))
    }

    /// A hash of the whole tree, bit by bit: what tests compare.
    pub fn fingerprint(&self) -> u64 {
        let mut state = std::hash::DefaultHasher::new();
        match &self.nodes {
            Nodes::Full(nodes) => bytemuck::cast_slice::<_, u8>(nodes).hash(&mut state),
            Nodes::Grid(nodes, _) => bytemuck::cast_slice::<_, u8>(nodes).hash(&mut state),
        }
        for block in self.triangles.iter() {
            block.corners.map(|row| row.map(|corner| corner.to_array().map(f32::to_bits))).hash(&mut state);
            (block.prim, block.geom).hash(&mut state);
        }
        for block in self.spheres.iter() {
            (block.center.map(|row| row.map(f32::to_bits)), block.radius.map(f32::to_bits)).hash(&mut state);
            (block.prim, block.geom).hash(&mut state);
        }
        state.finish()
    }
}

impl Nodes {
    /// How many.
    pub fn len(&self) -> usize {
        match self {
            Nodes::Full(nodes) => nodes.len(),
            Nodes::Grid(nodes, _) => nodes.len(),
        }
    }

    /// Memory.
    fn bytes(&self) -> usize {
        match self {
            Nodes::Full(nodes) => size_of_val(&nodes[..]),
            Nodes::Grid(nodes, _) => size_of_val(&nodes[..]),
        }
    }
}
