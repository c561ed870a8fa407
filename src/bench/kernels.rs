//! comber's own ways to trace a set of rays.

use super::rays::RaySet;
use crate::bvh::ray::Hit;
use crate::bvh::{Accel, Query, Traversal, TraversalCounts};
use crate::simd::Tier;
use crate::wave::features::Features;
use crate::wave::hits::Hits;
use std::time::{Duration, Instant};

/// Which kernel traces a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// The one that the renderer would choose.
    Suited,
    /// This one.
    Way(Traversal),
}

impl Kernel {
    /// The renderer's choice, and every way through a tree by itself.
    pub fn usual() -> Vec<Kernel> {
        std::iter::once(Kernel::Suited).chain(Traversal::THROUGH_A_TREE.map(Kernel::Way)).collect()
    }

    /// All that there are.
    pub fn all() -> Vec<Kernel> {
        std::iter::once(Kernel::Suited).chain(Traversal::ALL.map(Kernel::Way)).collect()
    }

    /// For reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Kernel::Suited => "suited",
            Kernel::Way(way) => way.name(),
        }
    }

    /// The way for a batch.
    pub fn way(self, accel: &Accel, query: Query, coherent: bool) -> Traversal {
        match self {
            Kernel::Suited => accel.suited(query, coherent),
            Kernel::Way(way) => way,
        }
    }
}

/// A thread's means to trace batches: where the hits of one go.
pub struct Tracer<'a> {
    accel: &'a Accel,
    kernel: Kernel,
    tier: Tier,
    hits: Hits,
    occluded: Vec<bool>,
}

impl<'a> Tracer<'a> {
    /// For the batches of `set`.
    pub fn new(accel: &'a Accel, kernel: Kernel, tier: Tier, set: &RaySet) -> Tracer<'a> {
        let most = set.batches.iter().map(|batch| batch.rays as usize).max().unwrap_or(0);
        Tracer { accel, kernel, tier, hits: Hits::allocate(most, Features::HITS), occluded: vec![false; most] }
    }

    /// Traces the batches `spans` of `set`; gives the time it took. A function of its own, so that `profiling/callgrind.sh` can
    /// count its instructions alone.
    #[inline(never)]
    pub fn trace(&mut self, set: &RaySet, spans: &[(std::ops::Range<usize>, bool)]) -> Duration {
        let start = Instant::now();
        for (rows, coherent) in spans {
            self.batch(set, rows.clone(), *coherent);
        }
        start.elapsed()
    }

    fn batch(&mut self, set: &RaySet, rows: std::ops::Range<usize>, coherent: bool) {
        let way = self.kernel.way(self.accel, set.query, coherent);
        let rays = set.rays.all().rows(rows);
        match set.query {
            Query::Closest => self.accel.closest_hits(way, self.tier, rays, self.hits.columns_mut(rays.len())),
            Query::Any => self.accel.any_hits(way, self.tier, rays, &mut self.occluded),
        };
    }
}

/// The closest hits of all rays of a set, whatever it asks.
pub fn closest_hits(accel: &Accel, kernel: Kernel, tier: Tier, set: &RaySet) -> Vec<Hit> {
    let mut tracer = Tracer::new(accel, kernel, tier, set);
    let mut hits = Vec::with_capacity(set.rays.len());
    for (rows, coherent) in set.spans() {
        let rays = set.rays.all().rows(rows);
        let n = rays.len();
        accel.closest_hits(kernel.way(accel, Query::Closest, coherent), tier, rays, tracer.hits.columns_mut(n));
        hits.extend((0..n).map(|row| tracer.hits.hit(row)));
    }
    hits
}

/// Whether each ray of a set hits anything, whatever it asks.
pub fn any_hits(accel: &Accel, kernel: Kernel, tier: Tier, set: &RaySet) -> Vec<bool> {
    let mut occluded = vec![false; set.rays.len()];
    for (rows, coherent) in set.spans() {
        let rays = set.rays.all().rows(rows.clone());
        accel.any_hits(kernel.way(accel, Query::Any, coherent), tier, rays, &mut occluded[rows]);
    }
    occluded
}

/// Nodes, leaves and primitive tests of all rays of a set.
pub fn counts(accel: &Accel, kernel: Kernel, tier: Tier, set: &RaySet) -> TraversalCounts {
    let mut tracer = Tracer::new(accel, kernel, tier, set);
    let mut counts = TraversalCounts::default();
    for (rows, coherent) in set.spans() {
        let rays = set.rays.all().rows(rows);
        let way = kernel.way(accel, set.query, coherent);
        counts += match set.query {
            Query::Closest => accel.closest_hits_counted(way, tier, rays, tracer.hits.columns_mut(rays.len())),
            Query::Any => accel.any_hits_counted(way, tier, rays, &mut tracer.occluded),
        };
    }
    counts
}
