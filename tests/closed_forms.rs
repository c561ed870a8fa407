//! Radiance that has a closed form, through the whole renderer: a rectangle above a floor, a sphere above a floor, the
//! image of a sphere, and sides that do not emit.

mod common;

use comber::options::{Cell, Direct, Integrator, Normals, RenderOptions};
use comber::scene::camera::Camera;
use comber::scene::description::SceneDescription;
use common::statistics::{Estimate, Family, regions};
use common::{Ready, make};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

const RADIANCE: f32 = 3.0;
const ALBEDO: f32 = 0.6;
const DIRECTS: [Direct; 4] = [Direct::Light, Direct::Mis, Direct::Hemisphere, Direct::Bsdf];

/// Width and height of frames.
const SIZE: (u32, u32) = (20, 14);

/// Looks down at the floor around the origin from the side, below the lights.
fn camera() -> Camera {
    make::camera(Vec3::new(2.0, 1.4, 3.0), Vec3::new(0.1, 0.0, 0.2), 0.4, 0.28)
}

/// A large floor at y = 0.
fn floor() -> SceneDescription {
    let mut scene = SceneDescription::default();
    let material = make::grey(&mut scene, ALBEDO, 0.0);
    make::quads(&mut scene, &[[Vec3::new(-50.0, 0.0, -50.0), Vec3::Z * 100.0, Vec3::X * 100.0]], material);
    scene
}

/// The mean over each pixel of a function of the point of the floor that is seen: 8 × 8 points a pixel, for functions
/// that vary over the frame, not over the pixel.
fn expected(camera: &Camera, at: impl Fn(DVec3) -> f64) -> Vec<f64> {
    let (width, height) = SIZE;
    let lens = camera.lens(width, height);
    let pixel = |x: u32, y: u32| {
        let point = |i: u32| {
            let (u, v) = (f64::from(i % 8) / 8.0 + 1.0 / 16.0, f64::from(i / 8) / 8.0 + 1.0 / 16.0);
            let d = lens.corner.as_dvec3()
                + lens.dx.as_dvec3() * (f64::from(x) + u)
                + lens.dy.as_dvec3() * (f64::from(y) + v);
            let origin = lens.origin.as_dvec3();
            origin - d * (origin.y / d.y)
        };
        (0..64).map(|i| at(point(i))).sum::<f64>() / 64.0
    };
    (0..height).flat_map(|y| (0..width).map(move |x| pixel(x, y))).collect()
}

/// Renders direct light on the floor and compares it with the closed form: where only points on lights are drawn, in
/// every pixel; where directions find the light now and then, in regions that it is found in often enough for a standard error.
fn compare(family: &mut Family, ready: &Ready, direct: Direct, expected: &[f64], what: &str) {
    let (width, height) = SIZE;
    let (samples, cells) = match direct {
        Direct::Light => (256, regions(width, height, width, height)),
        Direct::Mis => (256, regions(width, height, 5, 2)),
        Direct::Hemisphere | Direct::Bsdf => (4096, regions(width, height, 5, 2)),
    };
    let options = RenderOptions {
        width,
        height,
        samples,
        direct,
        integrator: Integrator::OneBounce,
        max_depth: 1,
        aovs: true,
        ..RenderOptions::default()
    };
    let picture = ready.render(&options).picture;
    let whole = Cell { x: 0, y: 0, width, height };
    for cell in cells.into_iter().chain([whole]) {
        let estimate = Estimate::of_pixels(&picture, cell, 0);
        let pixels = (cell.y..cell.y + cell.height).flat_map(|y| (cell.x..cell.x + cell.width).map(move |x| (x, y)));
        let sum: f64 = pixels.map(|(x, y)| expected[(y * width + x) as usize]).sum();
        let mean = sum / f64::from(cell.width * cell.height);
        family.add(estimate.z(mean), format!("{what} {direct:?} {cell:?}"));
        if cell == whole {
            let (off, error) = (estimate.mean / mean - 1.0, estimate.error / mean);
            println!("{what} {direct:?}: off by {off:+.1e} ± {error:.0e}");
        }
    }
}

/// Form factor of a point of the plane y = 0 towards the rectangle from (x0, z0) to (x1, z1) at height `h`, parallel to it:
/// the rectangle as a signed sum of four with a corner above the point (Howell, *A Catalog of Radiation Heat Transfer
/// Configuration Factors*, B-3).
fn rectangle_factor(at: DVec3, [x0, x1, z0, z1, h]: [f64; 5]) -> f64 {
    let corner = |x: f64, z: f64| {
        let (a, b) = (x / h, z / h);
        let (p, q) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
        (a / p * (b / p).atan() + b / q * (a / q).atan()) / (2.0 * PI)
    };
    let (x0, x1, z0, z1) = (x0 - at.x, x1 - at.x, z0 - at.z, z1 - at.z);
    corner(x1, z1) - corner(x0, z1) - corner(x1, z0) + corner(x0, z0)
}

