//! What must hold between pictures of one scene: bounces add up, strategies agree, more light samples mean less noise.

mod common;

use comber::film::picture::Picture;
use comber::options::{Direct, Integrator, Normals, RenderOptions, Roulette};
use comber::scene::description::SceneDescription;
use common::statistics::{ALPHA, Estimate, Family, regions, student};
use common::{Ready, assert_same, make, own, own_scenes};
use glam::Vec3;

const DIRECTS: [Direct; 4] = [Direct::Mis, Direct::Light, Direct::Hemisphere, Direct::Bsdf];

fn small() -> RenderOptions {
    RenderOptions { width: 48, height: 36, samples: 1, ..RenderOptions::default() }
}

fn with(options: &RenderOptions, integrator: Integrator) -> RenderOptions {
    RenderOptions { integrator, ..options.clone() }
}

/// Fails unless every channel of `whole` is the sum of the `parts` but for the rounding of the sums.
///
/// One sample a pixel: a channel is a sum of at most `terms` numbers that are not negative, and so are the parts, of the same
/// numbers. Each of the at most 2·`terms` additions rounds by at most half a unit in the last place of the whole sum, whatever
/// their order (Higham, *Accuracy and Stability of Numerical Algorithms*, §4.2).
///
/// Returns the largest difference, as a fraction of the bound.
fn assert_sum(whole: &Picture, parts: &[&Picture], terms: u32, what: &str) -> f64 {
    let half_unit = f64::from(f32::EPSILON) / 2.0;
    let mut worst = 0.0f64;
    for i in 0..whole.beauty.len() {
        for c in 0..3 {
            let sum: f64 = parts.iter().map(|p| f64::from(p.beauty[i][c])).sum();
            let difference = (f64::from(whole.beauty[i][c]) - sum).abs();
            let bound = 2.0 * f64::from(terms) * half_unit * sum * (1.0 + 1e-5);
            assert!(difference <= bound, "{what}: pixel {i}: {} is not {sum}", whole.beauty[i][c]);
            worst = worst.max(difference / bound.max(f64::MIN_POSITIVE));
        }
    }
    worst
}

#[test]
fn bounces_add_up_in_every_sample() {
    for path in own_scenes() {
        let ready = Ready::course(&path, Normals::Smooth);
        let mut worst = 0.0f64;
        for direct in DIRECTS {
            for roulette in [Roulette::Off, Roulette::Fixed(0.6), Roulette::Throughput { start: 1 }] {
                for light_samples in [1, 3] {
                    let options = RenderOptions {
                        direct,
                        roulette,
                        light_samples,
                        max_depth: 6,
                        width: 32,
                        height: 24,
                        ..small()
                    };
                    let what = format!("{} {direct:?} {roulette:?} -l {light_samples}", ready.name);
                    let [path, only_direct, zero, one, indirect] = [
                        Integrator::Path,
                        Integrator::Direct,
                        Integrator::ZeroBounce,
                        Integrator::OneBounce,
                        Integrator::IndirectOnly,
                    ]
                    .map(|integrator| ready.render(&with(&options, integrator)).picture);
                    // Emission at seven vertices, shadow rays from six.
                    let terms = 7 + 6 * light_samples * ready.scene.lights.len() as u32;
                    worst = worst.max(assert_sum(&path, &[&zero, &one, &indirect], terms, &what));
                    assert_sum(&only_direct, &[&zero, &one], 2 + light_samples, &what);
                    assert!(indirect.beauty.iter().flatten().any(|&c| c > 0.0), "{what}");
                }
            }
        }
        println!("{}: sums differ by at most {:.0} % of the bound", ready.name, worst * 100.0);
    }
}

#[test]
fn depths_are_bounces() {
    let ready = Ready::course(&own("cornell_spheres.dae"), Normals::Smooth);
    for direct in DIRECTS {
        // A rule that knows nothing of the depth limit: what rays are worth depends on what can still be found.
        let roulette = Roulette::THROUGHPUT;
        let at = |integrator, max_depth| {
            ready.render(&RenderOptions { direct, integrator, max_depth, roulette, samples: 4, ..small() }).picture
        };
        use Integrator::{Direct as DirectLight, IndirectOnly, OneBounce, Path, ZeroBounce};
        assert_same(&at(Path, 0), &at(ZeroBounce, 9), "0 is emission alone");
        assert_same(&at(Path, 1), &at(DirectLight, 9), "1 is direct light too");
        assert_same(&at(DirectLight, 0), &at(ZeroBounce, 0), "direct light needs one bounce");
        let black = |picture: Picture| picture.beauty.iter().flatten().all(|&c| c == 0.0);
        assert!(black(at(OneBounce, 0)) && black(at(IndirectOnly, 1)));
        assert!(!black(at(OneBounce, 1)) && !black(at(IndirectOnly, 2)));
        // Each bounce only adds.
        let pictures: Vec<_> = (0..6).map(|m| at(Path, m)).collect();
        for pair in pictures.windows(2) {
            let pairs = pair[0].beauty.iter().flatten().zip(pair[1].beauty.iter().flatten());
            assert!(pairs.clone().all(|(less, more)| less <= more), "{direct:?}");
            assert!(pairs.clone().any(|(less, more)| less < more), "{direct:?}");
        }
    }
}

/// Every region and channel of two pictures.
fn compare(family: &mut Family, a: &Picture, b: &Picture, what: &str) {
    for cell in regions(a.width as u32, a.height as u32, 4, 3) {
        for channel in 0..3 {
            let [a, b] = [a, b].map(|picture| Estimate::of_pixels(picture, cell, channel));
            family.add(a.z_from(b), format!("{what}, channel {channel} of {cell:?}"));
        }
    }
}

