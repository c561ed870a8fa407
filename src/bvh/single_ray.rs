//! Queries for callers that have no batch.

use super::accel::Accel;
use super::columns::{Query, TraversalCounts};
use super::double::Pending;
use super::ray::{Hit, Ray};
use super::traverse::Stack;

/// One ray after another, each with its own question. Keeps the stack, whose clearing would cost more than a short traversal.
pub struct SingleRay<'a> {
    accel: &'a Accel,
    stack: Stack,
    pending: Pending,
}

impl<'a> SingleRay<'a> {
    pub(super) fn new(accel: &'a Accel) -> SingleRay<'a> {
        SingleRay { accel, stack: Stack::new(), pending: Pending::new() }
    }

    /// The closest hit.
    #[inline(always)]
    pub fn closest_hit(&mut self, ray: &Ray) -> Hit {
        match self.accel {
            Accel::Bvh(bvh) => bvh.closest_hit(ray, &mut self.stack),
            Accel::Parted(parted) => parted.closest_hit(ray, &mut self.stack),
            Accel::Brute(brute, _) => brute.closest_hit(ray, &mut TraversalCounts::default()),
            Accel::Double(double) => double.hit::<false>(ray, &mut self.pending, &mut TraversalCounts::default()),
        }
    }

    /// Whether the ray hits anything.
    #[inline(always)]
    pub fn any_hit(&mut self, ray: &Ray) -> bool {
        match self.accel {
            Accel::Bvh(bvh) => bvh.any_hit(ray, &mut self.stack),
            Accel::Parted(parted) => parted.any_hit(ray, &mut self.stack),
            Accel::Brute(brute, _) => brute.any_hit(ray, &mut TraversalCounts::default()),
            Accel::Double(double) => {
                double.hit::<true>(ray, &mut self.pending, &mut TraversalCounts::default()).is_some()
            }
        }
    }

    /// What the ray visits on the way to its answer; of the oracle, the primitives it tests.
    pub fn visits(&mut self, query: Query, ray: &Ray) -> TraversalCounts {
        match self.accel {
            Accel::Bvh(bvh) => bvh.visits(query, ray, &mut self.stack).1,
            Accel::Parted(parted) => parted.visits(query, ray, &mut self.stack),
            Accel::Double(double) => {
                let mut counts = TraversalCounts { rays: 1, ..TraversalCounts::default() };
                match query {
                    Query::Closest => double.hit::<false>(ray, &mut self.pending, &mut counts),
                    Query::Any => double.hit::<true>(ray, &mut self.pending, &mut counts),
                };
                counts
            }
            Accel::Brute(brute, _) => {
                let mut counts = TraversalCounts { rays: 1, ..TraversalCounts::default() };
                match query {
                    Query::Closest => drop(brute.closest_hit(ray, &mut counts)),
                    Query::Any => drop(brute.any_hit(ray, &mut counts)),
                }
                counts
            }
        }
    }

    /// Nodes that the closest hit takes to find; for the oracle, primitives.
    pub fn cost(&mut self, ray: &Ray) -> u64 {
        let counts = self.visits(Query::Closest, ray);
        let is_tree = match self.accel {
            Accel::Bvh(_) | Accel::Parted(_) => true,
            Accel::Double(double) => double.is_tree(),
            Accel::Brute(..) => false,
        };
        if is_tree { counts.node_visits } else { counts.primitive_tests }
    }
}
