//! Independent renders of one picture, added up: their mean, and by how much they are spread.
//!
//! | | |
//! |---|---|
//! | [`Spread`] | mean and spread of every channel of every pixel |
//! | [`seed()`] | seeds of renders that are independent of each other |
//! | [`rounds`] | renders until the mean is known well enough: `comber reference` |
//! | [`sums_file`] | a spread on disk, to go on from |
//! | [`about`] | what a picture depends on, so that nothing else is added to it |

pub mod about;
pub mod rounds;
pub mod sums_file;

use crate::error::{Error, Result};

/// Mean and spread of the channels of pixels over renders, each with a weight.
///
/// Weights say how much a render knows: its variance is taken to be that of weight one over its weight, as it is where the weight is
/// the number of independent samples. Where it falls faster than that (Sobol' points, say), errors of means of renders of different weight
/// are overstated and never understated, by Chebyshev's sum inequality. Sums are updated by the method of D. H. D. West, "Updating mean and variance estimates: an improved
/// method", CACM 22(9), 1979, in double precision and in the order of renders, so they depend on nothing else.
#[derive(Clone, Debug, PartialEq)]
pub struct Spread {
    /// Renders added.
    pub rounds: u32,
    /// Sum of their weights.
    pub weight: f64,
    /// Weighted mean of each channel.
    pub mean: Vec<[f64; 3]>,
    /// Sum of weights times squared distances from the mean.
    pub m2: Vec<[f64; 3]>,
}

impl Spread {
    /// Bytes a pixel.
    pub const BYTES_A_PIXEL: u64 = 2 * size_of::<[f64; 3]>() as u64;

    /// Of no renders yet.
    pub fn new(pixels: usize) -> Spread {
        Spread { rounds: 0, weight: 0.0, mean: vec![[0.0; 3]; pixels], m2: vec![[0.0; 3]; pixels] }
    }

    /// Adds a render.
    ///
    /// # Errors
    /// [`Error::Pictures`] if it has another number of pixels.
    pub fn add(&mut self, picture: &[[f32; 3]], weight: f64) -> Result<()> {
        if picture.len() != self.mean.len() {
            let (got, want) = (picture.len(), self.mean.len());
            return Err(Error::Pictures(format!("a picture of {got} pixels cannot be added to one of {want}")));
        }
        self.rounds += 1;
        self.weight += weight;
        let share = weight / self.weight;
        for ((pixel, mean), m2) in picture.iter().zip(&mut self.mean).zip(&mut self.m2) {
            for c in 0..3 {
                let value = f64::from(pixel[c]);
                let before = value - mean[c];
                mean[c] += before * share;
                m2[c] += weight * before * (value - mean[c]);
            }
        }
        Ok(())
    }

    /// Variance of each channel of a pixel in a render of weight one; infinite if there are not two renders.
    pub fn variance(&self, at: usize) -> [f64; 3] {
        let degrees = f64::from(self.rounds.saturating_sub(1));
        self.m2[at].map(|m2| if degrees > 0.0 { m2 / degrees } else { f64::INFINITY })
    }

    /// Variance of the mean of each channel of a pixel: its standard error squared.
    pub fn variance_of_mean(&self, at: usize) -> [f64; 3] {
        self.variance(at).map(|variance| variance / self.weight)
    }

    /// Estimated relative error of the mean picture: √ of the mean, over pixels and channels, of se² / (mean² + ε).
    ///
    /// That is the root of the relMSE ([`crate::compare::relative`]) that the picture is expected to have against the truth.
    pub fn relative_error(&self, epsilon: f64) -> f64 {
        let terms = (0..self.mean.len()).map(|at| {
            let variance = self.variance_of_mean(at);
            (0..3).map(|c| variance[c] / (self.mean[at][c] * self.mean[at][c] + epsilon)).sum::<f64>()
        });
        (terms.sum::<f64>() / (3 * self.mean.len()) as f64).sqrt()
    }
}

/// Seeds of rounds of [`rounds`] are those from here on; those of `comber trade` from [`TRADE_SEEDS`] on.
pub const ROUND_SEEDS: u32 = 0;
/// See [`ROUND_SEEDS`].
pub const TRADE_SEEDS: u32 = 1 << 31;

/// The seed of render number `index`, derived from the one that the user gave.
///
/// Different indices have different seeds, because the hash (C. Wellons, "Prospecting for Hash Functions", 2018: `lowbias32`, improved
/// by T. Ettinger) is a permutation of 32-bit numbers.
pub fn seed(base: u32, index: u32) -> u32 {
    mix(index.wrapping_add(mix(base ^ 0x9e37_79b9)))
}

fn mix(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x21f0_aaad);
    x ^= x >> 15;
    x = x.wrapping_mul(0xd35a_2d97);
    x ^ x >> 15
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the definition, for weights that differ.
    #[test]
    fn mean_and_spread_are_those_of_the_definition() {
        let values = [[1.0f32, 0.5, -2.0], [4.0, 0.5, 1.0], [2.5, 0.5, 1e6], [0.0, 0.5, 3.0]];
        let weights = [1.0, 2.0, 4.0, 4.0];
        let mut spread = Spread::new(1);
        for (value, weight) in values.iter().zip(weights) {
            spread.add(&[*value], weight).unwrap();
        }
        let all: f64 = weights.iter().sum();
        for c in 0..3 {
            let of =
                |f: &dyn Fn(f64) -> f64| values.iter().zip(weights).map(|(v, w)| w * f(f64::from(v[c]))).sum::<f64>();
            let mean = of(&|v| v) / all;
            let variance = of(&|v| (v - mean).powi(2)) / 3.0;
            let close = |got: f64, want: f64| assert!((got - want).abs() <= 1e-12 * want.abs(), "{got} {want}");
            close(spread.mean[0][c], mean);
            close(spread.variance(0)[c], variance);
            close(spread.variance_of_mean(0)[c], variance / all);
        }
        assert!(spread.add(&[[0.0; 3]; 2], 1.0).is_err());
    }

    #[test]
    fn the_relative_error_is_that_of_the_definition() {
        let mut spread = Spread::new(2);
        assert_eq!(Spread::new(1).relative_error(0.01), f64::INFINITY);
        spread.add(&[[1.0; 3], [0.0; 3]], 8.0).unwrap();
        assert_eq!(spread.relative_error(0.01), f64::INFINITY, "one render says nothing of its error");
        spread.add(&[[3.0; 3], [0.0; 3]], 8.0).unwrap();
        // Mean 2, standard error 1; a black pixel has none.
        assert!((spread.relative_error(0.01) - (1.0 / 4.01 / 2.0f64).sqrt()).abs() < 1e-15);
    }

    #[test]
    fn seeds_differ() {
        let mut seeds: Vec<u32> = (0..50_000).map(|i| seed(7, i)).collect();
        seeds.extend((0..50_000).map(|i| seed(7, TRADE_SEEDS + i)));
        seeds.sort_unstable();
        seeds.dedup();
        assert_eq!(seeds.len(), 100_000);
        assert_ne!(seed(0, 0), seed(1, 0));
    }
}
