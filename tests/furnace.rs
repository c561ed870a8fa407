//! Closed rooms whose every surface emits E and reflects ρ: radiance is E·(1 + ρ + … + ρᵐ) everywhere, exactly.
//!
//! Where only continuing rays look for light, each sample is that sum but for rounding: a single ray that leaves the room, or
//! that meets the far side of a wall, shows. Where lights are sampled, the mean is tested against its standard error.

mod common;

use comber::film::picture::Picture;
use comber::options::{Cell, Direct, Normals, RenderOptions, Roulette};
use comber::scene::description::SceneDescription;
use comber::scene::procedural;
use common::statistics::{Estimate, Family};
use common::{Ready, make};
use glam::Vec3;

const EMISSION: f32 = 0.5;

/// A box of half-width `size` around `center`, seen from a point off its middle.
fn room(size: f32, center: Vec3, albedo: f32) -> Ready {
    let mut scene = SceneDescription::default();
    let material = make::grey(&mut scene, albedo, EMISSION);
    make::inward_box(&mut scene, center, size, material);
    ready(scene, center, size)
}

/// The same with a ball in it, which emits too.
fn room_with_ball(size: f32, center: Vec3, albedo: f32) -> Ready {
    let mut scene = SceneDescription::default();
    let material = make::grey(&mut scene, albedo, EMISSION);
    make::inward_box(&mut scene, center, size, material);
    make::sphere(&mut scene, center + Vec3::new(0.4, -0.5, -0.4) * size, 0.45 * size, material);
    ready(scene, center, size)
}

/// A ball of 1280 triangles, inside out.
fn hollow_ball(size: f32, center: Vec3, albedo: f32) -> Ready {
    let mut scene = procedural::generate("proc:sphere,tris=1280").expect("sphere");
    scene.materials.clear();
    let material = make::grey(&mut scene, albedo, EMISSION);
    for mesh in &mut scene.meshes {
        mesh.normals.clear();
        mesh.material = material;
        mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        mesh.positions.iter_mut().for_each(|p| *p = center + *p * size);
    }
    ready(scene, center, size)
}

fn ready(scene: SceneDescription, center: Vec3, size: f32) -> Ready {
    let from = center + Vec3::new(-0.3, 0.2, 0.35) * size;
    let camera = make::camera(from, center + Vec3::new(0.2, -0.3, -0.9) * size, 1.5, 1.5);
    Ready::new(scene, camera, Normals::Flat)
}

/// Each kind of room, of a size, around a point, with an albedo.
type Make = fn(f32, Vec3, f32) -> Ready;
const ROOMS: [(&str, Make); 3] = [("box", room), ("box with ball", room_with_ball), ("ball", hollow_ball)];

/// E·Σρᵏ for k from 0 to `depth`.
fn sum(albedo: f32, depth: u32) -> f64 {
    let albedo = f64::from(albedo);
    f64::from(EMISSION) * (0..=depth).map(|k| albedo.powi(k as i32)).sum::<f64>()
}

/// Continuing rays alone, which never end early.
fn exact(side: u32, samples: u32, max_depth: u32) -> RenderOptions {
    RenderOptions {
        width: side,
        height: side,
        samples,
        max_depth,
        direct: Direct::Bsdf,
        roulette: Roulette::Off,
        ..RenderOptions::default()
    }
}

/// The largest relative distance of a pixel from `expected`.
fn worst(picture: &Picture, expected: f64) -> f64 {
    picture.beauty.iter().flatten().map(|&c| (f64::from(c) / expected - 1.0).abs()).fold(0.0, f64::max)
}

/// A bound on the relative rounding error of a sample: each power of ρ carries one rounding a factor, and each of the
/// `depth` sums one of a partial sum, none larger than the last.
fn rounding(depth: u32) -> f64 {
    (2.0 * f64::from(depth) + 2.0) * f64::from(f32::EPSILON) / 2.0
}

#[test]
fn every_depth_has_its_partial_sum() {
    for (name, make) in ROOMS {
        let room = make(1.0, Vec3::ZERO, 0.75);
        for depth in 0..=12 {
            let error = worst(&room.render(&exact(48, 1, depth)).picture, sum(0.75, depth));
            assert!(error <= rounding(depth), "{name}, depth {depth}: {error:e}");
        }
    }
}

#[test]
fn energy_is_kept_to_a_hundred_thousandth_at_depth_1000() {
    for albedo in [0.0, 0.1, 0.5, 0.9, 0.99, 0.999] {
        for (name, make) in ROOMS {
            let room = make(1.0, Vec3::ZERO, albedo);
            let error = worst(&room.render(&exact(24, 1, 1000)).picture, sum(albedo, 1000));
            println!("{name}, albedo {albedo}: every sample within {error:.1e}");
            assert!(error <= 1e-5, "{name}, albedo {albedo}: {error:e}");
        }
    }
}

#[test]
fn without_an_end_the_sum_is_the_closed_form() {
    // ρ²⁰⁰⁰ is below what a float holds.
    for albedo in [0.1f32, 0.5, 0.9] {
        let room = room_with_ball(1.0, Vec3::ZERO, albedo);
        let error = worst(&room.render(&exact(24, 1, 2000)).picture, f64::from(EMISSION) / (1.0 - f64::from(albedo)));
        assert!(error <= 1e-5, "albedo {albedo}: {error:e}");
    }
}

/// Mean over the frame against the sum, for rules and strategies that leave a variance.
fn test_mean(family: &mut Family, room: &Ready, options: &RenderOptions, expected: f64, what: &str) {
    let options = RenderOptions { aovs: true, ..options.clone() };
    let picture = room.render(&options).picture;
    let whole = Cell { x: 0, y: 0, width: options.width, height: options.height };
    let estimate = Estimate::of_pixels(&picture, whole, 0);
    let (off, error) = (estimate.mean / expected - 1.0, estimate.error / expected);
    println!("{what}: off by {off:+.1e} ± {error:.1e}");
    // Rounding is all that is left where the variance vanishes.
    let z = if off.abs() <= rounding(options.max_depth) { 0.0 } else { off / error };
    family.add(z, what);
}

