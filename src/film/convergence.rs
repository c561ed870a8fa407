//! When a pixel has enough samples: the policy of adaptive sampling, as pure functions.
//!
//! The course's rule: a pixel is done when the 95 % confidence interval of its mean luminance is narrow,
//! `q · s / √n ≤ tolerance · mean`, tested after every batch. Three of its traps are closed here.
//!
//! * **Few samples.** With `q = 1.96` the interval is too narrow while `s` itself is a guess; Student's t widens it.
//! * **Black pixels.** Zeros have no spread, so `0 ≤ 0` would retire a pixel that has not found its light yet. `n`
//!   zeros only say, with 95 % confidence, that fewer than `3 / n` of the paths carry light (the rule of three), so
//!   such a pixel waits for [`zeros_needed`] samples.
//! * **Nearly black pixels.** A tolerance relative to a mean close to zero asks for precision that nobody can see.
//!   A mean *m* counts as √(m² + f²), *f* the rule's floor. A floor of 0.1 is also that of the relative error by which pictures are judged
//!   ([`crate::compare`]: ε = f²): bringing all parts to the same such error is never worse than spreading samples evenly. With *a* the samples that a
//!   part needs for it and *c* the most that it may get, it gets x = min(a, c), its squared error is y = a / x in units of that of the tolerance, and evenly spread
//!   samples have mean(a) / mean(x); x and y both grow with *a*, so mean(x) · mean(y) ≤ mean(a) (Chebyshev). Where errors fall
//!   faster than 1/n, all the more. With another floor that does not hold: at [`Adaptive::DARK`], Cornell boxes have 1.1 to 1.4 times the error, because dark corners take the
//!   samples.
//!
//! What is left: testing again and again, and stopping on a luckily small variance, biases the mean a little.
//! A larger `min_samples` or `batch` lessens that.

use super::interval::Interval;
use crate::options::{Adaptive, Confidence};

/// Two-sided 95 % quantile of the normal distribution.
const Z: f64 = 1.959_963_984_540_054;

/// Number, mean and spread of samples, gathered one at a time (Welford 1962; Knuth, TAOCP vol. 2, §4.2.2).
///
/// Stable where `Σx² − (Σx)²/n` is not: 10⁷ samples of mean 10⁴ and standard deviation 10⁻³ give their variance
/// to at least eight digits. NaN and infinities are the caller's to keep out: once in, they stay, and the pixel
/// never converges.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    /// Samples; stops counting at `u32::MAX`.
    pub n: u32,
    /// Their mean.
    pub mean: f64,
    /// Sum of squared deviations from the mean.
    pub m2: f64,
}

impl Moments {
    /// Adds one sample.
    pub fn push(&mut self, x: f64) {
        self.n = self.n.saturating_add(1);
        let delta = x - self.mean;
        self.mean += delta / f64::from(self.n);
        self.m2 += delta * (x - self.mean);
    }

    /// The moments of both sets of samples together (Chan, Golub & LeVeque 1979).
    ///
    /// Equal to pushing all samples one by one but for rounding: the last bits depend on how samples were grouped.
    pub fn merge(self, other: Self) -> Self {
        if self.n == 0 {
            return other;
        }
        if other.n == 0 {
            return self;
        }
        let (a, b) = (f64::from(self.n), f64::from(other.n));
        let delta = other.mean - self.mean;
        Moments {
            n: self.n.saturating_add(other.n),
            mean: self.mean + delta * (b / (a + b)),
            m2: self.m2 + other.m2 + delta * delta * (a * b / (a + b)),
        }
    }

    /// Unbiased variance of the samples; infinite for fewer than two, which say nothing about their spread.
    pub fn variance(&self) -> f64 {
        if self.n < 2 { f64::INFINITY } else { self.m2 / f64::from(self.n - 1) }
    }

    /// Standard error of the mean, `√(variance / n)`; infinite for fewer than two samples.
    pub fn standard_error(&self) -> f64 {
        if self.n < 2 { f64::INFINITY } else { (self.variance() / f64::from(self.n)).sqrt() }
    }
}

/// Whether a pixel, or a tile, with this interval of luminance may retire under `rule`.
///
/// `n ≥ min_samples` and `q · s / √n ≤ tolerance · √(mean² + floor²)`; a pixel of nothing but zeros needs
/// [`zeros_needed`] samples instead. Never with fewer than two samples or after a NaN or an infinity.
pub fn converged(interval: &Interval, rule: &Adaptive) -> bool {
    if interval.samples < rule.min_samples.max(2) || interval.degrees == 0 {
        return false;
    }
    if interval.mean == 0.0 && interval.error == 0.0 {
        return interval.samples >= zeros_needed(rule);
    }
    let quantile = match rule.confidence {
        Confidence::Z => Z,
        Confidence::T => student_t(interval.degrees),
    };
    // False for NaN; an infinite mean comes with a NaN spread.
    quantile * interval.error <= f64::from(rule.tolerance) * interval.mean.hypot(rule.floor.into())
}

