//! Who traces a set of rays: comber's kernels, or a peer in one of its modes.

use super::agreement::{self, Answers};
use super::interleave::Turn;
use super::kernels::{self, Kernel};
use super::rays::RaySet;
use crate::bvh::{Accel, Query};
use crate::measure::processor;
use crate::peer::embree::modes::Mode;
use crate::peer::embree::scene::Tree;
use crate::peer::embree::trace;
use crate::simd::Tier;
use std::ops::Range;
use std::sync::Barrier;
use std::time::{Duration, Instant};

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

    /// Share of rays about which it may disagree with the reference.
    pub fn may_differ(&self) -> f64 {
        match self {
            Contestant::Embree { tree, .. } if !tree.robust => agreement::FAST,
            _ => agreement::WATERTIGHT,
        }
    }

    /// Traces `set` on `threads` threads, each a part of it, and tells how many rays a second they trace together.
    ///
    /// A set that takes less than `least` is traced again and again for that long. Timed are trace calls alone: laying out Embree's
    /// records is not. The rates of the threads are added, so that one that ends early does not count as waiting.
    pub fn turn(&self, set: &RaySet, threads: usize, least: Duration) -> Turn {
        let barrier = Barrier::new(threads);
        let work = |thread: usize| {
            let mut part = Part::new(self, set, thread, threads);
            barrier.wait();
            let (start, waited) = (Instant::now(), processor::waited());
            let (mut rays, mut time) = (0, Duration::ZERO);
            while !part.rows.is_empty() && (rays == 0 || time < least) {
                time += part.trace(set);
                rays += part.rows.len();
            }
            let waited = processor::waited().zip(waited).map_or(0.0, |(after, before)| after - before);
            // A clock that does not resolve the time of a few rays must not make them infinitely fast.
            let rate = rays as f64 / time.as_secs_f64().max(1e-9);
            Turn { rate, waited: waited / start.elapsed().as_secs_f64().max(1e-9) }
        };
        if threads == 1 {
            return work(0);
        }
        std::thread::scope(|scope| {
            let work = &work;
            let all: Vec<_> = (0..threads).map(|thread| scope.spawn(move || work(thread))).collect();
            let turns = all.into_iter().map(|thread| thread.join().expect("tracing does not panic"));
            turns.fold(Turn { rate: 0.0, waited: 0.0 }, |sum, turn| Turn {
                rate: sum.rate + turn.rate,
                waited: sum.waited.max(turn.waited),
            })
        })
    }

    /// Traces `set` once on this thread, and does nothing else.
    pub fn once(&self, set: &RaySet) {
        Part::new(self, set, 0, 1).trace(set);
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

/// One thread's part of a set, and its means to trace it.
struct Part<'a> {
    rows: Range<usize>,
    tracer: Tracer<'a>,
}

enum Tracer<'a> {
    Comber(kernels::Tracer<'a>, Vec<(Range<usize>, bool)>),
    Embree(trace::Tracer<'a>),
}

impl<'a> Part<'a> {
    /// The part number `part` of `parts`: whole batches for comber's kernels.
    fn new(who: &Contestant<'a>, set: &RaySet, part: usize, parts: usize) -> Part<'a> {
        let cut = |n: usize| n * part / parts..n * (part + 1) / parts;
        match *who {
            Contestant::Comber { accel, kernel, tier } => {
                let spans = set.spans();
                let spans = spans[cut(spans.len())].to_vec();
                let rows = spans.first().map_or(0, |span| span.0.start)..spans.last().map_or(0, |span| span.0.end);
                Part { rows, tracer: Tracer::Comber(kernels::Tracer::new(accel, kernel, tier, set), spans) }
            }
            Contestant::Embree { tree, mode } => {
                let rows = cut(set.rays.len());
                let tracer = trace::Tracer::new(tree, set.query, mode, rows.len());
                Part { rows, tracer: Tracer::Embree(tracer) }
            }
        }
    }

    fn trace(&mut self, set: &RaySet) -> Duration {
        match &mut self.tracer {
            Tracer::Comber(tracer, spans) => tracer.trace(set, spans),
            Tracer::Embree(tracer) => tracer.trace(set.rays.all().rows(self.rows.clone()), |_| ()),
        }
    }
}
