//! Squared and largest differences of linear values.

use super::Channels;
use super::pair::Pair;

/// Mean squared error: the mean of (a − b)².
pub fn mean(pair: &Pair) -> Channels {
    pair.mean(|a, b| (a - b) * (a - b))
}

/// Largest |a − b|.
pub fn largest(pair: &Pair) -> Channels {
    let [r, g, b, luminance] = pair.fold(|a, b| (a - b).abs(), f64::max);
    Channels { rgb: r.max(g).max(b), each: [r, g, b], luminance }
}

#[cfg(test)]
mod tests {
    use super::super::pair::tests::{pair, pattern};
    use super::*;

    #[test]
    fn an_offset_is_its_square() {
        let b = pattern(1, 48, 36);
        let a = b.iter().map(|p| [p[0] + 0.5, p[1] - 0.25, p[2]]).collect();
        let pair = pair(48, a, b);
        let mse = mean(&pair);
        for (got, want) in mse.each.into_iter().zip([0.25, 0.0625, 0.0]) {
            assert!((got - want).abs() < 1e-7, "{mse:?}");
        }
        assert!((mse.rgb - 0.3125 / 3.0).abs() < 1e-7);
        assert!((mse.luminance - (0.2126f64 * 0.5 - 0.7152 * 0.25).powi(2)).abs() < 1e-7);
        assert!((largest(&pair).rgb - 0.5).abs() < 1e-6);
    }

    /// MSE goes with the square of the values, and does not tell A from B.
    #[test]
    fn scaling_and_symmetry() {
        let (a, b) = (pattern(1, 48, 36), pattern(2, 48, 36));
        let double = |p: &Vec<[f32; 3]>| p.iter().map(|p| p.map(|c| 2.0 * c)).collect::<Vec<_>>();
        let once = mean(&pair(48, a.clone(), b.clone()));
        assert_eq!(mean(&pair(48, double(&a), double(&b))), once.map(|v| 4.0 * v));
        assert_eq!(mean(&pair(48, b, a)), once);
    }
}
