//! What a picture must not depend on: the unit of length, where the scene stands and how it is turned, the order and number of
//! its triangles, the unit of radiance.

mod common;

use comber::film::picture::Picture;
use comber::film::tile::{FilmLayout, Sample, tiles};
use comber::options::{Cell, Normals, RenderOptions};
use comber::scene::camera::Camera;
use comber::scene::description::{MeshDescription, SceneDescription};
use common::rays::Random;
use common::statistics::{Estimate, Family, regions};
use common::{Ready, make};
use glam::{DQuat, DVec3, Vec3};

/// The scene that is moved about: a room with a lamp, a ball and a leaning board.
fn room() -> (SceneDescription, Camera) {
    let mut scene = SceneDescription::default();
    let walls = make::grey(&mut scene, 0.6, 0.0);
    make::inward_box(&mut scene, Vec3::ZERO, 1.0, walls);
    let board = make::grey(&mut scene, 0.8, 0.0);
    let corner = Vec3::new(-0.7, -0.95, -0.6);
    make::quads(&mut scene, &[[corner, Vec3::new(0.9, 0.1, -0.2), Vec3::new(0.1, 1.1, 0.3)]], board);
    make::sphere(&mut scene, Vec3::new(0.4, -0.5, -0.3), 0.35, walls);
    make::light(&mut scene, [Vec3::new(-0.3, 0.95, -0.4), Vec3::X * 0.6, Vec3::Z * 0.5], 7.0);
    let camera = make::camera(Vec3::new(0.2, -0.1, 0.9), Vec3::new(-0.1, -0.2, -1.0), 1.2, 0.9);
    (scene, camera)
}

fn options(seed: u32) -> RenderOptions {
    RenderOptions { width: 64, height: 48, samples: 128, seed, aovs: true, ..RenderOptions::default() }
}

fn render((scene, camera): (SceneDescription, Camera), options: &RenderOptions) -> Picture {
    Ready::new(scene, camera, Normals::Flat).render(options).picture
}

/// Scaled, turned about the origin, and moved; computed in f64 and rounded once.
#[derive(Clone, Copy, Debug)]
struct Motion {
    scale: f64,
    turn: DQuat,
    by: DVec3,
}

const STILL: Motion = Motion { scale: 1.0, turn: DQuat::IDENTITY, by: DVec3::ZERO };

impl Motion {
    fn point(&self, p: Vec3) -> Vec3 {
        (self.turn * p.as_dvec3() * self.scale + self.by).as_vec3()
    }

    fn side(&self, v: Vec3) -> Vec3 {
        (self.turn * v.as_dvec3() * self.scale).as_vec3()
    }

    fn of(&self, (mut scene, camera): (SceneDescription, Camera)) -> (SceneDescription, Camera) {
        for mesh in &mut scene.meshes {
            mesh.positions.iter_mut().for_each(|p| *p = self.point(*p));
        }
        for sphere in &mut scene.spheres {
            sphere.center = self.point(sphere.center);
            sphere.radius = (f64::from(sphere.radius) * self.scale) as f32;
        }
        for light in &mut scene.area_lights {
            light.center = self.point(light.center);
            (light.side_u, light.side_v) = (self.side(light.side_u), self.side(light.side_v));
            light.direction = self.side(light.direction);
        }
        let axis = |v: Vec3| (self.turn * v.as_dvec3()).as_vec3();
        let (right, up, forward) = (axis(camera.right), axis(camera.up), axis(camera.forward));
        (scene, Camera { position: self.point(camera.position), right, up, forward, ..camera })
    }
}

/// Every region and channel of two independent pictures of the same.
fn compare(family: &mut Family, a: &Picture, b: &Picture, what: &str) {
    for cell in regions(a.width as u32, a.height as u32, 4, 3) {
        let [a, b] = [a, b].map(|picture| Estimate::of_pixels(picture, cell, 0));
        family.add(a.z_from(b), format!("{what}, {cell:?}"));
    }
}