/// Samples after which a pixel that saw only zeros is taken to be black: `max(min_samples, 4 · batch, 64)`.
///
/// By the rule of three, 64 zeros leave at most 4.7 % of paths that could carry light, and the 4 · 64 of the
/// course's usual batch 1.2 %. Waiting is cheap in the common case, a background, where a path is one ray that misses.
pub fn zeros_needed(rule: &Adaptive) -> u32 {
    rule.min_samples.max(rule.batch.saturating_mul(4)).max(64)
}

/// Two-sided 95 % quantile of Student's t, `t(0.975, ν)`, for ν ≥ 1 degrees of freedom; infinite for ν = 0.
///
/// From a table up to ν = 20, then by the Cornish–Fisher expansion in 1/ν (Abramowitz & Stegun 26.7.5).
/// Wrong by less than 2e-7 everywhere.
pub fn student_t(degrees: u32) -> f64 {
    if degrees == 0 {
        return f64::INFINITY;
    }
    if let Some(&t) = STUDENT_T.get(degrees as usize - 1) {
        return t;
    }
    // g₁ … g₄ of 26.7.5 at x = Z: polynomials in x, which is fixed.
    const G: [f64; 4] =
        [2.372_271_230_298_563, 2.822_498_615_739_612, 2.555_849_679_507_723_3, 1.589_534_053_393_823_5];
    let u = 1.0 / f64::from(degrees);
    Z + u * (G[0] + u * (G[1] + u * (G[2] + u * G[3])))
}

