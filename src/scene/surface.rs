//! The point where a ray meets a surface: position, normals, and how far rounding may have moved it.

use super::origin::Origin;
use crate::sampling::v3::V3;
use glam::{DVec3, Vec3};

/// Bound on the relative rounding error of a position built from a few products and sums, with room to spare: 32 half
/// units in the last place. (Ten operations suffice; the rest covers the intersection test of a triangle
/// that the next ray meets at its origin.) It multiplies the magnitudes that went into the position, never the
/// size of the scene.
pub const ROUNDING: f32 = 32.0 * (f32::EPSILON * 0.5);

/// A point of a surface, seen from a ray. `O` says where rays leave: in single precision, or in either.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint<O = V3> {
    /// Where rays leave: off the surface by the rounding error, to the side that the ray came from.
    pub origin: O,
    /// Unit geometric normal, on the side that the ray came from.
    pub geometric: V3,
    /// Unit shading normal, on the side that the ray came from.
    pub normal: V3,
}

impl From<SurfacePoint> for SurfacePoint<Origin> {
    #[inline(always)]
    fn from(point: SurfacePoint) -> Self {
        SurfacePoint { origin: point.origin.into(), geometric: point.geometric, normal: point.normal }
    }
}

/// A point of a triangle with barycentric weights (1−u−v, u, v), hit along `direction`.
///
/// The position comes from the corners, not from origin + t·direction: its error is a few units in the last place of the
/// corners, however long the ray was.
#[inline(always)]
pub fn on_triangle(corners: [V3; 3], u: f32, v: f32, direction: V3) -> SurfacePoint {
    match on_broad_triangle(corners, u, v, direction) {
        (point, true) => point,
        _ => on_narrow_triangle(corners, u, v, direction),
    }
}

/// The same without branches, for loops over many; and whether the triangle is broad enough for that.
#[inline(always)]
pub fn on_broad_triangle(corners: [V3; 3], u: f32, v: f32, direction: V3) -> (SurfacePoint, bool) {
    let (normal, _, broad) = normal_if_broad(corners);
    (leaving(corners, [u, v], facing(normal, direction), 0.0), broad)
}

/// By the normal in f64. Rays leave such a triangle by more than the point's own coordinates err, by what its corners do: a ray that starts at the tip of
/// a sliver, its coordinates small, meets in a moment the weights of corners that are far away, and the next intersection test errs by units in the
/// last place of their distance.
#[cold]
#[inline(never)]
pub fn on_narrow_triangle(corners: [V3; 3], u: f32, v: f32, direction: V3) -> SurfacePoint {
    let (_, size, _) = normal_if_broad(corners);
    leaving(corners, [u, v], facing(narrow_normal(corners), direction), size)
}

/// Where rays leave a triangle on the side of `geometric`; the sizes of its edges count, if it is narrow.
#[inline(always)]
fn leaving([a, b, c]: [V3; 3], [u, v]: [f32; 2], geometric: V3, narrow: f32) -> SurfacePoint {
    let w = 1.0 - u - v;
    let position = a * w + b * u + c * v;
    let reach = a.abs() * w.abs() + b.abs() * u.abs() + c.abs() * v.abs();
    let away = offset(reach) + narrow * ROUNDING;
    SurfacePoint { origin: position + geometric * away, geometric, normal: geometric }
}

/// How far off a surface rays leave, given the magnitudes that went into the position.
///
/// All three axes count, not only their share along the normal: a floor at y = 0 has exact positions, but the distance
/// to it that the next ray's intersection test computes is wrong by a few units in the last place of the floor's extent. (With
/// the share along the normal alone, the floor of a Cornell box lay in its own shadow: 1 % of the image's mean was lost.)
#[inline(always)]
pub fn offset(reach: V3) -> f32 {
    (reach.x + reach.y + reach.z) * ROUNDING
}

/// Least square of the sine between a triangle's edges, scaled to a largest component of 1 (so their lengths are 1 to √3), for which
/// f32 knows the normal to about a millionth: enough that rays 89.9999° from it leave the triangle.
const BROAD: f32 = 1.0 / 16.0;

/// Unit normal of a triangle by its winding. Narrow triangles get theirs in f64; those without area, any that is perpendicular to them.
#[inline(always)]
pub fn triangle_normal(corners: [V3; 3]) -> V3 {
    match normal_if_broad(corners) {
        (normal, _, true) => normal,
        _ => narrow_normal(corners),
    }
}