#[test]
fn moving_the_scene_moves_nothing_in_the_picture() {
    let mut family = Family::new("motions");
    let expected = render(room(), &options(0));
    let turn = DQuat::from_axis_angle(DVec3::new(0.48, -0.6, 0.64), 1.1);
    let motions = [
        Motion { scale: 1e-3, ..STILL },
        Motion { scale: 3e5, ..STILL },
        Motion { by: DVec3::new(20.0, -7.0, 33.0), ..STILL },
        Motion { turn, ..STILL },
        Motion { scale: 40.0, turn, by: DVec3::new(100.0, 250.0, -300.0) },
    ];
    for (seed, motion) in (1..).zip(motions) {
        compare(&mut family, &render(motion.of(room()), &options(seed)), &expected, &format!("{motion:?}"));
    }
    family.check();
}

/// Where scaling is exact, so is the picture: nothing in comber has a length of its own.
#[test]
fn powers_of_two_scale_to_the_same_bits() {
    let options = RenderOptions { samples: 4, aovs: false, ..options(3) };
    let bits = |picture: Picture| picture.beauty.as_flattened().iter().map(|c| c.to_bits()).collect::<Vec<_>>();
    let expected = bits(render(room(), &options));
    for scale in [1.0 / 1024.0, 0.5, 4.0, 65536.0] {
        let scaled = bits(render(Motion { scale, ..STILL }.of(room()), &options));
        let different = scaled.iter().zip(&expected).filter(|(a, b)| a != b).count();
        assert_eq!(different, 0, "scale {scale}: {different} of {} values differ", expected.len());
    }
}

/// The triangles of all meshes, in another order.
fn shuffled((mut scene, camera): (SceneDescription, Camera)) -> (SceneDescription, Camera) {
    let mut random = Random(5);
    for mesh in &mut scene.meshes {
        for last in (1..mesh.triangles.len()).rev() {
            mesh.triangles.swap(last, random.below(last + 1));
        }
    }
    scene.meshes.reverse();
    (scene, camera)
}

/// Random numbers do not depend on the order of triangles, so only rays through edges may change, which hit either side.
#[test]
fn the_order_of_triangles_does_not_matter() {
    let options = RenderOptions { samples: 16, ..options(9) };
    let [a, b] = [room(), shuffled(room())].map(|scene| render(scene, &options));
    let different = a.beauty.iter().zip(&b.beauty).filter(|(a, b)| a != b).count();
    println!("{different} of {} pixels differ", a.beauty.len());
    assert!(different * 200 <= a.beauty.len(), "{different} pixels differ");
    let mut family = Family::new("order of triangles");
    compare(&mut family, &render(shuffled(room()), &self::options(1)), &render(room(), &self::options(0)), "shuffled");
    family.check();
}

/// The quad with these corners as `n` × `n` × 2 triangles.
fn grid(mesh: &MeshDescription, n: u32) -> MeshDescription {
    let [a, b, c, d] = [0, 1, 2, 3].map(|i| mesh.positions[i].as_dvec3());
    let at = |i: u32, j: u32| {
        let (u, v) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
        (a * ((1.0 - u) * (1.0 - v)) + b * (u * (1.0 - v)) + c * (u * v) + d * ((1.0 - u) * v)).as_vec3()
    };
    let positions = (0..=n).flat_map(|j| (0..=n).map(move |i| at(i, j))).collect();
    let corner = |i: u32, j: u32| j * (n + 1) + i;
    let square = |(i, j): (u32, u32)| {
        let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
        [[a, b, c], [a, c, d]]
    };
    let triangles = (0..n).flat_map(|j| (0..n).map(move |i| (i, j))).flat_map(square).collect();
    MeshDescription { positions, triangles, material: mesh.material, ..Default::default() }
}