/// `t(0.975, ν)` for ν = 1, 2, …, from the inverse of the incomplete beta function in 30-digit arithmetic.
const STUDENT_T: [f64; 20] = [
    12.706_204_736_174_7,
    4.302_652_729_749_464,
    3.182_446_305_283_71,
    2.776_445_105_197_794,
    2.570_581_835_636_316,
    2.446_911_851_144_97,
    2.364_624_251_592_785,
    2.306_004_135_204_167,
    2.262_157_162_798_206,
    2.228_138_851_986_275,
    2.200_985_160_091_64,
    2.178_812_829_667_229,
    2.160_368_656_462_793,
    2.144_786_687_917_804,
    2.131_449_545_559_776,
    2.119_905_299_221_255,
    2.109_815_577_833_317,
    2.100_922_040_241_038,
    2.093_024_054_408_31,
    2.085_963_447_265_865,
];

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{ContinuousCDF, StudentsT};

    const RULE: Adaptive =
        Adaptive { batch: 16, tolerance: 0.05, confidence: Confidence::T, min_samples: 32, ..Adaptive::COURSE };

    fn done(moments: &Moments, rule: &Adaptive) -> bool {
        converged(&Interval::of_samples(moments), rule)
    }

    fn of(samples: impl IntoIterator<Item = f64>) -> Moments {
        let mut moments = Moments::default();
        samples.into_iter().for_each(|x| moments.push(x));
        moments
    }

    /// Uniform in `0..1`, from Weyl's sequence: spread evenly, the same in every run.
    fn uniform(i: u32) -> f64 {
        (f64::from(i) * 0.618_033_988_749_894_9).fract()
    }

    #[test]
    fn moments_of_a_known_set() {
        let m = of([2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0]);
        assert_eq!((m.n, m.mean), (8, 5.0));
        assert!((m.variance() - 32.0 / 7.0).abs() < 1e-12);
        assert!((m.standard_error() - (4.0f64 / 7.0).sqrt()).abs() < 1e-12);
        assert_eq!(Moments::default().variance(), f64::INFINITY);
        assert_eq!(of([3.0]).standard_error(), f64::INFINITY);
    }

    #[test]
    fn merging_equals_pushing() {
        let samples: Vec<f64> = (0..1000).map(|i| uniform(i) * 3.0 + 7.0).collect();
        let whole = of(samples.iter().copied());
        for cut in [0, 1, 2, 500, 999, 1000] {
            let m = of(samples[..cut].iter().copied()).merge(of(samples[cut..].iter().copied()));
            assert_eq!(m.n, whole.n);
            assert!((m.mean - whole.mean).abs() < 1e-12, "{cut}");
            assert!((m.m2 / whole.m2 - 1.0).abs() < 1e-12, "{cut}");
        }
    }

    #[test]
    fn ten_million_samples_far_from_zero() {
        // ±σ in turn: a mean of 10⁴ and a variance of σ²·n/(n−1), exactly but for the rounding of the samples.
        let n = 10_000_000u32;
        let m = of((0..n).map(|i| 1e4 + if i % 2 == 0 { 1e-3 } else { -1e-3 }));
        let expected = 1e-6 * f64::from(n) / f64::from(n - 1);
        assert!((m.mean - 1e4).abs() < 1e-9, "{}", m.mean);
        assert!((m.variance() / expected - 1.0).abs() < 1e-8, "{:e}", m.variance() / expected - 1.0);

        // In batches, as the renderer merges them. The variance of a uniform variable of width w is w²/12.
        let width = 1e-3 * 12f64.sqrt();
        let batches = (0..n / 64).map(|b| of((0..64).map(|i| 1e4 + width * uniform(b * 64 + i))));
        let m = batches.fold(Moments::default(), Moments::merge);
        assert!((m.variance() / 1e-6 - 1.0).abs() < 1e-6, "{:e}", m.variance() / 1e-6 - 1.0);
    }

    #[test]
    fn student_t_agrees_with_statrs() {
        for degrees in (1..=2000).chain([5_000, 10_000]) {
            let expected = StudentsT::new(0.0, 1.0, f64::from(degrees)).unwrap().inverse_cdf(0.975);
            let got = student_t(degrees);
            assert!((got - expected).abs() < 1e-6, "ν = {degrees}: {got} instead of {expected}");
        }
        // Beyond, statrs itself falls below the normal quantile (1.95985 for ν = 10⁶), which is impossible.
        for degrees in [100_000, 1_000_000, u32::MAX] {
            let above = student_t(degrees) - Z;
            assert!(above > 0.0 && above < 2.373 / f64::from(degrees), "ν = {degrees}: {above:e}");
        }
        assert_eq!(student_t(0), f64::INFINITY);
    }

    #[test]
    fn black_pixels_wait() {
        assert_eq!(zeros_needed(&RULE), 64);
        assert_eq!(zeros_needed(&Adaptive { batch: 64, ..RULE }), 256);
        assert_eq!(zeros_needed(&Adaptive { min_samples: 1000, ..RULE }), 1000);
        let black = |n| Moments { n, mean: 0.0, m2: 0.0 };
        assert!(!done(&black(0), &RULE));
        assert!(!done(&black(63), &RULE));
        assert!(done(&black(64), &RULE));
    }

    #[test]
    fn one_find_among_zeros_keeps_a_pixel_going() {
        let mut m = Moments { n: 63, mean: 0.0, m2: 0.0 };
        m.push(1.0);
        assert!(!done(&m, &RULE));
    }

    #[test]
    fn nearly_black_pixels_end() {
        // A mean of 1e-6 and a spread of the same size: 5 % of the mean would take 1600 samples.
        let m = of((0..100).map(|i| 2e-6 * uniform(i)));
        assert!(done(&m, &RULE));
        assert!((Adaptive::DARK - 1.517_6e-4).abs() < 1e-8);
    }

    #[test]
    fn the_interval_decides() {
        // Samples 1 ± a: a half-width of t·a/√(n−1) around 1.
        let pixel = |n: u32, a: f64| of((0..n).map(|i| if i % 2 == 0 { 1.0 + a } else { 1.0 - a }));
        let limit = |n: u32| 0.05 * f64::from(n - 1).sqrt() / student_t(n - 1);
        for n in [32, 100, 1000] {
            assert!(done(&pixel(n, limit(n) * 0.999), &RULE));
            assert!(!done(&pixel(n, limit(n) * 1.001), &RULE));
        }
        // Between the two quantiles: z retires what t keeps.
        let m = pixel(32, limit(32) * 1.01);
        assert!(!done(&m, &RULE));
        assert!(done(&m, &Adaptive { confidence: Confidence::Z, ..RULE }));
    }

    #[test]
    fn never_before_the_least_number_of_samples() {
        let light = of(std::iter::repeat_n(10.0, 31));
        assert!(!done(&light, &RULE));
        assert!(done(&light, &Adaptive { min_samples: 31, ..RULE }));
        assert!(!done(&of([10.0]), &Adaptive { min_samples: 0, ..RULE }));
    }

    #[test]
    fn not_a_number_never_converges_and_never_panics() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut m = of(std::iter::repeat_n(1.0, 100));
            m.push(bad);
            m.push(1.0);
            assert!(!done(&m, &RULE), "{bad}");
            assert!(!done(&m.merge(m), &RULE), "{bad}");
        }
        let mut full = Moments { n: u32::MAX, mean: 1.0, m2: 0.0 };
        full.push(1.0);
        assert_eq!(full.merge(full).n, u32::MAX);
    }
}
