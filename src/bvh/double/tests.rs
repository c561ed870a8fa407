use super::*;
use crate::sampling::v3::V3;
use crate::scene::origin::Origin;
use crate::scene::shapes::{Geometry, NO_LIGHT, Shapes, Sphere, SphereInDouble};
use glam::Vec3;

/// Numbers from −1 to 1.
struct Random(u64);

impl Random {
    fn signed(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.signed(), self.signed(), self.signed())
    }
}

/// Small triangles and spheres around a place far away, of which single precision knows nothing, and a few of its distance.
fn scene(place: DVec3, count: usize, seed: u64) -> Shapes {
    let mut random = Random(seed);
    let mut shapes = Shapes::default();
    for number in 0..count {
        let size = if number % 50 == 0 { place.length().max(1.0) } else { 0.1 };
        let center = place + random.vector();
        let first = shapes.double.len() as u32;
        shapes.double.extend((0..3).map(|_| Origin::double(center + random.vector() * size).wide()));
        shapes.triangles.push([first, first + 1, first + 2]);
    }
    for _ in 0..count / 10 {
        let center = Origin::double(place + random.vector()).wide();
        shapes.spheres.push(Sphere { center: center.as_vec3(), radius: 0.05 });
        shapes.spheres_double.push(SphereInDouble { center, radius: 0.05 });
    }
    shapes.positions = shapes.double.iter().map(|p| p.as_vec3()).collect();
    let prim_count = shapes.prim_count() as u32;
    let geometry = Geometry { name: String::new(), first_prim: 0, prim_count, material: 0, light: NO_LIGHT };
    shapes.geometries = vec![geometry];
    shapes
}

/// A tree finds what the test of every primitive finds, to the bit, near the origin and far from it; and something at all.
#[test]
fn trees_and_lists_give_the_same_hits() {
    for (number, far) in [0.0, 1e3, 1e7, 1e12].into_iter().enumerate() {
        let place = DVec3::new(0.6, -0.64, 0.48) * far;
        let shapes = scene(place, 2000, number as u64);
        let (tree, list) = (Double::build(&shapes), Double::list(&shapes));
        assert!(tree.is_tree() && !list.is_tree());
        assert!(tree.stats().depth < 40 && tree.stats().leaf_blocks > 400, "{:?}", tree.stats());
        let (mut random, mut pending) = (Random(77), Pending::new());
        let (mut hits, mut tests) = (0, 0);
        for turn in 0..2000 {
            let from = if turn % 4 == 0 { place * -0.5 } else { place + random.vector() * 2.0 };
            let direction = (place + random.vector() * 0.7 - from).as_vec3();
            let t_max = if turn % 3 == 0 { random.signed().abs() as f32 * 2.0 } else { f32::INFINITY };
            let ray = Ray { t_max, ..Ray::leaving(Origin::double(from), V3::from(direction)) };
            let (mut of_tree, mut of_list) = (TraversalCounts::default(), TraversalCounts::default());
            let hit = tree.hit::<false>(&ray, &mut pending, &mut of_tree);
            assert_eq!(hit, list.hit::<false>(&ray, &mut pending, &mut of_list), "{ray:?}");
            assert_eq!(tree.hit::<true>(&ray, &mut pending, &mut of_list).is_some(), hit.is_some(), "{ray:?}");
            hits += u32::from(hit.is_some());
            tests += of_tree.primitive_tests;
        }
        assert!(hits > 500, "{hits} of 2000 hit at {far:e}");
        // Most of a tree is left out, however far away it stands.
        assert!(tests < 2000 * 300, "{tests} tests at {far:e}");
    }
}

