//! Traversal: batches of rays in, columns of hits out.
//!
//! A ray takes steps ([`flight`]); a batch keeps many rays in flight ([`wave`]).

mod flight;
mod slab;
pub(super) mod stack;
mod wave;

use super::Bvh4;
use super::child::Child;
use super::columns::{HitColumnsMut, RayColumns, TraversalCounts};
use super::ray::{Hit, Ray};
use crate::simd::{Kernel, Tier};
use flight::Flight;

impl Bvh4 {
    /// The closest hit of each ray.
    pub fn closest_hits(&self, tier: Tier, rays: RayColumns<'_>, hits: HitColumnsMut<'_>) -> TraversalCounts {
        if self.spheres.is_empty() {
            tier.run(ClosestHits::<false, false> { bvh: self, rays, hits })
        } else {
            tier.run(ClosestHits::<true, false> { bvh: self, rays, hits })
        }
    }

    /// The same, counting.
    pub fn closest_hits_counted(&self, tier: Tier, rays: RayColumns<'_>, hits: HitColumnsMut<'_>) -> TraversalCounts {
        tier.run(ClosestHits::<true, true> { bvh: self, rays, hits })
    }

    /// Whether each ray hits anything.
    pub fn any_hits(&self, tier: Tier, rays: RayColumns<'_>, occluded: &mut [bool]) -> TraversalCounts {
        if self.spheres.is_empty() {
            tier.run(AnyHits::<false, false> { bvh: self, rays, occluded })
        } else {
            tier.run(AnyHits::<true, false> { bvh: self, rays, occluded })
        }
    }

    /// The same, counting.
    pub fn any_hits_counted(&self, tier: Tier, rays: RayColumns<'_>, occluded: &mut [bool]) -> TraversalCounts {
        tier.run(AnyHits::<true, true> { bvh: self, rays, occluded })
    }

    /// How many nodes the closest-hit traversal of each ray visits.
    pub fn cost_columns(&self, tier: Tier, rays: RayColumns<'_>, visits: &mut [u32]) {
        tier.run(Costs { bvh: self, rays, visits });
    }

    /// The closest hit of one ray, for callers that have no batch.
    pub fn closest_hit(&self, ray: &Ray, counts: &mut TraversalCounts) -> Hit {
        counts.rays += 1;
        trace_one::<false>(self, ray, &mut Flight::new(), counts)
    }

    /// Whether one ray hits anything, for callers that have no batch.
    pub fn any_hit(&self, ray: &Ray, counts: &mut TraversalCounts) -> bool {
        counts.rays += 1;
        trace_one::<true>(self, ray, &mut Flight::new(), counts).is_some()
    }
}

struct ClosestHits<'a, const SPHERES: bool, const COUNT: bool> {
    bvh: &'a Bvh4,
    rays: RayColumns<'a>,
    hits: HitColumnsMut<'a>,
}

impl<const SPHERES: bool, const COUNT: bool> Kernel for ClosestHits<'_, SPHERES, COUNT> {
    type Output = TraversalCounts;

    #[inline(always)]
    fn run(self) -> TraversalCounts {
        let rays = self.rays.trimmed();
        let mut hits = self.hits.trimmed(rays.len());
        wave::trace::<false, SPHERES, COUNT>(self.bvh, rays, |row, hit| hits.set(row, hit))
    }
}

struct AnyHits<'a, const SPHERES: bool, const COUNT: bool> {
    bvh: &'a Bvh4,
    rays: RayColumns<'a>,
    occluded: &'a mut [bool],
}

impl<const SPHERES: bool, const COUNT: bool> Kernel for AnyHits<'_, SPHERES, COUNT> {
    type Output = TraversalCounts;

    #[inline(always)]
    fn run(self) -> TraversalCounts {
        let rays = self.rays.trimmed();
        let occluded = &mut self.occluded[..rays.len()];
        wave::trace::<true, SPHERES, COUNT>(self.bvh, rays, |row, hit| occluded[row] = hit.is_some())
    }
}

/// Node visits, one ray at a time.
struct Costs<'a> {
    bvh: &'a Bvh4,
    rays: RayColumns<'a>,
    visits: &'a mut [u32],
}

impl Kernel for Costs<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let rays = self.rays.trimmed();
        let visits = &mut self.visits[..rays.len()];
        let mut flight = Flight::new();
        for (row, visits) in visits.iter_mut().enumerate() {
            let mut counts = TraversalCounts::default();
            trace_one::<false>(self.bvh, &rays.ray(row), &mut flight, &mut counts);
            *visits = counts.node_visits as u32;
        }
    }
}

/// One ray from the root to its end.
#[inline(always)]
fn trace_one<const ANY: bool>(bvh: &Bvh4, ray: &Ray, flight: &mut Flight, counts: &mut TraversalCounts) -> Hit {
    if !ray.is_traceable() || bvh.nodes.is_empty() {
        return Hit::NONE;
    }
    flight.launch(ray);
    while flight.child() != Child::EMPTY {
        if flight.child().is_leaf() {
            flight.visit_leaf::<ANY, true, true>(bvh, counts);
        } else {
            flight.visit_node::<ANY, true>(bvh, counts);
        }
    }
    flight.hit()
}
