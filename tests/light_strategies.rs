//! Every way to choose among lights, and to draw points on them, means the same picture.

mod common;

use comber::film::picture::Picture;
use comber::light::selection::Selection;
use comber::options::{Cell, Direct, LightSampling, LightSelection, Normals, RenderOptions};
use comber::plan::Plan;
use comber::scene::description::SceneDescription;
use comber::wave::features::Features;
use common::statistics::{Estimate, Family, regions};
use common::{Ready, assert_same, make};
use glam::Vec3;

const SELECTIONS: [LightSelection; 3] = [LightSelection::Each, LightSelection::Power, LightSelection::Tree];
const SAMPLINGS: [LightSampling; 3] = [LightSampling::Corners, LightSampling::Area, LightSampling::SolidAngle];

fn small() -> RenderOptions {
    RenderOptions { width: 24, height: 18, samples: 48, max_depth: 3, aovs: true, ..RenderOptions::default() }
}

/// A room with rectangles, one of them askew, spheres, and two emissive meshes: a band of 40 triangles and a pyramid.
fn room() -> Ready {
    let mut scene = SceneDescription { name: "lamps of all kinds".into(), ..Default::default() };
    let walls = make::grey(&mut scene, 0.6, 0.0);
    make::inward_box(&mut scene, Vec3::ZERO, 1.0, walls);
    let block = make::grey(&mut scene, 0.5, 0.0);
    make::sphere(&mut scene, Vec3::new(0.4, -0.7, -0.3), 0.3, block);
    make::light(&mut scene, [Vec3::new(-0.4, 0.9, -0.4), Vec3::X * 0.5, Vec3::Z * 0.3], 4.0);
    make::light(&mut scene, [Vec3::new(-0.95, -0.6, -0.2), Vec3::Y * 0.7, Vec3::new(0.0, 0.2, 0.4)], 1.0);
    make::light(&mut scene, [Vec3::new(0.1, -0.9, 0.2), Vec3::Z * 0.2, Vec3::X * 0.2], 9.0);
    let glow = make::grey(&mut scene, 0.3, 5.0);
    make::sphere(&mut scene, Vec3::new(-0.5, 0.1, 0.2), 0.08, glow);
    make::sphere(&mut scene, Vec3::new(0.7, 0.5, -0.7), 0.15, glow);
    let band = make::grey(&mut scene, 0.2, 2.0);
    let piece = |i: u32| {
        let (x, side) = (-0.9 + 0.09 * i as f32, 0.02 + 0.05 * (i * 7 % 5) as f32 / 5.0);
        [Vec3::new(x, 0.3, -0.95), Vec3::X * side, Vec3::Y * side]
    };
    make::quads(&mut scene, &(0..20).map(piece).collect::<Vec<_>>(), band);
    let tip = make::grey(&mut scene, 0.0, 1.5);
    let at = Vec3::new(-0.5, -0.7, -0.6);
    let corner = |k: u32| at + [Vec3::X, Vec3::Z, -Vec3::X, -Vec3::Z][k as usize % 4] * 0.2;
    let faces = (0..4).map(|k| [corner(k + 1), corner(k) - corner(k + 1), (at + Vec3::Y * 0.3) - corner(k + 1)]);
    make::quads(&mut scene, &faces.collect::<Vec<_>>(), tip);
    let camera = make::camera(Vec3::new(0.2, 0.1, 0.9), Vec3::new(-0.1, -0.2, -1.0), 1.1, 0.8);
    Ready::new(scene, camera, Normals::Flat)
}

fn compare(family: &mut Family, a: &Picture, b: &Picture, what: &str) {
    let (width, height) = (a.width as u32, a.height as u32);
    let whole = Cell { x: 0, y: 0, width, height };
    for cell in regions(width, height, 4, 3).into_iter().chain([whole]) {
        let z = Estimate::of_pixels(a, cell, 1).z_from(Estimate::of_pixels(b, cell, 1));
        family.add(z, format!("{what} {cell:?}"));
    }
}

