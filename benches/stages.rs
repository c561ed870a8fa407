//! Each stage alone, on the queues that real scenes give it: `stage/<stage>/<scene>/depth<d>`, rows a second.
//!
//! One wave of the default size, one thread, everything warm: what a row costs when only the stage itself is in the way.
//! Kernels that are compiled for several tiers run at the best one; `-baseline` marks the others.

mod common;

use comber::simd::Tier;
use comber::wave::paths::Paths;
use common::Ready;
use common::pipeline::Pipeline;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::time::Duration;

const SCENES: [&str; 4] = ["cornell_spheres", "cornell_mesh", "default", "dragon"];

/// The deepest vertex whose rows are measured.
const DEEPEST: u32 = 1;

fn stages(criterion: &mut Criterion) {
    for ready in SCENES.into_iter().filter_map(common::load) {
        assert_tiers_agree(&ready);
        let tiers = Tier::available();
        let best = tiers.last().copied();
        for tier in tiers {
            let suffix = if Some(tier) == best { "" } else { "-baseline" };
            measure(criterion, &ready, tier, suffix);
        }
    }
}

/// Takes one wave from stage to stage, and measures each on the way.
fn measure(criterion: &mut Criterion, ready: &Ready, tier: Tier, suffix: &str) {
    let all_stages = suffix.is_empty();
    let mut pipeline = Pipeline::new(ready, &common::render_options(), tier);
    let mut bench = |stage: &str, depth: u32, rows: usize, run: &mut dyn FnMut()| {
        let mut group = criterion.benchmark_group(format!("stage/{stage}/{}", ready.name));
        group.sample_size(30).warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_millis(800));
        group.throughput(Throughput::Elements(rows as u64));
        group.bench_function(format!("depth{depth}{suffix}"), |b| b.iter(&mut *run));
        group.finish();
    };
    let mut live = pipeline.generate();
    let rows = live;
    bench("generate", 0, rows, &mut || {
        pipeline.generate();
    });
    for depth in 0..=DEEPEST {
        pipeline.traverse(depth, live);
        if all_stages {
            bench("traverse", depth, live, &mut || pipeline.traverse(depth, live));
        }
        let shaded = pipeline.shade(depth, live);
        bench("shade", depth, live, &mut || {
            pipeline.shade(depth, live);
        });
        if all_stages {
            bench("shadow", depth, shaded.shadows, &mut || pipeline.shadow(depth, shaded.shadows));
            // The rows come from `next` and go to `paths`, which nobody reads again at this depth.
            bench("roulette", depth, shaded.next, &mut || {
                pipeline.roulette(depth, shaded.next);
            });
        }
        live = pipeline.roulette(depth, shaded.next);
    }
    if all_stages {
        bench("retire", 0, rows, &mut || pipeline.retire());
    }
}

/// A benchmark of something wrong is worth nothing: all tiers must leave the same paths behind.
fn assert_tiers_agree(ready: &Ready) {
    let paths = |tier: Tier| {
        let mut pipeline = Pipeline::new(ready, &common::render_options(), tier);
        let mut live = pipeline.generate();
        for depth in 0..=DEEPEST {
            pipeline.traverse(depth, live);
            let shaded = pipeline.shade(depth, live);
            live = pipeline.roulette(depth, shaded.next);
        }
        bits(&pipeline.wave.paths, live)
    };
    let expected = paths(Tier::Baseline);
    assert!(!expected.is_empty());
    for tier in Tier::available() {
        assert!(paths(tier) == expected, "{}: tiers disagree", ready.name);
    }
}

fn bits(paths: &Paths, n: usize) -> Vec<u32> {
    let Paths { ox, oy, oz, dx, dy, dz, beta_r, beta_g, beta_b, pdf, .. } = paths;
    [ox, oy, oz, dx, dy, dz, beta_r, beta_g, beta_b, pdf]
        .iter()
        .flat_map(|c| c[..n].iter().map(|x| x.to_bits()))
        .collect()
}

criterion_group!(benches, stages);
criterion_main!(benches);
