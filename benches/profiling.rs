//! What profiling costs: renders plain, with the table of stages, and with the timeline, in turns.
//!
//! `cargo bench --bench profiling [-- SCENE…]` prints a table in Markdown: ratios of wall time and of processor time to plain renders,
//! medians of pairs. A busy machine hardly changes the latter. *best ÷ best* compares the fastest render of each, which disturbances touch least;
//! *by count* is the number of parts noted times what a note takes in a loop, as a share of the render.

mod common;

use comber::bench::interleave::{Effort, Turn, interleave};
use comber::bench::probe::Probe;
use comber::drive;
use comber::observer::{Observer, Part, Slice, Unobserved, Work};
use comber::options::RenderOptions;
use comber::plan::Plan;
use comber::profile::recorder::{Keep, Recorder};
use common::{Args, Ready, render_options};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

const WAYS: [(&str, Option<Keep>); 3] = [
    ("plain", None),
    ("stage table", Some(Keep { marks: false, counters: false, visits: false })),
    ("timeline", Some(Keep { marks: true, counters: false, visits: false })),
];

const ROUNDS: usize = 21;

fn main() {
    let args = Args::parse();
    println!(
        "| scene | threads | | Mray/s | wall ÷ plain | quartiles | cpu ÷ plain | best ÷ best | by count | disturbed |"
    );
    println!("|---|--:|---|--:|--:|--:|--:|--:|--:|--:|");
    for ready in args.scenes().into_iter().filter_map(common::load) {
        for threads in [1, 2] {
            let options = RenderOptions { threads: Some(threads), ..render_options() };
            match args.measure {
                true => compare(&ready, &options, ROUNDS),
                false => compare(&ready, &RenderOptions { width: 32, height: 24, samples: 2, ..options }, 1),
            }
        }
    }
}

fn compare(ready: &Ready, options: &RenderOptions, rounds: usize) {
    let plan = Plan::new(&ready.scene, &ready.accel, options).expect("a plan");
    let render = |observer: &dyn Observer| {
        let outcome = drive::render(&ready.scene, &ready.accel, &ready.camera, &plan, observer).expect("a render");
        outcome.stats.rays.all()
    };
    render(&Unobserved);
    let counter = Counter::default();
    let rays = render(&counter) as f64;
    let parts = counter.0.into_inner();
    let effort = Effort { rounds, time: Duration::MAX, turn: Duration::ZERO };
    let turns = interleave(WAYS.len(), plan.threads, effort, &mut Probe::new(), |way| {
        let start = Instant::now();
        let rays = match WAYS[way].1 {
            None => render(&Unobserved),
            Some(keep) => render(&Recorder::new(plan.threads, keep, &Unobserved)),
        };
        Turn { rate: rays as f64 / start.elapsed().as_secs_f64(), waited: 0.0 }
    });
    let best = |way: usize| turns.samples[way].iter().map(|sample| sample.rate).fold(0.0, f64::max);
    for (way, (name, keep)) in WAYS.iter().enumerate() {
        let ratio = turns.ratio(0, way);
        let share = keep.map_or(0.0, |keep| parts as f64 * note_seconds(keep) / (rays / best(0) * plan.threads as f64));
        println!(
            "| {} | {} | {name} | {:.2} | {:.4} | {:.4}–{:.4} | {:.4} | {:.4} | {:.3} % | {} |",
            ready.name,
            plan.threads,
            turns.summary(way).rate.median * 1e-6,
            ratio.rate.median,
            ratio.rate.low,
            ratio.rate.high,
            turns.cpu_ratio(way, 0).median,
            best(0) / best(way),
            100.0 * share,
            ratio.disturbed,
        );
    }
}

/// Counts parts.
#[derive(Default)]
struct Counter(AtomicU64);

impl Observer for Counter {
    fn ended(&self, _slice: &Slice) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }
}

/// What noting a part takes.
fn note_seconds(keep: Keep) -> f64 {
    const NOTES: u32 = 200_000;
    let recorder = Recorder::new(1, keep, &Unobserved);
    let part = Part::Stage { stage: 1, depth: 2 };
    let start = Instant::now();
    for _ in 0..NOTES {
        let now = Instant::now();
        recorder.began(part);
        recorder.ended(&Slice { part, start: now, end: now, work: Work::default() });
    }
    start.elapsed().as_secs_f64() / f64::from(NOTES)
}