#[test]
fn all_ways_to_choose_agree() {
    let ready = room();
    let base = |seed| RenderOptions { seed, ..small() };
    // What rays find by themselves knows nothing of choosing.
    let control = ready.render(&RenderOptions { direct: Direct::Bsdf, samples: 800, ..base(1000) }).picture;
    let mut family = Family::new("ways to choose among lights");
    let mut seed = 0;
    for direct in [Direct::Mis, Direct::Light] {
        for light_selection in SELECTIONS {
            for light_sampling in SAMPLINGS {
                for light_samples in [1, 3] {
                    seed += 1;
                    let options =
                        RenderOptions { direct, light_selection, light_sampling, light_samples, ..base(seed) };
                    let picture = ready.render(&options).picture;
                    let what = format!("{direct:?} {light_selection:?} {light_sampling:?} -l {light_samples}");
                    compare(&mut family, &control, &picture, &what);
                }
            }
        }
    }
    family.check();
}

#[test]
fn waves_and_reference_choose_alike() {
    let ready = room();
    for direct in [Direct::Mis, Direct::Light] {
        for light_selection in SELECTIONS {
            for light_sampling in SAMPLINGS {
                for light_samples in [1, 2] {
                    let options =
                        RenderOptions { direct, light_selection, light_sampling, light_samples, samples: 5, ..small() };
                    let wave = ready.render(&options);
                    let reference = ready.reference(&options);
                    let what = format!("{direct:?} {light_selection:?} {light_sampling:?} -l {light_samples}");
                    assert_same(&wave.picture, &reference.picture, &what);
                    assert_eq!(wave.stats.rays, reference.rays, "{what}: rays by kind");
                    assert_eq!(wave.stats.non_finite_samples, 0, "{what}");
                }
            }
        }
    }
}

#[test]
fn threads_waves_and_tiers_do_not_change_the_choice() {
    let ready = room();
    let options = RenderOptions { light_selection: LightSelection::Tree, samples: 9, ..small() };
    let first = ready.render(&options).picture;
    for simd in [comber::options::Simd::Auto, comber::options::Simd::Baseline] {
        for (threads, wave) in [(1, 77), (3, 1000), (2, 300)] {
            let options = RenderOptions { simd, threads: Some(threads), wave: Some(wave), ..options.clone() };
            assert_same(&ready.render(&options).picture, &first, &format!("{simd:?} {threads} {wave}"));
        }
    }
}

#[test]
fn the_plan_says_how_lights_are_chosen() {
    let ready = room();
    let plan = |options: &RenderOptions| Plan::new(&ready.scene, &ready.accel, options).expect("a plan");
    let shade = |plan: &Plan| {
        let stage = plan.stages.iter().find(|stage| stage.name == "shade").expect("shade");
        format!("{}; {}", stage.kernel, stage.why)
    };
    let auto = plan(&RenderOptions { light_selection: LightSelection::Tree, ..small() });
    assert!(matches!(auto.transport.selection, Selection::Tree(_)), "53 emitters are many");
    assert!(auto.features.has(Features::LOOK_BACK) && auto.columns.iter().any(|c| c.name == "path.nx"));
    assert!(shade(&auto).contains("light tree") && shade(&auto).contains("53"), "{}", shade(&auto));
    assert!(auto.memory.lights > 53 * 40, "{}", auto.memory.lights);
    let each = plan(&RenderOptions { light_selection: LightSelection::Each, ..small() });
    assert!(!each.features.has(Features::LOOK_BACK) && shade(&each).contains("each light"), "{}", shade(&each));
    assert_eq!(each.bytes_per_path + 24, auto.bytes_per_path, "three columns of two tables");
    let power = plan(&RenderOptions { light_selection: LightSelection::Power, ..small() });
    assert!(shade(&power).contains("by power"), "{}", shade(&power));
    // Without continuing rays that look for light, nobody looks back; without light samples there is nothing to choose.
    let light = plan(&RenderOptions { direct: Direct::Light, ..auto.options.clone() });
    assert!(!light.features.has(Features::LOOK_BACK) && shade(&light).contains("light tree"));
    let bsdf = plan(&RenderOptions { direct: Direct::Bsdf, ..small() });
    assert!(bsdf.memory.lights < 100 && !shade(&bsdf).contains("tree"));
}
