//! Points on lights and the choice among lights: drawn as often as their densities say, and densities that are those of the draws.

mod common;

use comber::light::Light;
use comber::light::shape::{EmissiveMesh, EmissiveSphere, LightShape, Parallelogram};
use comber::light::tree::LightTree;
use comber::material::diffuse;
use comber::options::LightSampling;
use comber::sampling::random::uniform4;
use comber::sampling::v3::V3;
use comber::sampling::warp;
use common::statistics::ALPHA;
use glam::Vec3;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f32::consts::PI;

/// χ² tests judged together: none of `tests` may be rarer than its share of [`ALPHA`].
fn check_rarest(claim: &str, results: &[(f64, String)]) {
    let least = results.iter().min_by(|a, b| a.0.total_cmp(&b.0)).expect("a test");
    let limit = 1.0 - (1.0 - ALPHA).powf(1.0 / results.len() as f64);
    println!("{claim}: {} tests, smallest p {:.1e} of {limit:.1e} ({})", results.len(), least.0, least.1);
    assert!(least.0 >= limit, "{claim}: p = {:.1e} below {limit:.1e} at {}", least.0, least.1);
}

/// p of counts beside expectations; cells that expect fewer than 8 are put together.
fn p_value(counts: &[u32], expected: &[f64], what: &str) -> f64 {
    let (mut chi2, mut cells, mut rest) = (0.0, 0, (0.0, 0.0));
    for (&count, &expected) in counts.iter().zip(expected) {
        let count = f64::from(count);
        if expected >= 8.0 {
            chi2 += (count - expected).powi(2) / expected;
            cells += 1;
        } else {
            rest = (rest.0 + count, rest.1 + expected);
        }
    }
    if rest.1 >= 8.0 {
        chi2 += (rest.0 - rest.1).powi(2) / rest.1;
        cells += 1;
    } else {
        // Points near the edge of a cell may fall into it where midpoints do not: two in a thousand at most.
        let all = f64::from(counts.iter().sum::<u32>());
        assert!(rest.0 <= 0.002 * all, "{what}: {} samples where {} are expected", rest.0, rest.1);
    }
    if cells < 2 {
        // Nothing varies.
        return 1.0;
    }
    1.0 - ChiSquared::new(f64::from(cells - 1)).expect("cells").cdf(chi2)
}

/// Of the surface that asks: these ways to draw do not look at it.
const NORMAL: V3 = V3 { x: 0.0, y: 0.0, z: 1.0 };

const HOW: [LightSampling; 2] = [LightSampling::Area, LightSampling::SolidAngle];

fn light(shape: Option<LightShape>) -> Light {
    Light { name: String::new(), shape: shape.expect("a shape with area"), radiance: Vec3::ONE }
}

fn parallelogram(corner: Vec3, u: Vec3, v: Vec3) -> Light {
    light(Parallelogram::new(corner, u, v).map(LightShape::Parallelogram))
}

fn triangle(a: Vec3, b: Vec3, c: Vec3) -> Light {
    light(EmissiveMesh::new([[a, b, c]].into_iter()).map(LightShape::Mesh))
}

/// Lights around the origin that emit downwards, or everywhere.
fn lights() -> Vec<(&'static str, Light)> {
    let v = Vec3::new;
    let turned = glam::Quat::from_euler(glam::EulerRot::XYZ, 0.4, 1.1, -0.3);
    vec![
        ("square", parallelogram(v(-0.5, 0.0, -0.5), Vec3::X, Vec3::Z)),
        ("tube", parallelogram(v(-1.0, 0.0, -0.01), Vec3::X * 2.0, Vec3::Z * 0.02)),
        ("turned", parallelogram(turned * v(-0.5, 0.0, -0.3), turned * Vec3::X, turned * (Vec3::Z * 0.6))),
        ("askew", parallelogram(v(-0.5, 0.0, -0.5), v(1.0, 0.0, 0.4), Vec3::Z)),
        ("triangle", triangle(v(-0.5, 0.0, -0.4), v(0.6, 0.0, -0.3), v(-0.1, 0.0, 0.7))),
        ("sliver", triangle(v(-1.0, 0.0, 0.0), v(1.0, 0.0, 0.0), v(0.9, 0.0, 0.02))),
        ("sphere", light(EmissiveSphere::new(Vec3::ZERO, 0.5).map(LightShape::Sphere))),
    ]
}

