//! The point where a ray meets a surface, in double precision: the twin of [`super::surface`] for `--precision f64`. One point at a time.
//!
//! Positions are `f64`, directions single precision: a normal is computed in `f64` and rounded.

use super::origin::Origin;
use super::surface::SurfacePoint;
use crate::sampling::v3::V3;
use glam::{DVec3, Vec3};

/// Bound on the relative rounding error of a position: 32 half-units in the last of the 48 bits that an [`Origin`] has, as
/// [`super::surface::ROUNDING`] is 32 of the 24 bits of single precision.
pub const ROUNDING: f64 = 1.0 / (1u64 << 44) as f64;

/// A point of a triangle with barycentric weights (1−u−v, u, v), hit along `direction`. The weights are those of the test in double precision: in single
/// precision, they would slide the point along the triangle, and past a neighbour that meets it.
pub fn on_triangle(corners: [DVec3; 3], u: f64, v: f64, direction: Vec3) -> SurfacePoint<Origin> {
    let [a, b, c] = corners;
    let w = 1.0 - u - v;
    let position = a * w + b * u + c * v;
    // The next ray's test sees the corners from here: it errs by units in the last place of their distances, too.
    let size = (b - a).abs().max((c - a).abs());
    let reach = a.abs() * w.abs() + b.abs() * u.abs() + c.abs() * v.abs() + size;
    leaving(position, triangle_normal(corners), reach, direction)
}

/// A point of a sphere, `from_center` of which is where the ray hit it, as seen from the centre: pulled back onto the sphere.
pub fn on_sphere(center: DVec3, radius: f64, from_center: DVec3, direction: Vec3) -> SurfacePoint<Origin> {
    let outward = from_center.try_normalize().unwrap_or(-direction.as_dvec3());
    leaving(center + outward * radius, outward, center.abs() + outward.abs() * radius, direction)
}

/// Off the surface by the rounding error, to the side that the ray came from.
fn leaving(position: DVec3, normal: DVec3, reach: DVec3, direction: Vec3) -> SurfacePoint<Origin> {
    let normal = if normal.dot(direction.as_dvec3()) > 0.0 { -normal } else { normal };
    let origin = Origin::double(position + normal * (reach.element_sum() * ROUNDING));
    let geometric = V3::from(normal.as_vec3());
    SurfacePoint { origin, geometric, normal: geometric }
}

/// Unit normal of a triangle by its winding; of one without area, any that is perpendicular to it. The edges are scaled first, so that no product
/// overflows.
pub fn triangle_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    let edges = [b - a, c - a];
    let [e1, e2] = edges.map(|edge| edge / edge.abs().max_element().max(f64::MIN_POSITIVE));
    e1.cross(e2).try_normalize().unwrap_or_else(|| {
        let longest = if e1.length_squared() >= e2.length_squared() { e1 } else { e2 };
        longest.try_normalize().map_or(DVec3::Z, |along| along.any_orthonormal_vector())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::surface;

    const CORNERS: [DVec3; 3] = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 2.5, 3.5), DVec3::new(1.5, 6.0, 2.0)];

    #[test]
    fn near_the_origin_both_precisions_agree() {
        let direction = V3::new(0.1, 0.2, -1.0);
        let single = surface::on_triangle(CORNERS.map(|corner| V3::from(corner.as_vec3())), 0.25, 0.5, direction);
        let double = on_triangle(CORNERS, 0.25, 0.5, direction.into());
        let close = |a: V3, b: V3, by: f32| Vec3::from(a - b).length() < by;
        assert!(close(single.origin, double.origin.high, 4e-5));
        assert!(close(single.geometric, double.geometric, 1e-6) && close(single.normal, double.normal, 1e-6));
        let center = DVec3::new(-1.0, 0.5, 2.0);
        let from_center = DVec3::new(0.0, 0.6, -0.8);
        let single =
            surface::on_sphere(V3::from(center.as_vec3()), 1.0, V3::from((center + from_center).as_vec3()), direction);
        let double = on_sphere(center, 1.0, from_center, direction.into());
        assert!(close(single.origin, double.origin.high, 4e-5) && close(single.geometric, double.geometric, 1e-6));
    }

    /// Where a unit in the last place of single precision is as large as the triangle.
    #[test]
    fn rays_leave_on_the_side_they_came_from() {
        let far = DVec3::new(3e7, -5e7, 1e7);
        let corners = CORNERS.map(|corner| Origin::double(corner + far).wide());
        let normal = triangle_normal(corners);
        for sign in [1.0, -1.0] {
            let direction = Vec3::new(0.1, 0.2, sign);
            let point = on_triangle(corners, 0.3, 0.4, direction);
            assert!(Vec3::from(point.geometric).dot(direction) < 0.0);
            let height = (point.origin.wide() - corners[0]).dot(normal) * -f64::from(sign) * normal.z.signum();
            assert!(height > 1e-7 && height < 2e-5, "{height:e}");
        }
    }

    #[test]
    fn triangles_without_area_have_a_normal() {
        let p = DVec3::new(3.0, -2.0, 7.0);
        for corners in [[p; 3], [p, p, p + DVec3::X], [p, p + DVec3::X, p + DVec3::X * 3.0]] {
            let normal = triangle_normal(corners);
            assert!((normal.length() - 1.0).abs() < 1e-12, "{normal}");
            assert!(normal.dot(corners[2] - corners[0]).abs() < 1e-12, "{normal}");
        }
        for scale in [1e-150, 1e-9, 1.0, 1e150] {
            assert_eq!(triangle_normal([DVec3::ZERO, DVec3::X * scale, DVec3::Y * 2.0 * scale]), DVec3::Z);
        }
    }
}
