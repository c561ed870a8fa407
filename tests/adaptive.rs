//! Adaptive sampling through the renderer: which pixels stop when, what they then hold, and what stopping costs in bias.

mod common;

use comber::drive::{self, Observer, Outcome};
use comber::film::convergence::{student_t, zeros_needed};
use comber::film::picture::Picture;
use comber::options::{Adaptive, Confidence, Direct, Integrator, Normals, RenderOptions};
use comber::plan::Plan;
use comber::scene::description::SceneDescription;
use common::statistics::{ALPHA, Estimate, student};
use common::{Ready, make, own};
use glam::Vec3;
use std::collections::BTreeSet;
use std::sync::atomic::{AtomicU64, Ordering};

const RULE: Adaptive =
    Adaptive { batch: 8, tolerance: 0.1, confidence: Confidence::T, min_samples: 16, ..Adaptive::COURSE };

fn small() -> RenderOptions {
    RenderOptions { width: 40, height: 28, samples: 100, aovs: true, ..RenderOptions::default() }
}

fn adaptive(rule: Adaptive, options: &RenderOptions) -> RenderOptions {
    RenderOptions { adaptive: Some(rule), ..options.clone() }
}

fn counts(picture: &Picture) -> &[u32] {
    picture.sample_count.as_deref().expect("counts")
}

/// A grey floor below a grey light, and nothing behind: luminance is any channel, and half of the frame is black.
fn grey_scene() -> Ready {
    let mut scene = SceneDescription::default();
    let floor = make::grey(&mut scene, 0.6, 0.0);
    make::quads(&mut scene, &[[Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0]], floor);
    make::sphere(&mut scene, Vec3::new(0.3, 0.4, 0.2), 0.4, floor);
    make::light(&mut scene, [Vec3::new(-0.6, 1.8, -0.6), Vec3::X, Vec3::Z], 4.0);
    let camera = make::camera(Vec3::new(2.0, 1.3, 3.5), Vec3::new(0.0, 0.7, 0.0), 0.8, 0.56);
    Ready::new(scene, camera, Normals::Flat)
}

/// Half-width of the interval over what it may be: at most 1 means done.
fn width(rule: &Adaptive, n: u32, mean: f64, variance_of_mean: f64) -> f64 {
    let quantile = match rule.confidence {
        Confidence::Z => 1.959_963_984_540_054,
        Confidence::T => student_t(n - 1),
    };
    quantile * variance_of_mean.sqrt() / (f64::from(rule.tolerance) * mean.hypot(rule.floor.into()))
}

#[test]
fn every_pixel_stops_at_the_first_test_that_it_passes() {
    let ready = grey_scene();
    for confidence in [Confidence::Z, Confidence::T] {
        for (batch, min_samples) in [(8, 2), (8, 16), (8, 20), (30, 2), (7, 50)] {
            let rule = Adaptive { batch, min_samples, confidence, ..RULE };
            let outcome = ready.render(&adaptive(rule, &small()));
            let got = &outcome.picture;
            // What every pixel would hold at each test, without a rule.
            let tests: Vec<u32> = (1..).map(|k| k * batch).take_while(|&n| n < 100).chain([100]).collect();
            let at: Vec<Picture> =
                tests.iter().map(|&samples| ready.render(&RenderOptions { samples, ..small() }).picture).collect();
            let (mut done, mut lit, mut unclear) = (0, 0, 0);
            for pixel in 0..got.beauty.len() {
                let value = |k: usize| f64::from(at[k].beauty[pixel][0]);
                let variance = |k: usize| f64::from(at[k].variance.as_ref().expect("variance")[pixel][0]);
                let passes = |k: usize| {
                    let n = tests[k];
                    match (value(k), variance(k)) {
                        _ if n < min_samples.max(2) => f64::INFINITY,
                        (0.0, 0.0) if n < zeros_needed(&rule) => f64::INFINITY,
                        (mean, variance) => width(&rule, n, mean, variance),
                    }
                };
                let widths: Vec<f64> = (0..tests.len()).map(passes).collect();
                // Layers are rounded to single precision: a width that near the limit may have gone either way.
                if widths.iter().any(|w| (w - 1.0).abs() < 1e-5) {
                    unclear += 1;
                    continue;
                }
                let stop = widths.iter().position(|&w| w <= 1.0).unwrap_or(tests.len() - 1);
                assert_eq!(counts(got)[pixel], tests[stop], "pixel {pixel}, {rule:?}");
                assert_eq!(got.beauty[pixel], at[stop].beauty[pixel], "pixel {pixel}: the mean of those samples");
                done += u64::from(widths[stop] <= 1.0);
                lit += u64::from(widths[stop] <= 1.0 && got.beauty[pixel][0] > 0.0);
            }
            assert!(unclear <= 3, "{unclear}");
            assert!((done..=done + unclear).contains(&outcome.stats.converged_pixels));
            println!(
                "batch {batch}, at least {min_samples}, {confidence:?}: {done} of 1120 pixels stopped, {lit} of them lit"
            );
            let distinct: BTreeSet<u32> = counts(got).iter().copied().collect();
            assert!(distinct.len() > 2 && distinct.contains(&100), "some stop, some never: {distinct:?}");
        }
    }
}

