//! From the unit square to directions, and back to densities. Local frame: +z is the normal.

use super::angle::sin_cos_quarter;
use super::order::max;
use super::v3::V3;
use std::f32::consts::{FRAC_PI_4, PI};

/// A point of the unit disk, area-preserving and low in distortion.
///
/// Shirley & Chiu, *A Low Distortion Map Between Disk and Square*, JGT 2(3), 1997. The angle stays within ±π/4, where short
/// polynomials give sine and cosine to the last bits without range reduction.
#[inline(always)]
pub fn concentric_disk(u: f32, v: f32) -> (f32, f32) {
    let a = u * 2.0 - 1.0;
    let b = v * 2.0 - 1.0;
    let x_leads = a.abs() > b.abs();
    let radius = if x_leads { a } else { b };
    let other = if x_leads { b } else { a };
    // At the centre both are zero: divide by one instead, and the radius makes the point (0, 0).
    let safe = if radius.abs() > 0.0 { radius } else { 1.0 };
    let angle = FRAC_PI_4 * (other / safe);
    let (sin, cos) = sin_cos_quarter(angle);
    let along = radius * cos;
    let across = radius * sin;
    (if x_leads { along } else { across }, if x_leads { across } else { along })
}

/// Cosine-weighted direction of the upper hemisphere (Malley's method). Density [`cosine_hemisphere_pdf`].
#[inline(always)]
pub fn cosine_hemisphere(u: f32, v: f32) -> V3 {
    let (x, y) = concentric_disk(u, v);
    let z = max(1.0 - x * x - y * y, 0.0).sqrt();
    V3::new(x, y, z)
}

/// Solid-angle density of [`cosine_hemisphere`]: cos θ / π.
#[inline(always)]
pub fn cosine_hemisphere_pdf(cos_theta: f32) -> f32 {
    cos_theta * (1.0 / PI)
}

/// Uniform direction of the upper hemisphere; density 1 / 2π.
#[inline(always)]
pub fn uniform_hemisphere(u: f32, v: f32) -> V3 {
    uniform_cap(u, v, 1.0)
}

/// Uniform direction within a cone around +z whose `1 − cos θ_max` is `height`; density `1 / (2π·height)`.
///
/// The concentric disk, lifted: a disk of radius r maps to the cap of height r²·`height`, equal areas to equal areas.
#[inline(always)]
pub fn uniform_cap(u: f32, v: f32, height: f32) -> V3 {
    let (x, y) = concentric_disk(u, v);
    let drop = (x * x + y * y) * height;
    let scale = max(height * (2.0 - drop), 0.0).sqrt();
    V3::new(x * scale, y * scale, 1.0 - drop)
}

/// A right-handed orthonormal basis around unit `n`: returns (tangent, bitangent).
///
/// Duff et al., *Building an Orthonormal Basis, Revisited*, JCGT 6(1), 2017.
#[inline(always)]
pub fn basis(n: V3) -> (V3, V3) {
    let sign = 1.0f32.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    let tangent = V3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x);
    let bitangent = V3::new(b, sign + n.y * n.y * a, -n.y);
    (tangent, bitangent)
}

/// A local direction in the frame around unit normal `n`, as a world direction.
#[inline(always)]
pub fn to_world(local: V3, n: V3) -> V3 {
    let (tangent, bitangent) = basis(n);
    tangent * local.x + bitangent * local.y + n * local.z
}

/// The power heuristic with exponent 2: weight of the technique with density `a` beside one with density `b`.
///
/// Veach, *Robust Monte Carlo Methods for Light Transport Simulation*, 1997, §9.2.4.
#[inline(always)]
pub fn power_heuristic(a: f32, b: f32) -> f32 {
    // As 1 / (1 + (b/a)²): squares of densities overflow near a light, the ratio does not.
    let ratio = b / a;
    1.0 / (1.0 + ratio * ratio)
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{ChiSquared, ContinuousCDF};

    fn grid(n: u32) -> impl Iterator<Item = (f32, f32)> {
        (0..n * n)
            .map(move |i| ((i % n) as f32 + 0.5, (i / n) as f32 + 0.5))
            .map(move |(a, b)| (a / n as f32, b / n as f32))
    }

    #[test]
    fn bases_are_orthonormal_and_right_handed() {
        let mut normals: Vec<V3> = grid(40)
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
    fn chi2(what: &str, sample: impl Fn(f32, f32) -> V3, cdf: impl Fn(f32) -> f32) {
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
