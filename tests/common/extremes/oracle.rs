//! What a ray truly hits, and by how much: the judge of every tracer.
//!
//! Corners and origins are f32, or sums of two f32 (48 bits, for `--precision f64`), directions f32, taken as the rational numbers that they are. A ray *crosses* a closed triangle if no two of its three
//! edge volumes have different signs and not all are 0 (rays in a triangle's plane do not cross it), at a distance above 0. These signs are exact.
//!
//! How much a tracer may err is one bound for all: [`BOUND`] times the largest coordinate of the primitive as seen from the ray's origin. It
//! is comber's own ([`comber::scene::surface::ROUNDING`]: 32 half-units in the last place), by which its rays leave surfaces.

use super::exact::{edge_sign, outside_sphere, side, sphere_sign, triple};
use comber::bvh::ray::{Hit, Ray};
use comber::scene::shapes::Shapes;
use comber::scene::surface::ROUNDING;
use glam::{DVec2, DVec3};

/// 32 half-units in the last place of 1.
pub const BOUND: f64 = ROUNDING as f64;

/// A true crossing.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    /// Distance in units of the direction, to the precision of f64.
    pub t: f64,
    /// How far, in units of the direction, the bound lets the distance err: more, the flatter the ray meets the surface.
    pub slack: f64,
    /// Whether the ray may be displaced by the bound and still crosses: it passes that far from the outline, and is not at its origin.
    pub certain: bool,
}

/// Where a ray starts, all of it.
pub fn origin(ray: &Ray) -> DVec3 {
    ray.origin.as_dvec3() + ray.low.as_dvec3()
}

/// The bound for a ray and a primitive, as a distance.
pub fn bound(ray: &Ray, shapes: &Shapes, prim: u32) -> f64 {
    let from = |p: DVec3| (p - origin(ray)).abs().max_element();
    BOUND
        * match sphere(shapes, prim) {
            Some((center, radius)) => from(center) + radius,
            None => shapes.corners_in_double(prim).map(from).into_iter().fold(0.0, f64::max),
        }
}

/// Centre and radius of the sphere, if the primitive is one.
pub fn sphere(shapes: &Shapes, prim: u32) -> Option<(DVec3, f64)> {
    (prim as usize).checked_sub(shapes.triangles.len()).map(|number| shapes.sphere_in_double(number))
}

/// All true crossings of a ray.
pub fn crossings(ray: &Ray, shapes: &Shapes, found: &mut Vec<Crossing>) {
    found.clear();
    for prim in 0..shapes.triangles.len() as u32 {
        found.extend(triangle(ray, shapes, prim));
    }
    for prim in shapes.triangles.len()..shapes.prim_count() {
        sphere_crossings(ray, shapes, prim as u32, found);
    }
}

/// The true crossing of a triangle.
pub fn triangle(ray: &Ray, shapes: &Shapes, prim: u32) -> Option<Crossing> {
    let corners = shapes.corners_in_double(prim);
    let [a, b, c] = corners;
    let (o, d) = (origin(ray), ray.direction.as_dvec3());
    let signs = [(b, c), (c, a), (a, b)].map(|(p, q)| edge_sign(o, ray.direction, p, q));
    if signs.contains(&1) == signs.contains(&-1) {
        return None;
    }
    let turn = if signs.contains(&1) { 1 } else { -1 };
    if side(o, corners) * turn <= 0 {
        return None;
    }
    let seen = corners.map(|corner| corner - o);
    let normal = (seen[1] - seen[0]).cross(seen[2] - seen[0]);
    let t = triple(seen[0], seen[1], seen[2]).0 / d.dot(normal);
    let bound = bound(ray, shapes, prim);
    let sine = d.dot(normal).abs() / normal.length().max(f64::MIN_POSITIVE);
    let slack = bound / sine.max(f64::MIN_POSITIVE);
    Some(Crossing { t, slack, certain: outline(d, seen) > bound && t > slack })
}

