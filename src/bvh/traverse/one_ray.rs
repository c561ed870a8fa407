//! One ray on its way to the plain kernel.

use super::any_hit::any_hit;
use super::closest_hit::closest_hit;
use super::stack::Stack;
use super::{Tree, TreeKernel};
use crate::bvh::columns::TraversalCounts;
use crate::bvh::intersect::Intersect;
use crate::bvh::node::Node;
use crate::bvh::ray::{Hit, Ray};

/// The closest hit of a ray.
pub struct ClosestHit<'a> {
    pub ray: &'a Ray,
    pub stack: &'a mut Stack,
}

impl TreeKernel for ClosestHit<'_> {
    type Output = Hit;

    #[inline(always)]
    fn run<N: Node, I: Intersect>(self, tree: Tree<'_, N>) -> Hit {
        let mut counts = TraversalCounts::default();
        if tree.spheres.is_empty() {
            closest_hit::<N, I, false, false>(&tree, self.ray, self.stack, &mut counts)
        } else {
            closest_hit::<N, I, true, false>(&tree, self.ray, self.stack, &mut counts)
        }
    }
}

/// Whether a ray hits anything.
pub struct AnyHit<'a> {
    pub ray: &'a Ray,
    pub stack: &'a mut Stack,
}

impl TreeKernel for AnyHit<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<N: Node, I: Intersect>(self, tree: Tree<'_, N>) -> bool {
        let mut counts = TraversalCounts::default();
        if tree.spheres.is_empty() {
            any_hit::<N, I, false, false>(&tree, self.ray, self.stack, &mut counts)
        } else {
            any_hit::<N, I, true, false>(&tree, self.ray, self.stack, &mut counts)
        }
    }
}

/// Nodes that the closest hit of a ray takes to find.
pub struct NodeVisits<'a> {
    pub ray: &'a Ray,
    pub stack: &'a mut Stack,
}

impl TreeKernel for NodeVisits<'_> {
    type Output = u64;

    fn run<N: Node, I: Intersect>(self, tree: Tree<'_, N>) -> u64 {
        let mut counts = TraversalCounts::default();
        closest_hit::<N, I, true, true>(&tree, self.ray, self.stack, &mut counts);
        counts.node_visits
    }
}
