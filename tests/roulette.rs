//! Rays that are traced by lot mean the same picture as those that are always traced; what clamping takes away is said.

mod common;

use comber::film::picture::Picture;
use comber::options::{Cell, Direct, Normals, RenderOptions, Roulette, Sampler};
use common::statistics::{Estimate, Family, regions};
use common::{Ready, assert_same};

const DIRECTS: [Direct; 4] = [Direct::Mis, Direct::Light, Direct::Bsdf, Direct::Hemisphere];

fn small() -> RenderOptions {
    let sampler = Sampler::Independent;
    RenderOptions { width: 32, height: 24, samples: 96, max_depth: 8, sampler, aovs: true, ..RenderOptions::default() }
}

fn ready() -> Ready {
    Ready::course(&common::own("cornell_spheres.dae"), Normals::Flat)
}

fn whole(options: &RenderOptions) -> Cell {
    Cell { x: 0, y: 0, width: options.width, height: options.height }
}

/// By efficiency, from hardly to far too much, on every way to estimate direct light, with and without several light samples.
#[test]
fn every_rule_means_the_same_picture() {
    let ready = ready();
    let off = RenderOptions { roulette: Roulette::Off, samples: 1500, seed: 100, ..small() };
    let control = ready.render(&off).picture;
    let mut family = Family::new("roulette");
    let mut seed = 0;
    for roulette in [0.5, 2.0, 8.0].map(|factor| Roulette::Efficiency { factor }).into_iter().chain([
        Roulette::EFFICIENCY,
        Roulette::THROUGHPUT,
        Roulette::Throughput { start: 0 },
        Roulette::Fixed(0.5),
    ]) {
        for (direct, light_samples) in [(Direct::Mis, 1), (Direct::Mis, 3), (Direct::Light, 1)] {
            seed += 1;
            let options = RenderOptions { roulette, direct, light_samples, seed, samples: 250, ..small() };
            let picture = ready.render(&options).picture;
            for cell in regions(32, 24, 4, 3).into_iter().chain([whole(&options)]) {
                let z = Estimate::of_pixels(&picture, cell, 1).z_from(Estimate::of_pixels(&control, cell, 1));
                family.add(z, format!("{roulette:?} {direct:?} -l {light_samples} {cell:?}"));
            }
        }
    }
    family.check();
}

/// What efficiency means: fewer rays × noise than without. Both figures are repeatable: rays are counted, and noise is that of given seeds.
#[test]
fn efficiency_saves_more_rays_than_it_adds_noise() {
    let ready = ready();
    let work = |roulette: Roulette| {
        let options = RenderOptions { roulette, max_depth: 40, samples: 200, ..small() };
        let outcome = ready.render(&options);
        let rays = outcome.stats.rays;
        let noise = relative_variance(&outcome.picture);
        (noise, (rays.camera + rays.bounce + rays.shadow) as f64)
    };
    let (off, by_efficiency) = (work(Roulette::Off), work(Roulette::EFFICIENCY));
    println!("off: {off:?}, by efficiency: {by_efficiency:?}");
    assert!(by_efficiency.1 < 0.9 * off.1, "fewer rays");
    assert!(by_efficiency.0 * by_efficiency.1 < off.0 * off.1, "and less noise × rays");
}

fn relative_variance(picture: &Picture) -> f64 {
    let variance = picture.variance.as_ref().expect("asked for");
    let of = |(p, v): (&[f32; 3], &[f32; 3])| {
        (0..3).map(|c| f64::from(v[c]) / (f64::from(p[c]).powi(2) + 0.01)).sum::<f64>()
    };
    picture.beauty.iter().zip(variance).map(of).sum()
}

/// Lamps and direct light are not touched; no contribution after two bounces is brighter than the bound, and what is taken away is light.
#[test]
fn clamping_takes_indirect_light_alone() {
    let ready = ready();
    for direct in DIRECTS {
        let base = RenderOptions { direct, roulette: Roulette::Off, samples: 16, ..small() };
        let clamped = |most: Option<f32>, max_depth: u32| {
            ready.render(&RenderOptions { clamp_indirect: most, max_depth, ..base.clone() }).picture
        };
        assert_same(&clamped(Some(1e-3), 1), &clamped(None, 1), &format!("{direct:?}: direct light"));
        assert_same(&clamped(Some(1e30), 4), &clamped(None, 4), &format!("{direct:?}: a bound that nothing reaches"));
        let (all, direct_light) = (clamped(None, 4), clamped(None, 1));
        let some = clamped(Some(1e-2), 4);
        let most_of_a_sample = match direct {
            // A path and its light samples after bounces 2, 3 and 4.
            Direct::Mis => 2.0 * 3.0 * 1e-2,
            _ => 3.0 * 1e-2,
        };
        let mut taken = 0.0;
        for ((all, some), direct_light) in all.beauty.iter().zip(&some.beauty).zip(&direct_light.beauty) {
            for c in 0..3 {
                assert!(some[c] <= all[c] + 1e-5 && some[c] <= direct_light[c] + most_of_a_sample + 1e-5, "{direct:?}");
                taken += f64::from(all[c] - some[c]);
            }
        }
        assert!(taken > 0.0, "{direct:?}: a bound that takes nothing tests nothing");
    }
}

#[test]
fn waves_and_reference_draw_the_same_lots_and_clamp_alike() {
    let ready = ready();
    for direct in DIRECTS {
        for (factor, light_samples) in [(0.5, 1), (1.0, 2), (8.0, 1)] {
            for clamp_indirect in [None, Some(0.02)] {
                let roulette = Roulette::Efficiency { factor };
                let options = RenderOptions { direct, roulette, light_samples, clamp_indirect, samples: 7, ..small() };
                let what = format!("{direct:?} {factor} -l {light_samples} {clamp_indirect:?}");
                let (wave, reference) = (ready.render(&options), ready.reference(&options));
                assert_same(&wave.picture, &reference.picture, &what);
                assert_eq!(wave.stats.rays, reference.rays, "{what}: rays by kind");
            }
        }
    }
}

/// What is learnt beforehand depends on neither threads, waves, samples nor the part of the frame that is rendered.
#[test]
fn a_sample_does_not_depend_on_the_others() {
    let ready = ready();
    let base = RenderOptions { samples: 4, ..small() };
    let all = ready.render(&base).picture;
    for (threads, wave) in [(1, 77), (3, 1000)] {
        let options = RenderOptions { threads: Some(threads), wave: Some(wave), ..base.clone() };
        assert_same(&ready.render(&options).picture, &all, &format!("{threads} {wave}"));
    }
    let cell = Cell { x: 3, y: 5, width: 9, height: 7 };
    let part = ready.render(&RenderOptions { cell: Some(cell), ..base.clone() }).picture;
    for (x, y) in (0..cell.height).flat_map(|y| (0..cell.width).map(move |x| (x, y))) {
        let at = ((cell.y + y) * base.width + cell.x + x) as usize;
        assert_eq!(part.beauty[(y * cell.width + x) as usize], all.beauty[at]);
    }
    // Twice as many samples: the first half of them are the same. The mean of all is that of both halves.
    let one = ready.render(&RenderOptions { samples: 1, ..base.clone() }).picture;
    let two = ready.render(&RenderOptions { samples: 2, ..base.clone() }).picture;
    let second = |at: usize| 2.0 * two.beauty[at][1] - one.beauty[at][1];
    assert!((0..one.beauty.len()).all(|at| second(at) >= -1e-4), "what the second sample adds is light");
}
