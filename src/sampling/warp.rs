//! From the unit square to directions, and back to densities. Local frame: +z is the normal.

use super::angle::sin_cos_quarter;
use super::lanes::{Lanes, V3};
use std::f32::consts::{FRAC_PI_4, PI};

/// A point of the unit disk, area-preserving and low in distortion.
///
/// Shirley & Chiu, *A Low Distortion Map Between Disk and Square*, JGT 2(3), 1997. The angle stays within ±π/4, where short
/// polynomials give sine and cosine to the last bits without range reduction.
#[inline(always)]
pub fn concentric_disk<F: Lanes>(u: F, v: F) -> (F, F) {
    let one = F::splat(1.0);
    let two = F::splat(2.0);
    let a = u * two - one;
    let b = v * two - one;
    let x_leads = a.abs().gt(b.abs());
    let radius = F::select(x_leads, a, b);
    let other = F::select(x_leads, b, a);
    // At the centre both are zero: divide by one instead, and the radius makes the point (0, 0).
    let safe = F::select(radius.abs().gt(F::splat(0.0)), radius, one);
    let angle = F::splat(FRAC_PI_4) * (other / safe);
    let (sin, cos) = sin_cos_quarter(angle);
    let along = radius * cos;
    let across = radius * sin;
    (F::select(x_leads, along, across), F::select(x_leads, across, along))
}

/// Cosine-weighted direction of the upper hemisphere (Malley's method). Density [`cosine_hemisphere_pdf`].
#[inline(always)]
pub fn cosine_hemisphere<F: Lanes>(u: F, v: F) -> V3<F> {
    let (x, y) = concentric_disk(u, v);
    let z = (F::splat(1.0) - x * x - y * y).max(F::splat(0.0)).sqrt();
    V3::new(x, y, z)
}

/// Solid-angle density of [`cosine_hemisphere`]: cos θ / π.
#[inline(always)]
pub fn cosine_hemisphere_pdf<F: Lanes>(cos_theta: F) -> F {
    cos_theta * F::splat(1.0 / PI)
}

/// Uniform direction of the upper hemisphere; density 1 / 2π.
#[inline(always)]
pub fn uniform_hemisphere<F: Lanes>(u: F, v: F) -> V3<F> {
    uniform_cap(u, v, F::splat(1.0))
}

/// Uniform direction within a cone around +z whose `1 − cos θ_max` is `height`; density `1 / (2π·height)`.
///
/// The concentric disk, lifted: a disk of radius r maps to the cap of height r²·`height`, equal areas to equal areas.
#[inline(always)]
pub fn uniform_cap<F: Lanes>(u: F, v: F, height: F) -> V3<F> {
    let (x, y) = concentric_disk(u, v);
    let drop = (x * x + y * y) * height;
    let scale = (height * (F::splat(2.0) - drop)).max(F::splat(0.0)).sqrt();
    V3::new(x * scale, y * scale, F::splat(1.0) - drop)
}

/// A right-handed orthonormal basis around unit `n`: returns (tangent, bitangent).
///
/// Duff et al., *Building an Orthonormal Basis, Revisited*, JCGT 6(1), 2017.
#[inline(always)]
pub fn basis<F: Lanes>(n: V3<F>) -> (V3<F>, V3<F>) {
    let one = F::splat(1.0);
    let sign = one.copysign(n.z);
    let a = -one / (sign + n.z);
    let b = n.x * n.y * a;
    let tangent = V3::new(one + sign * n.x * n.x * a, sign * b, -sign * n.x);
    let bitangent = V3::new(b, sign + n.y * n.y * a, -n.y);
    (tangent, bitangent)
}

/// A local direction in the frame around unit normal `n`, as a world direction.
#[inline(always)]
pub fn to_world<F: Lanes>(local: V3<F>, n: V3<F>) -> V3<F> {
    let (tangent, bitangent) = basis(n);
    tangent * local.x + bitangent * local.y + n * local.z
}

