//! Every pixel against its standard error.

use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF as _, Normal};

use super::bias::Estimate;
use super::pair::Pair;

/// Chance that any pixel fails if the pictures differ by noise alone.
pub const ALPHA: f64 = 0.01;

/// Two-sided z-tests of all channels of all pixels, Šidák-corrected.
///
/// A z is the difference over its standard error. It is normal where means of many samples are compared; few samples make
/// standard errors too small, and z² larger than 1 without anything being wrong.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ZTest {
    /// Chance that any test fails though all pixels are right.
    pub alpha: f64,
    /// The |z| that all tests stay below with probability 1 − α.
    pub limit: f64,
    /// Pixels tested.
    pub pixels: usize,
    /// Pixels that count but whose variance is not known (of one sample, say).
    pub untested: usize,
    /// Share of the pixels all of whose channels pass.
    pub passing: f64,
    /// Pixels that differ though neither picture has variance there: none may.
    pub impossible: usize,
    /// Largest |z| of those that are finite.
    pub largest: f64,
    /// Mean of z², over pixels: 1 if both state their errors rightly and are not biased.
    pub mean_square: Estimate,
    /// The sum of z², by channel: χ² distributed, as pixels are independent.
    pub chi2: [f64; 3],
    /// Its degrees of freedom: pixels with variance.
    pub degrees: [usize; 3],
    /// Chance of a sum as large or larger; 1 where there are no degrees.
    pub p: [f64; 3],
}

impl ZTest {
    /// Of a pair of which a variance is known in at least two pixels.
    pub fn of(pair: &Pair, alpha: f64) -> Option<ZTest> {
        let pixels: Vec<[Option<f64>; 3]> = pair.indices().filter_map(|at| z(pair, at)).collect();
        if !pair.has_variance() || pixels.len() < 2 {
            return None;
        }
        let limit = sidak(alpha, 3 * pixels.len());
        let finite = |pixel: &[Option<f64>; 3]| pixel.iter().all(|z| z.is_none_or(f64::is_finite));
        let passes = |pixel: &&[Option<f64>; 3]| pixel.iter().flatten().all(|z| z.abs() <= limit);
        let (mut chi2, mut degrees) = ([0.0; 3], [0usize; 3]);
        for pixel in &pixels {
            for (c, z) in pixel.iter().enumerate().filter_map(|(c, z)| Some((c, (*z)?))).filter(|(_, z)| z.is_finite())
            {
                chi2[c] += z * z;
                degrees[c] += 1;
            }
        }
        // Channels of a pixel depend on each other: the pixel's mean is one observation.
        let squares = pixels.iter().filter_map(|pixel| {
            let squares: Vec<f64> = pixel.iter().flatten().filter(|z| z.is_finite()).map(|z| z * z).collect();
            (!squares.is_empty()).then(|| squares.iter().sum::<f64>() / squares.len() as f64)
        });
        let p = [0, 1, 2].map(|c| match ChiSquared::new(degrees[c] as f64) {
            Ok(distribution) if chi2[c] > 0.0 => distribution.sf(chi2[c]),
            _ => 1.0,
        });
        Some(ZTest {
            alpha,
            limit,
            pixels: pixels.len(),
            untested: pair.count() - pixels.len(),
            passing: pixels.iter().filter(passes).count() as f64 / pixels.len() as f64,
            impossible: pixels.iter().filter(|pixel| !finite(pixel)).count(),
            largest: pixels.iter().flatten().flatten().map(|z| z.abs()).filter(|z| z.is_finite()).fold(0.0, f64::max),
            mean_square: Estimate::of_mean(squares),
            chi2,
            degrees,
            p,
        })
    }
}

/// The z of each channel of a pixel, if its variance is known.
///
/// Of a channel without variance there is none where both are the same; any other difference there is infinite.
pub fn z(pair: &Pair, at: usize) -> Option<[Option<f64>; 3]> {
    let variance = pair.variance(at)?;
    let [a, b] = pair.pixel(at);
    Some([0, 1, 2].map(|c| match a[c] - b[c] {
        difference if variance[c] > 0.0 => Some(difference / variance[c].sqrt()),
        0.0 => None,
        difference => Some(difference.signum() * f64::INFINITY),
    }))
}

/// The |z| that `tests` independent normal variables stay below, all of them, with probability 1 − `alpha` (Z. Šidák,
/// "Rectangular Confidence Regions for the Means of Multivariate Normal Distributions", 1967).
pub fn sidak(alpha: f64, tests: usize) -> f64 {
    let each = -((-alpha).ln_1p() / tests as f64).exp_m1();
    -Normal::standard().inverse_cdf(each / 2.0)
}

#[cfg(test)]
mod tests {
    use super::super::bias::Bias;
    use super::super::pair::tests::pair;
    use super::*;

