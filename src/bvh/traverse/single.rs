//! One ray after another: the plain kernels ([`closest_hit`], [`any_hit`]), for batches and for rays that other ways leave
//! out.

use super::any_hit::any_hit;
use super::closest_hit::closest_hit;
use super::stack::Stack;
use super::{Tree, TreeKernel};
use crate::bvh::block::TriangleBlock;
use crate::bvh::columns::{RayColumns, TraversalCounts};
use crate::bvh::intersect::Intersect;
use crate::bvh::node::Node;
use crate::bvh::ray::{Hit, Ray};

/// Traces all rays, and calls `finish` with the row and the hit of each. For the const parameters see [`trace_one`].
#[inline(always)]
pub fn trace<N: Node, I: Intersect, const ANY: bool, const SPHERES: bool, const COUNT: bool>(
    tree: &Tree<'_, N, impl TriangleBlock>,
    rays: RayColumns<'_>,
    mut finish: impl FnMut(usize, Hit),
) -> TraversalCounts {
    let mut counts = TraversalCounts { rays: rays.len() as u64, ..Default::default() };
    let mut stack = Stack::new();
    for row in 0..rays.len() {
        finish(row, trace_one::<N, I, ANY, SPHERES, COUNT>(tree, &rays.ray(row), &mut stack, &mut counts));
    }
    counts
}

/// Traces one ray. `ANY`: of the hit, only that there is one means something. `SPHERES`: the tree holds some. `COUNT`: fill in
/// `counts`.
#[inline(always)]
pub fn trace_one<N: Node, I: Intersect, const ANY: bool, const SPHERES: bool, const COUNT: bool>(
    tree: &Tree<'_, N, impl TriangleBlock>,
    ray: &Ray,
    stack: &mut Stack,
    counts: &mut TraversalCounts,
) -> Hit {
    if !ANY {
        closest_hit::<N, I, SPHERES, COUNT>(tree, ray, stack, counts)
    } else if any_hit::<N, I, SPHERES, COUNT>(tree, ray, stack, counts) {
        Hit { t: 0.0, u: 0.0, v: 0.0, prim: 0, geom: 0 }
    } else {
        Hit::NONE
    }
}

/// A ray for which the box test of many is not exact enough: it starts far away.
#[cold]
#[inline(never)]
pub fn alone<N: Node, I: Intersect, const ANY: bool, const COUNT: bool>(
    tree: &Tree<'_, N, impl TriangleBlock>,
    ray: &Ray,
    counts: &mut TraversalCounts,
) -> Hit {
    trace_one::<N, I, ANY, true, COUNT>(tree, ray, &mut Stack::new(), counts)
}

/// A ray of a caller that has no batch, as [`trace_one`] traces it.
pub struct OneRay<'a, const ANY: bool> {
    pub ray: &'a Ray,
    pub stack: &'a mut Stack,
}

impl<const ANY: bool> TreeKernel for OneRay<'_, ANY> {
    type Output = Hit;

    #[inline(always)]
    fn run<N: Node, B: TriangleBlock, I: Intersect>(self, tree: Tree<'_, N, B>) -> Hit {
        let mut counts = TraversalCounts::default();
        if tree.spheres.is_empty() {
            trace_one::<N, I, ANY, false, false>(&tree, self.ray, self.stack, &mut counts)
        } else {
            trace_one::<N, I, ANY, true, false>(&tree, self.ray, self.stack, &mut counts)
        }
    }
}

/// As [`OneRay`], and what the ray visits on the way.
pub struct Visits<'a, const ANY: bool> {
    pub ray: &'a Ray,
    pub stack: &'a mut Stack,
}

impl<const ANY: bool> TreeKernel for Visits<'_, ANY> {
    type Output = (Hit, TraversalCounts);

    fn run<N: Node, B: TriangleBlock, I: Intersect>(self, tree: Tree<'_, N, B>) -> (Hit, TraversalCounts) {
        let mut counts = TraversalCounts { rays: 1, ..TraversalCounts::default() };
        let hit = trace_one::<N, I, ANY, true, true>(&tree, self.ray, self.stack, &mut counts);
        (hit, counts)
    }
}