/// Above, beside, near, far, nearly in the plane, behind.
const POINTS: [Vec3; 8] = [
    Vec3::new(0.1, -1.0, 0.2),
    Vec3::new(2.0, -0.7, -1.5),
    Vec3::new(0.2, -0.05, -0.1),
    Vec3::new(0.1, -0.004, 0.15),
    Vec3::new(1.4, -0.06, 0.3),
    Vec3::new(3.0, -40.0, 12.0),
    Vec3::new(0.0, -900.0, 30.0),
    Vec3::new(0.3, 1.0, 0.1),
];

/// Where a ray meets a light: distance, and cosine at it.
fn meets(light: &Light, from: V3, direction: V3) -> Option<(f32, f32)> {
    let (from, d) = (Vec3::from(from).as_dvec3(), Vec3::from(direction).as_dvec3());
    let plane = |corner: Vec3, sides: [Vec3; 2], normal: Vec3, inside: &dyn Fn(f64, f64) -> bool| {
        let (normal, [u, v]) = (normal.as_dvec3(), sides.map(|side| side.as_dvec3()));
        let cos = -d.dot(normal);
        let t = (from - corner.as_dvec3()).dot(normal) / cos;
        let at = from + d * t - corner.as_dvec3();
        let (uu, uv, vv, pu, pv) = (u.dot(u), u.dot(v), v.dot(v), at.dot(u), at.dot(v));
        let determinant = uu * vv - uv * uv;
        let (s, t2) = ((pu * vv - pv * uv) / determinant, (pv * uu - pu * uv) / determinant);
        (cos > 0.0 && t > 0.0 && inside(s, t2)).then_some((t as f32, cos as f32))
    };
    match &light.shape {
        LightShape::Parallelogram(p) => {
            let inside = |s: f64, t: f64| (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t);
            plane(p.corner, [p.side_u, p.side_v], p.normal, &inside)
        }
        LightShape::Mesh(mesh) => {
            let [a, b, c] = mesh.triangles[0].corners;
            plane(a, [b - a, c - a], mesh.triangles[0].normal, &|s, t| s >= 0.0 && t >= 0.0 && s + t <= 1.0)
        }
        LightShape::Sphere(s) => {
            let way = s.center.as_dvec3() - from;
            let along = way.dot(d);
            let chord = f64::from(s.radius).powi(2) - (way - d * along).length_squared();
            let t = along - chord.max(0.0).sqrt();
            (chord > 0.0 && t > 0.0).then(|| (t as f32, (chord.sqrt() / f64::from(s.radius)) as f32))
        }
    }
}

/// Cells of equal solid angle over a cap around an axis, and finer ones within them.
struct Cap {
    axis: V3,
    across: [V3; 2],
    height: f32,
}

impl Cap {
    const RINGS: usize = 12;
    const SECTORS: usize = 16;

    /// Just holds the light: its box seen from a point, or all directions.
    fn around(light: &Light, from: Vec3) -> Cap {
        let half = match &light.shape {
            LightShape::Sphere(s) => s.radius,
            LightShape::Parallelogram(p) => (p.side_u + p.side_v).length().max((p.side_u - p.side_v).length()) * 0.5,
            LightShape::Mesh(_) => 1.05,
        };
        let middle = match &light.shape {
            LightShape::Parallelogram(p) => p.corner + (p.side_u + p.side_v) * 0.5,
            _ => Vec3::ZERO,
        };
        // Past the middle, so that nothing narrow falls between the finer cells around the axis.
        let way = middle + Vec3::new(0.11, 0.05, -0.13) * half - from;
        let sin = half * 1.22 / way.length();
        let height = if sin < 1.0 { sin * sin / (1.0 + (1.0 - sin * sin).sqrt()) } else { 2.0 };
        let axis = V3::from(way.normalize());
        let (t, b) = warp::basis(axis);
        // Turned a little, so that no edge of a light lies along the edge of cells.
        let across = [t * 0.8 + b * 0.6, b * 0.8 - t * 0.6];
        Cap { axis, across, height }
    }

