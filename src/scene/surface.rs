//! The point where a ray meets a surface: position, normals, and how far rounding may have moved it.

use crate::sampling::lanes::{Lanes, V3};

/// Bound on the relative rounding error of a position built from a few products and sums, with room to spare: 32 half
/// units in the last place. (Ten operations suffice; the rest covers the intersection test of a triangle
/// that the next ray meets at its origin.) It multiplies the magnitudes that went into the position, never the
/// size of the scene.
pub const ROUNDING: f32 = 32.0 * (f32::EPSILON * 0.5);

/// A point of a surface, seen from a ray.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint<F> {
    /// Where rays leave: off the surface by the rounding error, to the side that the ray came from.
    pub origin: V3<F>,
    /// Unit geometric normal, on the side that the ray came from.
    pub geometric: V3<F>,
    /// Unit shading normal, on the side that the ray came from.
    pub normal: V3<F>,
}

/// A point of a triangle with barycentric weights (1−u−v, u, v), hit along `direction`.
///
/// The position comes from the corners, not from origin + t·direction: its error is a few units in the last place of the
/// corners, however long the ray was.
#[inline(always)]
pub fn on_triangle<F: Lanes>(corners: [V3<F>; 3], u: F, v: F, direction: V3<F>) -> SurfacePoint<F> {
    let [a, b, c] = corners;
    let w = F::splat(1.0) - u - v;
    let position = a * w + b * u + c * v;
    let geometric = facing(triangle_normal(corners), direction);
    let reach = a.abs() * w.abs() + b.abs() * u.abs() + c.abs() * v.abs();
    SurfacePoint { origin: position + geometric * offset(reach), geometric, normal: geometric }
}

/// How far off a surface rays leave, given the magnitudes that went into the position.
///
/// All three axes count, not only their share along the normal: a floor at y = 0 has exact positions, but the distance
/// to it that the next ray's intersection test computes is wrong by a few units in the last place of the floor's extent. (With
/// the share along the normal alone, the floor of a Cornell box lay in its own shadow: 1 % of the image's mean was lost.)
#[inline(always)]
pub fn offset<F: Lanes>(reach: V3<F>) -> F {
    (reach.x + reach.y + reach.z) * F::splat(ROUNDING)
}

/// Unit normal of a triangle by its winding. The edges are scaled first: products of tiny edges would
/// underflow, and those of huge ones overflow.
#[inline(always)]
pub fn triangle_normal<F: Lanes>([a, b, c]: [V3<F>; 3]) -> V3<F> {
    let one = F::splat(1.0);
    let (e1, e2) = (b - a, c - a);
    let e1 = e1 * (one / e1.abs().max_component());
    let e2 = e2 * (one / e2.abs().max_component());
    e1.cross(e2).normalize()
}

/// A point of a sphere that a ray hits at `origin + t·direction`, pulled back onto the sphere.
#[inline(always)]
pub fn on_sphere<F: Lanes>(center: V3<F>, radius: F, hit: V3<F>, direction: V3<F>) -> SurfacePoint<F> {
    let outward = (hit - center).normalize();
    let geometric = facing(outward, direction);
    let position = center + outward * radius;
    let reach = center.abs() + outward.abs() * radius;
    let origin = position + geometric * offset(reach);
    SurfacePoint { origin, geometric, normal: geometric }
}

/// The shading normal: corner normals interpolated, turned to the side of the geometric one. Where they are missing (zero)
/// or cancel, the geometric normal serves.
#[inline(always)]
pub fn shading_normal<F: Lanes>(normals: [V3<F>; 3], u: F, v: F, geometric: V3<F>) -> V3<F> {
    let [a, b, c] = normals;
    let sum = a * (F::splat(1.0) - u - v) + b * u + c * v;
    let squared = sum.dot(sum);
    let usable = squared.gt(F::splat(1e-12));
    let unit = sum * (F::splat(1.0) / squared.sqrt());
    let towards = unit.dot(geometric);
    let turned = V3::select(towards.lt(F::splat(0.0)), -unit, unit);
    V3::select(usable, turned, geometric)
}

/// `normal`, turned against `direction`.
#[inline(always)]
fn facing<F: Lanes>(normal: V3<F>, direction: V3<F>) -> V3<F> {
    V3::select(normal.dot(direction).gt(F::splat(0.0)), -normal, normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn v(x: f32, y: f32, z: f32) -> V3<f32> {
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
    fn missing_normals_fall_back_to_the_geometric_one() {
        let g = v(0.0, 0.0, 1.0);
        let zero = v(0.0, 0.0, 0.0);
        assert_eq!(shading_normal([zero; 3], 0.2, 0.3, g), g);
        let n = v(0.6, 0.0, -0.8);
        assert!(shading_normal([n; 3], 0.2, 0.3, g).dot(g) > 0.0);
    }
}
