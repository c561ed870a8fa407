//! The triangle test and the tree of `--precision f64`, judged by exact arithmetic: corners and origins are whole numbers of up to 45 bits,
//! directions of up to 20, so signs of edge volumes are exact in 128 bits.

use comber::bvh::Accel;
use comber::bvh::ray::Ray;
use comber::options::{AccelOptions, Precision};
use comber::sampling::v3::V3;
use comber::scene::double::ROUNDING;
use comber::scene::origin::Origin;
use comber::scene::shapes::{Geometry, NO_LIGHT, Shapes};
use comber::scene::{Scene, procedural};
use comber::transport;
use glam::{DVec3, Vec3};

/// SplitMix64 (Steele, Lea and Flood 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// In [−1, 1).
    fn signed(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.signed(), self.signed(), self.signed())
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }
}

type Exact = [i128; 3];

fn exact(p: DVec3) -> Exact {
    p.to_array().map(|x| x as i128)
}

fn minus(a: Exact, b: Exact) -> Exact {
    std::array::from_fn(|i| a[i] - b[i])
}

fn volume([ax, ay, az]: Exact, [bx, by, bz]: Exact, [cx, cy, cz]: Exact) -> i128 {
    ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
}

/// Whether a ray crosses a triangle; on its outline counts.
fn crosses(from: Exact, along: Exact, corners: [Exact; 3]) -> bool {
    let [a, b, c] = corners.map(|corner| minus(corner, from));
    let signs = [volume(along, b, c), volume(along, c, a), volume(along, a, b)].map(i128::signum);
    if signs.contains(&1) == signs.contains(&-1) {
        return false;
    }
    let turn = if signs.contains(&1) { 1 } else { -1 };
    volume(a, b, c).signum() * turn > 0
}

/// Whole numbers around `place`, up to `size` apart.
fn whole(random: &mut Random, place: DVec3, size: f64) -> DVec3 {
    (place + random.vector() * size).round()
}

