//! Pixels that share paths, and lamps that are looked at by rays of their own, mean the same picture, with less noise.

mod common;

use comber::film::picture::Picture;
use comber::options::{Accel, AccelOptions, Cell, Direct, Integrator, Normals, RenderOptions, Roulette, Sampler, Simd};
use comber::plan::Plan;
use common::statistics::{Estimate, Family, regions};
use common::{Ready, assert_same, own};

fn ready(name: &str) -> Ready {
    Ready::course(&own(name), Normals::Smooth)
}

/// A frame whose sides are no multiples of a tile's.
fn small() -> RenderOptions {
    RenderOptions { width: 37, height: 28, samples: 12, ..RenderOptions::default() }
}

/// Mean of a channel over a part of each picture.
fn means(pictures: &[Picture], cell: Cell, channel: usize) -> Vec<f64> {
    let mean = |picture: &Picture| {
        let pixels = (cell.y..cell.y + cell.height).flat_map(|y| (cell.x..cell.x + cell.width).map(move |x| [x, y]));
        let pixels = pixels.map(|[x, y]| (x as usize, y as usize));
        let values: Vec<f64> = pixels.map(|(x, y)| f64::from(picture.beauty[y * picture.width + x][channel])).collect();
        values.iter().sum::<f64>() / values.len() as f64
    };
    pictures.iter().map(mean).collect()
}

fn renders(ready: &Ready, options: &RenderOptions, seeds: std::ops::Range<u32>) -> Vec<Picture> {
    seeds.map(|seed| ready.render(&RenderOptions { seed, ..options.clone() }).picture).collect()
}

/// Mean over pixels of the variance between pictures, relative as relMSE is, but to no less than `floor`.
fn noise(pictures: &[Picture], floor: f64) -> f64 {
    let pixels = pictures[0].beauty.len();
    let of = |pixel: usize| {
        let values: Vec<f64> = pictures.iter().map(|picture| f64::from(picture.beauty[pixel][1])).collect();
        let estimate = Estimate::of(&values);
        estimate.error.powi(2) * values.len() as f64 / (estimate.mean.powi(2) + floor)
    };
    (0..pixels).map(of).sum::<f64>() / pixels as f64
}

/// Pictures of other seeds are independent, whatever their pixels share: their means over parts of the frame are compared.
#[test]
fn sharing_means_the_same_picture() {
    let mut family = Family::new("what pixels share");
    for name in ["cornell_spheres.dae", "cornell_mesh.dae"] {
        let ready = ready(name);
        let mut compare = |with: &RenderOptions, what: &str| {
            let without = RenderOptions { reuse: 1, lamp_rays: 1, samples: 40, ..with.clone() };
            let (some, all) = (renders(&ready, with, 0..16), renders(&ready, &without, 100..116));
            let whole = Cell { x: 0, y: 0, width: 37, height: 28 };
            for cell in regions(37, 28, 3, 2).into_iter().chain([whole]) {
                for channel in [0, 1] {
                    let [a, b] = [&some, &all].map(|pictures| Estimate::of(&means(pictures, cell, channel)));
                    family.add(a.z_from(b), format!("{name}, {what}, {cell:?}, channel {channel}"));
                }
            }
        };
        for reuse in [2, 16, 64] {
            compare(&RenderOptions { reuse, ..small() }, &format!("reuse {reuse}"));
        }
        let shared = RenderOptions { reuse: 16, lamp_rays: 5, ..small() };
        compare(&RenderOptions { reuse: 1, ..shared.clone() }, "lamp rays");
        for direct in [Direct::Light, Direct::Bsdf, Direct::Hemisphere] {
            let samples = if direct == Direct::Light { 12 } else { 40 };
            compare(&RenderOptions { direct, samples, ..shared.clone() }, &format!("{direct:?}"));
        }
        for roulette in [Roulette::Off, Roulette::Fixed(0.5), Roulette::Throughput { start: 0 }] {
            compare(&RenderOptions { roulette, ..shared.clone() }, &format!("{roulette:?}"));
        }
        compare(&RenderOptions { max_depth: 2, ..shared.clone() }, "one indirect bounce");
        compare(&RenderOptions { integrator: Integrator::IndirectOnly, ..shared.clone() }, "indirect light alone");
        compare(&RenderOptions { sampler: Sampler::Independent, ..shared.clone() }, "independent numbers");
        compare(&RenderOptions { sampler: Sampler::BlueNoise, ..shared.clone() }, "blue noise");
        compare(&RenderOptions { light_samples: 3, replicates: 4, ..shared }, "three light samples, four replicates");
    }
    family.check();
}

