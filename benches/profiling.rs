//! What profiling costs: renders plain, with the table of stages, and with the timeline, in turns.
//!
//! `cargo bench --bench profiling [-- SCENE…]` prints a table in Markdown: ratios of wall time and of processor time to plain renders,
//! medians of pairs. A busy machine hardly changes the latter.

mod common;

use comber::bench::interleave::{Effort, Turn, interleave};
use comber::bench::probe::Probe;
use comber::drive;
use comber::observer::{Observer, Unobserved};
use comber::options::RenderOptions;
use comber::plan::Plan;
use comber::profile::recorder::{Keep, Recorder};
use common::{Args, Ready, render_options};
use std::time::{Duration, Instant};

const WAYS: [(&str, Option<Keep>); 3] = [
    ("plain", None),
    ("stage table", Some(Keep { marks: false, counters: false })),
    ("timeline", Some(Keep { marks: true, counters: false })),
];

const ROUNDS: usize = 21;

fn main() {
    let args = Args::parse();
    println!("| scene | threads | | Mray/s | wall ÷ plain | quartiles | cpu ÷ plain | disturbed |");
    println!("|---|--:|---|--:|--:|--:|--:|--:|");
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
    let effort = Effort { rounds, time: Duration::MAX, turn: Duration::ZERO };
    let turns = interleave(WAYS.len(), plan.threads, effort, &mut Probe::new(), |way| {
        let start = Instant::now();
        let rays = match WAYS[way].1 {
            None => render(&Unobserved),
            Some(keep) => render(&Recorder::new(plan.threads, keep, &Unobserved)),
        };
        Turn { rate: rays as f64 / start.elapsed().as_secs_f64(), waited: 0.0 }
    });
    for (way, (name, _)) in WAYS.iter().enumerate() {
        let ratio = turns.ratio(0, way);
        println!(
            "| {} | {} | {name} | {:.2} | {:.4} | {:.4}–{:.4} | {:.4} | {} |",
            ready.name,
            plan.threads,
            turns.summary(way).rate.median * 1e-6,
            ratio.rate.median,
            ratio.rate.low,
            ratio.rate.high,
            turns.cpu_ratio(way, 0).median,
            ratio.disturbed,
        );
    }
}