#[test]
fn strategies_agree_on_every_scene() {
    let mut family = Family::new("strategies");
    for path in own_scenes() {
        let ready = Ready::course(&path, Normals::Smooth);
        let pictures = DIRECTS.map(|direct| {
            let samples = if matches!(direct, Direct::Mis | Direct::Light) { 48 } else { 256 };
            // Strategies that share random numbers would not be independent.
            let seed = direct as u32;
            ready.render(&RenderOptions { direct, samples, seed, aovs: true, ..small() }).picture
        });
        for (picture, direct) in pictures.iter().zip(DIRECTS).skip(1) {
            compare(&mut family, &pictures[0], picture, &format!("{} Mis and {direct:?}", ready.name));
        }
    }
    family.check();
}

#[test]
fn more_light_samples_mean_the_same_with_less_noise() {
    let ready = Ready::course(&own("cornell_spheres.dae"), Normals::Smooth);
    let mut family = Family::new("-l 1 and -l 4");
    for direct in [Direct::Light, Direct::Mis, Direct::Hemisphere] {
        for integrator in [Integrator::Path, Integrator::OneBounce] {
            let render = |light_samples, seed| {
                let options = RenderOptions { direct, light_samples, seed, samples: 32, aovs: true, ..small() };
                ready.render(&with(&options, integrator)).picture
            };
            let noise = |picture: &Picture| {
                let variance = picture.variance.as_ref().expect("variance");
                variance.iter().map(|v| f64::from(v[1])).sum::<f64>()
            };
            let mut gains = Vec::new();
            for seed in 0..6 {
                let (one, four) = (render(1, seed), render(4, 100 + seed));
                compare(&mut family, &one, &four, &format!("{direct:?} {integrator:?}"));
                gains.push((noise(&one) / noise(&four)).ln());
            }
            // Of all light, the few brightest samples make most of the variance: light nearly touched by a long path.
            // They say nothing of direct light, whose variance goes down by up to four.
            if integrator == Integrator::OneBounce {
                let gain = Estimate::of(&gains);
                println!("{direct:?}: variance of direct light over {:.2} ± {:.2}", gain.mean.exp(), gain.error);
                assert!(gain.mean > student(ALPHA, gains.len()) * gain.error, "{direct:?}: {gains:?}");
            }
        }
    }
    family.check();
}

/// A room with `n` × `n` squares of different sizes under its ceiling: each a light, or all one mesh.
fn room_of_squares(n: u32, as_mesh: bool) -> Ready {
    let mut scene = SceneDescription::default();
    let walls = make::grey(&mut scene, 0.6, 0.0);
    make::inward_box(&mut scene, Vec3::ZERO, 1.0, walls);
    let square = |i: u32| {
        let step = 1.8 / n as f32;
        let side = step * (0.2 + 0.7 * (i * 7 % 11) as f32 / 10.0);
        let corner = Vec3::new(-0.9 + step * (i % n) as f32, 0.95, -0.9 + step * (i / n) as f32);
        [corner, Vec3::X * side, Vec3::Z * side]
    };
    let squares: Vec<_> = (0..n * n).map(square).collect();
    if as_mesh {
        let material = make::grey(&mut scene, 0.0, 2.0);
        make::quads(&mut scene, &squares, material);
    } else {
        squares.iter().for_each(|&sides| make::light(&mut scene, sides, 2.0));
    }
    let camera = make::camera(Vec3::new(0.2, -0.1, 0.9), Vec3::new(-0.1, -0.2, -1.0), 1.2, 0.9);
    Ready::new(scene, camera, Normals::Flat)
}

#[test]
fn many_lights_agree_with_one_mesh_of_them() {
    let mut family = Family::new("lights and a mesh of them");
    // 16 are all asked, 25 and the mesh's triangles are drawn by the tree.
    for (n, light_samples) in [(4, 1), (5, 1), (5, 2)] {
        let (lights, mesh) = (room_of_squares(n, false), room_of_squares(n, true));
        assert_eq!((lights.scene.lights.len() as u32, mesh.scene.lights.len()), (n * n, 1));
        for direct in DIRECTS {
            let options = RenderOptions { direct, samples: 24, light_samples, aovs: true, max_depth: 3, ..small() };
            let a = lights.render(&options).picture;
            let b = mesh.render(&RenderOptions { seed: 1, light_samples: 8, ..options }).picture;
            compare(&mut family, &a, &b, &format!("{} lights, -l {light_samples}, {direct:?}", n * n));
        }
    }
    family.check();
}

#[test]
fn lights_of_different_radiance_agree_with_what_rays_find() {
    // 25 lights, so drawn by the tree; every fifth is dark and must not be asked.
    let mut ready = room_of_squares(5, false);
    for (i, light) in ready.scene.lights.iter_mut().enumerate() {
        light.radiance = Vec3::new(1.0, 0.5, 0.1) * (i % 5) as f32;
    }
    let mut family = Family::new("lights of different radiance");
    let pictures = DIRECTS.map(|direct| {
        let seed = direct as u32;
        ready.render(&RenderOptions { direct, samples: 64, seed, aovs: true, max_depth: 3, ..small() }).picture
    });
    for (picture, direct) in pictures.iter().zip(DIRECTS).skip(1) {
        compare(&mut family, &pictures[0], picture, &format!("{direct:?}"));
    }
    family.check();
}