/// How much less noise, of given seeds, is repeatable.
#[test]
fn sharing_takes_noise_away() {
    let ready = ready("cornell_mesh.dae");
    let of = |options: RenderOptions, floor: f64| noise(&renders(&ready, &options, 0..6), floor);
    let base = RenderOptions { width: 64, height: 48, ..small() };
    let alone = of(base.clone(), 0.01);
    let mut before = alone;
    for (reuse, least) in [(4, 1.5), (16, 3.5)] {
        let shared = of(RenderOptions { reuse, ..base.clone() }, 0.01);
        println!("blocks of {reuse}: 1/{:.2} of the relative variance", alone / shared);
        assert!(shared < before && alone / shared > least, "{alone} → {shared}");
        before = shared;
    }
    // Emission alone: what is left is the edges of the lamp.
    let lamps = RenderOptions { integrator: Integrator::ZeroBounce, ..base };
    let [one, sixteen] = [1, 16].map(|lamp_rays| of(RenderOptions { lamp_rays, ..lamps.clone() }, 1e9));
    println!("16 lamp rays: 1/{:.0} of the variance", one / sixteen);
    assert!(one / sixteen > 16.0, "{one} → {sixteen}");
}

#[test]
fn how_the_work_is_cut_changes_no_bit() {
    for name in ["cornell_spheres.dae", "cornell_mesh.dae"] {
        let ready = ready(name);
        let options = RenderOptions {
            reuse: 16,
            lamp_rays: 3,
            samples: 19,
            threads: Some(1),
            wave: Some(256),
            simd: Simd::Baseline,
            aovs: true,
            ..small()
        };
        let expected = ready.render(&options);
        for (threads, wave) in [(1, 257), (2, 256), (2, 1000), (5, 4096), (2, 1 << 15)] {
            for simd in [Simd::Baseline, Simd::Auto] {
                let varied = RenderOptions { threads: Some(threads), wave: Some(wave), simd, ..options.clone() };
                let outcome = ready.render(&varied);
                assert_same(
                    &outcome.picture,
                    &expected.picture,
                    &format!("{threads} threads, waves of {wave}, {simd:?}"),
                );
                assert_eq!(outcome.stats.rays, expected.stats.rays);
            }
        }
    }
}

/// Samples of a pixel are the same whatever their number, and so are pictures that were made bit by bit.
#[test]
fn one_thread_of_samples_is_the_beginning_of_more() {
    let ready = ready("cornell_mesh.dae");
    let options = RenderOptions { reuse: 8, lamp_rays: 2, width: 16, height: 16, samples: 1, ..small() };
    let [one, two] = [1, 2].map(|samples| ready.render(&RenderOptions { samples, ..options.clone() }).picture);
    let second: Vec<f32> = one.beauty.iter().zip(&two.beauty).map(|(a, b)| 2.0 * b[1] - a[1]).collect();
    assert!(second.iter().all(|&value| value > -1e-5), "a second sample is not negative");
    assert!(second.iter().zip(&one.beauty).any(|(b, a)| *b != a[1]), "nor the first again");
}

#[test]
fn what_does_not_go_together_is_refused() {
    let ready = ready("cornell_mesh.dae");
    let shared = RenderOptions { reuse: 16, ..small() };
    let refused = |options: RenderOptions| Plan::new(&ready.scene, &ready.accel, &options).unwrap_err().to_string();
    assert!(refused(RenderOptions { wave: Some(255), ..shared.clone() }).contains("does not hold a tile"));
    assert!(refused(RenderOptions { clamp_indirect: Some(1.0), ..shared.clone() }).contains("clamp-indirect"));
    let adaptive = Some(comber::options::Adaptive::COURSE);
    assert!(refused(RenderOptions { adaptive, ..shared.clone() }).contains("adaptive"));
    // Where no second vertex scatters anything, nothing is shared, and any wave will do.
    let plan = Plan::new(&ready.scene, &ready.accel, &RenderOptions { max_depth: 1, wave: Some(1), ..shared }).unwrap();
    assert!(plan.stages.iter().all(|stage| stage.name != "reuse"));
}

/// The twin of every way through the tree: all primitives, one after another.
#[test]
fn the_structure_that_answers_rays_changes_no_bit() {
    let name = "cornell_mesh.dae";
    let options = RenderOptions { reuse: 16, lamp_rays: 3, ..small() };
    let tree = ready(name).render(&options).picture;
    let brute = ready(name)
        .with_accel(Accel::Brute)
        .render(&RenderOptions { accel: AccelOptions::of(Accel::Brute), ..options });
    assert_same(&brute.picture, &tree, "brute force");
}
