//! Whole renders: waves against the depth-first reference integrator, on the same threads.
//!
//! `cargo bench --bench render [-- SCENE…]` prints a table in Markdown. The two take turns, so that whatever else the
//! machine does meets both; each pair gives one ratio, and the table shows their median and quartiles. Pictures must be
//! equal to the bit, or the bench fails.
//!
//! Columns: `ratio` is the reference's wall time over the waves' (above 1, waves win), `still` the same without the pairs
//! whose probe says that the machine was disturbed, `cpu` the ratio of processor times, which a busy machine hardly changes.

mod common;

use comber::drive::{self, RayCounts, Unobserved};
use comber::film::picture::Picture;
use comber::options::RenderOptions;
use comber::plan::Plan;
use comber::reference;
use common::{Args, Quartiles, Ready, Sample, disturbed, render_options, sample};

const PAIRS: usize = 9;

fn main() {
    let args = Args::parse();
    println!(
        "| scene | threads | waves Mray/s | reference Mray/s | ratio | quartiles | still | cpu | pairs (disturbed) |"
    );
    println!("|---|--:|--:|--:|--:|--:|--:|--:|--:|");
    for ready in args.scenes().into_iter().filter_map(common::load) {
        for threads in [1, 2] {
            let options = RenderOptions { threads: Some(threads), ..render_options() };
            match args.measure {
                true => compare(&ready, &options, PAIRS),
                false => compare(&ready, &RenderOptions { width: 32, height: 24, samples: 2, ..options }, 1),
            }
        }
    }
}

/// Renders `pairs` times both ways and prints a row.
fn compare(ready: &Ready, options: &RenderOptions, pairs: usize) {
    let threads = options.threads.map_or(1, |threads| threads as usize);
    // Once for nothing: it warms caches and page tables, and proves that there is one picture to race for.
    let rays = check(ready, options);
    let mut waves = Vec::new();
    let mut references = Vec::new();
    for _ in 0..pairs {
        waves.push(sample(threads, || by_waves(ready, options)).1);
        references.push(sample(threads, || depth_first(ready, options)).1);
    }
    print_row(ready.name, threads, rays, &waves, &references);
}

fn print_row(name: &str, threads: usize, rays: RayCounts, waves: &[Sample], references: &[Sample]) {
    let all: Vec<Sample> = [waves, references].concat();
    let disturbed = disturbed(&all);
    let (by_wave, by_reference) = disturbed.split_at(waves.len());
    let pairs: Vec<_> = waves.iter().zip(references).zip(by_wave.iter().zip(by_reference)).collect();
    let ratio = |((wave, reference), _): &((&Sample, &Sample), _)| reference.wall / wave.wall;
    let is_still = |(_, (a, b)): &&((&Sample, &Sample), (&bool, &bool))| !(**a || **b);
    let ratios = Quartiles::of(pairs.iter().map(ratio));
    let still = Quartiles::of(pairs.iter().filter(is_still).map(ratio));
    let cpu = Quartiles::of(pairs.iter().map(|((wave, reference), _)| reference.cpu / wave.cpu));
    let million = (rays.camera + rays.bounce + rays.shadow) as f64 * 1e-6;
    let rate = |samples: &[Sample]| million / Quartiles::of(samples.iter().map(|s| s.wall)).median;
    println!(
        "| {name} | {threads} | {:.2} | {:.2} | {:.2} | {:.2}–{:.2} | {:.2} | {:.2} | {} ({}) |",
        rate(waves),
        rate(references),
        ratios.median,
        ratios.low,
        ratios.high,
        still.median,
        cpu.median,
        pairs.len(),
        pairs.len() - pairs.iter().filter(is_still).count(),
    );
}

/// Fails unless both ways trace the same rays to the same picture.
fn check(ready: &Ready, options: &RenderOptions) -> RayCounts {
    let (picture, rays) = by_waves(ready, options);
    let (expected, expected_rays) = depth_first(ready, options);
    let bits = |p: &Picture| p.beauty.iter().flatten().map(|c| c.to_bits()).collect::<Vec<_>>();
    assert!(bits(&picture) == bits(&expected), "{}: the pictures differ", ready.name);
    assert_eq!(rays, expected_rays, "{}: the rays differ", ready.name);
    rays
}

/// As `comber render` does it, with the pool of threads that it starts.
fn by_waves(ready: &Ready, options: &RenderOptions) -> (Picture, RayCounts) {
    let plan = Plan::new(&ready.scene, &ready.accel, options).expect("a sound plan");
    let outcome = drive::render(&ready.scene, &ready.accel, &ready.camera, &plan, &Unobserved).expect("a picture");
    (outcome.picture, outcome.stats.rays)
}

/// One path at a time, tiles in parallel, in a pool that is started here because waves start theirs too.
fn depth_first(ready: &Ready, options: &RenderOptions) -> (Picture, RayCounts) {
    let threads = options.threads.map_or(0, |threads| threads as usize);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    let render = || reference::render(&ready.scene, &ready.accel, &ready.camera, options);
    let reference = pool.install(render).expect("a picture");
    (reference.picture, reference.rays)
}
