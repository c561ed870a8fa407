//! The confidence interval of a mean: from samples that are independent, or from sequences that are.

use super::convergence::Moments;

/// A mean, and how far it may be off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Samples behind it.
    pub samples: u32,
    /// Mean.
    pub mean: f64,
    /// Standard error of the mean; infinite where nothing can be said.
    pub error: f64,
    /// Degrees of freedom of the standard error: how well it is known itself.
    pub degrees: u32,
}

impl Interval {
    /// Of independent samples.
    pub fn of_samples(moments: &Moments) -> Interval {
        Interval {
            samples: moments.n,
            mean: moments.mean,
            error: moments.standard_error(),
            degrees: moments.n.saturating_sub(1),
        }
    }

    /// Of independent sequences, each with its number of samples and their mean: by the spread between the means.
    ///
    /// With `wᵣ = nᵣ / n`, the variance is `R / (R − 1) · Σ wᵣ² (mᵣ − m)²`: the usual one where all are equally long, and
    /// close to it where a sequence is one sample ahead.
    pub fn of_sequences(sequences: impl Iterator<Item = (u32, f64)> + Clone) -> Interval {
        let filled = sequences.filter(|&(n, _)| n > 0);
        let (mut count, mut samples, mut sum) = (0u32, 0u32, 0.0);
        for (n, mean) in filled.clone() {
            count += 1;
            samples = samples.saturating_add(n);
            sum += f64::from(n) * mean;
        }
        let mean = if samples > 0 { sum / f64::from(samples) } else { 0.0 };
        let squares: f64 = filled.map(|(n, m)| (f64::from(n) / f64::from(samples) * (m - mean)).powi(2)).sum();
        let error = if count < 2 { f64::INFINITY } else { (squares * f64::from(count) / f64::from(count - 1)).sqrt() };
        Interval { samples, mean, error, degrees: count.saturating_sub(1) }
    }

    /// As if there were `samples` of the same spread.
    pub fn at(self, samples: u32) -> Interval {
        let scale = f64::from(self.samples) / f64::from(samples.max(1));
        Interval { samples, error: self.error * scale.sqrt(), ..self }
    }

    /// Of a tile: the mean of its pixels' means, and an error that is as large beside it as the errors of the pixels are beside theirs, in the root
    /// mean square. A mean below `floor` counts as about as much (as in [`super::convergence::converged`]).
    ///
    /// An error beside the *tile's* mean would let a tile stop early that has a lamp in a corner, whatever the rest of it looks like. Beside their own means, though,
    /// pixels that have met a rare bright path, and are too bright for it, would seem no worse than others: so what counts is the smaller mean.
    pub fn of_tile(pixels: impl Iterator<Item = Interval> + Clone, floor: f64) -> Interval {
        let mut all = Interval { samples: u32::MAX, mean: 0.0, error: 0.0, degrees: 0 };
        let mut count = 0u32;
        for one in pixels.clone() {
            count += 1;
            all.samples = all.samples.min(one.samples);
            all.mean += one.mean;
            all.degrees = all.degrees.saturating_add(one.degrees);
        }
        let n = f64::from(count.max(1));
        all.mean /= n;
        // No error is none beside any mean, 0 among them.
        let with_error = pixels.filter(|one| one.error != 0.0);
        let squares: f64 = with_error.map(|one| (one.error / one.mean.min(all.mean).hypot(floor)).powi(2)).sum();
        Interval { error: all.mean.hypot(floor) * (squares / n).sqrt(), ..all }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sequences_of_one_sample_are_samples() {
        let values = [2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0];
        let mut moments = Moments::default();
        values.iter().for_each(|&x| moments.push(x));
        let (a, b) = (Interval::of_samples(&moments), Interval::of_sequences(values.iter().map(|&x| (1, x))));
        assert_eq!((a.samples, a.mean, a.degrees), (b.samples, b.mean, b.degrees));
        assert!((a.error / b.error - 1.0).abs() < 1e-14);
        assert!((a.at(32).error * 2.0 / a.error - 1.0).abs() < 1e-14, "four times the samples, half the error");
    }

    #[test]
    fn a_tile_is_as_good_as_its_pixels_are_beside_their_means() {
        let pixel = |mean, error| Interval { samples: 8, mean, error, degrees: 7 };
        let tile = |pixels: &[Interval]| Interval::of_tile(pixels.iter().copied(), 1e-3);
        let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-5;
        // Equally bright: the root mean square of the errors.
        let even = tile(&[pixel(2.0, 0.3), pixel(2.0, 0.4)]);
        assert_eq!((even.samples, even.mean, even.degrees), (8, 2.0, 14));
        assert!(near(even.error, (0.125f64).sqrt()), "{even:?}");
        // A lamp beside noise hides none of it; a firefly counts beside what is around it.
        let lamp = tile(&[pixel(100.0, 0.0), pixel(1.0, 0.5)]);
        assert!(near(lamp.error / lamp.mean, 0.5 / 2f64.sqrt()), "{lamp:?}");
        let mut pixels = vec![pixel(1.0, 0.0); 99];
        pixels.push(pixel(101.0, 100.0));
        assert!(near(tile(&pixels).error / 2.0, 5.0), "{:?}", tile(&pixels));
        // Nothing but zeros, and what nobody knows.
        assert_eq!(tile(&[pixel(0.0, 0.0); 3]).error, 0.0);
        assert_eq!(Interval::of_tile([pixel(0.0, 0.0); 3].into_iter(), 0.0).error, 0.0);
        assert_eq!(tile(&[pixel(1.0, f64::INFINITY), pixel(1.0, 0.1)]).error, f64::INFINITY);
    }

    #[test]
    fn one_sequence_says_nothing_and_empty_ones_are_left_out() {
        assert_eq!(Interval::of_sequences([(9, 1.0)].into_iter()).error, f64::INFINITY);
        assert_eq!(Interval::of_sequences(std::iter::empty()).error, f64::INFINITY);
        let some = Interval::of_sequences([(4, 1.0), (0, 7.0), (4, 3.0)].into_iter());
        assert_eq!((some.samples, some.mean, some.degrees), (8, 2.0, 1));
        assert!((some.error - 1.0).abs() < 1e-14);
    }
}
