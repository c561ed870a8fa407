//! Whole renders: waves against the depth-first reference integrator, on the same threads.
//!
//! `cargo bench --bench render [-- SCENE…]` prints a table in Markdown of what `comber bench --only render` measures too. The two
//! take turns, so that whatever else the machine does meets both; each pair gives one ratio, and the table shows their median and
//! quartiles, without the pairs whose probe says that the machine was disturbed. Pictures must be equal to the bit, or the
//! bench fails.
//!
//! Columns: `ratio` is the reference's wall time over the waves' (above 1, waves win), `cpu` the ratio of processor times, which
//! a busy machine hardly changes.

mod common;

use comber::bench::end_to_end::Subject;
use comber::bench::interleave::Effort;
use comber::bench::probe::Probe;
use comber::options::RenderOptions;
use common::{Args, Ready, render_options};
use std::time::Duration;

const PAIRS: usize = 9;

fn main() {
    let args = Args::parse();
    println!("| scene | threads | waves Mray/s | reference Mray/s | ratio | quartiles | cpu | pairs | disturbed |");
    println!("|---|--:|--:|--:|--:|--:|--:|--:|--:|");
    let mut probe = Probe::new();
    for ready in args.scenes().into_iter().filter_map(common::load) {
        for threads in [1, 2] {
            let options = RenderOptions { threads: Some(threads), ..render_options() };
            match args.measure {
                true => compare(&ready, &options, PAIRS, &mut probe),
                false => {
                    compare(&ready, &RenderOptions { width: 32, height: 24, samples: 2, ..options }, 1, &mut probe)
                }
            }
        }
    }
}

/// Renders `pairs` times both ways and prints a row.
fn compare(ready: &Ready, options: &RenderOptions, pairs: usize, probe: &mut Probe) {
    let subject = Subject { scene: &ready.scene, accel: &ready.accel, camera: &ready.camera, options };
    let effort = Effort { rounds: pairs, time: Duration::MAX, turn: Duration::ZERO };
    let report = subject.measure(effort, probe, || ()).expect("both ways give one picture");
    let ratio = &report.ratio;
    println!(
        "| {} | {} | {:.2} | {:.2} | {:.2} | {:.2}–{:.2} | {:.2} | {} | {} |",
        ready.name,
        report.threads,
        report.waves.rate.median * 1e-6,
        report.control.rate.median * 1e-6,
        ratio.rate.median,
        ratio.rate.low,
        ratio.rate.high,
        report.cpu_ratio.median,
        pairs,
        ratio.disturbed,
    );
}
