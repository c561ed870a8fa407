//! Traversal: batches of rays in, columns of hits out.
//!
//! The ways through the tree give the same hits: one ray after another ([`closest_hit`], [`any_hit`]), many in flight at
//! once ([`wave`]), neighbours together ([`packet`]), and, where there is little to hit, all with everything ([`list`]). Which is faster depends on the tree and on the rays:
//! [`Traversal`]. Each is generic over the formats of nodes ([`crate::bvh::node::Node`]) and leaves ([`crate::bvh::block::TriangleBlock`]), and over
//! the triangle test ([`crate::bvh::intersect::Intersect`]).

mod any_hit;
mod batch;
mod bins;
mod closest_hit;
mod crossings;
mod leaf;
mod list;
mod packet;
mod single;
pub(super) mod slab;
pub(super) mod stack;
mod wave;

use super::Bvh4;
use super::aabb::Aabb;
use super::block::TriangleBlock;
use super::bvh4::Tables;
use super::child::Child;
use super::columns::{HitColumnsMut, Query, RayColumns, TraversalCounts};
use super::grid_node8::GridNode8;
use super::intersect::Intersect;
use super::moller_trumbore::MollerTrumbore;
use super::node::Node;
use super::ray::{Hit, Ray};
use super::sphere4::Sphere4;
use super::watertight::Watertight;
use crate::options::Intersection;
use crate::simd::Tier;
use batch::{Batch, Results};
use single::{OneRay, Visits};
pub use stack::Stack;

/// A tree as kernels see it.
#[derive(Clone, Copy, Debug)]
pub struct Tree<'a, N: Node, B> {
    /// The root first.
    pub nodes: &'a [N],
    /// What all nodes share.
    pub frame: N::Frame,
    /// The nodes, widened, if there are such.
    pub wide: &'a [GridNode8],
    /// Leaf blocks of triangles.
    pub triangles: &'a [B],
    /// Leaf blocks of spheres.
    pub spheres: &'a [Sphere4],
}

impl<N: Node, B> Tree<'_, N, B> {
    /// The children of a node and their boxes.
    pub fn children(&self, node: usize) -> impl Iterator<Item = (Child, Aabb)> {
        let node = &self.nodes[node];
        (0..4).filter_map(move |lane| Some((child_of(node, lane), node.child_box(&self.frame, lane)?)))
    }
}

/// What one slot of a node refers to.
#[inline(always)]
pub(super) fn child_of<N: Node>(node: &N, lane: usize) -> Child {
    // The mask spares a bounds check.
    Child::from_bits(node.children()[lane & 3])
}

/// Work on a tree, whatever its nodes, its leaves and its triangle test.
pub trait TreeKernel {
    /// What it gives back.
    type Output;
    /// The work.
    fn run<N: Node, B: TriangleBlock, I: Intersect>(self, tree: Tree<'_, N, B>) -> Self::Output;
}

/// How a batch goes through the tree. The hits do not depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Traversal {
    /// One ray after another: the control.
    Single,
    /// Many rays at once: hides the waits for memory and for mispredicted branches.
    InFlight,
    /// Neighbours together: they share their visits, if they go the same way.
    Packet,
    /// No way through a tree: every ray meets every primitive.
    List,
}

impl Traversal {
    /// All ways: what tests run through.
    pub const ALL: [Traversal; 4] = [Traversal::Single, Traversal::InFlight, Traversal::Packet, Traversal::List];

    /// The ways through a tree: what benches run through, however large the scene.
    pub const THROUGH_A_TREE: [Traversal; 3] = [Traversal::Single, Traversal::InFlight, Traversal::Packet];

    /// For reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Traversal::Single => "single",
            Traversal::InFlight => "in-flight",
            Traversal::Packet => "packet",
            Traversal::List => "list",
        }
    }
}

/// Bytes of a tree from which coherent rays go in flight, too: so many triangles lie in a pixel then that each ray of a packet
/// has leaves of its own.
///
/// Camera rays that hit, of a picture of 1024 × 1024, packets ÷ in flight (AVX-512): lucy100k of 6 MiB 1.5, the dragon of 50 MiB
/// 1.3, coral of 6 million triangles and 324 MiB 1.4, of 16 million and 865 MiB 1.05, 29 million triangles and 1.7 GiB 0.65.
const PACKET_BYTES: usize = 1 << 29;