    fn cell(&self, direction: V3) -> Option<usize> {
        let [t, b] = self.across;
        let (x, y) = (direction.dot(t), direction.dot(b));
        // 1 − cos, without cancellation for narrow caps.
        let chord = direction - self.axis;
        let ring = chord.dot(chord) * 0.5 / self.height * Self::RINGS as f32;
        let sector = (y.atan2(x) / (2.0 * PI) + 0.5) * Self::SECTORS as f32;
        (ring < Self::RINGS as f32).then(|| ring as usize * Self::SECTORS + (sector as usize).min(Self::SECTORS - 1))
    }

    /// The integral of a density over each cell, by midpoints.
    fn integrals(&self, density: impl Fn(V3) -> f64) -> Vec<f64> {
        const FINE: usize = 96;
        let [t, b] = self.across;
        let mut cells = vec![0.0; Self::RINGS * Self::SECTORS];
        let share = 2.0 * std::f64::consts::PI * f64::from(self.height) / (cells.len() * FINE * FINE) as f64;
        for i in 0..Self::RINGS * FINE {
            let drop = self.height * (i as f32 + 0.5) / (Self::RINGS * FINE) as f32;
            let sin = (drop * (2.0 - drop)).sqrt();
            for j in 0..Self::SECTORS * FINE {
                let angle = (j as f32 + 0.5) / (Self::SECTORS * FINE) as f32 * 2.0 * PI - PI;
                let direction = t * (sin * angle.cos()) + b * (sin * angle.sin()) + self.axis * (1.0 - drop);
                cells[i / FINE * Self::SECTORS + j / FINE] += density(direction) * share;
            }
        }
        cells
    }
}

/// The integral of a density over each cell of `cap`: by midpoints of the light's surface, dω = cos / r² dA, which however narrow
/// a light is seen stay on it; spheres by midpoints of directions.
fn integrals(light: &Light, cap: &Cap, from: Vec3, density: impl Fn(V3) -> f64) -> Vec<f64> {
    const FINE: u32 = 1200;
    let (corner, u, v, half) = match &light.shape {
        LightShape::Sphere(_) => return cap.integrals(density),
        LightShape::Parallelogram(p) => (p.corner, p.side_u, p.side_v, false),
        LightShape::Mesh(mesh) => {
            let [a, b, c] = mesh.triangles[0].corners;
            (a, b - a, c - a, true)
        }
    };
    let [corner, u, v, from] = [corner, u, v, from].map(|x| x.as_dvec3());
    let normal = u.cross(v);
    let share = 1.0 / f64::from(FINE * FINE);
    let mut cells = vec![0.0; Cap::RINGS * Cap::SECTORS];
    for (i, j) in (0..FINE).flat_map(|i| (0..FINE).map(move |j| (i, j))) {
        let (s, t) = ((f64::from(i) + 0.5) / f64::from(FINE), (f64::from(j) + 0.5) / f64::from(FINE));
        if half && s + t > 1.0 {
            continue;
        }
        let way = corner + u * s + v * t - from;
        let squared = way.length_squared();
        let direction = way / squared.sqrt();
        let solid_angle = direction.dot(normal).abs() / squared * share;
        let direction = V3::from(direction.as_vec3());
        if let Some(cell) = cap.cell(direction) {
            cells[cell] += density(direction) * solid_angle;
        }
    }
    cells
}