#[test]
fn counts_are_whole_batches_between_the_least_and_the_most() {
    let ready = Ready::course(&own("cornell_spheres.dae"), Normals::Smooth);
    for (batch, min_samples, samples) in [(1, 2, 20), (1, 10, 20), (7, 2, 100), (7, 30, 100), (16, 17, 64), (64, 2, 50)]
    {
        for confidence in [Confidence::Z, Confidence::T] {
            let rule = Adaptive { batch, min_samples, confidence, tolerance: 0.3, ..Adaptive::COURSE };
            let options = RenderOptions { samples, ..small() };
            let outcome = ready.render(&adaptive(rule, &options));
            for &n in counts(&outcome.picture) {
                assert!(n <= samples && n >= min_samples.min(samples), "{n} {rule:?}");
                assert!(n % batch == 0 || n == samples, "{n} {rule:?}");
            }
            let sum: u64 = counts(&outcome.picture).iter().map(|&n| u64::from(n)).sum();
            assert_eq!(sum, outcome.stats.samples, "{rule:?}");
            if batch >= samples {
                let plain = ready.render(&options).picture;
                assert_eq!(plain.beauty, outcome.picture.beauty, "a rule that is never asked changes nothing");
            }
        }
    }
}

#[test]
fn a_black_background_stops_when_it_is_surely_black() {
    let mut scene = SceneDescription::default();
    let lit = make::grey(&mut scene, 0.0, 1.0);
    make::sphere(&mut scene, Vec3::ZERO, 1.0, lit);
    let camera = make::camera(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, 0.8, 0.56);
    let ready = Ready::new(scene, camera, Normals::Flat);
    for (batch, min_samples) in [(8, 2), (20, 2), (8, 100), (30, 32)] {
        let rule = Adaptive { batch, min_samples, ..RULE };
        let picture = ready.render(&adaptive(rule, &RenderOptions { samples: 4000, ..small() })).picture;
        let depth = picture.depth.as_ref().expect("depth");
        let (mut background, mut light) = (0, 0);
        for (pixel, &n) in counts(&picture).iter().enumerate() {
            if depth[pixel].is_infinite() {
                assert_eq!(n, zeros_needed(&rule).next_multiple_of(batch), "background");
                assert_eq!(picture.beauty[pixel], [0.0; 3]);
                background += 1;
            } else if picture.beauty[pixel] == [1.0; 3] {
                assert_eq!(n, min_samples.next_multiple_of(batch), "emission without any spread");
                light += 1;
            }
        }
        assert!(background > 400 && light > 50, "{background} {light}");
    }
}

#[test]
fn the_wider_interval_never_stops_first() {
    let ready = grey_scene();
    let mut extra = Vec::new();
    for batch in [2, 4, 32] {
        let [z, t] = [Confidence::Z, Confidence::T].map(|confidence| {
            let rule = Adaptive { batch, min_samples: 2, confidence, tolerance: 0.1, ..Adaptive::COURSE };
            ready.render(&adaptive(rule, &RenderOptions { samples: 256, ..small() })).picture
        });
        let pairs = counts(&z).iter().zip(counts(&t));
        assert!(pairs.clone().all(|(z, t)| z <= t));
        let mean = |picture| counts(picture).iter().map(|&n| f64::from(n)).sum::<f64>() / 1120.0;
        println!("batch {batch}: z takes {:.1} samples a pixel, t {:.1}", mean(&z), mean(&t));
        extra.push(mean(&t) / mean(&z));
    }
    // Two samples tell z what they do not tell t, whose quantile is then 12.7; at 32 the quantiles are 1.96 and 2.04.
    assert!(extra[0] > extra[1] && extra[1] > extra[2] && extra[2] >= 1.0, "{extra:?}");
}

