//! A batch of rays on its way to a kernel: formats of nodes and of leaves, triangle test, instruction set, and whether there are spheres are
//! chosen here, once.

use super::{Traversal, Tree, TreeKernel, list, packet, single, wave};
use crate::bvh::block::TriangleBlock;
use crate::bvh::columns::{HitColumnsMut, RayColumns, TraversalCounts};
use crate::bvh::intersect::Intersect;
use crate::bvh::node::Node;
use crate::bvh::ray::Hit;
use crate::simd::wide::{Wide, WideKernel};
use crate::simd::{Kernel, Tier};
use std::marker::PhantomData;

/// Where results go, which says what is asked.
#[derive(Debug)]
pub enum Results<'a> {
    /// The closest hit of each ray.
    Closest(HitColumnsMut<'a>),
    /// Whether each ray hits anything.
    Any(&'a mut [bool]),
}

/// Rays and how to trace them.
#[derive(Debug)]
pub struct Batch<'a> {
    /// The way through the tree.
    pub way: Traversal,
    /// The instruction set.
    pub tier: Tier,
    /// The rays.
    pub rays: RayColumns<'a>,
    /// Where results go.
    pub results: Results<'a>,
    /// Whether to count what is visited.
    pub count: bool,
}

impl TreeKernel for Batch<'_> {
    type Output = TraversalCounts;

    fn run<N: Node, B: TriangleBlock, I: Intersect>(self, tree: Tree<'_, N, B>) -> TraversalCounts {
        // Counting costs a little, and so does looking out for spheres.
        match (self.count, tree.spheres.is_empty()) {
            (false, true) => self.trace::<N, B, I, false, false>(tree),
            (false, false) => self.trace::<N, B, I, true, false>(tree),
            (true, _) => self.trace::<N, B, I, true, true>(tree),
        }
    }
}

impl Batch<'_> {
    fn trace<N: Node, B: TriangleBlock, I: Intersect, const SPHERES: bool, const COUNT: bool>(
        self,
        tree: Tree<'_, N, B>,
    ) -> TraversalCounts {
        let Batch { way, tier, rays, results, .. } = self;
        let rays = rays.trimmed();
        match results {
            Results::Closest(hits) => {
                let mut hits = hits.trimmed(rays.len());
                let finish = |row, hit| hits.set(row, hit);
                Ask::<N, B, I, _, false, SPHERES, COUNT> { tree, rays, finish, test: PhantomData }.run(way, tier)
            }
            Results::Any(occluded) => {
                let occluded = &mut occluded[..rays.len()];
                let finish = |row: usize, hit: Hit| occluded[row] = hit.is_some();
                Ask::<N, B, I, _, true, SPHERES, COUNT> { tree, rays, finish, test: PhantomData }.run(way, tier)
            }
        }
    }
}

/// A batch with all but its way and its instruction set chosen. `finish` takes the row and the hit of each ray.
struct Ask<'a, N: Node, B, I, F, const ANY: bool, const SPHERES: bool, const COUNT: bool> {
    tree: Tree<'a, N, B>,
    rays: RayColumns<'a>,
    finish: F,
    test: PhantomData<I>,
}

/// Kernels of their own, so that none carries the stack of another.
struct Single<A>(A);
struct InFlight<A>(A);
struct Packet<A>(A);
struct List<A>(A);

impl<
    N: Node,
    B: TriangleBlock,
    I: Intersect,
    F: FnMut(usize, Hit),
    const ANY: bool,
    const SPHERES: bool,
    const COUNT: bool,
> Ask<'_, N, B, I, F, ANY, SPHERES, COUNT>
{
    fn run(self, way: Traversal, tier: Tier) -> TraversalCounts {
        match way {
            Traversal::Single => tier.run(Single(self)),
            Traversal::InFlight => tier.run_wide(InFlight(self)),
            Traversal::Packet => tier.run_wide(Packet(self)),
            Traversal::List => tier.run_wide(List(self)),
        }
    }
}

impl<
    N: Node,
    B: TriangleBlock,
    I: Intersect,
    F: FnMut(usize, Hit),
    const ANY: bool,
    const SPHERES: bool,
    const COUNT: bool,
> Kernel for Single<Ask<'_, N, B, I, F, ANY, SPHERES, COUNT>>
{
    type Output = TraversalCounts;

    #[inline(always)]
    fn run(self) -> TraversalCounts {
        let Ask { tree, rays, finish, .. } = self.0;
        single::trace::<N, I, ANY, SPHERES, COUNT>(&tree, rays, finish)
    }
}

impl<
    N: Node,
    B: TriangleBlock,
    I: Intersect,
    F: FnMut(usize, Hit),
    const ANY: bool,
    const SPHERES: bool,
    const COUNT: bool,
> WideKernel for InFlight<Ask<'_, N, B, I, F, ANY, SPHERES, COUNT>>
{
    type Output = TraversalCounts;

    #[inline(always)]
    fn run<W: Wide>(self, wide: W) -> TraversalCounts {
        let Ask { tree, rays, finish, .. } = self.0;
        wave::trace::<W, N, B, I, ANY, SPHERES, COUNT>(wide, &tree, rays, finish)
    }
}

impl<
    N: Node,
    B: TriangleBlock,
    I: Intersect,
    F: FnMut(usize, Hit),
    const ANY: bool,
    const SPHERES: bool,
    const COUNT: bool,
> WideKernel for Packet<Ask<'_, N, B, I, F, ANY, SPHERES, COUNT>>
{
    type Output = TraversalCounts;

    #[inline(always)]
    fn run<W: Wide>(self, wide: W) -> TraversalCounts {
        let Ask { tree, rays, finish, .. } = self.0;
        packet::trace::<W, N, I, ANY, SPHERES, COUNT>(wide, &tree, rays, finish)
    }
}

impl<
    N: Node,
    B: TriangleBlock,
    I: Intersect,
    F: FnMut(usize, Hit),
    const ANY: bool,
    const SPHERES: bool,
    const COUNT: bool,
> WideKernel for List<Ask<'_, N, B, I, F, ANY, SPHERES, COUNT>>
{
    type Output = TraversalCounts;

    #[inline(always)]
    fn run<W: Wide>(self, wide: W) -> TraversalCounts {
        let Ask { tree, rays, finish, .. } = self.0;
        list::trace::<W, N, I, SPHERES, COUNT>(wide, &tree, rays, finish)
    }
}