#[test]
fn ten_thousand_triangles_look_like_the_quad_that_they_fill() {
    let mut family = Family::new("quads in pieces");
    let expected = render(room(), &options(0));
    let (mut scene, camera) = room();
    scene.meshes[1] = grid(&scene.meshes[1], 71);
    assert!(scene.meshes[1].triangles.len() > 10_000);
    compare(&mut family, &render((scene, camera), &options(1)), &expected, "the board in 10082 triangles");

    // A lamp that is a mesh of as many triangles.
    let lamp = |n: u32, seed: u32| {
        let (mut scene, camera) = room();
        scene.area_lights.clear();
        let material = make::grey(&mut scene, 0.0, 7.0);
        let sides = [Vec3::new(-0.3, 0.95, -0.4), Vec3::X * 0.6, Vec3::Z * 0.5];
        make::quads(&mut scene, &[sides], material);
        let last = scene.meshes.len() - 1;
        scene.meshes[last] = grid(&scene.meshes[last], n);
        render((scene, camera), &options(seed))
    };
    compare(&mut family, &lamp(1, 2), &expected, "the lamp as a mesh");
    compare(&mut family, &lamp(71, 3), &expected, "the lamp in 10082 triangles");
    family.check();
}

#[test]
fn the_unit_of_radiance_does_not_matter() {
    let options = RenderOptions { samples: 8, aovs: false, ..options(4) };
    let lit = |factor: f64| {
        let (mut scene, camera) = room();
        for light in &mut scene.area_lights {
            light.radiance = (light.radiance.as_dvec3() * factor).as_vec3();
        }
        render((scene, camera), &options)
    };
    let expected = lit(1.0);
    let brightest = expected.beauty.as_flattened().iter().copied().fold(0.0, f32::max);
    for power in [-30, -20, -10, 10, 20, 30] {
        let factor = 10f64.powi(power);
        let picture = lit(factor);
        for (a, b) in picture.beauty.as_flattened().iter().zip(expected.beauty.as_flattened()) {
            let (a, b) = (f64::from(*a) / factor, f64::from(*b));
            // A rounding for each factor and sum; and what single precision has no exponent for.
            let error = (a - b).abs();
            assert!(error <= 1e-5 * b + 1e-8 * f64::from(brightest), "10^{power}: {a} instead of {b}");
        }
    }
}

/// Samples of mean 10⁴ and deviation 10⁻³, as near as single precision has them: steps of 2⁻¹⁰, whose moments are exact in integers.
#[test]
fn ten_million_samples_of_a_bright_pixel_keep_their_moments() {
    const N: i128 = 10_000_000;
    let pixel = Cell { x: 0, y: 0, width: 1, height: 1 };
    let layout = FilmLayout { variance: true, luminance: true, ..FilmLayout::default() };
    let mut tile = tiles(pixel, layout).remove(0);
    let mut random = Random(11);
    let step = 1.0 / 1024.0;
    let (mut sum, mut squares) = (0i128, 0i128);
    for _ in 0..N {
        // Three coins: a deviation of √(3 · 2/3) / √2 steps, about 10⁻³.
        let steps = random.below(3) as i32 + random.below(3) as i32 - 2;
        let value = 1e4 + steps as f32 * step;
        assert_eq!(f64::from(value), 1e4 + f64::from(steps) * f64::from(step));
        tile.add(0, 0, &Sample { radiance: [value; 3], ..Sample::default() });
        sum += i128::from(steps);
        squares += i128::from(steps * steps);
    }
    let step = f64::from(step);
    let mean = 1e4 + sum as f64 / N as f64 * step;
    let m2 = (squares * N - sum * sum) as f64 / N as f64 * step * step;
    let deviation = (m2 / N as f64).sqrt();
    assert!((9e-4..1.3e-3).contains(&deviation), "{deviation}");
    let moments = tile.luminance[0];
    for (name, got, expected, scale) in [
        // The mean to six digits of itself, and to less than its standard error.
        ("mean", tile.mean[0][1], mean, mean.min(deviation / (N as f64).sqrt() * 1e6)),
        ("sum of squares", tile.m2[0][2], m2, m2),
        ("mean luminance", moments.mean, mean, mean.min(deviation / (N as f64).sqrt() * 1e6)),
        ("squares of luminance", moments.m2, m2, m2),
    ] {
        let error = (got - expected).abs() / scale;
        println!("{name}: {error:.1e}");
        assert!(error < 1e-6, "{name}: {got} instead of {expected}: {error:e}");
    }
    assert_eq!((tile.count[0], moments.n, tile.non_finite), (N as u32, N as u32, 0));
}
