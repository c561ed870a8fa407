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

    /// Of a mean of many means, all equally weighty: a tile's.
    pub fn of_all(intervals: impl Iterator<Item = Interval>) -> Interval {
        let mut all = Interval { samples: u32::MAX, mean: 0.0, error: 0.0, degrees: 0 };
        let mut count = 0u32;
        for one in intervals {
            count += 1;
            all.samples = all.samples.min(one.samples);
            all.mean += one.mean;
            all.error += one.error * one.error;
            all.degrees = all.degrees.saturating_add(one.degrees);
        }
        let n = f64::from(count.max(1));
        Interval { mean: all.mean / n, error: (all.error / n).sqrt(), ..all }
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
    fn one_sequence_says_nothing_and_empty_ones_are_left_out() {
        assert_eq!(Interval::of_sequences([(9, 1.0)].into_iter()).error, f64::INFINITY);
        assert_eq!(Interval::of_sequences(std::iter::empty()).error, f64::INFINITY);
        let some = Interval::of_sequences([(4, 1.0), (0, 7.0), (4, 3.0)].into_iter());
        assert_eq!((some.samples, some.mean, some.degrees), (8, 2.0, 1));
        assert!((some.error - 1.0).abs() < 1e-14);
    }
}