    /// Normal numbers of mean 0 and variance 1, the same in every run.
    fn normals(n: usize, seed: u64) -> Vec<f64> {
        let mut state = seed * 2 + 1;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 11) as f64 + 0.5) / (1u64 << 53) as f64
        };
        (0..n).map(|_| (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos()).collect()
    }

    /// B is flat, A is `factor` times that and noise of deviation `sigma` times that which its variances state.
    fn noisy(factor: f64, sigma: f64) -> Pair {
        const STATED: f64 = 0.02;
        let n = 128 * 96;
        let noise = normals(3 * n, 5);
        let a = (0..n).map(|i| [0, 1, 2].map(|c| (0.5 * factor + STATED * sigma * noise[3 * i + c]) as f32)).collect();
        let mut pair = pair(128, a, vec![[0.5; 3]; n]);
        pair.variance_a = Some(vec![[(STATED * STATED) as f32; 3]; n]);
        pair
    }

    #[test]
    fn noise_as_stated_passes() {
        let pair = noisy(1.0, 1.0);
        let test = ZTest::of(&pair, ALPHA).unwrap();
        println!("{test:?}");
        assert_eq!((test.pixels, test.untested, test.impossible), (128 * 96, 0, 0));
        assert!((test.mean_square.value - 1.0).abs() < 3.5 * test.mean_square.error);
        // The variance of a mean of three z² is 2/3.
        assert!((test.mean_square.error / (2.0 / 3.0 / 12288.0f64).sqrt() - 1.0).abs() < 0.05);
        assert!(test.passing == 1.0 && test.largest < test.limit);
        assert!(test.p.iter().all(|p| *p > 1e-3 && *p < 0.999), "{:?}", test.p);
        let bias = Bias::of(&pair).unwrap();
        assert!(bias.bias2.z().abs() < 3.5 && bias.z.iter().all(|z| z.abs() < 3.5), "{bias:?}");
        assert!((bias.variance[0] - 4e-4).abs() < 1e-9 && bias.known == [true, false]);
        let mse = super::super::squared::mean(&pair).rgb;
        assert!((bias.mse / mse - 1.0).abs() < 1e-9, "MSE = bias² + variance");
    }

    #[test]
    fn bias_is_found_though_no_pixel_shows_it() {
        let pair = noisy(1.01, 1.0);
        let (test, bias) = (ZTest::of(&pair, ALPHA).unwrap(), Bias::of(&pair).unwrap());
        assert!(test.passing > 0.999, "a quarter of a standard error is not seen in a pixel");
        assert!(bias.z.iter().all(|z| (z - 0.005 / (0.02 / 12288f64.sqrt())).abs() < 4.0), "{bias:?}");
        assert!((bias.bias2.value - 2.5e-5).abs() < 4.0 * bias.bias2.error && bias.bias2.z() > 5.0, "{bias:?}");
    }

    #[test]
    fn errors_stated_too_small_are_found() {
        let test = ZTest::of(&noisy(1.0, 1.2), ALPHA).unwrap();
        assert!((test.mean_square.value - 1.44).abs() < 4.0 * test.mean_square.error);
        assert!(test.p.iter().all(|p| *p < 1e-9));
    }

    #[test]
    fn no_variance_means_no_difference() {
        let mut three = pair(3, vec![[0.0; 3], [1.0; 3], [1.0; 3]], vec![[0.0; 3], [1.0, 1.0, 2.0], [1.5; 3]]);
        assert!(ZTest::of(&three, ALPHA).is_none() && Bias::of(&three).is_none());
        three.variance_a = Some(vec![[0.0; 3], [0.0; 3], [0.25; 3]]);
        let test = ZTest::of(&three, ALPHA).unwrap();
        assert_eq!((test.pixels, test.impossible, test.degrees), (3, 1, [1; 3]));
        assert_eq!(test.passing, 2.0 / 3.0);
        assert_eq!(test.chi2, [1.0; 3]);
        // One sample does not know its variance.
        three.variance_a = Some(vec![[f32::INFINITY; 3], [0.0; 3], [0.25; 3]]);
        assert_eq!(ZTest::of(&three, ALPHA).unwrap().untested, 1);
        three.variance_a = Some(vec![[f32::INFINITY; 3]; 3]);
        assert!(ZTest::of(&three, ALPHA).is_none());
    }

    #[test]
    fn sidak_limits() {
        assert!((sidak(0.05, 1) - 1.959_964).abs() < 1e-5);
        // 1 − 0.99^(1/100), half of it in each tail.
        assert!((sidak(0.01, 100) - 3.888_8).abs() < 1e-3, "{}", sidak(0.01, 100));
    }

    /// The distribution holds for millions of pixels: its tail is that of Wilson and Hilferty's approximation.
    #[test]
    fn chi_squared_of_many_degrees() {
        for n in [1e3, 1e5, 4e6f64] {
            let sum = n + 2.0 * (2.0 * n).sqrt();
            let z = ((sum / n).cbrt() - (1.0 - 2.0 / (9.0 * n))) / (2.0 / (9.0 * n)).sqrt();
            let [got, want] = [ChiSquared::new(n).unwrap().sf(sum), Normal::standard().sf(z)];
            assert!((got / want - 1.0).abs() < 0.01, "{n}: {got} {want}");
        }
    }
}