#[test]
fn points_on_lights_follow_their_densities() {
    const SAMPLES: u32 = 60_000;
    let (mut results, mut narrow) = (Vec::new(), Vec::new());
    for (name, light) in lights() {
        for (number, point) in POINTS.into_iter().enumerate() {
            for how in HOW {
                let what = format!("{name} from {point}, {how:?}");
                let from = V3::from(point);
                let density = |direction: V3| {
                    meets(&light, from, direction)
                        .map_or(0.0, |(distance, cos)| f64::from(light.pdf(0, from, distance, cos, how)))
                };
                let cap = Cap::around(&light, point);
                let draw = |i: u32| {
                    let [u, v, ..] = uniform4(i, number as u32, how as u32, 5);
                    light.sample(0, from, NORMAL, [u, v], how)
                };
                if (0..1000).all(|i| draw(i).pdf == 0.0) {
                    assert!(density(-V3::from(point).normalize()) == 0.0, "{what}: nothing is drawn");
                    continue;
                }
                let mut counts = vec![0u32; Cap::RINGS * Cap::SECTORS];
                for i in 0..SAMPLES {
                    let sample = draw(i);
                    // Rounding may put a point that is seen edge on behind the light.
                    if sample.pdf == 0.0 {
                        continue;
                    }
                    let cell = cap.cell(sample.direction).unwrap_or_else(|| panic!("{what}: {sample:?} is outside"));
                    counts[cell] += 1;
                    if let Some((distance, cos)) = meets(&light, from, sample.direction) {
                        let pdf = light.pdf(0, from, distance, cos, how);
                        let ratio = pdf / sample.pdf;
                        // Shadow rays end before the light, which points nearly in its plane see under a larger angle.
                        let near = 1e-3 + 2.5e-5 / (distance * cos);
                        assert!((ratio - 1.0).abs() < near, "{what}: sampled {}, claimed {pdf}", sample.pdf);
                    }
                }
                let expected = integrals(&light, &cap, point, density);
                let whole: f64 = expected.iter().sum();
                // A density that rises steeply, next to a light, is coarsely integrated.
                if (whole - 1.0).abs() > 0.02 {
                    assert!((whole - 1.0).abs() < 0.15, "{what}: the density integrates to {whole}");
                    narrow.push(format!("{what}: {whole:.3}"));
                    continue;
                }
                let drawn: u32 = counts.iter().sum();
                let expected: Vec<_> = expected.iter().map(|e| e / whole * f64::from(drawn)).collect();
                results.push((p_value(&counts, &expected, &what), what));
            }
        }
    }
    println!("too narrow for the grid: {narrow:?}");
    assert!(narrow.len() <= 12 && results.len() > 70, "{} of {}", narrow.len(), results.len());
    check_rarest("points on lights", &results);
}

#[test]
fn solid_angle_is_uniform_over_the_light() {
    // Where it is used, all directions to a light weigh the same; the control is that areas do not.
    for (name, light) in lights().into_iter().take(3) {
        let from = V3::new(0.3, -0.6, 0.2);
        let densities = HOW.map(|how| {
            let mut range = (f32::INFINITY, 0.0f32);
            for i in 0..1000 {
                let [u, v, ..] = uniform4(i, 0, 0, 0);
                let pdf = light.sample(0, from, NORMAL, [u, v], how).pdf;
                range = (range.0.min(pdf), range.1.max(pdf));
            }
            range.1 / range.0
        });
        println!("{name}: largest ÷ smallest density {densities:?}");
        assert!(densities[1] == 1.0 && densities[0] > 1.2, "{name}");
    }
}

/// Lamps of different kind and power, near each other and apart: 60 rectangles, 40 spheres, a mesh of 100 triangles, a dark one.
fn many() -> Vec<Light> {
    let mut lights = Vec::new();
    for i in 0..100u32 {
        let [x, y, z, w] = uniform4(i, 0, 0, 3);
        let center = Vec3::new(x * 8.0 - 4.0, 1.0 + y, z * 8.0 - 4.0);
        let side = 0.05 + 0.2 * w;
        let mut lamp = if i % 5 < 3 {
            let (u, v) = (Vec3::X * side, if i % 2 == 0 { Vec3::Z } else { Vec3::Y } * side);
            parallelogram(center, u, v)
        } else {
            light(EmissiveSphere::new(center, side).map(LightShape::Sphere))
        };
        lamp.radiance = Vec3::new(w, 1.0, x) * 10.0f32.powi((i % 4) as i32);
        lights.push(lamp);
    }
    let shard = |i: u32| {
        let [x, y, z, w] = uniform4(i, 1, 0, 3);
        let corner = Vec3::new(x, y + 3.0, z) * 2.0;
        [corner, corner + Vec3::new(w, 0.1, 0.0) * 0.3, corner + Vec3::new(0.0, w - 0.5, 0.3)]
    };
    let flat = [Vec3::ZERO, Vec3::X, Vec3::X * 2.0];
    let shards = (0..100).map(shard).chain([flat]);
    lights.push(light(EmissiveMesh::new(shards).map(LightShape::Mesh)));
    lights.push(Light { radiance: Vec3::ZERO, ..lights[0].clone() });
    lights
}

