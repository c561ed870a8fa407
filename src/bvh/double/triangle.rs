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
    // After overflow these may be NaN, which no range of `t` contains.
    let t = (a * seen[0][2] + b * seen[1][2] + c * seen[2][2]) / (area * ray.depth);
    Some(Crossing { t, u: b / area, v: c / area })
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
