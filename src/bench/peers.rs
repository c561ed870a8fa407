//! Who traces a set of rays: comber's kernels, or a peer in one of its modes.

use super::agreement::Answers;
use super::kernels::{self, Kernel};
use super::rays::RaySet;
use crate::bvh::{Accel, Query};
use crate::peer::embree::modes::Mode;
use crate::peer::embree::scene::Tree;
use crate::peer::embree::trace;
use crate::simd::Tier;
use std::sync::Barrier;
use std::time::Duration;

/// A tracer of rays.
#[derive(Clone, Copy)]
pub enum Contestant<'a> {
    /// comber.
    Comber {
        /// Its tree.
        accel: &'a Accel,
        /// Which kernel.
        kernel: Kernel,
        /// Instruction set.
        tier: Tier,
    },
    /// Embree.
    Embree {
        /// Its tree.
        tree: &'a Tree,
        /// How it is asked.
        mode: Mode,
    },
}

impl Contestant<'_> {
    /// For reports.
    pub fn name(&self) -> String {
        match self {
            Contestant::Comber { kernel, .. } => kernel.name().into(),
            Contestant::Embree { tree, mode } => format!("{} {mode}", tree.name()),
        }
    }

    /// Traces `set` on `threads` threads, each a part of it, and tells how many rays a second they trace together.
    ///
    /// Timed are trace calls alone: laying out Embree's records is not. The rates of the threads are added, so that one
    /// that ends early does not count as waiting.
    pub fn rate(&self, set: &RaySet, threads: usize) -> f64 {
        let barrier = Barrier::new(threads);
        let work = |thread: usize| {
            let (rays, time) = self.part(set, thread, threads, &barrier);
            if rays == 0 { 0.0 } else { rays as f64 / time.as_secs_f64().max(1e-9) }
        };
        if threads == 1 {
            return work(0);
        }
        std::thread::scope(|scope| {
            let work = &work;
            let all: Vec<_> = (0..threads).map(|thread| scope.spawn(move || work(thread))).collect();
            all.into_iter().map(|thread| thread.join().unwrap_or(f64::NAN)).sum()
        })
    }

    /// Traces the `part`-th of `parts` parts, which begin together; gives its rays and the time.
    fn part(&self, set: &RaySet, part: usize, parts: usize, begin: &Barrier) -> (usize, Duration) {
        let cut = |n: usize| n * part / parts..n * (part + 1) / parts;
        match *self {
            Contestant::Comber { accel, kernel, tier } => {
                let spans = set.spans();
                let spans = &spans[cut(spans.len())];
                let rays = spans.iter().map(|(rows, _)| rows.len()).sum();
                let mut tracer = kernels::Tracer::new(accel, kernel, tier, set);
                begin.wait();
                (rays, tracer.trace(set, spans))
            }
            Contestant::Embree { tree, mode } => {
                let rays = set.rays.all().rows(cut(set.rays.len()));
                let mut tracer = trace::Tracer::new(tree, set.query, mode, rays.len());
                begin.wait();
                (rays.len(), tracer.trace(rays, |_| ()))
            }
        }
    }

    /// The answers to all rays of `set`.
    pub fn answers(&self, set: &RaySet) -> Answers {
        match (*self, set.query) {
            (Contestant::Comber { accel, kernel, tier }, Query::Closest) => {
                let hits = kernels::closest_hits(accel, kernel, tier, set);
                Answers::Closest(hits.into_iter().map(|hit| (hit.t, hit.prim)).collect())
            }
            (Contestant::Comber { accel, kernel, tier }, Query::Any) => {
                Answers::Any(kernels::any_hits(accel, kernel, tier, set))
            }
            (Contestant::Embree { tree, mode }, Query::Closest) => {
                let mut tracer = trace::Tracer::new(tree, Query::Closest, mode, set.rays.len());
                Answers::Closest(tracer.closest_hits(set.rays.all()))
            }
            (Contestant::Embree { tree, mode }, Query::Any) => {
                let mut tracer = trace::Tracer::new(tree, Query::Any, mode, set.rays.len());
                Answers::Any(tracer.any_hits(set.rays.all()))
            }
        }
    }
}