/// The normal, the sizes of two edges together, and whether the triangle is broad enough for that normal. The edges are scaled first: products of
/// tiny edges would underflow, and those of huge ones overflow.
#[inline(always)]
fn normal_if_broad([a, b, c]: [V3; 3]) -> (V3, f32, bool) {
    let (e1, e2) = (b - a, c - a);
    let (size1, size2) = (e1.abs().max_component(), e2.abs().max_component());
    let e1 = e1 * (1.0 / size1);
    let e2 = e2 * (1.0 / size2);
    let cross = e1.cross(e2);
    let squared = cross.dot(cross);
    // A NaN is not greater.
    (cross * (1.0 / squared.sqrt()), size1 + size2, squared > BROAD)
}

/// The normal of a narrow triangle, computed in f64.
#[cold]
#[inline(never)]
fn narrow_normal(corners: [V3; 3]) -> V3 {
    let [a, b, c] = corners.map(|corner| Vec3::from(corner).as_dvec3());
    let across = || {
        let edges = [b - a, c - b, a - c];
        let longest =
            edges.into_iter().fold(DVec3::ZERO, |x, y| if y.length_squared() > x.length_squared() { y } else { x });
        longest.try_normalize().map_or(DVec3::Z, |along| along.any_orthonormal_vector())
    };
    // Differences and products of f32 are far from the ends of what f64 holds, but their squares may not be.
    let cross = (b - a).cross(c - a);
    let largest = cross.abs().max_element();
    let normal = if largest > 0.0 && largest.is_finite() { (cross / largest).normalize() } else { across() };
    normal.as_vec3().into()
}

/// A point of a sphere that a ray hits at `origin + t·direction`, pulled back onto the sphere.
///
/// A sphere smaller than a unit in the last place of its centre may have its centre hit: the ray is turned back then.
#[inline(always)]
pub fn on_sphere(center: V3, radius: f32, hit: V3, direction: V3) -> SurfacePoint {
    let from_center = hit - center;
    let off_center = from_center.abs().max_component() > 0.0;
    let outward = V3::select(off_center, from_center, -direction);
    // Scaled first, as squares of tiny and of huge radii are out of range.
    let outward = (outward * (1.0 / outward.abs().max_component())).normalize();
    let geometric = facing(outward, direction);
    let position = center + outward * radius;
    let reach = center.abs() + outward.abs() * radius;
    let origin = position + geometric * offset(reach);
    SurfacePoint { origin, geometric, normal: geometric }
}

/// The shading normal: corner normals interpolated, turned to the side of the geometric one. Where they are missing (zero)
/// or cancel, the geometric normal serves.
#[inline(always)]
pub fn shading_normal(normals: [V3; 3], u: f32, v: f32, geometric: V3) -> V3 {
    let [a, b, c] = normals;
    let sum = a * (1.0 - u - v) + b * u + c * v;
    let squared = sum.dot(sum);
    let usable = squared > 1e-12;
    let unit = sum * (1.0 / squared.sqrt());
    let towards = unit.dot(geometric);
    let turned = V3::select(towards < 0.0, -unit, unit);
    V3::select(usable, turned, geometric)
}

