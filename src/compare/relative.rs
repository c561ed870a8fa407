//! Squared differences relative to the reference.

use super::Channels;
use super::pair::Pair;

/// ε, if none is given: that of both sources, for radiance of the order of 1.
pub const EPSILON: f64 = 0.01;

/// relMSE: the mean of (a − b)² / (b² + ε).
///
/// F. Rousselle, C. Knaus, M. Zwicker, "Adaptive Sampling and Reconstruction using Greedy Error Minimization", ACM TOG 30(6),
/// 2011, section 5, with ε = 0.01.
pub fn relmse(pair: &Pair, epsilon: f64) -> Channels {
    pair.mean(|a, b| (a - b) * (a - b) / (b * b + epsilon))
}

/// MRSE, the mean relative squared error: the mean of ((a − b) / (b + ε))².
///
/// As pbrt-v4's `imgtool diff --metric MRSE` (M. Pharr, W. Jakob, G. Humphreys, "Physically Based Rendering", 4th ed., 2023), with
/// ε = 0.01. A reference below zero counts by its size, where pbrt's would divide by nothing at −ε.
pub fn mrse(pair: &Pair, epsilon: f64) -> Channels {
    pair.mean(|a, b| ((a - b) / (b.abs() + epsilon)).powi(2))
}

#[cfg(test)]
mod tests {
    use super::super::pair::tests::pair;
    use super::*;

    #[test]
    fn closed_forms() {
        let pair = pair(2, vec![[1.1, 0.5, 0.0], [1.1, 0.5, 0.0]], vec![[1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]);
        let close = |got: [f64; 3], want: [f64; 3]| {
            got.into_iter().zip(want).for_each(|(g, w)| assert!((g - w).abs() <= 1e-6 * (1.0 + w), "{got:?} {want:?}"));
        };
        close(relmse(&pair, 0.01).each, [0.01 / 1.01, 25.0, 0.0]);
        close(mrse(&pair, 0.01).each, [0.01 / 1.0201, 2500.0, 0.0]);
    }

    /// Where the reference is far above ε, pictures twice as bright have the same relative error.
    #[test]
    fn scaling_changes_nothing() {
        let at = |scale: f32| pair(2, vec![[110.0 * scale; 3], [90.0 * scale; 3]], vec![[100.0 * scale; 3]; 2]);
        for f in [relmse, mrse] {
            let [one, two] = [f(&at(1.0), EPSILON).rgb, f(&at(2.0), EPSILON).rgb];
            assert!((one - 0.01).abs() < 1e-5 && (one / two - 1.0).abs() < 1e-3, "{one} {two}");
        }
    }
}
