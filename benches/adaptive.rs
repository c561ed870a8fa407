//! What the rules of adaptive sampling keep of their promise: bias, coverage of the 95 % interval, samples, error.
//!
//! `cargo bench --bench adaptive [-- SCENE…]` prints two tables in Markdown. The first is of pixels whose samples are drawn from known
//! distributions, so that the true mean is known: *bias* is the mean over pixels minus the truth, in per cent of it, with its z; *covered*
//! is the share of pixels whose interval, after stopping, holds the truth. The second is of scenes, against a long render: error is relative
//! MSE (ε = 0.01) over that of as many samples spread uniformly, of the same sampler, and of Sobol points without replicates, which is what one
//! gets without the option.

mod common;

use comber::drive::{self, Unobserved};
use comber::film::convergence::student_t;
use comber::film::develop::develop;
use comber::film::picture::Picture;
use comber::film::tile::{FilmLayout, Sample, tiles};
use comber::options::{Adaptive, Area, Cell, Confidence, RenderOptions, Sampler, Tests, Trust};
use comber::plan::Plan;
use comber::sampling::random::uniform4;
use common::{Args, Ready};

/// A rule and what it judges by.
struct Rule {
    name: String,
    adaptive: Adaptive,
    sampler: Sampler,
    replicates: u32,
}

fn rules(samplers: &[(Sampler, u32)]) -> Vec<Rule> {
    let base = Adaptive { confidence: Confidence::T, min_samples: 64, ..Adaptive::COURSE };
    let shapes = [
        ("z, once, batches (the course's)", Adaptive { confidence: Confidence::Z, min_samples: 2, ..base }),
        ("t, once, batches", base),
        ("t, once, doubling", Adaptive { tests: Tests::Doubling, ..base }),
        ("t, twice, batches", Adaptive { trust: Trust::Twice, ..base }),
        ("t, twice, doubling", Adaptive { tests: Tests::Doubling, trust: Trust::Twice, ..base }),
        ("t, halves, batches", Adaptive { trust: Trust::Halves, ..base }),
        ("t, halves, doubling", Adaptive { tests: Tests::Doubling, trust: Trust::Halves, ..base }),
        ("t, tile, batches", Adaptive { area: Area::Tile, ..base }),
        ("t, tile, doubling", Adaptive { area: Area::Tile, tests: Tests::Doubling, ..base }),
    ];
    let of = |&(sampler, replicates): &(Sampler, u32)| {
        let with = match sampler {
            Sampler::Independent => "independent".to_owned(),
            _ => format!("Sobol, {replicates} replicates"),
        };
        shapes.map(|(name, adaptive)| Rule { name: format!("{name}; {with}"), adaptive, sampler, replicates })
    };
    samplers.iter().flat_map(of).collect()
}

/// A distribution of samples of mean 1, from a number in [0, 1).
type Draw = fn(f64, f64) -> f64;