/// `normal`, turned against `direction`.
#[inline(always)]
fn facing(normal: V3, direction: V3) -> V3 {
    V3::select(normal.dot(direction) > 0.0, -normal, normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn v(x: f32, y: f32, z: f32) -> V3 {
        V3::new(x, y, z)
    }

    #[test]
    fn normals_hold_at_every_scale() {
        for scale in [1e-18f32, 1e-9, 1.0, 1e9, 1e18] {
            let n = triangle_normal([v(0.0, 0.0, 0.0), v(scale, 0.0, 0.0), v(0.0, 2.0 * scale, 0.0)]);
            assert_eq!((n.x, n.y, n.z), (0.0, 0.0, 1.0), "scale {scale}");
        }
    }

    #[test]
    fn rays_leave_on_the_side_they_came_from() {
        let corners = [v(1.0, 2.0, 3.0), v(4.0, 2.5, 3.5), v(1.5, 6.0, 2.0)];
        for sign in [1.0, -1.0] {
            let d = v(0.1, 0.2, sign);
            let s = on_triangle(corners, 0.3, 0.4, d);
            assert!(s.geometric.dot(d) < 0.0);
            // Exactly (in f64) above the plane, and by no more than the bound.
            let n: glam::Vec3 = s.geometric.into();
            let o: glam::Vec3 = s.origin.into();
            let a: glam::Vec3 = corners[0].into();
            let height = (o.as_dvec3() - a.as_dvec3()).dot(n.as_dvec3());
            assert!(height > 0.0 && height < 3e-5, "{height}");
        }
    }

    #[test]
    fn narrow_triangles_have_exact_normals_and_empty_ones_any() {
        let exact = |corners: [V3; 3]| {
            let [a, b, c] = corners.map(|corner| glam::Vec3::from(corner).as_dvec3());
            (b - a).cross(c - a).normalize()
        };
        for height in [1e-1f32, 1e-3, 1e-5, 1e-6] {
            for tip in [0.0, 0.3, 1.0] {
                let corners = [
                    v(1.7, 0.3, -0.9),
                    v(2.4, 1.1, -0.6),
                    v(1.7 + 0.7 * tip, 0.3 + 0.8 * tip + height, -0.9 + 0.3 * tip),
                ];
                let normal: glam::Vec3 = triangle_normal(corners).into();
                let error = normal.as_dvec3().distance(exact(corners));
                assert!(error < 1e-6, "height {height}, tip {tip}: {error:e}");
            }
        }
        let p = v(3.0, -2.0, 7.0);
        for corners in [[p; 3], [p, p, v(4.0, 0.0, 1.0)], [p, v(4.0, -2.0, 7.0), v(6.0, -2.0, 7.0)]] {
            let normal: glam::Vec3 = triangle_normal(corners).into();
            assert!((normal.length() - 1.0).abs() < 1e-6, "{normal}");
            let edge: glam::Vec3 = (corners[2] - corners[0]).into();
            assert!(normal.dot(edge).abs() < 1e-5, "{normal} beside {edge}");
        }
    }

    /// What loops over many compute, and put right afterwards, is what one gets.
    #[test]
    fn broad_triangles_are_told_from_narrow_ones() {
        let thin = |h: f32| [v(0.1, 0.2, 0.3), v(1.4, 0.9, -0.2), v(0.8, 0.6 + h, 0.1)];
        let d = v(0.1, 0.2, -1.0);
        for (height, expected) in [(1.0, true), (1e-6, false), (0.01, false), (0.0, false)] {
            let (point, broad) = on_broad_triangle(thin(height), 0.3, 0.4, d);
            assert_eq!(broad, expected, "{height}");
            let one = on_triangle(thin(height), 0.3, 0.4, d);
            let other = if broad { point } else { on_narrow_triangle(thin(height), 0.3, 0.4, d) };
            assert_eq!((one.origin, one.geometric), (other.origin, other.geometric));
        }
    }

    #[test]
    fn spheres_smaller_than_their_coordinates_still_have_normals() {
        let center = v(1e7, -2e7, 3e6);
        let d = v(0.6, 0.0, -0.8);
        let point = on_sphere(center, 1e-6, center, d);
        assert_eq!(point.geometric, -d);
        for radius in [1e-30, 1e-9, 1.0, 1e9, 1e25f32] {
            let point = on_sphere(v(0.0, 0.0, 0.0), radius, v(0.0, 0.0, radius), d);
            assert_eq!(point.geometric, v(0.0, 0.0, 1.0), "{radius:e}");
        }
    }

    #[test]
    fn rays_leave_the_tip_of_a_sliver_by_what_its_far_corners_err() {
        let corners = [v(-4e8, 3e8, 1e3), v(2.0, -1.0, 0.5), v(4e8, -3e8, 2e3)];
        let point = on_triangle(corners, 1.0, 0.0, v(0.1, 0.2, -1.0));
        let from_tip = glam::Vec3::from(point.origin).distance(glam::Vec3::from(corners[1]));
        assert!((ROUNDING * 4e8..ROUNDING * 3e9).contains(&from_tip), "{from_tip}");
        // A broad one by what its own coordinates err, however large it is.
        let point = on_triangle([v(-4e8, 3e8, 1e3), v(2.0, -1.0, 0.5), v(4e8, 3e8, 2e3)], 1.0, 0.0, v(0.1, 0.2, -1.0));
        assert!(glam::Vec3::from(point.origin).distance(glam::Vec3::from(corners[1])) < ROUNDING * 10.0);
    }

    #[test]
    fn missing_normals_fall_back_to_the_geometric_one() {
        let g = v(0.0, 0.0, 1.0);
        let zero = v(0.0, 0.0, 0.0);
        assert_eq!(shading_normal([zero; 3], 0.2, 0.3, g), g);
        let n = v(0.6, 0.0, -0.8);
        assert!(shading_normal([n; 3], 0.2, 0.3, g).dot(g) > 0.0);
    }
}
