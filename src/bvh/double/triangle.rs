//! The watertight ray–triangle test of [`crate::bvh::watertight`], in double precision throughout.
//!
//! Both triangles at an edge compute the same numbers for it, with opposite signs: products of `f64` are rounded, but rounding keeps order, so a
//! difference that is not 0 has the right sign. Where it is 0, what rounding took from the products decides (`fma`, which gives it
//! exactly). So the side on which a ray passes a sheared edge is always known, and no ray slips between triangles.

use glam::DVec3;

/// A ray as the test needs it.
#[derive(Clone, Copy, Debug)]
pub struct Sheared {
    /// The two other axes, then the axis of the largest direction component.
    axes: [usize; 3],
    /// Origin, permuted by `axes`.
    origin: [f64; 3],
    /// What to subtract from x and y per unit of z.
    shear: [f64; 2],
    /// The largest direction component.
    depth: f64,
}

/// Where a ray crosses the plane of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Distance in units of the ray's direction.
    pub t: f64,
    /// Weight of the second corner.
    pub u: f64,
    /// Weight of the third corner.
    pub v: f64,
}

impl Sheared {
    /// Permutes and shears. The direction must not be zero.
    #[inline(always)]
    pub fn new(origin: DVec3, direction: DVec3) -> Sheared {
        let d = direction.abs();
        let axes = if d.x > d.y && d.x > d.z {
            [1, 2, 0]
        } else if d.y > d.z {
            [2, 0, 1]
        } else {
            [0, 1, 2]
        };
        let [x, y, z] = axes.map(|axis| direction[axis]);
        Sheared { axes, origin: axes.map(|axis| origin[axis]), shear: [x / z, y / z], depth: z }
    }
}

/// Tests one triangle, from both sides.
#[inline(always)]
pub fn cross(ray: &Sheared, corners: [DVec3; 3]) -> Option<Crossing> {
    let [ax, ay, az] = ray.axes;
    let seen = corners.map(|corner| {
        let z = corner[az] - ray.origin[2];
        let x = (corner[ax] - ray.origin[0]) - ray.shear[0] * z;
        let y = (corner[ay] - ray.origin[1]) - ray.shear[1] * z;
        [x, y, z]
    });
    let [a, b, c] = [edge(seen[2], seen[1]), edge(seen[0], seen[2]), edge(seen[1], seen[0])];
    if (a < 0.0 || b < 0.0 || c < 0.0) && (a > 0.0 || b > 0.0 || c > 0.0) {
        return None;
    }
    let area = a + b + c;
    if area == 0.0 {
        return None;
    }
    let along = [corners[1] - corners[0], corners[2] - corners[0]];
    if let Some([a, b, c]) = edge_on(seen, area) {
        let t = (a * seen[0][2] + b * seen[1][2] + c * seen[2][2]) / ray.depth;
        return (normal(along.map(|edge| edge.to_array())) != [0.0; 3]).then_some(Crossing { t, u: b, v: c });
    }
    let longest = along[0].length_squared().max(along[1].length_squared());
    // After overflow these may be NaN, which no range of `t` contains.
    let t = if along[0].cross(along[1]).length_squared() < longest * longest * BROAD {
        to_plane(ray, corners[0], along)?
    } else {
        (a * seen[0][2] + b * seen[1][2] + c * seen[2][2]) / (area * ray.depth)
    };
    Some(Crossing { t, u: b / area, v: c / area })
}

/// The weights of a point where the ray passes a triangle that it sees edge-on: so nearly that the height of what it sees is less than the rounding of
/// its corners, and weights by area are noise. The longest edge that is seen spans all of it: the point is the nearest of that one. (To miss such triangles would
/// open gaps between their neighbours.) `None` of others. `seen` from the ray, with twice that area.
#[inline(always)]
fn edge_on(seen: [[f64; 3]; 3], area: f64) -> Option<[f64; 3]> {
    const ROUNDINGS: f64 = 16.0 * f64::EPSILON;
    let edge = |p: [f64; 3], q: [f64; 3]| [q[0] - p[0], q[1] - p[1]];
    let squared = |[x, y]: [f64; 2]| x * x + y * y;
    let (mut from, mut longest) = (0, 0.0);
    for corner in 0..3 {
        let length = squared(edge(seen[corner], seen[(corner + 1) % 3]));
        if length > longest {
            (from, longest) = (corner, length);
        }
    }
    let farthest = seen.map(|[x, y, _]| x.abs().max(y.abs())).into_iter().fold(0.0, f64::max);
    if area.abs() > ROUNDINGS * farthest * longest.sqrt() {
        return None;
    }
    let to = (from + 1) % 3;
    let [x, y] = edge(seen[from], seen[to]);
    let part = (-(seen[from][0] * x + seen[from][1] * y) / longest).clamp(0.0, 1.0);
    let mut weights = [0.0; 3];
    (weights[from], weights[to]) = (1.0 - part, part);
    Some(weights)
}