/// The power heuristic with exponent 2: weight of the technique with density `a` beside one with density `b`.
///
/// Veach, *Robust Monte Carlo Methods for Light Transport Simulation*, 1997, §9.2.4.
#[inline(always)]
pub fn power_heuristic<F: Lanes>(a: F, b: F) -> F {
    // As 1 / (1 + (b/a)²): squares of densities overflow near a light, the ratio does not.
    let ratio = b / a;
    F::splat(1.0) / (F::splat(1.0) + ratio * ratio)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec4;
    use statrs::distribution::{ChiSquared, ContinuousCDF};

    fn grid(n: u32) -> impl Iterator<Item = (f32, f32)> {
        (0..n * n)
            .map(move |i| ((i % n) as f32 + 0.5, (i / n) as f32 + 0.5))
            .map(move |(a, b)| (a / n as f32, b / n as f32))
    }

    #[test]
    fn four_lanes_give_the_bits_of_one() {
        let points: Vec<_> =
            grid(64).chain([(0.0, 0.0), (0.5, 0.5), (1.0 - f32::EPSILON, 0.0), (0.25, 0.75)]).collect();
        for four in points.chunks_exact(4) {
            let u = Vec4::from_array([0, 1, 2, 3].map(|i: usize| four[i].0));
            let v = Vec4::from_array([0, 1, 2, 3].map(|i: usize| four[i].1));
            let n = V3::new(u - Vec4::splat(0.5), v - Vec4::splat(0.3), u * v - Vec4::splat(0.2)).normalize();
            let wide = to_world(cosine_hemisphere(u, v), n);
            let cap = uniform_cap(u, v, Vec4::splat(0.3));
            for (lane, &(u, v)) in four.iter().enumerate() {
                let n1 = V3::new(u - 0.5, v - 0.3, u * v - 0.2).normalize();
                let one = to_world(cosine_hemisphere(u, v), n1);
                for (a, b) in [(wide.x[lane], one.x), (wide.y[lane], one.y), (wide.z[lane], one.z)] {
                    assert_eq!(a.to_bits(), b.to_bits());
                }
                assert_eq!(cap.x[lane].to_bits(), uniform_cap(u, v, 0.3).x.to_bits());
            }
        }
    }

    #[test]
    fn bases_are_orthonormal_and_right_handed() {
        let mut normals: Vec<V3<f32>> = grid(40)
            .map(|(u, v)| {
                let d = uniform_hemisphere(u, v);
                if ((u * 1000.0) as u32).is_multiple_of(2) { d } else { -d }
            })
            .collect();
        normals.extend([
            V3::new(0.0, 0.0, 1.0),
            V3::new(0.0, 0.0, -1.0),
            V3::new(0.0, 1.0, -0.0),
            V3::new(1.0, 0.0, 0.0),
        ]);
        for n in normals {
            let (t, b) = basis(n);
            for (x, want) in [
                (t.dot(t), 1.0),
                (b.dot(b), 1.0),
                (t.dot(b), 0.0),
                (t.dot(n), 0.0),
                (b.dot(n), 0.0),
                (t.cross(b).dot(n), 1.0),
            ] {
                assert!((x - want).abs() < 2e-6, "{n:?}: {x} ≠ {want}");
            }
        }
    }

    /// χ² of random directions over equal-probability cells (bands in the given CDF of z, sectors in azimuth).
    fn chi2(what: &str, sample: impl Fn(f32, f32) -> V3<f32>, cdf: impl Fn(f32) -> f32) {
        let (bands, sectors, n) = (16usize, 24usize, 1u32 << 19);
        let mut cells = vec![0u32; bands * sectors];
        for i in 0..n {
            let [u, v, ..] = crate::sampling::random::uniform4(i, 77, 0, 1);
            let d = sample(u, v);
            assert!((d.dot(d) - 1.0).abs() < 1e-5);
            let band = ((cdf(d.z) * bands as f32) as usize).min(bands - 1);
            let turn = d.y.atan2(d.x) / (2.0 * PI) + 0.5;
            cells[band * sectors + ((turn * sectors as f32) as usize).min(sectors - 1)] += 1;
        }
        let expected = f64::from(n) / cells.len() as f64;
        let chi2: f64 = cells.iter().map(|&c| (f64::from(c) - expected).powi(2) / expected).sum();
        let p = 1.0 - ChiSquared::new(cells.len() as f64 - 1.0).unwrap().cdf(chi2);
        assert!(p > 1e-4, "{what}: χ² = {chi2:.0}, p = {p:e}");
    }

    #[test]
    fn directions_follow_their_densities() {
        chi2("cosine", cosine_hemisphere, |z| z * z);
        chi2("uniform hemisphere", uniform_hemisphere, |z| z);
        chi2("cap", |u, v| uniform_cap(u, v, 0.25), |z| (z - 0.75) / 0.25);
        chi2("tiny cap", |u, v| uniform_cap(u, v, 1e-3), |z| (z - 0.999) / 1e-3);
    }

    #[test]
    fn the_power_heuristic_survives_extreme_densities() {
        assert_eq!(power_heuristic(1e30_f32, 1e30), 0.5);
        assert_eq!(power_heuristic(1.0_f32, f32::INFINITY), 0.0);
        assert_eq!(power_heuristic(1e30_f32, 0.0), 1.0);
        assert!((power_heuristic(3.0_f32, 4.0) + power_heuristic(4.0_f32, 3.0) - 1.0).abs() < 1e-6);
    }
}
