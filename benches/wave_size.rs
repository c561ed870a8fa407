//! The curve from which the default size of a wave was chosen: whole renders on one thread, with waves of 2⁸ to 2²⁰ rows.
//!
//! `cargo bench --bench wave_size [-- SCENE…]` prints CSV. The sizes take turns, `REPEATS` times over.
//! `profiling/wave_curve.sh` keeps the result.

mod common;

use comber::drive::{self, Unobserved};
use comber::options::RenderOptions;
use comber::plan::Plan;
use common::{Args, Quartiles, Ready, Sample, disturbed, render_options, sample};

const REPEATS: usize = 5;

fn main() {
    let args = Args::parse();
    println!("scene,rows,bytes,mray_per_s,relative_to_best,cpu_s,cpu_relative_to_best,repeats,disturbed");
    for ready in args.scenes().into_iter().filter_map(common::load) {
        match args.measure {
            true => curve(&ready, 8..=20, REPEATS),
            false => curve(&ready, 8..=9, 1),
        }
    }
}

fn curve(ready: &Ready, logs: std::ops::RangeInclusive<u32>, repeats: usize) {
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
    let mut samples: Vec<Vec<Sample>> = vec![Vec::new(); plans.len()];
    let mut rays = 0;
    for _ in 0..repeats {
        for (plan, samples) in plans.iter().zip(&mut samples) {
            let render = || drive::render(&ready.scene, &ready.accel, &ready.camera, plan, &Unobserved);
            let (outcome, taken) = sample(1, render);
            let counts = outcome.expect("a picture").stats.rays;
            rays = counts.camera + counts.bounce + counts.shadow;
            samples.push(taken);
        }
    }
    let flags = disturbed(&samples.concat());
    let wall = |samples: &[Sample]| Quartiles::of(samples.iter().map(|s| s.wall)).median;
    let cpu = |samples: &[Sample]| Quartiles::of(samples.iter().map(|s| s.cpu)).median;
    let best = samples.iter().map(|s| wall(s)).fold(f64::INFINITY, f64::min);
    let best_cpu = samples.iter().map(|s| cpu(s)).fold(f64::INFINITY, f64::min);
    for ((plan, samples), flags) in plans.iter().zip(&samples).zip(flags.chunks(repeats)) {
        println!(
            "{},{},{},{:.3},{:.3},{:.3},{:.3},{},{}",
            ready.name,
            plan.wave,
            plan.wave * plan.bytes_per_path,
            rays as f64 * 1e-6 / wall(samples),
            best / wall(samples),
            cpu(samples),
            best_cpu / cpu(samples),
            repeats,
            flags.iter().filter(|&&flag| flag).count(),
        );
    }
}
