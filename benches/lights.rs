//! What choosing among lights is worth: efficiency, 1 / (variance × processor time), of ways to choose a light and a point on it.
//!
//! `cargo bench --bench lights [-- SCENE…]` prints a table in Markdown. Ways take turns, each with a seed of its own; ratios to the first way
//! are medians of rounds, with quartiles. Variance is that of a sample, over the picture's mean squared, averaged over all pixels. Of lamps and shards,
//! direct light alone is rendered: that the camera sees them would drown what is asked.
//! Scenes: `lamps N` is a floor with blocks under a grid of N lamps, rectangles and spheres whose powers span three orders of
//! magnitude; `shards N` has the same grid as one emissive mesh; then scenes with few lights.

mod common;

use comber::bench::interleave::{Effort, Turn, interleave};
use comber::bench::probe::Probe;
use comber::bench::statistics::Quartiles;
use comber::bvh::Accel;
use comber::drive::{self, Unobserved};
use comber::film::picture::Picture;
use comber::options::{self, Integrator, LightSampling, LightSelection, Normals, RenderOptions, Sampler};
use comber::plan::Plan;
use comber::sampling::random::uniform4;
use comber::scene::camera::Camera;
use comber::scene::description::{
    AreaLightDescription, MaterialDescription, MeshDescription, SceneDescription, SphereDescription, Surface,
};
use comber::scene::{Scene, SceneOptions};
use common::Args;
use glam::{DVec3, Vec3};
use std::cell::Cell;
use std::time::Duration;

/// A way to choose: selection, points on lights, rays for each light.
type Way = (LightSelection, LightSampling, u32);

const EACH: Way = (LightSelection::Each, LightSampling::SolidAngle, 1);
const POWER: Way = (LightSelection::Power, LightSampling::SolidAngle, 1);
const TREE: Way = (LightSelection::Tree, LightSampling::SolidAngle, 1);
const AREA: Way = (LightSelection::Auto, LightSampling::Area, 1);
const SOLID: Way = (LightSelection::Auto, LightSampling::SolidAngle, 1);

fn rays(way: Way, light_samples: u32) -> Way {
    (way.0, way.1, light_samples)
}

fn main() {
    let args = Args::parse();
    println!(
        "| scene | emitters | way | rays a vertex | variance | ÷ first | cpu ÷ first | **efficiency ÷ first** | quartiles |"
    );
    println!("|---|--:|---|--:|--:|--:|--:|--:|--:|");
    let counts: &[u32] = if args.measure { &[1, 4, 16, 100, 10_000] } else { &[4] };
    for &n in counts {
        let ways: &[Way] = if n <= 100 { &[EACH, POWER, TREE] } else { &[POWER, TREE] };
        contest(&args, &format!("lamps {n}"), ways, || lamps(n));
    }
    for &n in counts {
        let ways = [EACH, TREE, rays(EACH, 4), rays(TREE, 4), rays(TREE, 16)];
        contest(&args, &format!("shards {n}"), &ways, || shards(n));
    }
    if args.measure {
        for name in ["default", "cornell_quad_light", "cornell_spheres", "CBspheres_lambertian", "CBbunny"] {
            contest(&args, name, &[AREA, SOLID], || common::describe(name));
        }
        contest(&args, "lamps 16 by area", &[AREA, SOLID], || lamps(16));
        contest(&args, "shards 16 by area", &[AREA, SOLID], || shards(16));
    }
}

