//! Traversal: batches of rays in, columns of hits out.
//!
//! Two ways through the tree give the same hits: one ray after another ([`closest_hit`], [`any_hit`]), and many in flight at
//! once ([`wave`], whose rays take steps, [`flight`]). Which is faster depends on the tree and on the rays: [`Traversal`].

mod any_hit;
mod closest_hit;
mod flight;
mod leaf;
mod slab;
pub(super) mod stack;
mod wave;

use super::Bvh4;
use super::columns::{HitColumnsMut, RayColumns, TraversalCounts};
use super::ray::{Hit, Ray};
use crate::simd::{Kernel, Tier};
use any_hit::any_hit;
use closest_hit::closest_hit;
pub use stack::Stack;

/// How a batch goes through the tree. The hits do not depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Traversal {
    /// One ray after another: fewest instructions.
    Single,
    /// Many rays at once: hides the waits for memory and for mispredicted branches.
    InFlight,
}

impl Traversal {
    /// All ways: what benches and tests run through.
    pub const ALL: [Traversal; 2] = [Traversal::Single, Traversal::InFlight];

    /// For reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Traversal::Single => "single",
            Traversal::InFlight => "in-flight",
        }
    }
}

/// Bytes of a tree from which incoherent rays go in flight: below, everything is in the caches near the core, and there
/// is little to wait for.
const IN_FLIGHT_BYTES: usize = 1 << 20;

impl Bvh4 {
    /// The way that suits rays of which neighbours go the same way (`coherent`), or do not.
    pub fn suited(&self, coherent: bool) -> Traversal {
        let large = self.stats().bytes >= IN_FLIGHT_BYTES;
        if large && !coherent { Traversal::InFlight } else { Traversal::Single }
    }

    /// The closest hit of each ray.
    pub fn closest_hits(
        &self,
        way: Traversal,
        tier: Tier,
        rays: RayColumns<'_>,
        hits: HitColumnsMut<'_>,
    ) -> TraversalCounts {
        if self.spheres.is_empty() {
            tier.run(ClosestHits::<false, false> { bvh: self, way, rays, hits })
        } else {
            tier.run(ClosestHits::<true, false> { bvh: self, way, rays, hits })
        }
    }

    /// The same, counting.
    pub fn closest_hits_counted(
        &self,
        way: Traversal,
        tier: Tier,
        rays: RayColumns<'_>,
        hits: HitColumnsMut<'_>,
    ) -> TraversalCounts {
        tier.run(ClosestHits::<true, true> { bvh: self, way, rays, hits })
    }

    /// Whether each ray hits anything.
    pub fn any_hits(&self, way: Traversal, tier: Tier, rays: RayColumns<'_>, occluded: &mut [bool]) -> TraversalCounts {
        if self.spheres.is_empty() {
            tier.run(AnyHits::<false, false> { bvh: self, way, rays, occluded })
        } else {
            tier.run(AnyHits::<true, false> { bvh: self, way, rays, occluded })
        }
    }

    /// The same, counting.
    pub fn any_hits_counted(
        &self,
        way: Traversal,
        tier: Tier,
        rays: RayColumns<'_>,
        occluded: &mut [bool],
    ) -> TraversalCounts {
        tier.run(AnyHits::<true, true> { bvh: self, way, rays, occluded })
    }

    /// How many nodes the closest-hit traversal of each ray visits.
    pub fn cost_columns(&self, tier: Tier, rays: RayColumns<'_>, visits: &mut [u32]) {
        tier.run(Costs { bvh: self, rays, visits });
    }

    /// The closest hit of one ray, for callers that have no batch.
    #[inline(always)]
    pub fn closest_hit(&self, ray: &Ray, stack: &mut Stack) -> Hit {
        let mut counts = TraversalCounts::default();
        if self.spheres.is_empty() {
            closest_hit::<false, false>(self, ray, stack, &mut counts)
        } else {
            closest_hit::<true, false>(self, ray, stack, &mut counts)
        }
    }

    /// Whether one ray hits anything, for callers that have no batch.
    #[inline(always)]
    pub fn any_hit(&self, ray: &Ray, stack: &mut Stack) -> bool {
        let mut counts = TraversalCounts::default();
        if self.spheres.is_empty() {
            any_hit::<false, false>(self, ray, stack, &mut counts)
        } else {
            any_hit::<true, false>(self, ray, stack, &mut counts)
        }
    }

    /// Nodes that the closest-hit traversal of one ray visits.
    pub fn node_visits(&self, ray: &Ray, stack: &mut Stack) -> u64 {
        let mut counts = TraversalCounts::default();
        closest_hit::<true, true>(self, ray, stack, &mut counts);
        counts.node_visits
    }
}

struct ClosestHits<'a, const SPHERES: bool, const COUNT: bool> {
    bvh: &'a Bvh4,
    way: Traversal,
    rays: RayColumns<'a>,
    hits: HitColumnsMut<'a>,
}

impl<const SPHERES: bool, const COUNT: bool> Kernel for ClosestHits<'_, SPHERES, COUNT> {
    type Output = TraversalCounts;

    #[inline(always)]
    fn run(self) -> TraversalCounts {
        let rays = self.rays.trimmed();
        let mut hits = self.hits.trimmed(rays.len());
        if self.way == Traversal::InFlight {
            return wave::trace::<false, SPHERES, COUNT>(self.bvh, rays, |row, hit| hits.set(row, hit));
        }
        let mut counts = TraversalCounts { rays: rays.len() as u64, ..Default::default() };
        let mut stack = Stack::new();
        for row in 0..rays.len() {
            hits.set(row, closest_hit::<SPHERES, COUNT>(self.bvh, &rays.ray(row), &mut stack, &mut counts));
        }
        counts
    }
}

struct AnyHits<'a, const SPHERES: bool, const COUNT: bool> {
    bvh: &'a Bvh4,
    way: Traversal,
    rays: RayColumns<'a>,
    occluded: &'a mut [bool],
}

impl<const SPHERES: bool, const COUNT: bool> Kernel for AnyHits<'_, SPHERES, COUNT> {
    type Output = TraversalCounts;

    #[inline(always)]
    fn run(self) -> TraversalCounts {
        let rays = self.rays.trimmed();
        let occluded = &mut self.occluded[..rays.len()];
        if self.way == Traversal::InFlight {
            return wave::trace::<true, SPHERES, COUNT>(self.bvh, rays, |row, hit| occluded[row] = hit.is_some());
        }
        let mut counts = TraversalCounts { rays: rays.len() as u64, ..Default::default() };
        let mut stack = Stack::new();
        for (row, occluded) in occluded.iter_mut().enumerate() {
            *occluded = any_hit::<SPHERES, COUNT>(self.bvh, &rays.ray(row), &mut stack, &mut counts);
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
        let mut stack = Stack::new();
        for (row, visits) in self.visits[..rays.len()].iter_mut().enumerate() {
            *visits = self.bvh.node_visits(&rays.ray(row), &mut stack) as u32;
        }
    }
}