/// Least square of twice the area over that of the longer edge for which weights are known well enough to interpolate distances by. The height of a point above the
/// triangle, as told by them, errs by a rounding error over that ratio, and rays leave surfaces by 2⁹ rounding errors
/// ([`crate::scene::double::ROUNDING`]): a needle of aspect 10⁶ would be hit again by every other ray that leaves it.
const BROAD: f64 = 1.0 / 16.0;

/// Distance to the plane of a narrow triangle by its normal; `None` for a triangle without area, where
/// the weights are noise.
#[cold]
fn to_plane(ray: &Sheared, corner: DVec3, [e, f]: [DVec3; 2]) -> Option<f64> {
    let axes = ray.axes;
    let normal = normal([e, f].map(|edge| axes.map(|axis| edge[axis])));
    let from = [0, 1, 2].map(|i| corner[axes[i]] - ray.origin[i]);
    let above = normal[0] * from[0] + normal[1] * from[1] + normal[2] * from[2];
    let towards = normal[0] * ray.shear[0] + normal[1] * ray.shear[1] + normal[2];
    (normal != [0.0; 3]).then_some(above / (towards * ray.depth))
}

/// The normal of a triangle between two edges, as long as they make it; each component is right to two roundings.
fn normal([e, f]: [[f64; 3]; 2]) -> [f64; 3] {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| {
        // a·b − c·d (Kahan; Jeannerod, Louvet and Muller 2013).
        let product = e[j] * f[i];
        e[i].mul_add(f[j], -product) - e[j].mul_add(f[i], -product)
    })
}

/// Which side of the edge between two corners the ray is on.
#[inline(always)]
fn edge(p: [f64; 3], q: [f64; 3]) -> f64 {
    let (one, other) = (p[0] * q[1], p[1] * q[0]);
    if one == other { remainder(p, q, one) } else { one - other }
}

