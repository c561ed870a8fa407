//! What the rules of adaptive sampling keep of their promise: bias, coverage of the 95 % interval, samples, error.
//!
//! `cargo bench --bench adaptive [-- distributions | SCENE…]` prints two tables in Markdown. The first is of pixels whose samples are drawn from known
//! distributions, so that the true mean is known: *bias* is the mean over pixels minus the truth, in per cent of it, with its z (by tiles); *covered*
//! is the share of pixels whose interval, by their variance after stopping, holds the truth – with one sequence of Sobol points that variance is an upper bound –,
//! *within* the share of those that the rule has stopped that are as near to the truth as the tolerance says. The second is of scenes, against a long render: error is
//! relative MSE (ε = 0.01) over that of as many rays spent evenly, with the same numbers, and with a single Sobol sequence, which is what one gets without the option.

mod common;
#[path = "../tests/common/known_pixels.rs"]
mod known_pixels;

use comber::drive::{self, Outcome, Unobserved};
use comber::film::picture::Picture;
use comber::options::{Adaptive, Area, Confidence, RenderOptions, Sampler, Tests, Trust};
use comber::plan::Plan;
use common::{Args, Ready};
use known_pixels::{Ended, KINDS, Known, Rule};

/// The default rule, but for tests that begin after 64 samples.
const TILE: Adaptive = Adaptive {
    confidence: Confidence::T,
    min_samples: 64,
    area: Area::Tile,
    floor: Adaptive::FLOOR,
    ..Adaptive::COURSE
};

fn rule(name: &str, adaptive: Adaptive, (sampler, replicates): (Sampler, u32)) -> Rule {
    let with = match (sampler, replicates) {
        (Sampler::Independent, _) => "independent".to_owned(),
        (_, 1) => "Sobol".to_owned(),
        _ => format!("Sobol, {replicates} replicates"),
    };
    Rule { name: format!("{name}; {with}"), adaptive, sampler, replicates }
}

/// Every rule for independent numbers, and the default one for others.
fn all_rules() -> Vec<Rule> {
    let base = Adaptive { area: Area::Pixel, floor: Adaptive::DARK, ..TILE };
    let shapes = [
        ("z, once, batches (the course's)", Adaptive { confidence: Confidence::Z, min_samples: 2, ..base }),
        ("t, once, batches", base),
        ("t, once, doubling", Adaptive { tests: Tests::Doubling, ..base }),
        ("t, twice, batches", Adaptive { trust: Trust::Twice, ..base }),
        ("t, twice, doubling", Adaptive { tests: Tests::Doubling, trust: Trust::Twice, ..base }),
        ("t, halves, batches", Adaptive { trust: Trust::Halves, ..base }),
        ("t, halves, doubling", Adaptive { tests: Tests::Doubling, trust: Trust::Halves, ..base }),
        ("t, tile, batches", TILE),
        ("t, tile, doubling", Adaptive { tests: Tests::Doubling, ..TILE }),
    ];
    let independent = shapes.map(|(name, adaptive)| rule(name, adaptive, (Sampler::Independent, 1)));
    let tiles = [("t, tile, batches", TILE), ("t, tile, doubling", Adaptive { tests: Tests::Doubling, ..TILE })];
    let sobol = tiles.map(|(name, adaptive)| rule(name, adaptive, (Sampler::Sobol, 1)));
    independent.into_iter().chain(sobol).collect()
}

/// Those that are tried on scenes, where each takes long.
fn few_rules() -> Vec<Rule> {
    let course =
        Adaptive { area: Area::Pixel, floor: Adaptive::DARK, confidence: Confidence::Z, min_samples: 2, ..TILE };
    let (course, once) =
        (("z, each pixel (the course's)", course), ("t, each pixel", Adaptive { area: Area::Pixel, ..TILE }));
    let tile = ("t, tile", TILE);
    let deep = ("t, tile, floor 1.5e-4", Adaptive { floor: Adaptive::DARK, ..TILE });
    let doubling = ("t, tile, doubling", Adaptive { tests: Tests::Doubling, ..TILE });
    let [independent, one, four, many] =
        [(Sampler::Independent, 1), (Sampler::Sobol, 1), (Sampler::Sobol, 4), (Sampler::Sobol, 16)];
    let pairs = [
        (course, independent),
        (once, independent),
        (deep, independent),
        (tile, independent),
        (course, many),
        (once, many),
        (tile, many),
        (tile, four),
        (deep, one),
        (doubling, one),
        (tile, one),
    ];
    pairs.map(|((name, adaptive), with)| rule(name, adaptive, with)).into()
}

/// All that the project has, and what it renders when nothing is said.
const SCENES: [&str; 6] =
    ["cornell_empty", "cornell_mesh", "cornell_quad_light", "cornell_spheres", "cornell_transforms", "default"];