/// Distance between the ray's line and the outline of a triangle, seen along the ray. `seen`: the corners from the origin.
fn outline(d: DVec3, seen: [DVec3; 3]) -> f64 {
    let (x, y) = d.normalize().any_orthonormal_pair();
    let flat = seen.map(|p| DVec2::new(p.dot(x), p.dot(y)));
    let segment = |p: DVec2, q: DVec2| {
        let along = q - p;
        let at = (-p.dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        (p + along * at).length()
    };
    segment(flat[0], flat[1]).min(segment(flat[1], flat[2])).min(segment(flat[2], flat[0]))
}

fn sphere_crossings(ray: &Ray, shapes: &Shapes, prim: u32, found: &mut Vec<Crossing>) {
    let Some((center, r)) = sphere(shapes, prim) else { return };
    if sphere_sign(origin(ray), ray.direction, center, r) < 0 {
        return;
    }
    let (f, d) = (center - origin(ray), ray.direction.as_dvec3());
    let (length, bound) = (d.length(), bound(ray, shapes, prim));
    let unit = d / length;
    let past = f.cross(unit).length();
    let half = ((r - past).max(0.0) * (r + past)).sqrt();
    let outside = outside_sphere(origin(ray), center, r);
    // What lies behind the origin does not count: from inside the near side, from outside both if the centre lies behind.
    let near = (outside > 0 && f.dot(unit) > 0.0).then(|| f.dot(unit) - half);
    let far = (outside < 0 || near.is_some()).then(|| f.dot(unit) + half);
    for t in [near, far].into_iter().flatten() {
        let slack = bound * r / half.max(f64::MIN_POSITIVE);
        found.push(Crossing { t: t / length, slack: slack / length, certain: r - past > bound && t > slack });
    }
}

/// Whether the point that a hit reports lies within the bound of its primitive.
pub fn truthful(ray: &Ray, t: f32, shapes: &Shapes, prim: u32) -> bool {
    off(ray, t, shapes, prim) <= bound(ray, shapes, prim)
}

/// How far the point that a hit reports lies from its primitive.
fn off(ray: &Ray, t: f32, shapes: &Shapes, prim: u32) -> f64 {
    // Seen from the ray's origin: far from that of the coordinates, f64 has no place for the point itself.
    let (o, along) = (origin(ray), ray.direction.as_dvec3() * f64::from(t));
    match sphere(shapes, prim) {
        Some((center, radius)) => ((along - (center - o)).length() - radius).abs(),
        None => distance(along, shapes.corners_in_double(prim).map(|corner| corner - o)),
    }
}

/// Distance between a point and a triangle.
pub fn distance(point: DVec3, corners: [DVec3; 3]) -> f64 {
    let corners = corners.map(|corner| corner - point);
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a);
    let inside = [(a, b), (b, c), (c, a)].iter().all(|&(p, q)| p.cross(q).dot(normal) >= 0.0);
    if inside && normal != DVec3::ZERO {
        return (a.dot(normal) / normal.length()).abs();
    }
    let segment = |p: DVec3, q: DVec3| {
        let along = q - p;
        let at = (-p.dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        (p + along * at).length()
    };
    segment(a, b).min(segment(b, c)).min(segment(c, a))
}

/// How often a closed mesh winds round a point (van Oosterom and Strackee 1983): 0 outside; not a number on the surface.
pub fn winding(point: DVec3, shapes: &Shapes) -> f64 {
    let solid_angle = |prim: u32| {
        let [a, b, c] = shapes.corners_in_double(prim).map(|corner| corner - point);
        let (x, y, z) = (a.length(), b.length(), c.length());
        let below = x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y;
        let above = triple(a, b, c).0;
        if above == 0.0 && below <= 0.0 { f64::NAN } else { 2.0 * above.atan2(below) }
    };
    let degenerate = |prim: u32| {
        let [a, b, c] = shapes.corners_in_double(prim);
        (b - a).cross(c - a) == DVec3::ZERO
    };
    let faces = (0..shapes.triangles.len() as u32).filter(|&prim| !degenerate(prim));
    faces.map(solid_angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

/// How far a ray's line passes from a primitive; 0 through it.
pub fn passes(ray: &Ray, shapes: &Shapes, prim: u32) -> f64 {
    let (o, d) = (origin(ray), ray.direction.as_dvec3());
    if let Some((center, radius)) = sphere(shapes, prim) {
        let past = (center - o).cross(d.normalize()).length();
        return (past - radius).max(0.0);
    }
    let corners = shapes.corners_in_double(prim);
    let [a, b, c] = corners;
    let signs = [(b, c), (c, a), (a, b)].map(|(p, q)| edge_sign(o, ray.direction, p, q));
    let through = signs.contains(&1) != signs.contains(&-1);
    if through { 0.0 } else { outline(d, corners.map(|corner| corner - o)) }
}

/// On which side of a triangle's plane a ray starts; 0 for spheres.
pub fn side_of_start(ray: &Ray, shapes: &Shapes, prim: u32) -> i32 {
    if sphere(shapes, prim).is_some() { 0 } else { side(origin(ray), shapes.corners_in_double(prim)) }
}

/// Whether a ray that left a primitive truly meets it again: a sphere from inside, or a triangle from the side on which `incoming` came, because its
/// direction, which was right as rounded, points below the surface.
pub fn returns(ray: &Ray, hit: &Hit, shapes: &Shapes, incoming: i32) -> bool {
    if let Some((center, radius)) = sphere(shapes, hit.prim) {
        let mut truth = Vec::new();
        crossings(ray, shapes, &mut truth);
        let slack = |c: &Crossing| c.slack + bound(ray, shapes, hit.prim);
        return outside_sphere(origin(ray), center, radius) < 0
            && truth.iter().any(|c| (c.t - f64::from(hit.t)).abs() <= slack(c));
    }
    incoming != 0 && side_of_start(ray, shapes, hit.prim) == incoming && triangle(ray, shapes, hit.prim).is_some()
}