/// In a grid of squares cut in two, far from the origin, rays at edges and vertices hit: none passes between triangles.
#[test]
fn no_ray_passes_between_triangles() {
    const N: usize = 20;
    let place = DVec3::new(6e6, -6.4e6, 4.8e6);
    let mut random = Random(5);
    let mut shapes = Shapes::default();
    let bump = |random: &mut Random| random.signed() * 0.02;
    for i in 0..=N {
        for j in 0..=N {
            let p = DVec3::new(i as f64, j as f64, 0.0) / N as f64 + DVec3::Z * bump(&mut random);
            shapes.double.push(Origin::double(place + p).wide());
        }
    }
    for i in 0..N as u32 {
        for j in 0..N as u32 {
            let corner = i * (N as u32 + 1) + j;
            let [a, b, c, d] = [corner, corner + N as u32 + 1, corner + N as u32 + 2, corner + 1];
            shapes.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    shapes.positions = shapes.double.iter().map(|p| p.as_vec3()).collect();
    let prim_count = shapes.prim_count() as u32;
    shapes.geometries = vec![Geometry { name: String::new(), first_prim: 0, prim_count, material: 0, light: NO_LIGHT }];
    let tree = Double::build(&shapes);
    let mut pending = Pending::new();
    for turn in 0..40_000u32 {
        let triangle = shapes.triangles[turn as usize * 7 % shapes.triangles.len()];
        let [a, b, _] = triangle.map(|vertex| shapes.double[vertex as usize]);
        let share = if turn % 2 == 0 { 0.0 } else { random.signed().abs() };
        let aim = a + (b - a) * share;
        // The rim has nothing on its other side.
        let inside = (aim - place).truncate();
        if inside.min_element() < 0.01 || inside.max_element() > 0.99 {
            continue;
        }
        let from = Origin::double(aim + random.vector() + DVec3::Z * 2.0);
        let direction = (aim - from.wide()).as_vec3();
        let hit =
            tree.hit::<false>(&Ray::leaving(from, direction.into()), &mut pending, &mut TraversalCounts::default());
        assert!(hit.is_some() && (hit.t - 1.0).abs() < 0.1, "turn {turn}: {hit:?}");
    }
}

#[test]
fn edges_of_the_range_and_nothing() {
    let nothing = Double::build(&Shapes::default());
    let ray = Ray::new(Vec3::new(0.25, 0.25, 1.0), Vec3::NEG_Z);
    let (mut pending, mut counts) = (Pending::new(), TraversalCounts::default());
    assert_eq!(nothing.hit::<false>(&ray, &mut pending, &mut counts), Hit::NONE);
    assert!(nothing.bounds().is_empty() && nothing.boxes_at_depth(0).is_empty());

    let geometry = Geometry { name: String::new(), first_prim: 0, prim_count: 2, material: 0, light: NO_LIGHT };
    let shapes = Shapes {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        triangles: vec![[0, 1, 2]; 2],
        geometries: vec![geometry],
        ..Shapes::default()
    };
    let tree = Double::build(&shapes);
    let mut ask = |ray: Ray| tree.hit::<false>(&ray, &mut pending, &mut counts);
    assert_eq!(ask(ray), Hit { t: 1.0, u: 0.25, v: 0.25, prim: 0, geom: 0 }, "the smaller of equal ones");
    assert!(ask(Ray { t_max: 1.0, ..ray }).is_some(), "t_max counts");
    assert!(!ask(Ray { t_max: 1f32.next_down(), ..ray }).is_some());
    assert!(!ask(Ray { t_min: 1.0, ..ray }).is_some(), "t_min does not");
    for wrong in [
        Ray { direction: Vec3::ZERO, ..ray },
        Ray { origin: Vec3::NAN, ..ray },
        Ray { t_max: f32::NAN, ..ray },
        Ray { t_max: -1.0, ..ray },
    ] {
        assert_eq!(ask(wrong), Hit::NONE, "{wrong:?}");
    }
    // A ray in the plane of a box's face, and one along an edge.
    assert!(ask(Ray::new(Vec3::new(0.0, 0.5, 1e9), Vec3::NEG_Z)).is_some());
    assert!(ask(Ray::new(Vec3::new(0.0, 0.0, 1e9), Vec3::NEG_Z)).is_some());
}