#[test]
fn the_tree_picks_as_often_as_it_says() {
    let lights = many();
    let tree = LightTree::new(&lights);
    let parts: Vec<(usize, u32)> =
        lights.iter().enumerate().flat_map(|(i, light)| (0..light.parts()).map(move |part| (i, part))).collect();
    assert_eq!(tree.emitters(), parts.len());
    let (mut results, mut sums) = (Vec::new(), Vec::new());
    for place in 0..40 {
        let [x, y, z, w] = uniform4(place, 0, 0, 9);
        let from = V3::new(x * 10.0 - 5.0, y * 2.0 - 0.5, z * 10.0 - 5.0);
        let normal = warp::uniform_cap(x, w, 2.0f32);
        let what = format!("{from:?} facing {normal:?}");
        let probabilities: Vec<f64> =
            parts.iter().map(|&(light, part)| tree.probability(light, part, from, normal).into()).collect();
        let sum: f64 = probabilities.iter().sum();
        // What is missing to 1 are groups that only seemed to send light.
        assert!(sum < 1.0 + 1e-5, "{what}: probabilities sum to {sum}");
        let mut counts = vec![0u32; parts.len() + 1];
        let samples = 40_000;
        for i in 0..samples {
            let [u, v, ..] = uniform4(i, place, 1, 9);
            let Some(picked) = tree.pick(from, normal, f64::from(u) + f64::from(v) / f64::from(1 << 24)) else {
                counts[parts.len()] += 1;
                continue;
            };
            let number = parts.iter().position(|&part| part == (picked.light, picked.part)).expect("a part");
            let said = probabilities[number];
            assert!((f64::from(picked.probability) / said - 1.0).abs() < 1e-5, "{what}: {picked:?}, {said}");
            counts[number] += 1;
        }
        let outcomes = probabilities.iter().copied().chain([(1.0 - sum).max(0.0)]);
        let expected: Vec<_> = outcomes.map(|p| p * f64::from(samples)).collect();
        results.push((p_value(&counts, &expected, &what), what));
        // Neither the dark light nor the triangle without area is ever picked.
        assert_eq!(probabilities[parts.len() - 1], 0.0);
        assert_eq!(probabilities[parts.len() - 2], 0.0);
        sums.push(sum);
    }
    sums.sort_by(f64::total_cmp);
    println!("probabilities sum to {:.3} at worst, {:.3} in the median", sums[0], sums[sums.len() / 2]);
    check_rarest("picks of the tree", &results);
}

#[test]
fn what_lights_a_point_is_never_left_out() {
    // Wherever a sample of a part arrives on the front of the surface, the tree may pick that part.
    let lights = many();
    let tree = LightTree::new(&lights);
    let mut arrived = 0;
    for i in 0..3000u32 {
        let [x, y, z, w] = uniform4(i, 0, 0, 1);
        let from = V3::new(x * 10.0 - 5.0, y * 8.0 - 1.0, z * 10.0 - 5.0);
        let normal = warp::uniform_cap(w, x, 2.0f32);
        for (number, light) in lights.iter().enumerate().filter(|(_, light)| light.radiance != Vec3::ZERO) {
            let part = light.pick(y);
            let sample = light.sample(part, from, NORMAL, [z, w], LightSampling::SolidAngle);
            if sample.pdf > 0.0 && sample.direction.dot(normal) > 0.0 {
                arrived += 1;
                let probability = tree.probability(number, part, from, normal);
                assert!(probability > 0.0, "light {number}, part {part} lights {from:?} facing {normal:?}");
            }
        }
    }
    assert!(arrived > 10_000);
}

