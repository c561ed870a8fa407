//! The four-wide tree itself. `build` makes it, `traverse` asks it.

use std::hash::{Hash, Hasher};

use super::aabb::Aabb;
use super::block::TriangleBlock;
use super::child::Child;
use super::grid_node4::{Grid, GridNode4};
use super::grid_node8::{self, GridNode8};
use super::intersect::Intersect;
use super::node::Node;
use super::node4::Node4;
use super::shared_tri4::SharedTri4;
use super::sphere4::Sphere4;
use super::stats::BvhStats;
use super::traverse::{Tree, TreeKernel};
use super::tri4::Tri4;
use crate::options::Intersection;
use crate::system::Buffer;

/// Nodes and blocks of triangles, in one of their formats: the root first, then depth-first; none if there are no primitives. Blocks
/// stand in the order in which nodes refer to them.
#[derive(Clone, Debug)]
pub(super) enum Tables {
    /// Planes in single precision, full blocks.
    Full(Buffer<Node4>, Buffer<Tri4>),
    /// Planes on a grid, full blocks.
    Grid(Buffer<GridNode4>, Grid, Buffer<Tri4>),
    /// Planes on a grid, compact blocks.
    Compact(Buffer<GridNode4>, Grid, Buffer<SharedTri4>),
}

/// A four-wide BVH over triangles and spheres. It owns all it needs.
#[derive(Clone, Debug)]
pub struct Bvh4 {
    pub(super) tables: Tables,
    /// The nodes on a grid, widened: what rays in flight step through.
    pub(super) wide: Buffer<GridNode8>,
    pub(super) spheres: Buffer<Sphere4>,
    pub(super) bounds: Aabb,
    pub(super) intersection: Intersection,
    /// Why its leaves have their format.
    pub(super) leaves_why: &'static str,
    pub(super) stats: BvhStats,
}

impl Default for Bvh4 {
    fn default() -> Self {
        Bvh4 {
            tables: Tables::Full(Buffer::default(), Buffer::default()),
            wide: Buffer::default(),
            spheres: Buffer::default(),
            bounds: Aabb::EMPTY,
            intersection: Intersection::default(),
            leaves_why: "there are none",
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
        match (&self.tables, self.intersection) {
            (Tables::Grid(..), _) => ("64-byte", "a 16-bit grid makes boxes hardly larger, or was asked for"),
            (Tables::Compact(..), _) => {
                ("64-byte", "a 16-bit grid makes boxes hardly larger, or compact leaves need it")
            }
            (Tables::Full(..), Intersection::Watertight) => {
                ("128-byte", "a 16-bit grid is too coarse, or was not wanted")
            }
            (Tables::Full(..), Intersection::Fast) => ("128-byte", "the fast test needs full nodes"),
        }
    }

    /// How large a block of triangles is, and why.
    pub fn leaf_format(&self) -> (&'static str, &'static str) {
        (if self.tables.is_compact() { "128-byte" } else { "192-byte" }, self.leaves_why)
    }

    /// Bytes of a node, and of a block of triangles.
    pub fn row_bytes(&self) -> [usize; 2] {
        match &self.tables {
            Tables::Full(..) => [size_of::<Node4>(), size_of::<Tri4>()],
            Tables::Grid(..) => [size_of::<GridNode4>(), size_of::<Tri4>()],
            Tables::Compact(..) => [size_of::<GridNode4>(), size_of::<SharedTri4>()],
        }
    }

    /// Memory of nodes and blocks.
    pub fn bytes(&self) -> usize {
        let [nodes, triangles] = self.tables.bytes();
        nodes.len() + triangles.len() + size_of_val(&self.spheres[..]) + size_of_val(&self.wide[..])
    }

    /// The boxes of one level: 0 is the whole scene, 1 the root's children, and so on.
    pub fn boxes_at_depth(&self, depth: u32) -> Vec<Aabb> {
        struct Level(u32, Aabb);
        impl TreeKernel for Level {
            type Output = Vec<Aabb>;

            fn run<N: Node, B: TriangleBlock, I: Intersect>(self, tree: Tree<'_, N, B>) -> Vec<Aabb> {
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
        self.tables.bytes().hash(&mut state);
        for block in self.spheres.iter() {
            (block.center.map(|row| row.map(f32::to_bits)), block.radius.map(f32::to_bits)).hash(&mut state);
            (block.prim, block.geom).hash(&mut state);
        }
        state.finish()
    }
}

impl Tables {
    /// How many nodes, and how many blocks.
    pub fn lens(&self) -> [usize; 2] {
        match self {
            Tables::Full(nodes, triangles) => [nodes.len(), triangles.len()],
            Tables::Grid(nodes, _, triangles) => [nodes.len(), triangles.len()],
            Tables::Compact(nodes, _, triangles) => [nodes.len(), triangles.len()],
        }
    }

    /// Nodes and blocks as they lie in memory.
    pub fn bytes(&self) -> [&[u8]; 2] {
        match self {
            Tables::Full(nodes, triangles) => [bytemuck::cast_slice(nodes), bytemuck::cast_slice(triangles)],
            Tables::Grid(nodes, _, triangles) => [bytemuck::cast_slice(nodes), bytemuck::cast_slice(triangles)],
            Tables::Compact(nodes, _, triangles) => [bytemuck::cast_slice(nodes), bytemuck::cast_slice(triangles)],
        }
    }

    /// The nodes as rays in flight step through them; none but of nodes on a grid.
    pub fn widened(&self) -> Buffer<GridNode8> {
        match self {
            Tables::Full(..) => Buffer::default(),
            Tables::Grid(nodes, grid, _) => grid_node8::widened(nodes, grid),
            Tables::Compact(nodes, grid, _) => grid_node8::widened(nodes, grid),
        }
    }

    /// Whether blocks are compact.
    pub fn is_compact(&self) -> bool {
        matches!(self, Tables::Compact(..))
    }
}
