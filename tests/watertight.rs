//! No ray leaves a closed mesh unseen: not through edges, not through vertices, not along the faces of boxes, at no
//! scale and no offset.

mod common;

use comber::bvh::{Accel, HitColumnsMut, RayColumns, Traversal};
use comber::options::{AccelOptions, LeafFormat, Quality};
use comber::scene::shapes::{Geometry, NO_LIGHT, Shapes};
use comber::simd::Tier;
use common::rays::{QUALITIES, Random, kernels};
use glam::Vec3;

/// A closed mesh, and how to find points inside it.
struct Solid {
    name: &'static str,
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    inside: fn(&mut Random) -> Vec3,
}

/// The cube [−1, 1]³. Half of the points inside it lie very close to faces and edges.
fn cube() -> Solid {
    let positions = (0..8).map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * 2.0 - 1.0);
    let quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    Solid {
        name: "cube",
        positions: positions.collect(),
        triangles: quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        inside: |random| {
            let mut point = random.vector();
            for axis in 0..3 {
                if random.below(3) == 0 {
                    let distance = 10f32.powi(-(random.below(6) as i32) - 1);
                    point[axis] = (1.0 - distance) * point[axis].signum();
                }
            }
            point
        },
    }
}

/// An icosahedron, its faces divided into four `levels` times.
fn icosphere(levels: u32) -> Solid {
    let g = (1.0 + 5f32.sqrt()) / 2.0;
    let mut positions = Vec::new();
    for (a, b) in [(1.0, g), (1.0, -g), (-1.0, g), (-1.0, -g)] {
        positions.extend([Vec3::new(0.0, a, b), Vec3::new(a, b, 0.0), Vec3::new(b, 0.0, a)]);
    }
    // Edges have length 2; faces are the triples of corners that are so far apart.
    let near = |a: usize, b: usize| (positions[a].distance(positions[b]) - 2.0).abs() < 1e-3;
    let mut triangles = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    triangles.push([a as u32, b as u32, c as u32]);
                }
            }
        }
    }
    for _ in 0..levels {
        let mut middles = std::collections::HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push(positions[a as usize] + positions[b as usize]);
                positions.len() as u32 - 1
            })
        };
        let mut finer = Vec::new();
        for [a, b, c] in triangles {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
        positions.iter_mut().for_each(|p| *p = p.normalize());
    }
    Solid { name: "icosphere", positions, triangles, inside: |random| random.vector() * 0.5 }
}

