//! Bias and variance apart.
//!
//! A picture that is right but noisy differs from the truth by its variance alone: MSE = bias² + variance. Where the variance
//! of each pixel's mean is known, what is left of the squared difference estimates bias², without bias itself:
//! E[(a − b)²] = bias² + var a + var b.

use serde::Serialize;

use super::pair::Pair;

/// An estimate and its standard error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// The estimate.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
}

impl Estimate {
    /// The mean of independent numbers.
    pub fn of_mean(numbers: impl Iterator<Item = f64> + Clone) -> Estimate {
        let (sum, n) = numbers.clone().fold((0.0, 0.0), |(sum, n), v| (sum + v, n + 1.0));
        let mean = sum / n;
        let squares: f64 = numbers.map(|v| (v - mean) * (v - mean)).sum();
        Estimate { value: mean, error: (squares / (n - 1.0) / n).sqrt() }
    }

    /// Distance from zero in standard errors; where there is no error, there may be no distance.
    pub fn z(self) -> f64 {
        if self.value == 0.0 { 0.0 } else { self.value / self.error }
    }
}

/// What the differences consist of, over all pixels whose variances are known.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bias {
    /// Pixels counted.
    pub pixels: usize,
    /// Which pictures' variances are known: A, B. One without counts as exact.
    pub known: [bool; 2],
    /// Mean of a − b by channel; its error follows from the variances.
    pub difference: [Estimate; 3],
    /// Those over their errors.
    pub z: [f64; 3],
    /// bias², averaged over pixels and channels; its error follows from its spread over pixels, so it may be negative.
    pub bias2: Estimate,
    /// bias² by channel.
    pub bias2_each: [Estimate; 3],
    /// Mean variance of A and of B, averaged over pixels and channels; zero where unknown.
    pub variance: [f64; 2],
    /// MSE of the pixels counted: `bias2 + variance[0] + variance[1]`.
    pub mse: f64,
}

impl Bias {
    /// Of a pair of which a variance is known in at least two pixels.
    pub fn of(pair: &Pair) -> Option<Bias> {
        let pixels: Vec<(usize, [f64; 3])> = pair.indices().filter_map(|at| Some((at, pair.variance(at)?))).collect();
        if !pair.has_variance() || pixels.len() < 2 {
            return None;
        }
        let n = pixels.len() as f64;
        let delta = |at: usize, c: usize| f64::from(pair.a[at][c]) - f64::from(pair.b[at][c]);
        let difference = [0, 1, 2].map(|c| {
            let (sum, squared) = pixels.iter().fold((0.0, 0.0), |(d, v), &(at, var)| (d + delta(at, c), v + var[c]));
            Estimate { value: sum / n, error: squared.sqrt() / n }
        });
        let left = |&(at, variance): &(usize, [f64; 3]), c: usize| delta(at, c).powi(2) - variance[c];
        let bias2_each = [0, 1, 2].map(|c| Estimate::of_mean(pixels.iter().map(|pixel| left(pixel, c))));
        // Channels of a pixel depend on each other, pixels do not.
        let all = pixels.iter().map(|pixel| [0, 1, 2].map(|c| left(pixel, c)).iter().sum::<f64>() / 3.0);
        let variance = [&pair.variance_a, &pair.variance_b].map(|layer| {
            let mean = |layer: &Vec<[f32; 3]>| {
                pixels.iter().flat_map(|(at, _)| layer[*at]).map(f64::from).sum::<f64>() / (3.0 * n)
            };
            layer.as_ref().map_or(0.0, mean)
        });
        let bias2 = Estimate::of_mean(all);
        Some(Bias {
            pixels: pixels.len(),
            known: [pair.variance_a.is_some(), pair.variance_b.is_some()],
            difference,
            z: difference.map(Estimate::z),
            bias2,
            bias2_each,
            variance,
            mse: bias2.value + variance[0] + variance[1],
        })
    }
}