/// Nodes up to which incoherent rays go in packets, too, asking for the closest hit or for any: there is not much of a tree to
/// disagree about, and what rays in flight would wait for lies in the nearest cache.
///
/// Mray/s of the renderer's queues, a torus of so many triangles in the Cornell box (AVX-512; closest hit and any hit, in flight →
/// packets): 48: 8.3 → 12.0, 17.7 → 22.5; 160: 14.0 → 15.0, 17.4 → 25.3; 500 (60 nodes): 13.6 → 13.4, 16.6 → 22.5; 2000 (199 nodes):
/// 13.8 → 11.3, 17.0 → 18.7; 8000: 12.5 → 9.8, 16.0 → 15.2; 30,000: 12.8 → 8.5, 15.1 → 13.4. One ray after another: 9 and 12 at most.
const PACKET_NODES: [usize; 2] = [50, 400];

/// Blocks of four primitives up to which all are tested.
///
/// Mray/s of the same queues (in flight, packets, list; AVX-512), a torus of so many triangles in the Cornell box: 24, nine blocks: 11.5, 16.1,
/// 19.9 and 16.4, 26.9, 34.1; 48, fifteen blocks: 13.5, 15.6, 15.5 and 17.3, 26.8, 22.2.
const LIST_BLOCKS: usize = 10;

impl Bvh4 {
    /// The way that suits rays of which neighbours go the same way (`coherent`), or do not.
    pub fn suited(&self, query: Query, coherent: bool) -> Traversal {
        let stats = self.stats();
        let small = stats.nodes <= PACKET_NODES[usize::from(query == Query::Any)];
        if stats.leaf_blocks <= LIST_BLOCKS {
            Traversal::List
        } else if small || (coherent && stats.bytes < PACKET_BYTES) {
            Traversal::Packet
        } else {
            Traversal::InFlight
        }
    }

    /// Runs `kernel` on the tree as it is. There is no fast test on a grid, whose trees would have to be full, and compact leaves go with
    /// a grid alone: half as many kernels to compile.
    #[inline(always)]
    pub fn with_tree<K: TreeKernel>(&self, kernel: K) -> K::Output {
        match (&self.tables, self.intersection) {
            (Tables::Full(nodes, triangles), Intersection::Watertight) => {
                kernel.run::<_, _, Watertight>(self.tree(nodes, (), triangles))
            }
            (Tables::Full(nodes, triangles), Intersection::Fast) => {
                kernel.run::<_, _, MollerTrumbore>(self.tree(nodes, (), triangles))
            }
            (Tables::Grid(nodes, grid, triangles), _) => {
                kernel.run::<_, _, Watertight>(self.tree(nodes, *grid, triangles))
            }
            (Tables::Compact(nodes, grid, triangles), _) => {
                kernel.run::<_, _, Watertight>(self.tree(nodes, *grid, triangles))
            }
        }
    }

    #[inline(always)]
    fn tree<'a, N: Node, B>(&'a self, nodes: &'a [N], frame: N::Frame, triangles: &'a [B]) -> Tree<'a, N, B> {
        Tree { nodes, frame, wide: &self.wide, triangles, spheres: &self.spheres }
    }

    /// The closest hit of each ray. Counts rays, and what was visited if `count`.
    pub fn closest_hits(
        &self,
        way: Traversal,
        tier: Tier,
        rays: RayColumns<'_>,
        hits: HitColumnsMut<'_>,
        count: bool,
    ) -> TraversalCounts {
        self.with_tree(Batch { way, tier, rays, results: Results::Closest(hits), count })
    }

    /// Whether each ray hits anything. Counts rays, and what was visited if `count`.
    pub fn any_hits(
        &self,
        way: Traversal,
        tier: Tier,
        rays: RayColumns<'_>,
        occluded: &mut [bool],
        count: bool,
    ) -> TraversalCounts {
        self.with_tree(Batch { way, tier, rays, results: Results::Any(occluded), count })
    }

    /// The closest hit of one ray, for callers that have no batch.
    #[inline(always)]
    pub fn closest_hit(&self, ray: &Ray, stack: &mut Stack) -> Hit {
        self.with_tree(OneRay::<false> { ray, stack })
    }

    /// Whether one ray hits anything, for callers that have no batch.
    #[inline(always)]
    pub fn any_hit(&self, ray: &Ray, stack: &mut Stack) -> bool {
        self.with_tree(OneRay::<true> { ray, stack }).is_some()
    }

    /// What one ray visits on the way to its answer, and that: the closest hit, or whether there is any.
    pub fn visits(&self, query: Query, ray: &Ray, stack: &mut Stack) -> (Hit, TraversalCounts) {
        match query {
            Query::Closest => self.with_tree(Visits::<false> { ray, stack }),
            Query::Any => self.with_tree(Visits::<true> { ray, stack }),
        }
    }
}
