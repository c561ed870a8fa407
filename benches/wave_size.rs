//! The curve from which the default size of a wave was chosen: whole renders on one thread, with waves of 2⁸ to 2²⁰ rows.
//!
//! `cargo bench --bench wave_size [-- SCENE…]` prints CSV. The sizes take turns, `REPEATS` times over.
//! `profiling/wave_curve.sh` keeps the result.

mod common;

use comber::bench::interleave::{Effort, Turn, interleave};
use comber::bench::probe::Probe;
use comber::bench::statistics::Quartiles;
use comber::drive::{self, Unobserved};
use comber::options::RenderOptions;
use comber::plan::Plan;
use common::{Args, Ready, render_options};
use std::time::{Duration, Instant};

const REPEATS: usize = 5;

fn main() {
    let args = Args::parse();
    println!("scene,rows,bytes,mray_per_s,relative_to_best,cpu_s,cpu_relative_to_best,repeats,disturbed");
    let mut probe = Probe::new();
    for ready in args.scenes().into_iter().filter_map(common::load) {
        match args.measure {
            true => curve(&ready, 8..=20, REPEATS, &mut probe),
            false => curve(&ready, 8..=9, 1, &mut probe),
        }
    }
}

fn curve(ready: &Ready, logs: std::ops::RangeInclusive<u32>, repeats: usize, probe: &mut Probe) {
    let options = |log: u32| RenderOptions {
        // 2²⁰ samples in all: the largest wave is filled once.
        width: 256,
        height: 256,
        threads: Some(1),
        wave: Some(1 << log),
        ..render_options()
    };
    let plan = |log: u32| Plan::new(&ready.scene, &ready.accel, &options(log)).expect("a sound plan");
    let plans: Vec<Plan> = logs.map(plan).collect();
    let mut rays = 0;
    let effort = Effort { rounds: repeats, time: Duration::MAX, turn: Duration::ZERO };
    let turns = interleave(plans.len(), 1, effort, probe, |size| {
        let start = Instant::now();
        let outcome = drive::render(&ready.scene, &ready.accel, &ready.camera, &plans[size], &Unobserved);
        let seconds = start.elapsed().as_secs_f64();
        let counts = outcome.expect("a picture").stats.rays;
        rays = counts.camera + counts.bounce + counts.shadow;
        Turn { rate: rays as f64 / seconds, waited: 0.0 }
    });
    let rate = |size: usize| turns.summary(size).rate.median;
    let cpu = |size: usize| Quartiles::of(turns.samples[size].iter().map(|s| s.cpu)).median;
    let best = (0..plans.len()).map(rate).fold(0.0, f64::max);
    let best_cpu = (0..plans.len()).map(cpu).fold(f64::INFINITY, f64::min);
    for (size, plan) in plans.iter().enumerate() {
        println!(
            "{},{},{},{:.3},{:.3},{:.3},{:.3},{},{}",
            ready.name,
            plan.wave,
            plan.wave * plan.bytes_per_path,
            rate(size) * 1e-6,
            rate(size) / best,
            cpu(size),
            best_cpu / cpu(size),
            repeats,
            turns.summary(size).disturbed,
        );
    }
}