const PIXELS: [(&str, Draw); 6] = [
    ("uniform", |u, _| 2.0 * u),
    ("edge: 0.2 or 1.8", |u, _| if u < 0.5 { 0.2 } else { 1.8 }),
    ("exponential", |u, _| -(1.0 - u).ln()),
    ("log-normal, σ = 1.5", |u, v| {
        let normal = (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos();
        (1.5 * normal - 1.125).exp()
    }),
    ("lit once in 50", |u, _| if u < 0.02 { 50.0 } else { 0.0 }),
    ("firefly once in 10⁴", |u, _| 0.5 + if u < 1e-4 { 5000.0 } else { 0.0 }),
];

fn main() {
    let args = Args::parse();
    distributions(if args.measure { 64 } else { 1 }, if args.measure { 1 << 14 } else { 256 });
    for ready in args.scenes().into_iter().filter_map(common::load) {
        match args.measure {
            true => scene(&ready, [64, 48], 4096, 8),
            false => scene(&ready, [16, 12], 128, 2),
        }
    }
}

/// What is known of a set of pixels after stopping.
#[derive(Default)]
struct Known {
    pixels: f64,
    covered: f64,
    samples: f64,
    sum: f64,
    squares: f64,
}

impl Known {
    fn add(&mut self, mean: f64, variance: f64, samples: u32, truth: f64, degrees: u32) {
        self.pixels += 1.0;
        self.samples += f64::from(samples);
        self.sum += mean - truth;
        self.squares += (mean - truth).powi(2);
        self.covered += f64::from((mean - truth).abs() <= student_t(degrees) * variance.sqrt());
    }

    fn bias(&self) -> (f64, f64) {
        let mean = self.sum / self.pixels;
        (mean, mean / ((self.squares / self.pixels - mean * mean) / self.pixels).sqrt())
    }
}

fn degrees(rule: &Rule, samples: u32) -> u32 {
    match rule.replicates {
        1 => samples.saturating_sub(1),
        replicates if rule.adaptive.trust == Trust::Halves => replicates - 2,
        replicates => replicates - 1,
    }
}

/// Tiles of 256 pixels each, all of one distribution, through the film and its rules.
fn distributions(repeats: u32, most: u32) {
    println!("| pixel | rule | samples | bias, % | z | covered, % |\n|---|---|--:|--:|--:|--:|");
    for (what, draw) in PIXELS {
        for rule in rules(&[(Sampler::Independent, 1)]) {
            let mut known = Known::default();
            for seed in 0..repeats {
                let picture = simulate(&rule.adaptive, draw, most, seed);
                for pixel in 0..picture.beauty.len() {
                    let samples = picture.sample_count.as_ref().expect("counts")[pixel];
                    let variance = f64::from(picture.variance.as_ref().expect("variance")[pixel][0]);
                    known.add(f64::from(picture.beauty[pixel][0]), variance, samples, 1.0, degrees(&rule, samples));
                }
            }
            let (bias, z) = known.bias();
            println!(
                "| {what} | {} | {:.0} | {:+.2} | {z:+.1} | {:.1} |",
                rule.name.trim_end_matches("; independent"),
                known.samples / known.pixels,
                100.0 * bias,
                100.0 * known.covered / known.pixels
            );
        }
    }
}

fn simulate(rule: &Adaptive, draw: Draw, most: u32, seed: u32) -> Picture {
    let cell = Cell { x: 0, y: 0, width: 16, height: 16 };
    let options = RenderOptions { width: 16, height: 16, aovs: true, adaptive: Some(*rule), ..Default::default() };
    let mut film = tiles(cell, FilmLayout::new(&options));
    let tile = &mut film[0];
    let mut first = 0;
    while first < most && !tile.active.is_empty() {
        let step = rule.step(first).min(most - first);
        for local in tile.active.clone() {
            let (from, stride, count) = tile.wanted(local as usize, first, step);
            for index in (0..count).map(|k| from + k * stride) {
                let [u, v, ..] = uniform4(local, index, 0, seed).map(f64::from);
                let radiance = [draw(u, v) as f32; 3];
                tile.add(local as usize, index, &Sample { radiance, ..Sample::default() });
            }
        }
        tile.retire(rule);
        first += step;
    }
    develop(&film, cell, (16, 16))
}

/// A scene, against a long render of its own.
fn scene(ready: &Ready, [width, height]: [u32; 2], most: u32, seeds: u32) {
    let options = RenderOptions { width, height, aovs: true, ..RenderOptions::default() };
    let render = |options: &RenderOptions| {
        let plan = Plan::new(&ready.scene, &ready.accel, options).expect("a plan");
        drive::render(&ready.scene, &ready.accel, &ready.camera, &plan, &Unobserved).expect("a render").picture
    };
    let truth = render(&RenderOptions { samples: 4 * most, seed: 1_000_000, ..options.clone() }).beauty;
    println!("\n{}, {width} × {height} pixels, at most {most} samples, tolerance 0.05, {seeds} seeds\n", ready.name);
    println!(
        "| rule | samples | bias, % | z | covered, % | error ÷ uniform | ÷ uniform Sobol |\n|---|--:|--:|--:|--:|--:|--:|"
    );
    let error = |picture: &Picture| {
        let squares = picture.beauty.iter().zip(&truth).flat_map(|(got, truth)| {
            got.iter().zip(truth).map(|(&g, &t)| f64::from(g - t).powi(2) / (f64::from(t).powi(2) + 0.01))
        });
        squares.sum::<f64>() / (3 * truth.len()) as f64
    };
    for rule in rules(&[(Sampler::Independent, 1), (Sampler::Sobol, 16), (Sampler::Sobol, 32)]) {
        let (mut known, mut mine, mut means) = (Known::default(), 0.0, Vec::new());
        for seed in 0..seeds {
            let picture = render(&RenderOptions {
                samples: most,
                seed,
                adaptive: Some(rule.adaptive),
                sampler: rule.sampler,
                replicates: rule.replicates,
                ..options.clone()
            });
            mine += error(&picture) / f64::from(seeds);
            let before = known.sum;
            for pixel in 0..picture.beauty.len() {
                let samples = picture.sample_count.as_ref().expect("counts")[pixel];
                let variance = f64::from(picture.variance.as_ref().expect("variance")[pixel][1]);
                let (mean, truth) = (f64::from(picture.beauty[pixel][1]), f64::from(truth[pixel][1]));
                // Nothing is random where the lamp or nothing is seen.
                if variance > 0.0 {
                    known.add(mean, variance, samples, truth, degrees(&rule, samples));
                }
            }
            means.push(known.sum - before);
        }
        let samples = known.samples / known.pixels;
        let uniform = |sampler| {
            let samples = (samples.round() as u32).max(1);
            let of =
                |seed: u32| error(&render(&RenderOptions { samples, seed: 77 + seed, sampler, ..options.clone() }));
            (0..2u32).map(of).sum::<f64>() / 2.0
        };
        let (same, sobol) = (uniform(rule.sampler), uniform(Sampler::Sobol));
        let light: f64 = truth.iter().map(|t| f64::from(t[1])).sum();
        let mean = means.iter().sum::<f64>() / f64::from(seeds);
        let spread =
            means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / f64::from(seeds.max(2) - 1) / f64::from(seeds);
        println!(
            "| {} | {samples:.0} | {:+.3} | {:+.1} | {:.1} | {:.2} | {:.2} |",
            rule.name,
            100.0 * mean / light,
            mean / spread.sqrt(),
            100.0 * known.covered / known.pixels,
            mine / same,
            mine / sobol
        );
    }
}