fn contest(args: &Args, name: &str, ways: &[Way], make: impl Fn() -> Option<(SceneDescription, Camera)>) {
    if !args.chosen(name) {
        return;
    }
    let Some((description, camera)) = make() else { return };
    let options = SceneOptions { normals: Normals::Smooth, substitute_materials: true };
    let scene = Scene::build(description, options).expect("a sound scene");
    let accel = Accel::build(&scene.shapes, &options::AccelOptions::default()).expect("a tree");
    let emitters: u32 = scene.lights.iter().map(|light| light.parts()).sum();
    let plan = |way: usize, seed: u32| {
        let (light_selection, light_sampling, light_samples) = ways[way];
        // Of the many rays of a hundred lamps, fewer samples do.
        let many = light_selection == LightSelection::Each && scene.lights.len() > 16;
        let (width, height, samples) = match (args.measure, many) {
            (true, false) => (96, 72, 16),
            (true, true) => (96, 72, 2),
            (false, _) => (16, 12, 2),
        };
        let options = RenderOptions {
            width,
            height,
            samples,
            seed,
            light_selection,
            light_sampling,
            light_samples,
            aovs: true,
            integrator: if name.contains(' ') { Integrator::OneBounce } else { Integrator::Path },
            sampler: Sampler::Independent,
            threads: Some(1),
            ..RenderOptions::default()
        };
        Plan::new(&scene, &accel, &options).expect("a plan")
    };
    let seed = Cell::new(0);
    let effort = Effort { rounds: if args.measure { 7 } else { 1 }, time: Duration::MAX, turn: Duration::ZERO };
    // Planning builds the light tree: not part of what a sample costs, so it happens before the turn.
    let plans: Vec<_> = (0..ways.len()).map(|way| plan(way, 0)).collect();
    let turns = interleave(ways.len(), 1, effort, &mut Probe::new(), |way| {
        seed.set(seed.get() + 1);
        let mut plan = plans[way].clone();
        plan.options.seed = seed.get();
        let outcome = drive::render(&scene, &accel, &camera, &plan, &Unobserved).expect("a render");
        Turn { rate: 1.0 / variance(&outcome.picture, plan.options.samples), waited: 0.0 }
    });
    for (way, &(selection, sampling, light_samples)) in ways.iter().enumerate() {
        // Processor time of as many samples as the first way takes.
        let cpu = |way: usize| {
            let scale = f64::from(plans[0].options.samples) / f64::from(plans[way].options.samples);
            turns.samples[way].iter().map(move |s| s.cpu * scale)
        };
        let efficiency = |way: usize| turns.samples[way].iter().zip(cpu(way)).map(|(s, cpu)| s.rate / cpu);
        let gain = Quartiles::of(efficiency(way).zip(efficiency(0)).map(|(a, b)| a / b));
        let variance = Quartiles::of(turns.samples[way].iter().map(|s| 1.0 / s.rate)).median;
        let first = Quartiles::of(turns.samples[0].iter().map(|s| 1.0 / s.rate)).median;
        println!(
            "| {name} | {emitters} | {selection:?} {sampling:?} -l {light_samples} | {} | {variance:.3} | {:.3} | {:.3} | **{:.2}** | {:.2}–{:.2} |",
            plans[way].transport.shadow_samples,
            variance / first,
            Quartiles::of(cpu(way).zip(cpu(0)).map(|(a, b)| a / b)).median,
            gain.median,
            gain.low,
            gain.high,
        );
    }
}

/// Variance of one sample of a pixel, over the square of the picture's mean.
fn variance(picture: &Picture, samples: u32) -> f64 {
    let sum = |layer: &[[f32; 3]]| layer.iter().flatten().map(|&c| f64::from(c)).sum::<f64>();
    let count = 3.0 * picture.beauty.len() as f64;
    let mean = sum(&picture.beauty) / count;
    sum(picture.variance.as_ref().expect("variances")) / count * f64::from(samples) / (mean * mean)
}

fn material(scene: &mut SceneDescription, albedo: f32, emission: Vec3) -> u32 {
    scene.materials.push(MaterialDescription {
        name: String::new(),
        at: Default::default(),
        surface: Surface::Diffuse { albedo: Vec3::splat(albedo) },
        emission,
    });
    scene.materials.len() as u32 - 1
}