fn main() {
    let args = Args::parse();
    if args.chosen("distributions") {
        distributions(if args.measure { 32 } else { 2 }, if args.measure { 1 << 14 } else { 256 });
    }
    let scenes = if args.measure { &SCENES[..] } else { &SCENES[..1] };
    for ready in scenes.iter().filter(|name| args.chosen(name)).filter_map(|name| common::load(name)) {
        match args.measure {
            true => scene(&ready, [64, 48], 1024, 4),
            false => scene(&ready, [16, 12], 128, 2),
        }
    }
}

/// Tiles of 256 pixels each, all of one distribution, through the film and its rules.
fn distributions(tiles: u32, most: u32) {
    println!("| pixel | rule | samples | bias, % | z | covered, % | within, % |\n|---|---|--:|--:|--:|--:|--:|");
    for kind in &KINDS {
        for rule in all_rules() {
            let known = known_pixels::known(kind, &rule, tiles, most);
            let (bias, z) = known.bias();
            println!(
                "| {} | {} | {:.0} | {:+.2} | {z:+.1} | {:.1} | {:.1} |",
                kind.name,
                rule.name,
                known.samples(),
                100.0 * bias,
                100.0 * known.covered(),
                100.0 * known.within()
            );
        }
    }
}

/// A scene, against a long render of its own.
fn scene(ready: &Ready, [width, height]: [u32; 2], most: u32, seeds: u32) {
    let options = RenderOptions { width, height, aovs: true, ..RenderOptions::default() };
    let render = |options: &RenderOptions| -> Outcome {
        let plan = Plan::new(&ready.scene, &ready.accel, options).expect("a plan");
        drive::render(&ready.scene, &ready.accel, &ready.camera, &plan, &Unobserved).expect("a render")
    };
    let truth = render(&RenderOptions { samples: 16 * most, seed: 1_000_000, ..options.clone() }).picture.beauty;
    println!("\n{}, {width} × {height} pixels, at most {most} samples, {seeds} seeds\n", ready.name);
    println!(
        "| rule | tolerance | samples | bias, % | z | covered, % | within, % | error ÷ evenly spread | ÷ evenly spread Sobol |"
    );
    println!("|---|--:|--:|--:|--:|--:|--:|--:|--:|");
    let error = |picture: &Picture| {
        let squares = picture.beauty.iter().zip(&truth).flat_map(|(got, truth)| {
            got.iter().zip(truth).map(|(&g, &t)| f64::from(g - t).powi(2) / (f64::from(t).powi(2) + 0.01))
        });
        squares.sum::<f64>() / (3 * truth.len()) as f64
    };
    // Errors of evenly spread samples, of which there are as many as make so many rays.
    let even = |sampler: Sampler, replicates: u32, rays: f64| {
        let with = |samples: u32, seed: u32| {
            render(&RenderOptions { samples, sampler, replicates, seed: 77 + seed, ..options.clone() })
        };
        let each = with(64, 0).stats.rays.all() as f64 / 64.0;
        let samples = ((rays / each).round() as u32).max(replicates.max(2));
        (0..seeds).map(|seed| error(&with(samples, seed).picture)).sum::<f64>() / f64::from(seeds)
    };
    let tolerances = |rule: &Rule| match (rule.name.as_str(), most) {
        ("t, tile; Sobol", _) => vec![0.02, 0.05, 0.1, 0.2],
        _ => vec![0.05],
    };
    for (rule, tolerance) in
        few_rules().into_iter().flat_map(|r| tolerances(&r).into_iter().map(move |t| (r.clone(), t)))
    {
        let rule = Rule { adaptive: Adaptive { tolerance, ..rule.adaptive }, ..rule };
        let (mut known, mut mine, mut rays) = (Known::default(), 0.0, 0.0);
        for seed in 0..seeds {
            let Outcome { picture, stats, .. } =
                render(&RenderOptions { width, height, samples: most, seed, ..rule.options() });
            mine += error(&picture) / f64::from(seeds);
            rays += stats.rays.all() as f64 / f64::from(seeds);
            for (pixel, true_colour) in truth.iter().enumerate() {
                let ended = Ended {
                    mean: f64::from(picture.beauty[pixel][1]),
                    variance: f64::from(picture.variance.as_ref().expect("variance")[pixel][1]),
                    samples: picture.sample_count.as_ref().expect("counts")[pixel],
                };
                // Nothing is random where the lamp or nothing is seen.
                if ended.variance > 0.0 {
                    known.add(&rule, &ended, f64::from(true_colour[1]), most);
                }
            }
            known.close();
        }
        let (bias, z) = known.bias();
        println!(
            "| {} | {tolerance} | {:.0} | {:+.3} | {z:+.1} | {:.1} | {:.1} | {:.2} | {:.2} |",
            rule.name,
            known.samples(),
            100.0 * bias,
            100.0 * known.covered(),
            100.0 * known.within(),
            mine / even(rule.sampler, rule.replicates, rays),
            mine / even(Sampler::Sobol, 1, rays)
        );
    }
}