/// A torus: radius 1, tube 0.3.
fn torus(around: u32, tube: u32) -> Solid {
    let on_circle = |angle: f32| Vec3::new(angle.cos(), angle.sin(), 0.0);
    let turn = std::f32::consts::TAU;
    let mut solid = Solid {
        name: "torus",
        positions: Vec::new(),
        triangles: Vec::new(),
        inside: |random| {
            let (angle, offset) = (random.signed() * 4.0, random.vector() * 0.1);
            Vec3::new(angle.cos(), angle.sin(), 0.0) + offset
        },
    };
    for i in 0..around {
        for j in 0..tube {
            let (ring, section) =
                (on_circle(turn * i as f32 / around as f32), on_circle(turn * j as f32 / tube as f32) * 0.3);
            solid.positions.push(ring * (1.0 + section.x) + Vec3::Z * section.y);
            let corner = |i: u32, j: u32| (i % around) * tube + j % tube;
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            solid.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    solid
}

/// A ray from inside, in the solid's own space.
fn ray(random: &mut Random, solid: &Solid, kind: usize) -> (Vec3, Vec3) {
    let mut origin = (solid.inside)(random);
    let triangle = solid.triangles[random.below(solid.triangles.len())];
    let [a, b, _] = triangle.map(|i| solid.positions[i as usize]);
    let target = match kind {
        0 => return (origin, random.vector()),
        // Along an axis.
        1 => {
            let mut direction = Vec3::ZERO;
            direction[random.below(3)] = random.signed().signum();
            return (origin, direction);
        }
        // Along an axis and in the faces of boxes that touch this vertex, exactly through it or along its edges.
        2 => {
            let (axis, keep) = (random.below(3), random.below(3));
            for k in 0..3 {
                if k != axis && k != keep {
                    origin[k] = a[k];
                }
            }
            let mut direction = Vec3::ZERO;
            direction[axis] = random.signed().signum();
            return (origin, direction);
        }
        // At a vertex, at the middle of an edge, somewhere on an edge.
        3 => a,
        4 => (a + b) * 0.5,
        5 => a.lerp(b, random.signed().abs()),
        // At an edge that is much closer than the triangle is large, so that part of it lies behind.
        _ => {
            let target = a.lerp(b, random.signed().abs());
            origin = target + random.vector() * 10f32.powi(-(random.below(6) as i32) - 1);
            target
        }
    };
    (origin, target - origin)
}

/// Traces `count` rays from inside; every one must hit.
fn assert_closed(solid: &Solid, scale: f32, offset: f32, count: usize) {
    let place = |p: Vec3| p * scale + Vec3::new(1.0, -0.7, 0.3) * (offset * scale);
    let shapes = Shapes {
        positions: solid.positions.iter().map(|&p| place(p)).collect(),
        triangles: solid.triangles.clone(),
        geometries: vec![Geometry {
            name: String::new(),
            first_prim: 0,
            prim_count: solid.triangles.len() as u32,
            material: 0,
            light: NO_LIGHT,
        }],
        ..Shapes::default()
    };
    let compact = AccelOptions { leaves: LeafFormat::Compact, ..AccelOptions::default() };
    let mut trees: Vec<(Accel, AccelOptions)> = QUALITIES
        .into_iter()
        .map(|quality| AccelOptions { quality, ..AccelOptions::default() })
        .map(|options| (Accel::build(&shapes, &options).unwrap(), options))
        .collect();
    // Not every size suits compact nodes, which compact leaves need.
    trees.extend(Accel::build(&shapes, &compact).ok().map(|tree| (tree, compact)));
    let bounds = trees[0].0.bounds();
    let mut random = Random(u64::from(scale.to_bits()) << 32 | u64::from(offset.to_bits()));
    let mut columns: [Vec<f32>; 6] = Default::default();
    let mut kinds = Vec::new();
    while kinds.len() < count {
        let kind = random.below(7);
        let (origin, direction) = ray(&mut random, solid, kind);
        // These move the origin to the surface, or beyond it.
        if (kind == 2 || kind == 6) && !is_inside(solid, origin) {
            continue;
        }
        let origin = place(origin);
        // Far from the origin of coordinates, rounding may have put it onto the surface.
        if !(origin.cmpgt(bounds.min) & origin.cmplt(bounds.max)).all() {
            continue;
        }
        for axis in 0..3 {
            columns[axis].push(origin[axis]);
            columns[3 + axis].push(direction[axis]);
        }
        kinds.push(kind);
    }
    let [ox, oy, oz, dx, dy, dz] = &columns;
    let rays = RayColumns { ox, oy, oz, dx, dy, dz, t_min: None, t_max: None, low: None };
    // Every kernel on the usual trees, and one of them on every tree: kernels do not know how a tree was built.
    let ways = kernels().into_iter().flat_map(|kernel| trees.iter().map(move |tree| (kernel, tree)));
    let usual = (Traversal::InFlight, Tier::available().pop().expect("the baseline"));
    let ways = ways.filter(|(kernel, (_, options))| options.quality == Quality::Default || *kernel == usual);
    for ((way, tier), (accel, options)) in ways {
        let (mut t, mut u, mut v) = (vec![0.0; count], vec![0.0; count], vec![0.0; count]);
        let (mut prim, mut geom) = (vec![0; count], vec![0; count]);
        accel.closest_hits(
            way,
            tier,
            rays,
            HitColumnsMut { t: &mut t, u: &mut u, v: &mut v, prim: &mut prim, geom: &mut geom },
        );
        let mut occluded = vec![false; count];
        accel.any_hits(way, tier, rays, &mut occluded);
        let leaks: Vec<_> = (0..count).filter(|&i| t[i].is_infinite() || !occluded[i]).collect();
        assert!(
            leaks.is_empty(),
            "{} at scale {scale}, offset {offset}, {way:?} {}, {options:?}: {} of {count} rays leak; the first, of kind {}: {:?}",
            solid.name,
            tier.name(),
            leaks.len(),
            kinds[leaks[0]],
            rays.ray(leaks[0]),
        );
    }
}

/// Well inside, for the three solids here.
fn is_inside(solid: &Solid, p: Vec3) -> bool {
    match solid.name {
        "cube" => p.abs().max_element() < 1.0,
        "icosphere" => p.length() < 0.75,
        _ => (p.truncate().length() - 1.0).hypot(p.z) < 0.2,
    }
}

#[test]
fn solids_are_closed_at_every_scale() {
    for solid in [cube(), icosphere(3), torus(48, 24)] {
        for scale in [1e-6, 1.0, 1e6] {
            assert_closed(&solid, scale, 0.0, 400_000);
        }
    }
}

#[test]
fn solids_are_closed_far_from_the_origin() {
    for solid in [cube(), icosphere(3), torus(48, 24)] {
        for offset in [10.0, 1e3] {
            assert_closed(&solid, 1.0, offset, 100_000);
        }
    }
}
