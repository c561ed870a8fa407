//! Waves and the depth-first reference integrator draw the same random numbers: they agree to the bit, in every layer.

mod common;

use comber::options::{
    AccelOptions, Adaptive, Area, Confidence, Direct, Integrator, LightSampling, LightSelection, Normals, Precision,
    RenderOptions, Roulette, Sampler, Tests, Trust,
};
use common::{Ready, assert_same, own_scenes};

fn small() -> RenderOptions {
    RenderOptions { width: 52, height: 39, samples: 9, ..RenderOptions::default() }
}

/// Renders both ways and compares pictures and ray counts.
fn check(ready: &Ready, options: &RenderOptions, what: &str) {
    let what = format!("{} {what}", ready.name);
    let wave = ready.render(options);
    let reference = ready.reference(options);
    assert_same(&wave.picture, &reference.picture, &what);
    if options.integrator != Integrator::BvhCost {
        assert_eq!(wave.stats.rays, reference.rays, "{what}: rays by kind");
    }
    assert_eq!(wave.stats.non_finite_samples, 0, "{what}");
}

#[test]
fn every_scene_and_direct_strategy_agrees_to_the_bit() {
    for path in own_scenes() {
        for normals in [Normals::Smooth, Normals::Flat] {
            let ready = Ready::course(&path, normals);
            for direct in [Direct::Mis, Direct::Light, Direct::Hemisphere, Direct::Bsdf] {
                for light_samples in [1, 3] {
                    let options = RenderOptions { direct, light_samples, aovs: true, ..small() };
                    check(&ready, &options, &format!("{normals:?} {direct:?} -l {light_samples}"));
                }
            }
        }
    }
}

/// In double precision, by the tree and by the test of every primitive, which find the same.
#[test]
fn double_precision_agrees_to_the_bit() {
    let tree = AccelOptions { precision: Precision::F64, ..AccelOptions::default() };
    let list = AccelOptions { kind: comber::options::Accel::Brute, ..tree };
    for path in own_scenes() {
        for normals in [Normals::Smooth, Normals::Flat] {
            let [by_tree, by_list] = [tree, list].map(|accel| Ready::course_in(&path, normals, accel));
            for direct in [Direct::Mis, Direct::Light, Direct::Hemisphere, Direct::Bsdf] {
                let options = RenderOptions { direct, aovs: true, accel: tree, samples: 4, ..small() };
                check(&by_tree, &options, &format!("f64, {normals:?} {direct:?}"));
            }
            let of = |accel| RenderOptions { accel, samples: 1, ..small() };
            let (a, b) = (by_tree.render(&of(tree)), by_list.render(&of(list)));
            assert_same(&a.picture, &b.picture, &format!("{} f64, tree and list", by_tree.name));
        }
    }
    let ready = Ready::course_in(&common::own("cornell_spheres.dae"), Normals::Smooth, tree);
    for integrator in [Integrator::Direct, Integrator::IndirectOnly, Integrator::Normals, Integrator::BvhCost] {
        for light_sampling in [LightSampling::Corners, LightSampling::Area, LightSampling::SolidAngle] {
            let options = RenderOptions { integrator, light_sampling, light_samples: 2, accel: tree, ..small() };
            check(&ready, &options, &format!("f64, {integrator:?} {light_sampling:?}"));
        }
    }
    let power = RenderOptions { light_selection: LightSelection::Power, accel: tree, aovs: true, ..small() };
    check(&ready, &power, "f64, by power");
}

#[test]
fn every_integrator_agrees_to_the_bit() {
    let ready = Ready::course(&common::own("cornell_spheres.dae"), Normals::Smooth);
    for integrator in [
        Integrator::Path,
        Integrator::Direct,
        Integrator::ZeroBounce,
        Integrator::OneBounce,
        Integrator::IndirectOnly,
        Integrator::Normals,
        Integrator::BvhCost,
    ] {
        for max_depth in [0, 1, 2, 7] {
            for aovs in [false, true] {
                let options = RenderOptions { integrator, max_depth, aovs, ..small() };
                check(&ready, &options, &format!("{integrator:?} -m {max_depth}, layers: {aovs}"));
            }
        }
    }
}

#[test]
fn every_roulette_rule_agrees_to_the_bit() {
    let ready = Ready::course(&common::own("cornell_mesh.dae"), Normals::Smooth);
    for roulette in [
        Roulette::Off,
        Roulette::Fixed(0.6),
        Roulette::Throughput { start: 0 },
        Roulette::THROUGHPUT,
        Roulette::EFFICIENCY,
    ] {
        check(&ready, &RenderOptions { roulette, max_depth: 40, ..small() }, &format!("{roulette:?}"));
    }
}

#[test]
fn adaptive_sampling_agrees_to_the_bit() {
    let ready = Ready::course(&common::own("cornell_spheres.dae"), Normals::Flat);
    for confidence in [Confidence::Z, Confidence::T] {
        let rule = Adaptive { batch: 16, tolerance: 0.2, confidence, min_samples: 16, ..Adaptive::COURSE };
        let options = RenderOptions { adaptive: Some(rule), samples: 100, aovs: true, ..small() };
        check(&ready, &options, &format!("{confidence:?}"));
        let counts = ready.render(&options).picture.sample_count.expect("counts");
        assert!(counts.iter().any(|&n| n < 100) && counts.contains(&100), "some pixels retire early, some never");
    }
}

/// Every rule, by samples and by sequences: waves and reference stop the same halves of the same pixels.
#[test]
fn every_adaptive_rule_agrees_to_the_bit() {
    let ready = Ready::course(&common::own("cornell_spheres.dae"), Normals::Flat);
    for (area, trust, tests) in [
        (Area::Tile, Trust::Once, Tests::Batches),
        (Area::Tile, Trust::Halves, Tests::Doubling),
        (Area::Pixel, Trust::Twice, Tests::Batches),
        (Area::Pixel, Trust::Halves, Tests::Batches),
        (Area::Pixel, Trust::Once, Tests::Doubling),
    ] {
        for (sampler, replicates) in
            [(Sampler::Independent, 1), (Sampler::Sobol, 1), (Sampler::Sobol, 8), (Sampler::BlueNoise, 4)]
        {
            let rule = Adaptive { batch: 16, tolerance: 0.3, area, trust, tests, ..Adaptive::COURSE };
            let options =
                RenderOptions { adaptive: Some(rule), samples: 96, aovs: true, sampler, replicates, ..small() };
            check(&ready, &options, &format!("{area:?} {trust:?} {tests:?} {sampler:?} {replicates}"));
        }
    }
}
