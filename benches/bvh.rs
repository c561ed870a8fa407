//! Building and traversal, on a bumpy sphere of about 300 000 triangles: names are stable, so that runs compare.
//!
//! Rays: `camera`, in tiles of 8×8 pixels; `bounce`, from the camera's hits in cosine-distributed directions;
//! `occlusion`, the bounce rays asked for any hit. One thread. Each bench checks its hits against the other tier
//! before it measures.

use std::hint::black_box;

use comber::bvh::{Accel, Bvh4, HitColumnsMut, RayColumns, Traversal};
use comber::options::{self, Quality};
use comber::scene::shapes::{Geometry, NO_LIGHT, Shapes};
use comber::simd::Tier;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;

/// Rays a call, as a wave would hand them over.
const WAVE: usize = 4096;

/// A sphere with bumps of several sizes: as irregular as a scan, and made from nothing.
fn bumpy_sphere(rings: u32, sectors: u32) -> Shapes {
    let mut shapes = Shapes::default();
    for i in 0..=rings {
        for j in 0..sectors {
            let (theta, phi) =
                (i as f32 / rings as f32 * std::f32::consts::PI, j as f32 / sectors as f32 * std::f32::consts::TAU);
            let p = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            let bump = |f: f32| (p.x * f).sin() * (p.y * f + 1.0).sin() * (p.z * f + 2.0).sin();
            shapes.positions.push(p * (1.0 + 0.2 * bump(5.0) + 0.05 * bump(23.0) + 0.01 * bump(91.0)));
            if i < rings {
                let at = |i: u32, j: u32| i * sectors + j % sectors;
                let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
                shapes.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    let prim_count = shapes.triangles.len() as u32;
    shapes.geometries =
        vec![Geometry { name: "bumpy".into(), first_prim: 0, prim_count, material: 0, light: NO_LIGHT }];
    shapes
}

/// Rays in columns.
#[derive(Default)]
struct Rays([Vec<f32>; 6]);

impl Rays {
    fn push(&mut self, origin: Vec3, direction: Vec3) {
        for (column, value) in self.0.iter_mut().zip(origin.to_array().into_iter().chain(direction.to_array())) {
            column.push(value);
        }
    }

    fn len(&self) -> usize {
        self.0[0].len()
    }

    fn wave(&self, rows: std::ops::Range<usize>) -> RayColumns<'_> {
        let [ox, oy, oz, dx, dy, dz] = self.0.each_ref().map(|column| &column[rows.clone()]);
        RayColumns { ox, oy, oz, dx, dy, dz, t_min: None, t_max: None, low: None }
    }
}

/// What the others are checked against.
const PLAIN: (Traversal, Tier) = (Traversal::Single, Tier::Baseline);

/// Every way through the tree on every tier.
fn kernels() -> Vec<(Traversal, Tier)> {
    let tiers = |way| Tier::available().into_iter().map(move |tier| (way, tier));
    Traversal::THROUGH_A_TREE.into_iter().flat_map(tiers).collect()
}

/// Hits in columns.
#[derive(PartialEq, Debug)]
struct Hits {
    floats: [Vec<f32>; 3],
    ids: [Vec<u32>; 2],
}

fn trace(accel: &Accel, (way, tier): (Traversal, Tier), rays: &Rays) -> Hits {
    let n = rays.len();
    let mut hits = Hits { floats: [(); 3].map(|()| vec![0.0; n]), ids: [(); 2].map(|()| vec![0; n]) };
    for start in (0..n).step_by(WAVE) {
        let rows = start..(start + WAVE).min(n);
        let [t, u, v] = hits.floats.each_mut().map(|column| &mut column[rows.clone()]);
        let [prim, geom] = hits.ids.each_mut().map(|column| &mut column[rows.clone()]);
        accel.closest_hits(way, tier, rays.wave(rows), HitColumnsMut { t, u, v, prim, geom });
    }
    hits
}

fn occluded(accel: &Accel, (way, tier): (Traversal, Tier), rays: &Rays) -> Vec<bool> {
    let mut occluded = vec![false; rays.len()];
    for start in (0..rays.len()).step_by(WAVE) {
        let rows = start..(start + WAVE).min(rays.len());
        accel.any_hits(way, tier, rays.wave(rows.clone()), &mut occluded[rows]);
    }
    occluded
}

fn camera() -> Rays {
    const SIDE: usize = 512;
    let mut rays = Rays::default();
    for pixel in 0..SIDE * SIDE {
        let (tile, within) = (pixel / 64, pixel % 64);
        let x = (tile % (SIDE / 8) * 8 + within % 8) as f32 / SIDE as f32 - 0.5;
        let y = (tile / (SIDE / 8) * 8 + within / 8) as f32 / SIDE as f32 - 0.5;
        rays.push(Vec3::new(0.0, 0.0, 3.5), Vec3::new(0.8 * x, 0.8 * y, -1.0).normalize());
    }
    rays
}

fn bounces(shapes: &Shapes, camera: &Rays, hits: &Hits) -> Rays {
    let mut state = 1u32;
    let mut random = move || {
        state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
        ((word >> 22) ^ word) as f32 / u32::MAX as f32
    };
    let mut rays = Rays::default();
    for row in (0..camera.len()).filter(|&row| hits.floats[0][row].is_finite()) {
        let ray = camera.wave(row..row + 1).ray(0);
        let [a, b, c] = shapes.corners(hits.ids[0][row]);
        let normal = (b - a).cross(c - a).normalize();
        let normal = if normal.dot(ray.direction) > 0.0 { -normal } else { normal };
        let (z, phi) = (2.0 * random() - 1.0, std::f32::consts::TAU * random());
        let r = (1.0 - z * z).max(0.0).sqrt();
        let direction = normal + 0.999 * Vec3::new(r * phi.cos(), r * phi.sin(), z);
        rays.push(ray.origin + ray.direction * hits.floats[0][row] + normal * 1e-4, direction.normalize());
    }
    rays
}

fn bench(criterion: &mut Criterion) {
    let shapes = bumpy_sphere(390, 390);
    let accel = Accel::build(&shapes, &options::AccelOptions::default()).expect("small enough");
    let camera = camera();
    let bounce = bounces(&shapes, &camera, &trace(&accel, PLAIN, &camera));

    let mut group = criterion.benchmark_group("bvh/build");
    group.sample_size(10).throughput(Throughput::Elements(shapes.triangles.len() as u64));
    for quality in [Quality::Fast, Quality::Default, Quality::Best] {
        group.bench_function(quality.name(), |b| {
            b.iter(|| Bvh4::build(black_box(&shapes), &options::AccelOptions { quality, ..Default::default() }))
        });
    }
    group.finish();

    for (name, rays) in [("camera", &camera), ("bounce", &bounce)] {
        let expected = trace(&accel, PLAIN, rays);
        let mut group = criterion.benchmark_group(format!("bvh/{name}"));
        group.sample_size(20).throughput(Throughput::Elements(rays.len() as u64));
        for kernel in kernels() {
            assert_eq!(trace(&accel, kernel, rays), expected, "kernels disagree");
            group.bench_function(format!("{:?}/{}", kernel.0, kernel.1.name()), |b| {
                b.iter(|| trace(&accel, kernel, black_box(rays)))
            });
        }
        group.finish();
    }

    let expected = trace(&accel, PLAIN, &bounce);
    let mut group = criterion.benchmark_group("bvh/occlusion");
    group.sample_size(20).throughput(Throughput::Elements(bounce.len() as u64));
    for kernel in kernels() {
        let any = occluded(&accel, kernel, &bounce);
        assert!(any.iter().zip(&expected.floats[0]).all(|(any, t)| *any == t.is_finite()), "any hit disagrees");
        group.bench_function(format!("{:?}/{}", kernel.0, kernel.1.name()), |b| {
            b.iter(|| occluded(&accel, kernel, black_box(&bounce)))
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
