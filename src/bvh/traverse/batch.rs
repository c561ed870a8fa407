//! A batch of rays on its way to a kernel: node format, triangle test, instruction set, and whether there are spheres are
//! chosen here, once.

use super::any_hit::any_hit;
use super::closest_hit::closest_hit;
use super::stack::Stack;
use super::{Traversal, Tree, TreeKernel, packet, wave};
use crate::bvh::columns::{HitColumnsMut, RayColumns, TraversalCounts};
use crate::bvh::intersect::Intersect;
use crate::bvh::node::Node;
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

    fn run<N: Node, I: Intersect>(self, tree: Tree<'_, N>) -> TraversalCounts {
        // Counting costs a little, and so does looking out for spheres.
        match (self.count, tree.spheres.is_empty()) {
            (false, true) => self.trace::<N, I, false, false>(tree),
            (false, false) => self.trace::<N, I, true, false>(tree),
            (true, _) => self.trace::<N, I, true, true>(tree),
        }
    }
}

impl Batch<'_> {
    fn trace<N: Node, I: Intersect, const SPHERES: bool, const COUNT: bool>(
        self,
        tree: Tree<'_, N>,
    ) -> TraversalCounts {
        let rays = self.rays.trimmed();
        let test = PhantomData::<I>;
        match (self.way, self.results) {
            (Traversal::Single, Results::Closest(hits)) => {
                let hits = hits.trimmed(rays.len());
                self.tier.run(SingleClosest::<N, I, SPHERES, COUNT> { tree, rays, hits, test })
            }
            (Traversal::Single, Results::Any(occluded)) => {
                let occluded = &mut occluded[..rays.len()];
                self.tier.run(SingleAny::<N, I, SPHERES, COUNT> { tree, rays, occluded, test })
            }
            (Traversal::InFlight, Results::Closest(hits)) => {
                let hits = hits.trimmed(rays.len());
                self.tier.run_wide(WaveClosest::<N, I, SPHERES, COUNT> { tree, rays, hits, test })
            }
            (Traversal::InFlight, Results::Any(occluded)) => {
                let occluded = &mut occluded[..rays.len()];
                self.tier.run_wide(WaveAny::<N, I, SPHERES, COUNT> { tree, rays, occluded, test })
            }
            (Traversal::Packet, Results::Closest(hits)) => {
                let hits = hits.trimmed(rays.len());
                self.tier.run_wide(PacketClosest::<N, I, SPHERES, COUNT> { tree, rays, hits, test })
            }
            (Traversal::Packet, Results::Any(occluded)) => {
                let occluded = &mut occluded[..rays.len()];
                self.tier.run_wide(PacketAny::<N, I, SPHERES, COUNT> { tree, rays, occluded, test })
            }
        }
    }
}

struct SingleClosest<'a, N: Node, I, const SPHERES: bool, const COUNT: bool> {
    tree: Tree<'a, N>,
    rays: RayColumns<'a>,
    hits: HitColumnsMut<'a>,
    test: PhantomData<I>,
}

impl<N: Node, I: Intersect, const SPHERES: bool, const COUNT: bool> Kernel for SingleClosest<'_, N, I, SPHERES, COUNT> {
    type Output = TraversalCounts;

    #[inline(always)]
    fn run(mut self) -> TraversalCounts {
        let mut counts = TraversalCounts { rays: self.rays.len() as u64, ..Default::default() };
        let mut stack = Stack::new();
        for row in 0..self.rays.len() {
            let ray = self.rays.ray(row);
            self.hits.set(row, closest_hit::<N, I, SPHERES, COUNT>(&self.tree, &ray, &mut stack, &mut counts));
        }
        counts
    }
}

struct SingleAny<'a, N: Node, I, const SPHERES: bool, const COUNT: bool> {
    tree: Tree<'a, N>,
    rays: RayColumns<'a>,
    occluded: &'a mut [bool],
    test: PhantomData<I>,
}

impl<N: Node, I: Intersect, const SPHERES: bool, const COUNT: bool> Kernel for SingleAny<'_, N, I, SPHERES, COUNT> {
    type Output = TraversalCounts;

    #[inline(always)]
    fn run(self) -> TraversalCounts {
        let mut counts = TraversalCounts { rays: self.rays.len() as u64, ..Default::default() };
        let mut stack = Stack::new();
        for (row, occluded) in self.occluded.iter_mut().enumerate() {
            let ray = self.rays.ray(row);
            *occluded = any_hit::<N, I, SPHERES, COUNT>(&self.tree, &ray, &mut stack, &mut counts);
        }
        counts
    }
}

struct WaveClosest<'a, N: Node, I, const SPHERES: bool, const COUNT: bool> {
    tree: Tree<'a, N>,
    rays: RayColumns<'a>,
    hits: HitColumnsMut<'a>,
    test: PhantomData<I>,
}

impl<N: Node, I: Intersect, const SPHERES: bool, const COUNT: bool> WideKernel
    for WaveClosest<'_, N, I, SPHERES, COUNT>
{
    type Output = TraversalCounts;

    #[inline(always)]
    fn run<W: Wide>(mut self, wide: W) -> TraversalCounts {
        wave::trace::<W, N, I, false, SPHERES, COUNT>(wide, &self.tree, self.rays, |row, hit| self.hits.set(row, hit))
    }
}

struct WaveAny<'a, N: Node, I, const SPHERES: bool, const COUNT: bool> {
    tree: Tree<'a, N>,
    rays: RayColumns<'a>,
    occluded: &'a mut [bool],
    test: PhantomData<I>,
}

impl<N: Node, I: Intersect, const SPHERES: bool, const COUNT: bool> WideKernel for WaveAny<'_, N, I, SPHERES, COUNT> {
    type Output = TraversalCounts;

    #[inline(always)]
    fn run<W: Wide>(self, wide: W) -> TraversalCounts {
        wave::trace::<W, N, I, true, SPHERES, COUNT>(wide, &self.tree, self.rays, |row, hit| {
            self.occluded[row] = hit.is_some();
        })
    }
}

struct PacketClosest<'a, N: Node, I, const SPHERES: bool, const COUNT: bool> {
    tree: Tree<'a, N>,
    rays: RayColumns<'a>,
    hits: HitColumnsMut<'a>,
    test: PhantomData<I>,
}

impl<N: Node, I: Intersect, const SPHERES: bool, const COUNT: bool> WideKernel
    for PacketClosest<'_, N, I, SPHERES, COUNT>
{
    type Output = TraversalCounts;

    #[inline(always)]
    fn run<W: Wide>(mut self, wide: W) -> TraversalCounts {
        packet::trace::<W, N, I, false, SPHERES, COUNT>(wide, &self.tree, self.rays, |row, hit| self.hits.set(row, hit))
    }
}

struct PacketAny<'a, N: Node, I, const SPHERES: bool, const COUNT: bool> {
    tree: Tree<'a, N>,
    rays: RayColumns<'a>,
    occluded: &'a mut [bool],
    test: PhantomData<I>,
}

impl<N: Node, I: Intersect, const SPHERES: bool, const COUNT: bool> WideKernel for PacketAny<'_, N, I, SPHERES, COUNT> {
    type Output = TraversalCounts;

    #[inline(always)]
    fn run<W: Wide>(self, wide: W) -> TraversalCounts {
        packet::trace::<W, N, I, true, SPHERES, COUNT>(wide, &self.tree, self.rays, |row, hit| {
            self.occluded[row] = hit.is_some();
        })
    }
}
