//! The ray–sphere test of Haines, Günther and Akenine-Möller, "Precision Improvements for Ray/Sphere
//! Intersection" (Ray Tracing Gems, 2019, chapter 7).
//!
//! The discriminant comes from the distance between the centre and the ray, not from a difference of squares, and
//! the two roots from two formulas that never subtract nearly equal numbers. In f64: spheres are few, and the
//! smaller root of a ray that starts on the sphere is then 0 to within a rounding of the ray's own origin.

use glam::{DVec3, Vec3};

use super::ray::Ray;

/// The smaller root above `t_min` and not above `t_max`, else the larger; `None` if neither is in range. Rays that start
/// inside hit the far side.
#[inline(always)]
pub fn intersect(ray: &Ray, center: Vec3, radius: f32, t_max: f32) -> Option<f32> {
    let (one, other) = roots(ray.origin.as_dvec3() - center.as_dvec3(), ray.direction.as_dvec3(), f64::from(radius))?;
    first((one as f32, other as f32), ray.t_min.max(0.0), t_max)
}

/// The smaller of two roots above `t_min` and not above `t_max`, else the larger.
#[inline(always)]
pub fn first<T: PartialOrd + Copy>((one, other): (T, T), t_min: T, t_max: T) -> Option<T> {
    let (near, far) = if one < other { (one, other) } else { (other, one) };
    let in_range = |t: T| t > t_min && t <= t_max;
    if in_range(near) {
        Some(near)
    } else if in_range(far) {
        Some(far)
    } else {
        None
    }
}

/// Where a line from `f`, as seen from the centre, along `d` meets a sphere; in no order.
#[inline(always)]
pub fn roots(f: DVec3, d: DVec3, radius: f64) -> Option<(f64, f64)> {
    let radius_squared = radius * radius;
    let a = d.dot(d);
    let b = -f.dot(d);
    let discriminant = radius_squared - (f + d * (b / a)).length_squared();
    // NaN is an unused lane.
    if discriminant < 0.0 || discriminant.is_nan() {
        return None;
    }
    let c = f.dot(f) - radius_squared;
    let root = (a * discriminant).sqrt();
    let q = if b < 0.0 { b - root } else { b + root };
    Some((c / q, q / a))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cast(origin: [f32; 3], direction: [f32; 3], center: Vec3, radius: f32) -> Option<f32> {
        let ray = Ray::new(origin.into(), direction.into());
        intersect(&ray, center, radius, f32::MAX)
    }

    #[test]
    fn outside_inside_behind_beside() {
        assert_eq!(cast([0.0, 0.0, -3.0], [0.0, 0.0, 2.0], Vec3::ZERO, 1.0), Some(1.0));
        assert_eq!(cast([0.0; 3], [0.0, 0.0, -2.0], Vec3::ZERO, 1.0), Some(0.5));
        assert_eq!(cast([0.0, 0.0, 3.0], [0.0, 0.0, 1.0], Vec3::ZERO, 1.0), None);
        assert_eq!(cast([0.0, 1.1, -3.0], [0.0, 0.0, 1.0], Vec3::ZERO, 1.0), None);
        assert_eq!(cast([0.0, 0.0, -1.0], [0.0, 0.0, 1.0], Vec3::ZERO, 1.0), Some(2.0));
    }

    #[test]
    fn far_and_small_spheres_keep_their_surface() {
        let hit = cast([0.0; 3], [1.0, 0.0, 0.0], Vec3::new(800_000.0, 0.0, 0.0), 0.5).unwrap();
        assert_eq!(hit, 799_999.5);
        let hit = cast([-1e6, 0.0, 0.0], [1.0, 0.0, 0.0], Vec3::ZERO, 1e6).unwrap();
        assert_eq!(hit, 2e6);
    }
}
