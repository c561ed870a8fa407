//! Traversal: batches of rays in, columns of hits out.
//!
//! The kernels here are all that knows how a batch becomes rays, so a kernel that holds many rays in flight
//! replaces the loop in [`ClosestHits`] or [`AnyHits`] and nothing else.

mod any_hit;
mod closest_hit;
mod slab;
pub(super) mod stack;

use super::Bvh4;
use super::columns::{HitColumnsMut, RayColumns, TraversalCounts};
use crate::bvh::ray::{Hit, Ray};
use crate::simd::{Kernel, Tier};
use any_hit::any_hit;
use closest_hit::closest_hit;
use stack::Stack;

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
        closest_hit::<true, true>(self, ray, &mut Stack::new(), counts)
    }

    /// Whether one ray hits anything, for callers that have no batch.
    pub fn any_hit(&self, ray: &Ray, counts: &mut TraversalCounts) -> bool {
        counts.rays += 1;
        any_hit::<true, true>(self, ray, &mut Stack::new(), counts)
    }
}

/// One ray at a time.
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
        let mut counts = TraversalCounts { rays: rays.len() as u64, ..Default::default() };
        let mut stack = Stack::new();
        for row in 0..rays.len() {
            let ray = rays.ray(row);
            hits.set(row, closest_hit::<SPHERES, COUNT>(self.bvh, &ray, &mut stack, &mut counts));
        }
        counts
    }
}

/// One ray at a time.
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
        let mut counts = TraversalCounts { rays: rays.len() as u64, ..Default::default() };
        let mut stack = Stack::new();
        for (row, occluded) in occluded.iter_mut().enumerate() {
            let ray = rays.ray(row);
            *occluded = any_hit::<SPHERES, COUNT>(self.bvh, &ray, &mut stack, &mut counts);
        }
        counts
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
        let mut stack = Stack::new();
        for (row, visits) in visits.iter_mut().enumerate() {
            let mut counts = TraversalCounts::default();
            closest_hit::<true, true>(self.bvh, &rays.ray(row), &mut stack, &mut counts);
            *visits = counts.node_visits as u32;
        }
    }
}
