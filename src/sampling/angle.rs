//! Angles without the system's library: sine, cosine and arc tangent from polynomials, without branches, and the same bits on
//! every machine.

use super::order::{max, min};
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// Sine and cosine for |angle| ≤ π/4: Taylor series, truncated below one unit in the last place of `f32`.
#[inline(always)]
pub fn sin_cos_quarter(angle: f32) -> (f32, f32) {
    let t = angle * angle;
    let s = 2.755_731_9e-6 * t - 1.984_127e-4;
    let s = s * t + 8.333_334e-3;
    let s = s * t - 1.666_666_7e-1;
    let s = s * t * angle + angle;
    let c = 2.480_158_7e-5 * t - 1.388_888_9e-3;
    let c = c * t + 4.166_666_8e-2;
    let c = c * t - 0.5;
    let c = c * t + 1.0;
    (s, c)
}

/// Sine and cosine for angles from 0 to π, folded at π/2 and π/4.
#[inline(always)]
pub fn sin_cos(angle: f32) -> (f32, f32) {
    let obtuse = angle > FRAC_PI_2;
    let supplement = PI - angle;
    let acute = if obtuse { supplement } else { angle };
    let steep = acute > FRAC_PI_4;
    let complement = FRAC_PI_2 - acute;
    let (s, c) = sin_cos_quarter(if steep { complement } else { acute });
    let (s, c) = (if steep { c } else { s }, if steep { s } else { c });
    let opposite = -c;
    (s, if obtuse { opposite } else { c })
}

/// The angle from 0 to π of the vector (x, y), y ≥ 0, off the x axis: `atan2`. Not a number for (0, 0).
///
/// Polynomial for |t| ≤ tan(π/8) after Moshier's Cephes library (`atanf`), to which larger ones are turned by −π/4.
#[inline(always)]
pub fn angle_of(y: f32, x: f32) -> f32 {
    let ax = x.abs();
    let (small, large) = (min(y, ax), max(y, ax));
    let turned = small > large * 0.414_213_57;
    let (difference, sum) = (small - large, small + large);
    let over = if turned { difference } else { small };
    let under = if turned { sum } else { large };
    let t = over / under;
    let z = t * t;
    let p = 8.053_744_5e-2 * z - 1.387_768_6e-1;
    let p = p * z + 1.997_771_1e-1;
    let p = p * z - 3.333_295e-1;
    let p = p * z * t + t;
    let angle = p + if turned { FRAC_PI_4 } else { 0.0 };
    let complement = FRAC_PI_2 - angle;
    let angle = if y > ax { complement } else { angle };
    let supplement = PI - angle;
    if x < 0.0 { supplement } else { angle }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quarter_sine_and_cosine_are_right_to_two_units() {
        for i in -1000..=1000 {
            let a = i as f32 / 1000.0 * FRAC_PI_4;
            let (s, c) = sin_cos_quarter(a);
            assert!((f64::from(s) - f64::from(a).sin()).abs() <= 1.2e-7, "sin {a}");
            assert!((f64::from(c) - f64::from(a).cos()).abs() <= 1.2e-7, "cos {a}");
        }
    }

    #[test]
    fn sine_and_cosine_are_right_over_half_a_turn() {
        let mut worst = 0.0f64;
        for i in 0..=100_000 {
            let a = i as f32 / 100_000.0 * PI;
            let (s, c) = sin_cos(a);
            let error = (f64::from(s) - f64::from(a).sin()).abs().max((f64::from(c) - f64::from(a).cos()).abs());
            worst = worst.max(error);
        }
        println!("largest error {worst:.1e}");
        assert!(worst < 2.5e-7, "{worst:e}");
        // Small angles keep their relative precision: tiny solid angles depend on it.
        for i in 1..=60 {
            let a = 0.7 * 0.5f32.powi(i);
            assert!((f64::from(sin_cos(a).0) / f64::from(a).sin() - 1.0).abs() < 2e-7, "{a}");
        }
    }

    #[test]
    fn the_arc_tangent_is_right_in_all_directions_and_at_all_sizes() {
        let mut worst = 0.0f64;
        for scale in [1e-30f32, 1e-10, 1.0, 1e10, 1e30] {
            for i in 0..=100_000 {
                let a = f64::from(i) / 100_000.0 * std::f64::consts::PI;
                let (y, x) = (a.sin() as f32 * scale, a.cos() as f32 * scale);
                let exact = f64::from(y.max(0.0)).atan2(x.into());
                worst = worst.max((f64::from(angle_of(y.max(0.0), x)) - exact).abs());
            }
        }
        println!("largest error {worst:.1e}");
        assert!(worst < 4e-7, "{worst:e}");
        for i in 1..=60 {
            let y = 0.7 * 0.5f32.powi(i);
            assert!((f64::from(angle_of(y, 1.0)) / f64::from(y).atan() - 1.0).abs() < 3e-7, "{y}");
        }
        assert_eq!((angle_of(0.0f32, 1.0), angle_of(1.0f32, 0.0), angle_of(0.0f32, -1.0)), (0.0, FRAC_PI_2, PI));
    }
}