fn shapes(double: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Shapes {
    let prim_count = triangles.len() as u32;
    Shapes {
        positions: double.iter().map(|p| p.as_vec3()).collect(),
        double,
        triangles,
        geometries: vec![Geometry { name: String::new(), first_prim: 0, prim_count, material: 0, light: NO_LIGHT }],
        ..Shapes::default()
    }
}

fn tree(shapes: &Shapes) -> Accel {
    Accel::build(shapes, &AccelOptions { precision: Precision::F64, ..AccelOptions::default() }).expect("a tree")
}

/// A unit in the last place of single precision is as large as the scene here.
const PLACE: DVec3 = DVec3::new(1.3e13, -0.9e13, 1.7e13);
const SIZE: f64 = 1_048_576.0;

/// Loose triangles, needles among them: what a ray truly hits, the tree finds; what the tree finds, the ray hits or passes by no more than
/// rounding.
#[test]
fn hits_are_those_of_exact_arithmetic() {
    let mut random = Random(11);
    let (mut rays, mut hits, mut misses, mut false_hits) = (0u32, 0u32, 0u32, 0u32);
    for scene in 0..40 {
        let mut double = Vec::new();
        for number in 0..24 {
            let center = whole(&mut random, PLACE, SIZE);
            let size = if number % 3 == 0 { SIZE } else { SIZE * 0.3 };
            let mut corners = [(); 3].map(|()| whole(&mut random, center, size));
            if number % 4 == 0 {
                // A needle: a millionth as wide as long.
                corners[2] = (corners[1] + DVec3::new(1.0, -1.0, 1.0)).round();
            }
            double.extend(corners);
        }
        let triangles: Vec<[u32; 3]> = (0..24).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let shapes = shapes(double, triangles);
        let accel = tree(&shapes);
        let mut single = accel.single();
        for turn in 0..2500 {
            let from = whole(&mut random, PLACE, SIZE * 2.0);
            let target = random.below(24) as u32;
            let corners = shapes.corners_in_double(target);
            let [u, v] = [(); 2].map(|()| random.signed().abs() * 0.5);
            let aim = match turn % 3 {
                0 => corners[random.below(3)],
                1 => corners[0] + (corners[1] - corners[0]) * u,
                _ => corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v,
            };
            // A whole direction of up to 20 bits; every third ray exactly at its aim, if that is so far away.
            let way = aim - from;
            let direction = (way / (way.abs().max_element() / 1_000_000.0).max(1.0)).round();
            if direction == DVec3::ZERO {
                continue;
            }
            rays += 1;
            let ray = Ray::leaving(Origin::double(from), V3::from(direction.as_vec3()));
            assert_eq!(ray.origin.as_dvec3() + ray.low.as_dvec3(), from, "48 bits hold it");
            let hit = single.closest_hit(&ray);
            let crossed = |prim| crosses(exact(from), exact(direction), shapes.corners_in_double(prim).map(exact));
            // Differences are up to 2²³, so f64 errs by a thousandth of this.
            let clearly = |prim| passes(from, direction, &shapes, prim) > 1e-6;
            if !hit.is_some() && (0..24).any(|prim| crossed(prim) && clearly(prim)) {
                misses += 1;
                println!("scene {scene}, turn {turn}: missed");
            }
            hits += u32::from(hit.is_some());
            // A ray that starts in a triangle does not cross it, but f64 may put the crossing a hair before the start.
            let ahead = f64::from(hit.t) * direction.length() > 1e-6;
            false_hits += u32::from(hit.is_some() && !crossed(hit.prim) && clearly(hit.prim) && ahead);
        }
    }
    println!("{rays} rays, {hits} hits, {misses} misses, {false_hits} false hits");
    assert!(rays > 90_000 && hits > rays / 2);
    assert_eq!((misses, false_hits), (0, 0));
}

/// How far a ray's line passes from the outline of a triangle.
fn passes(from: DVec3, direction: DVec3, shapes: &Shapes, prim: u32) -> f64 {
    let (x, y) = direction.normalize().any_orthonormal_pair();
    let seen = shapes.corners_in_double(prim).map(|corner| {
        let p = corner - from;
        glam::DVec2::new(p.dot(x), p.dot(y))
    });
    let segment = |p: glam::DVec2, q: glam::DVec2| {
        let along = q - p;
        let at = (-p.dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        (p + along * at).length()
    };
    segment(seen[0], seen[1]).min(segment(seen[1], seen[2])).min(segment(seen[2], seen[0]))
}

/// Distance between a point and a triangle.
fn distance(point: DVec3, corners: [DVec3; 3]) -> f64 {
    let [a, b, c] = corners.map(|corner| corner - point);
    let normal = (b - a).cross(c - a);
    if [(a, b), (b, c), (c, a)].iter().all(|&(p, q)| p.cross(q).dot(normal) >= 0.0) {
        return (a.dot(normal) / normal.length()).abs();
    }
    let segment = |p: DVec3, q: DVec3| {
        let at = (-p.dot(q - p) / (q - p).length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        (p + (q - p) * at).length()
    };
    segment(a, b).min(segment(b, c)).min(segment(c, a))
}

/// Paths inside closed meshes, far from the origin: no ray leaves, and none hits again what it left.
#[test]
fn closed_meshes_far_away_do_not_leak() {
    let (mut all, mut excused) = (0u64, 0u64);
    for (spec, place) in [
        ("proc:sphere,tris=500", DVec3::ZERO),
        ("proc:sphere,tris=500", DVec3::new(3e6, -5e6, 7e6)),
        ("proc:blob,tris=3000", DVec3::new(-4e7, 1e7, 2e7)),
        ("proc:cubes,tris=12", DVec3::new(6e9, 3e9, -2e9)),
        ("proc:torus,tris=800", DVec3::new(1e5, 2e5, 3e5)),
    ] {
        let mesh = procedural::generate(spec).expect("a mesh").meshes.remove(0);
        let double = mesh.positions.iter().map(|p| Origin::double(p.as_dvec3() + place).wide()).collect();
        let scene = Scene { shapes: shapes(double, mesh.triangles), ..Scene::default() };
        let accel = tree(&scene.shapes);
        let (mut single, mut random) = (accel.single(), Random(3));
        let start = |random: &mut Random| {
            // Just below the middle of a triangle, whose front is outside.
            loop {
                let prim = random.below(scene.shapes.triangles.len()) as u32;
                let [a, b, c] = scene.shapes.corners_in_double(prim);
                let normal = (b - a).cross(c - a).normalize();
                if normal.is_finite() {
                    break Origin::double((a + b + c) / 3.0 - normal * 0.01);
                }
            }
        };
        let (mut origin, mut left) = (start(&mut random), None);
        let mut direction = random.vector().normalize().as_vec3();
        let mut length = 0;
        for _ in 0..100_000 {
            let hit = single.closest_hit(&Ray::leaving(origin, direction.into()));
            all += 1;
            if !hit.is_some() && length > 0 {
                // In the angle between two triangles, rounding may put a point behind the other one.
                let bound = (place.abs().max_element() + 2.0) * 3.0 * ROUNDING;
                let others = (0..scene.shapes.triangles.len() as u32).filter(|&prim| Some(prim) != left);
                let near = others.map(|prim| distance(origin.wide(), scene.shapes.corners_in_double(prim)));
                let near = near.fold(f64::INFINITY, f64::min);
                assert!(near < bound, "{spec} at {place}: a ray left the mesh: {origin:?} along {direction}, {near:e}");
                excused += 1;
            }
            assert!(left != Some(hit.prim), "{spec} at {place}: {hit:?} again, from {origin:?} along {direction}");
            length += 1;
            if !hit.is_some() || length == 16 {
                (origin, left, length) = (start(&mut random), None, 0);
                direction = random.vector().normalize().as_vec3();
                continue;
            }
            let at = transport::surface_at(&scene, &hit, origin, direction.into());
            let normal = Vec3::from(at.geometric);
            // One in four 89.9999° from the normal.
            let tangent = normal.cross(random.vector().as_vec3()).normalize();
            direction = match random.below(4) {
                0 => (tangent + normal * 1.745e-6).normalize(),
                _ => (normal + random.vector().normalize().as_vec3() * 0.999).normalize(),
            };
            (origin, left) = (at.origin, Some(hit.prim));
        }
    }
    println!("{all} rays, {excused} left where rounding may put them outside");
    assert!(excused * 100_000 <= all, "{excused} of {all}");
}