#[test]
fn trees_of_one_light_of_none_and_of_equals() {
    let at = (V3::new(0.0, -1.0, 0.0), V3::new(0.0, 1.0, 0.0));
    let lamp = || parallelogram(Vec3::ZERO, Vec3::X, Vec3::Z);
    assert!(LightTree::new(&[]).pick(at.0, at.1, 0.5).is_none());
    let dark = Light { radiance: Vec3::ZERO, ..lamp() };
    assert!(LightTree::new(std::slice::from_ref(&dark)).pick(at.0, at.1, 0.5).is_none());
    assert_eq!(LightTree::new(&[dark]).probability(0, 0, at.0, at.1), 0.0);
    let one = LightTree::new(&[lamp()]);
    assert_eq!(one.pick(at.0, at.1, 0.5).map(|p| (p.light, p.part, p.probability)), Some((0, 0, 1.0)));
    assert!(one.pick(at.0, -at.1, 0.5).is_none(), "nothing arrives on a surface that faces away");
    // All in one place: nothing to split by.
    let equal: Vec<Light> = (0..1000).map(|_| lamp()).collect();
    let tree = LightTree::new(&equal);
    let sum: f32 = (0..1000).map(|i| tree.probability(i, 0, at.0, at.1)).sum();
    assert!((sum - 1.0).abs() < 1e-4 && (tree.probability(7, 0, at.0, at.1) - 1e-3).abs() < 1e-6);
    // Strengths and sizes at the ends of what numbers can be.
    for (scale, radiance) in [(1e-12, 1e30), (1e12, 1e-30), (1.0, 1e30)] {
        let at_scale = |i: f32| {
            let lamp = parallelogram(Vec3::X * (i * 3.0 * scale), Vec3::X * scale, Vec3::Z * scale);
            Light { radiance: Vec3::splat(radiance), ..lamp }
        };
        let lights: Vec<Light> = (0..50).map(|i| at_scale(i as f32)).collect();
        let tree = LightTree::new(&lights);
        let from = at.0 * scale;
        let sum: f32 = (0..50).map(|i| tree.probability(i, 0, from, at.1)).sum();
        assert!((sum - 1.0).abs() < 1e-4, "scale {scale}, radiance {radiance}: {sum}");
    }
}

#[test]
fn the_diffuse_bsdf_is_reciprocal_and_conserves_energy() {
    let albedo = V3::new(0.3, 0.7, 1.0);
    // It depends on neither direction, which is reciprocity; with any two directions it is albedo / π.
    let f: V3 = diffuse::evaluate(albedo);
    assert!((f.y - 0.7 / PI).abs() < 1e-7);
    let normal = V3::new(0.3, -0.8, 0.52).normalize();
    let n = 512;
    let (mut reflected, mut density) = (0.0f64, 0.0f64);
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let direction =
            warp::to_world(warp::uniform_hemisphere((i as f32 + 0.5) / n as f32, (j as f32 + 0.5) / n as f32), normal);
        let cos = direction.dot(normal);
        reflected += f64::from(f.y * cos);
        density += f64::from(diffuse::pdf(cos));
    }
    let solid_angle = 2.0 * std::f64::consts::PI / f64::from(n * n);
    assert!((reflected * solid_angle - 0.7).abs() < 1e-5, "{}", reflected * solid_angle);
    assert!((density * solid_angle - 1.0).abs() < 1e-5);
    // A sample's weight is f·cos / pdf with the density that it claims; and no channel gains.
    for i in 0..10_000 {
        let [u, v, ..] = uniform4(i, 0, 0, 0);
        let sample = diffuse::sample(albedo, normal, normal, u, v);
        let cos = sample.direction.dot(normal);
        if sample.weight.is_zero() {
            continue;
        }
        assert!((sample.pdf - diffuse::pdf(cos)).abs() < 1e-6);
        for (weight, (f, albedo)) in
            [sample.weight.x, sample.weight.y, sample.weight.z].into_iter().zip([(f.x, 0.3), (f.y, 0.7), (f.z, 1.0)])
        {
            assert!(weight <= albedo && (f64::from(weight * sample.pdf) - f64::from(f * cos)).abs() < 1e-6);
        }
    }
}