const RECTANGLE: [f64; 5] = [-0.7, 0.5, -0.4, 1.1, 1.7];

/// The rectangle as a corner and two sides; its front is below.
fn rectangle_sides() -> [Vec3; 3] {
    let [x0, x1, z0, z1, h] = RECTANGLE.map(|x| x as f32);
    [Vec3::new(x0, h, z0), Vec3::X * (x1 - x0), Vec3::Z * (z1 - z0)]
}

#[test]
fn a_rectangle_lights_a_floor_by_its_form_factor() {
    let camera = camera();
    // Irradiance π·L·F, of which ρ/π leaves in every direction.
    let radiance = f64::from(ALBEDO) * f64::from(RADIANCE);
    let expected = expected(&camera, |p| radiance * rectangle_factor(p, RECTANGLE));
    let mut as_light = floor();
    make::light(&mut as_light, rectangle_sides(), RADIANCE);
    let mut as_mesh = floor();
    let material = make::grey(&mut as_mesh, 0.0, RADIANCE);
    make::quads(&mut as_mesh, &[rectangle_sides()], material);
    let mut family = Family::new("a rectangle above a floor");
    for (scene, what) in [(as_light, "parallelogram"), (as_mesh, "mesh")] {
        let ready = Ready::new(scene, camera, Normals::Flat);
        for direct in DIRECTS {
            compare(&mut family, &ready, direct, &expected, what);
        }
    }
    family.check();
}

#[test]
fn a_sphere_lights_a_floor_by_its_solid_angle() {
    let camera = camera();
    let (center, radius) = (DVec3::new(-0.9, 1.9, 0.4), 0.55);
    // L·π·sin²θ·cos φ, θ being half the angle that the sphere fills and φ its direction off the vertical.
    let radiance = f64::from(ALBEDO) * f64::from(RADIANCE);
    let expected = expected(&camera, |p| {
        let way = center - p;
        radiance * radius * radius / way.length_squared() * (way.y / way.length())
    });
    let mut scene = floor();
    let material = make::grey(&mut scene, 0.0, RADIANCE);
    make::sphere(&mut scene, center.as_vec3(), radius as f32, material);
    let ready = Ready::new(scene, camera, Normals::Flat);
    let mut family = Family::new("a sphere above a floor");
    for direct in DIRECTS {
        compare(&mut family, &ready, direct, &expected, "sphere");
    }
    family.check();
}

#[test]
fn a_parallelogram_and_a_mesh_of_its_shape_light_alike() {
    // Askew, and seen by walls as well as by a floor.
    let sides = [Vec3::new(-0.5, 0.6, -0.3), Vec3::new(0.7, 0.3, 0.1), Vec3::new(0.1, -0.2, 0.6)];
    let room = |scene: &mut SceneDescription| {
        let material = make::grey(scene, 0.7, 0.0);
        make::inward_box(scene, Vec3::ZERO, 1.0, material);
    };
    let (mut light, mut mesh) = (SceneDescription::default(), SceneDescription::default());
    room(&mut light);
    room(&mut mesh);
    make::light(&mut light, sides, RADIANCE);
    let material = make::grey(&mut mesh, 0.0, RADIANCE);
    make::quads(&mut mesh, &[sides], material);
    let view = make::camera(Vec3::new(0.6, 0.1, 0.9), Vec3::new(-0.2, -0.3, -1.0), 1.2, 0.9);
    let [light, mesh] = [light, mesh].map(|scene| Ready::new(scene, view, Normals::Flat));
    let mut family = Family::new("a parallelogram and its mesh");
    for direct in [Direct::Light, Direct::Mis] {
        let options =
            RenderOptions { width: 48, height: 36, samples: 64, direct, aovs: true, ..RenderOptions::default() };
        let a = light.render(&options).picture;
        let b = mesh.render(&RenderOptions { seed: 1, ..options }).picture;
        for cell in regions(48, 36, 8, 6) {
            let z = Estimate::of_pixels(&a, cell, 0).z_from(Estimate::of_pixels(&b, cell, 0));
            family.add(z, format!("{direct:?} {cell:?}"));
        }
    }
    family.check();
}