/// A floor of 10 × 10 with 25 blocks, and a camera that sees it.
fn floor() -> (SceneDescription, Camera) {
    let mut scene = SceneDescription::default();
    let grey = material(&mut scene, 0.5, Vec3::ZERO);
    let mut mesh = MeshDescription { material: grey, ..Default::default() };
    quad(&mut mesh, [Vec3::new(-5.0, 0.0, -5.0), Vec3::Z * 10.0, Vec3::X * 10.0]);
    for i in 0..25u32 {
        let [x, z, height, size] = uniform4(i, 0, 0, 11);
        let (side, height) = (0.2 + 0.4 * size, 0.2 + 0.5 * height);
        let corner = Vec3::new((i % 5) as f32 * 2.0 - 5.0 + x, 0.0, (i / 5) as f32 * 2.0 - 5.0 + z);
        let [u, v, w] = [Vec3::X * side, Vec3::Y * height, Vec3::Z * side];
        let sides = [[corner, v, u], [corner, w, v], [corner + v, w, u], [corner + u, v, w], [corner + w, u, v]];
        sides.into_iter().for_each(|side| quad(&mut mesh, side));
    }
    scene.meshes.push(mesh);
    let camera = Camera::look(DVec3::new(0.0, 5.0, 9.0), DVec3::new(0.0, -5.0, -8.0), DVec3::Y, 0.55, 0.41);
    (scene, camera.expect("a camera"))
}

fn quad(mesh: &mut MeshDescription, [corner, u, v]: [Vec3; 3]) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend([corner, corner + u, corner + u + v, corner + v]);
    mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
}

/// Lamp `i` of `n`: middle, half-width, power relative to the others'.
fn lamp(i: u32, n: u32) -> (Vec3, f32, f32) {
    let across = f64::from(n).sqrt().ceil() as u32;
    let step = 9.0 / across as f32;
    let [x, y, z, w] = uniform4(i, 0, 0, 12);
    let place = Vec3::new((i % across) as f32 + x, 0.0, (i / across) as f32 + z) * step;
    let half = (0.12 * step).min(0.2);
    (place + Vec3::new(-4.5, 0.9 + y, -4.5), half, 10.0f32.powf(3.0 * w))
}

fn lamps(n: u32) -> Option<(SceneDescription, Camera)> {
    let (mut scene, camera) = floor();
    for i in 0..n {
        let (center, half, power) = lamp(i, n);
        let color = Vec3::new(1.0, 0.9, 0.8) * power;
        if i % 3 == 2 {
            let glow = material(&mut scene, 0.0, color);
            let (name, at, radius) = (String::new(), Default::default(), half);
            scene.spheres.push(SphereDescription { name, at, center, radius, double: None, material: glow });
        } else {
            scene.area_lights.push(AreaLightDescription {
                name: String::new(),
                at: Default::default(),
                center,
                double: None,
                side_u: Vec3::X * (2.0 * half),
                side_v: Vec3::Z * (2.0 * half),
                direction: Vec3::NEG_Y,
                radiance: color,
            });
        }
    }
    Some((scene, camera))
}

/// About `n` triangles in one mesh, two a lamp.
fn shards(n: u32) -> Option<(SceneDescription, Camera)> {
    let (mut scene, camera) = floor();
    let glow = material(&mut scene, 0.0, Vec3::new(1.0, 0.9, 0.8));
    let mut mesh = MeshDescription { material: glow, ..Default::default() };
    let lamps = n.div_ceil(2);
    for i in 0..lamps {
        let (center, half, power) = lamp(i, lamps);
        let half = half * (0.2 + 0.8 * power / 1000.0);
        let (u, v) = (Vec3::X * (2.0 * half), Vec3::Z * (2.0 * half));
        quad(&mut mesh, [center - u * 0.5 - v * 0.5, u, v]);
    }
    scene.meshes.push(mesh);
    Some((scene, camera))
}