/// The difference of two products that are rounded to the same number: exact but for one rounding.
#[cold]
fn remainder(p: [f64; 3], q: [f64; 3], product: f64) -> f64 {
    p[0].mul_add(q[1], -product) - p[1].mul_add(q[0], -product)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::ray::Ray;
    use crate::bvh::watertight;
    use glam::Vec3;
    use proptest::prelude::*;

    fn sheared(ray: &Ray) -> Sheared {
        Sheared::new(ray.origin.as_dvec3(), ray.direction.as_dvec3())
    }

    #[test]
    fn weights_belong_to_the_second_and_third_corner() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let ray = Sheared::new(DVec3::new(0.25, 0.5, 2.0), DVec3::NEG_Z);
        assert_eq!(cross(&ray, corners), Some(Crossing { t: 2.0, u: 0.25, v: 0.5 }));
        assert_eq!(cross(&ray, [DVec3::ZERO; 3]), None);
        assert_eq!(cross(&ray, [DVec3::ZERO, DVec3::X, DVec3::X * 2.0]), None);
    }

    /// Products that differ by less than rounding: the sign is right all the same, and opposite from the other side.
    #[test]
    fn edges_have_the_right_sign_where_products_round_alike() {
        let e = f64::EPSILON;
        let (p, q) = ([1.0 + e, 1.0, 0.0], [1.0 + 2.0 * e, 1.0 + e, 0.0]);
        assert_eq!(p[0] * q[1], p[1] * q[0]);
        assert!(edge(p, q) > 0.0, "(1 + ε)² − (1 + 2ε) = ε²");
        assert_eq!(edge(p, q), -edge(q, p));
    }

    /// A needle of aspect 10⁶: how far the plane is, is known to the last places, from wherever the needle is seen; a line is not hit.
    #[test]
    fn needles_are_where_they_are() {
        let corners =
            [DVec3::new(0.3, -0.2, 0.1), DVec3::new(1.1, 0.5, -0.3), DVec3::new(1.1 + 6e-7, 0.5 - 4e-7, -0.3 + 7e-7)];
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[1]).normalize();
        let mut hits = 0;
        for i in 0..1000 {
            let weight = (f64::from(i) + 0.5) / 1000.0;
            let point = corners[0].lerp(corners[1].lerp(corners[2], 0.5), weight);
            let origin = point + normal * 1e-12;
            let direction = (normal * 0.3 + normal.any_orthonormal_vector() * (weight - 0.5)).as_vec3().as_dvec3();
            // Away from the plane, and towards it.
            for turn in 0..3 {
                let mut corners = corners;
                corners.rotate_left(turn);
                assert!(cross(&Sheared::new(origin, direction), corners).is_none_or(|hit| hit.t < 0.0), "{weight}");
                let Some(hit) = cross(&Sheared::new(origin, -direction), corners) else { continue };
                hits += 1;
                let height = hit.t * direction.dot(normal);
                assert!((height - 1e-12).abs() < 2e-15, "{weight}: {height:e}");
            }
        }
        assert!(hits > 2700, "{hits}");
        let line = [corners[0], corners[0] + DVec3::new(0.25, 0.5, 1.0), corners[0] + DVec3::new(0.5, 1.0, 2.0)];
        let exact = line.map(|corner| corner.as_vec3().as_dvec3());
        let exact = [exact[0], exact[1], exact[1] * 2.0 - exact[0]];
        let aim = exact[0].lerp(exact[2], 0.3);
        for i in 0..100 {
            let from = aim + DVec3::new(f64::from(i), 37.0, -11.0);
            assert_eq!(cross(&Sheared::new(from, aim - from), exact), None);
        }
    }

    /// A ray in the plane of a triangle: rounding alone decides whether it is hit, but where it is hit, a point of the triangle is named.
    #[test]
    fn triangles_seen_edge_on_are_hit_where_they_are() {
        let corners = [DVec3::new(1.0, -2.0, -1.0), DVec3::new(0.0, -1.0, 1.0), DVec3::new(1.0, -3.0, 0.0)];
        let mut hits = 0;
        for i in 0..1000 {
            let [u, v] = [f64::from(i % 31) / 31.0, f64::from(i % 37) / 37.0];
            let aim = corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * (v * (1.0 - u));
            let origin = corners[0] * 3.0 - corners[1] * 1.1 - corners[2] * 0.9;
            let ray = Sheared::new(origin, aim - origin);
            let Some(hit) = cross(&ray, corners) else { continue };
            hits += 1;
            let reported = origin + (aim - origin) * hit.t;
            let by_weights = corners[0] * (1.0 - hit.u - hit.v) + corners[1] * hit.u + corners[2] * hit.v;
            assert!(reported.distance(by_weights) < 1e-14, "{reported} {by_weights}");
            assert!(hit.u >= 0.0 && hit.v >= 0.0 && hit.u + hit.v <= 1.0, "{hit:?}");
        }
        assert!(hits > 100, "{hits}");
    }

    fn vector() -> impl Strategy<Value = [f32; 3]> {
        let coordinate = || prop_oneof![(-3i32..=3).prop_map(|i| i as f32), -10f32..10.0];
        [coordinate(), coordinate(), coordinate()]
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None, ..Default::default() })]

        /// Beside the test in single precision: hits of both are the same but for its rounding.
        #[test]
        fn both_precisions_agree(origin in vector(), direction in vector(), corners in [vector(), vector(), vector()]) {
            let ray = Ray::new(origin.into(), direction.into());
            prop_assume!(ray.is_traceable());
            let corners = corners.map(Vec3::from_array);
            let single = watertight::scalar(&watertight::ShearedRay::new(&ray), corners);
            let double = cross(&sheared(&ray), corners.map(Vec3::as_dvec3));
            // Seen edge-on, f32 leaves little of the weights.
            let normal = (corners[1] - corners[0]).as_dvec3().cross((corners[2] - corners[0]).as_dvec3());
            prop_assume!(normal.normalize_or_zero().dot(ray.direction.as_dvec3().normalize()).abs() > 1e-2);
            if let (Some(single), Some(double)) = (single, double) {
                let error = |a: f32, b: f64| (f64::from(a) - b).abs() / b.abs().max(1.0);
                prop_assert!(error(single.t, double.t) < 1e-2 && error(single.u, double.u) < 1e-2, "{single:?} {double:?}");
                let place = ray.origin.as_dvec3() + ray.direction.as_dvec3() * double.t;
                let [a, b, c] = corners.map(Vec3::as_dvec3);
                let by_weights = a * (1.0 - double.u - double.v) + b * double.u + c * double.v;
                prop_assert!(place.distance(by_weights) < 1e-9, "{place} {by_weights}");
            }
        }
    }
}