/// Bias of adaptive means and how often they are as near as the rule says, against many samples of the same pixels.
#[test]
fn stopping_when_it_looks_good_costs_little() {
    let ready = grey_scene();
    let options =
        RenderOptions { width: 20, height: 14, integrator: Integrator::OneBounce, direct: Direct::Light, ..small() };
    let truth = ready.render(&RenderOptions { samples: 20_000, seed: 1000, ..options.clone() }).picture;
    // Pixels without light have nothing to be near to.
    let lit: Vec<usize> = (0..truth.beauty.len()).filter(|&i| truth.beauty[i][0] > 0.01).collect();
    for (confidence, batch) in [(Confidence::T, 16), (Confidence::Z, 16), (Confidence::T, 4)] {
        let rule = Adaptive { batch, min_samples: batch, confidence, tolerance: 0.1, ..Adaptive::COURSE };
        let (mut biases, mut covered) = (Vec::new(), Vec::new());
        for seed in 0..40 {
            let picture =
                ready.render(&adaptive(rule, &RenderOptions { samples: 2000, seed, ..options.clone() })).picture;
            let off = |&i: &usize| f64::from(picture.beauty[i][0]) / f64::from(truth.beauty[i][0]) - 1.0;
            let offs: Vec<f64> = lit.iter().map(off).collect();
            let near = offs.iter().filter(|off| off.abs() <= f64::from(rule.tolerance)).count();
            biases.push(Estimate::of(&offs).mean);
            covered.push(near as f64 / offs.len() as f64);
        }
        // Welch: the truth's own standard error, in the mean over pixels, is part of the difference's.
        let errors = lit.iter().map(|&i| {
            let variance = f64::from(truth.variance.as_ref().expect("variance")[i][0]);
            variance / f64::from(truth.beauty[i][0]).powi(2)
        });
        let of_truth = errors.sum::<f64>().sqrt() / lit.len() as f64;
        let (bias, coverage) = (Estimate::of(&biases), Estimate::of(&covered));
        let error = bias.error.hypot(of_truth);
        println!(
            "{confidence:?}, batch {batch}: bias {:+.2} ± {:.2} % of the pixel, within 10 % in {:.1} ± {:.1} % of pixels",
            bias.mean * 100.0,
            error * 100.0,
            coverage.mean * 100.0,
            coverage.error * 100.0
        );
        let quantile = student(ALPHA, biases.len());
        // The whole confidence interval of the bias lies within a fifth of the tolerance.
        let most = f64::from(rule.tolerance) / 5.0;
        assert!(bias.mean.abs() + quantile * error < most, "{confidence:?}: bias {bias:?}");
        assert!(coverage.mean - quantile * coverage.error > 0.9, "{confidence:?}: {coverage:?}");
    }
}

/// Asks to stop once so many samples are done.
struct StopAfter {
    limit: u64,
    done: AtomicU64,
    total: AtomicU64,
}

impl Observer for StopAfter {
    fn samples(&self, done: u64, total: u64) {
        self.done.fetch_max(done, Ordering::Relaxed);
        self.total.fetch_max(total, Ordering::Relaxed);
    }

    fn stop(&self) -> bool {
        self.done.load(Ordering::Relaxed) >= self.limit
    }
}

fn stopped_after(ready: &Ready, options: &RenderOptions, limit: u64) -> Outcome {
    let observer = StopAfter { limit, done: AtomicU64::new(0), total: AtomicU64::new(0) };
    let plan = Plan::new(&ready.scene, &ready.accel, options).expect("plan");
    let outcome = drive::render(&ready.scene, &ready.accel, &ready.camera, &plan, &observer).expect("render");
    assert_eq!(observer.done.into_inner(), outcome.stats.samples, "all that was reported was kept");
    assert!(outcome.stats.samples <= observer.total.into_inner());
    outcome
}

#[test]
fn a_stopped_render_holds_the_first_samples_of_each_pixel() {
    let ready = grey_scene();
    for rule in [None, Some(RULE)] {
        for threads in [1, 3] {
            // Waves of 100 rows cut through pixels.
            let options =
                RenderOptions { adaptive: rule, threads: Some(threads), wave: Some(100), samples: 40, ..small() };
            let whole = ready.render(&options);
            for limit in [0, 1, 5000, 20_000] {
                let outcome = stopped_after(&ready, &options, limit);
                let picture = &outcome.picture;
                let what = format!("{rule:?} {threads} threads, stopped after {limit}");
                assert!(outcome.stopped, "{what}");
                assert!(outcome.stats.samples >= limit && outcome.stats.samples < whole.stats.samples, "{what}");
                let sum: u64 = counts(picture).iter().map(|&n| u64::from(n)).sum();
                assert_eq!(sum, outcome.stats.samples, "{what}");
                assert_eq!(outcome.stats.samples, outcome.stats.rays.camera, "{what}");
                let (least, most) = (counts(picture).iter().min(), counts(picture).iter().max());
                let (fewest, mean, top) = outcome.stats.samples_per_pixel;
                assert_eq!((least, most), (Some(&fewest), Some(&top)), "{what}");
                assert!((mean - sum as f64 / 1120.0).abs() < 1e-9, "{what}");
                let distinct: BTreeSet<u32> = counts(picture).iter().copied().collect();
                for n in distinct {
                    // A plan takes no fewer than one sample: pixels without any are black.
                    let same = (n > 0).then(|| {
                        ready.render(&RenderOptions { samples: n, adaptive: None, ..options.clone() }).picture
                    });
                    for (pixel, _) in counts(picture).iter().enumerate().filter(|(_, count)| **count == n) {
                        let expected = same.as_ref().map_or([0.0; 3], |same| same.beauty[pixel]);
                        assert_eq!(picture.beauty[pixel], expected, "{what}: pixel {pixel} with {n} samples");
                    }
                }
            }
            let outcome = stopped_after(&ready, &options, u64::MAX);
            assert!(!outcome.stopped);
            assert_eq!(outcome.picture.beauty, whole.picture.beauty);
        }
    }
}