#[test]
fn every_strategy_and_roulette_rule_keeps_the_energy() {
    let mut family = Family::new("furnaces");
    let mut seed = 0;
    let roulettes = [
        (Roulette::Off, 60),
        (Roulette::Fixed(0.7), 200),
        (Roulette::Throughput { start: 0 }, 200),
        (Roulette::THROUGHPUT, 200),
        (Roulette::EFFICIENCY, 200),
    ];
    for (albedo, depth_off) in [(0.5, 40), (0.8, 60)] {
        for (roulette, depth) in roulettes {
            let depth = if roulette == Roulette::Off { depth_off } else { depth };
            for direct in [Direct::Bsdf, Direct::Mis, Direct::Light, Direct::Hemisphere] {
                // Tests that are judged together must not share their random numbers.
                seed += 1;
                let options = RenderOptions { direct, roulette, light_samples: 2, seed, ..exact(20, 20, depth) };
                // Points on the walls of a box have unbounded weights near its edges, where the variance of `Light`
                // does not exist and no standard error holds. In a ball every point weighs the same.
                let (room, name) = match direct {
                    Direct::Light => (hollow_ball(1.0, Vec3::ZERO, albedo), "ball"),
                    _ => (room_with_ball(1.0, Vec3::ZERO, albedo), "box with ball"),
                };
                let what = format!("{name}, albedo {albedo}, {direct:?}, {roulette:?}");
                test_mean(&mut family, &room, &options, sum(albedo, depth), &what);
            }
        }
    }
    family.check();
}

/// Samples that are not the sum: rays that left the room or met a wall from behind.
fn lost(room: &Ready, albedo: f32) -> (usize, usize) {
    let depth = 40;
    let picture = room.render(&exact(128, 1, depth)).picture;
    let expected = sum(albedo, depth);
    let wrong = |p: &&[f32; 3]| (f64::from(p[0]) / expected - 1.0).abs() > rounding(depth);
    (picture.beauty.iter().filter(wrong).count(), picture.beauty.len() * (depth as usize + 1))
}

#[test]
fn no_ray_leaks_at_any_scale() {
    for size in [1e-6, 1e-3, 1.0, 1e3, 1e6] {
        for (name, make) in ROOMS {
            let (lost, rays) = lost(&make(size, Vec3::ZERO, 0.9), 0.9);
            println!("{name} of size {size}: {lost} of {rays} rays lost");
            assert_eq!(lost, 0, "{name} of size {size}, {rays} rays");
        }
    }
}

/// Far from the origin single precision itself is coarse: at 1000 units, corners lie on a grid of 6e-5, and a point of a wall
/// may be rounded to beyond the wall next to it. Near the origin nothing is lost; what is lost far away stays rare.
#[test]
fn few_rays_leak_far_from_the_origin() {
    for (away, most) in [(1.0, 0.0), (10.0, 0.0), (100.0, 1e-5), (1000.0, 5e-5)] {
        for (name, make) in ROOMS {
            let (lost, rays) = lost(&make(1.0, away * FAR, 0.9), 0.9);
            println!("{name} {away} away: {lost} of {rays} rays lost");
            assert!(lost as f64 <= most * rays as f64, "{name} {away} away: {lost} of {rays} rays lost");
        }
    }
}

/// Where the room stands when it stands one unit away on each axis, more or less.
const FAR: Vec3 = Vec3::new(1.0, -0.7, 0.9);

/// Radiance of the ball's wall by points on the wall, over what it should be.
fn by_light_samples(size: f32, center: Vec3, seed: u32) -> Estimate {
    let room = hollow_ball(size, center, 0.5);
    let options = RenderOptions { direct: Direct::Light, aovs: true, seed, ..exact(32, 32, 1) };
    let whole = Cell { x: 0, y: 0, width: 32, height: 32 };
    let estimate = Estimate::of_pixels(&room.render(&options).picture, whole, 0);
    let expected = sum(0.5, 1);
    Estimate { mean: estimate.mean / expected, error: estimate.error / expected }
}

#[test]
fn lights_are_not_in_their_own_shadow() {
    // In a ball all points weigh the same, so that the least loss to false shadows shows.
    let mut family = Family::new("shadow rays that must be free");
    let sizes = [1e-6, 1e-3, 1.0, 1e3, 1e6].map(|size| (size, 0.0));
    for (seed, (size, away)) in sizes.into_iter().chain([(1.0, 1.0), (1.0, 10.0), (1.0, 100.0)]).enumerate() {
        family.add(by_light_samples(size, away * FAR, seed as u32).z(1.0), format!("size {size}, {away} away"));
    }
    family.check();
}

/// Rays leave a surface, and end before a light, by the rounding error of positions, which 1000 units from the origin is
/// 0.005: both ends have then moved into the room, and light sampling sees its walls from closer than they are.
#[test]
fn light_sampling_gains_no_more_than_the_offset_far_from_the_origin() {
    let estimate = by_light_samples(1.0, 1000.0 * FAR, 0);
    let offset = f64::from(comber::scene::surface::ROUNDING) * 1000.0 * f64::from(FAR.abs().element_sum());
    println!("1000 away: {:+.1e} ± {:.0e}, offset {offset:.1e}", estimate.mean - 1.0, estimate.error);
    assert!(estimate.mean - 1.0 <= offset && estimate.z(1.0) > -3.0, "{estimate:?}");
}
