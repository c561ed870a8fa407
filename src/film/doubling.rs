//! How good the mean of a single sequence is, whose samples avoid each other: by what the last doubling of them changed.
//!
//! The spread of such samples says far too much of the error of their mean (at 64 to 1024 samples of the Cornell boxes, 3 to 100 times the variance),
//! and dealing them to several sequences, which would tell, costs accuracy. But let *a* and *b* be the means of the first and of the second half of
//! them, *m* = (a + b) / 2 that of all, V the variance of *m* and V½ that of *a* and of *b*. Then *m* − *a* = (b − a) / 2, and
//!
//! E (m − a)² = (var a + var b) / 2 − var m = V½ − V
//!
//! whatever ties the halves to each other. Were they independent, V½ would be 2 V and this V itself; as they avoid each other it is more, (2ᵖ − 1) V where
//! the variance falls as n⁻ᵖ: in the tiles of the Cornell boxes at 64 to 1024 samples 0.93 to 1.4 V, in those that hold little but a lamp 2 to 3. Where the variance falls in steps,
//! it is off either way: for a single straight edge 1.5 V at 32 samples and 0.7 V at 128, for light in a hundredth of the directions 0.6 V at 128. One number from a pixel is a poor guess, but a tile has 256 of them.
//!
//! To take the bound off by p, as told by the change before, gave 0.4 to 1.9 V, less than V on average: the variance falls more slowly the more samples there are.

use super::interval::Interval;

/// What is known of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Doubling {
    /// Samples when there was last a power of two of them.
    samples: u32,
    /// Mean luminance of those.
    mean: f64,
    /// How far it lies from that of half of them.
    change: f64,
}

impl Doubling {
    /// To be told of every sample: how many there are now, and the mean luminance of all.
    #[inline]
    pub fn note(&mut self, samples: u32, mean: f64) {
        if samples.is_power_of_two() {
            *self = Doubling { samples, mean, change: mean - self.mean };
        }
    }

    /// The interval of `samples` samples of this mean: since the last power of two, the variance is taken to have fallen as 1 / n; but light that has been
    /// met only since then has moved the mean, and the error is no less than that.
    pub fn interval(&self, samples: u32, mean: f64) -> Interval {
        let known = self.samples >= 2;
        let scale = (f64::from(self.samples) / f64::from(samples.max(1))).sqrt();
        let error = (self.change.abs() * scale).max((mean - self.mean).abs());
        Interval { samples, mean, error: if known { error } else { f64::INFINITY }, degrees: u32::from(known) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::{self, RenderOptions};
    use crate::sampling::sampler::Sampler;

    fn of(values: impl IntoIterator<Item = f64>) -> Interval {
        let (mut doubling, mut samples, mut mean) = (Doubling::default(), 0, 0.0);
        for value in values {
            samples += 1;
            mean += (value - mean) / f64::from(samples);
            doubling.note(samples, mean);
        }
        doubling.interval(samples, mean)
    }

    #[test]
    fn the_change_from_one_half_to_the_whole() {
        assert_eq!(of([]).error, f64::INFINITY);
        assert_eq!((of([3.0]).error, of([3.0]).degrees), (f64::INFINITY, 0));
        let four = of([1.0, 3.0, 6.0, 10.0]);
        assert_eq!((four.samples, four.mean, four.error, four.degrees), (4, 5.0, 3.0, 1));
        // Two of them more: the change at four still counts, less by √(4 / 6).
        let six = of([1.0, 3.0, 6.0, 10.0, 7.0, 9.0]);
        assert!((six.mean - 6.0).abs() < 1e-14 && (six.error - 3.0 * (4.0f64 / 6.0).sqrt()).abs() < 1e-14, "{six:?}");
        // Black until the last doubling, and lit since.
        let lit = of([0.0, 0.0, 0.0, 0.0, 0.0, 6.0]);
        assert_eq!((lit.mean, lit.error), (1.0, 1.0));
    }

    /// Over many pixels: the true variance of the mean for independent numbers, about that or more for Sobol points.
    #[test]
    fn it_is_about_the_variance_of_the_mean_or_more() {
        type Integrand = fn([f32; 4]) -> f64;
        let integrands: [(&str, Integrand); 3] = [
            ("an edge", |[u, v, ..]| f64::from(u8::from(f64::from(u) + 0.7 * f64::from(v) < 0.8))),
            ("a product", |[u, v, w, x]| f64::from(u * v) + f64::from(w * x) * 3.0),
            ("rare", |[u, v, ..]| if u * v < 0.01 { 30.0 } else { 0.0 }),
        ];
        for (name, f) in integrands {
            for n in [32u32, 128] {
                for (kind, range) in [(options::Sampler::Independent, 0.88..1.12), (options::Sampler::Sobol, 0.5..5.0)]
                {
                    let options = RenderOptions { sampler: kind, samples: n, ..RenderOptions::default() };
                    let sampler = Sampler::new(&options);
                    let pixels = 4000;
                    let all: Vec<Interval> =
                        (0..pixels).map(|p| of((0..n).map(|i| f(sampler.draw(p, i, 2))))).collect();
                    let mean = all.iter().map(|one| one.mean).sum::<f64>() / f64::from(pixels);
                    let truth = all.iter().map(|one| (one.mean - mean).powi(2)).sum::<f64>() / f64::from(pixels - 1);
                    let stated = all.iter().map(|one| one.error * one.error).sum::<f64>() / f64::from(pixels);
                    let ratio = stated / truth;
                    println!("{name}, {n} samples, {kind:?}: {ratio:.2}");
                    // Both variances err by some 3 to 5 per cent.
                    assert!(range.contains(&ratio), "{name}, {n} samples, {kind:?}: {ratio}");
                }
            }
        }
    }
}
