//! Peak signal-to-noise ratio.

use super::Channels;
use super::pair::Pair;
use super::seen::{Seen, grey};
use crate::film::png_output::srgb_encoded;

/// 10 log₁₀(1 / MSE) decibels of sRGB-encoded values clamped to 0..1, so that the peak is 1; infinite where there is no
/// error. It is what 8-bit pictures would have (peak 255), without their rounding.
pub fn of(pair: &Pair, seen: &Seen) -> Channels {
    let n = pair.count() as f64;
    let (mut each, mut luminance) = ([0.0; 3], 0.0);
    for at in pair.indices() {
        let (a, b) = (seen.a[at], seen.b[at]);
        for c in 0..3 {
            each[c] += (srgb_encoded(a[c]) - srgb_encoded(b[c])).powi(2);
        }
        luminance += (grey(a) - grey(b)).powi(2);
    }
    let rgb = each.iter().sum::<f64>() / 3.0;
    Channels { rgb, each, luminance }.map(|sum| -10.0 * (sum / n).log10())
}

#[cfg(test)]
mod tests {
    use super::super::pair::tests::{pair, pattern};
    use super::*;
    use crate::film::png_output::srgb_decoded;

    #[test]
    fn closed_forms() {
        let of = |a, b| {
            let pair = pair(48, a, b);
            super::of(&pair, &Seen::new(&pair, 0.0))
        };
        let flat = |encoded: f64| vec![[srgb_decoded(encoded) as f32; 3]; 48];
        assert!((of(flat(0.5), flat(0.6)).rgb - 20.0).abs() < 1e-4, "an error of a tenth is 20 dB");
        assert!((of(flat(0.5), flat(0.51)).luminance - 40.0).abs() < 1e-3);
        assert!(of(flat(0.0), flat(1.0)).rgb.abs() < 1e-9);
        assert_eq!(of(flat(0.3), flat(0.3)).rgb, f64::INFINITY);
        assert_eq!(of(vec![[1.0; 3]; 48], vec![[7.0; 3]; 48]).rgb, f64::INFINITY, "beyond the peak nothing is seen");
        let (a, b) = (pattern(1, 48, 36), pattern(2, 48, 36));
        assert_eq!(of(a.clone(), b.clone()), of(b, a));
    }
}