/// The part of the frame that a sphere covers whose centre is at `toward` from the camera and fills half the angle `theta`.
///
/// Rays x of the cone satisfy xᵀQx ≤ 0 with Q = cos²θ·1 − a·aᵀ, a being the unit axis. On the plane at distance 1 this is an
/// ellipse of area π·(−det Q)/(det A)^{3/2}, A being what Q is across the plane.
fn covered(camera: &Camera, toward: DVec3, theta: f64) -> f64 {
    let axis = toward.normalize();
    let (x, y) = (axis.dot(camera.right.as_dvec3()), axis.dot(camera.up.as_dvec3()));
    let (cos2, sin2) = (theta.cos().powi(2), theta.sin().powi(2));
    let area = PI * cos2 * cos2 * sin2 / (cos2 * (cos2 - x * x - y * y)).powf(1.5);
    let (tan_x, tan_y) = camera.shown(64, 48);
    area / (4.0 * f64::from(tan_x) * f64::from(tan_y))
}

#[test]
fn the_image_of_a_sphere_is_its_ellipse() {
    let mut family = Family::new("images of spheres");
    let camera = make::camera(Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 1.0, -2.0), 0.8, 0.6);
    for (right, up, ahead, radius) in [
        (0.0, 0.0, 4.0, 1.0),
        (1.4, 0.9, 4.0, 0.8),
        (-2.0, 1.2, 4.0, 0.7),
        (0.9, -0.9, 20.0, 0.5),
        (0.1, 0.1, 2.0, 0.9),
    ] {
        let toward = (camera.right * right + camera.up * up + camera.forward * ahead).as_dvec3();
        let mut scene = SceneDescription::default();
        let material = make::grey(&mut scene, 0.0, 1.0);
        let center = camera.position.as_dvec3() + toward;
        make::sphere(&mut scene, center.as_vec3(), radius, material);
        let ready = Ready::new(scene, camera, Normals::Flat);
        let options =
            RenderOptions { width: 64, height: 48, samples: 256, max_depth: 0, aovs: true, ..RenderOptions::default() };
        let picture = ready.render(&options).picture;
        let estimate = Estimate::of_pixels(&picture, Cell { x: 0, y: 0, width: 64, height: 48 }, 0);
        let expected = covered(&camera, toward, (f64::from(radius) / toward.length()).asin());
        println!("radius {radius} at {toward:.2}: {:.6} ± {:.1e}, {expected:.6}", estimate.mean, estimate.error);
        family.add(estimate.z(expected), format!("radius {radius} at {toward:.2}"));
    }
    family.check();
}

/// The brightest channel of any pixel, over all strategies and bounces.
fn brightest(ready: &Ready, integrator: Integrator) -> f32 {
    let render = |direct| {
        let options = RenderOptions { width: 32, height: 24, samples: 16, direct, integrator, ..Default::default() };
        ready.render(&options).picture.beauty.into_iter().flatten().fold(0.0, f32::max)
    };
    DIRECTS.map(render).into_iter().fold(0.0, f32::max)
}

#[test]
fn lights_are_black_from_behind() {
    let [corner, u, v] = rectangle_sides();
    for as_mesh in [false, true] {
        // Sides swapped: the front is above, and the floor sees the back.
        let add = |scene: &mut SceneDescription, sides| {
            if as_mesh {
                let material = make::grey(scene, 0.0, RADIANCE);
                make::quads(scene, &[sides], material);
            } else {
                make::light(scene, sides, RADIANCE);
            }
        };
        let (mut down, mut up) = (floor(), floor());
        add(&mut down, [corner, u, v]);
        add(&mut up, [corner, v, u]);
        let look_up = make::camera(Vec3::new(0.3, 0.2, 0.5), corner + u * 0.5 + v * 0.4, 0.5, 0.4);
        for camera in [camera(), look_up] {
            let [front, back] = [&down, &up].map(|scene| Ready::new(scene.clone(), camera, Normals::Flat));
            assert!(brightest(&front, Integrator::Path) > 0.0);
            assert_eq!(brightest(&back, Integrator::Path), 0.0, "mesh: {as_mesh}");
        }
    }
}

#[test]
fn a_sphere_light_is_black_inside() {
    let mut scene = floor();
    let material = make::grey(&mut scene, 0.0, RADIANCE);
    make::sphere(&mut scene, Vec3::new(0.5, 0.5, 0.5), 5.0, material);
    let inside = Ready::new(scene.clone(), camera(), Normals::Flat);
    assert_eq!(brightest(&inside, Integrator::Path), 0.0);
    let outside = make::camera(Vec3::new(20.0, 3.0, 0.0), Vec3::ZERO, 0.5, 0.4);
    assert!(brightest(&Ready::new(scene, outside, Normals::Flat), Integrator::ZeroBounce) > 0.0);
}
