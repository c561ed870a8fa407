//! How far a picture is from another: error metrics, bias and variance apart, tests by standard errors.
//!
//! A is the picture, B the reference. One file a metric:
//!
//! | | |
//! |---|---|
//! | [`pair`] | two pictures laid over each other, and which pixels count |
//! | [`squared`] | MSE, RMSE, largest difference |
//! | [`relative`] | relMSE, MRSE |
//! | [`psnr`], [`ssim`], [`flip`] | on what is seen: clamped, encoded |
//! | [`bias`] | MSE = bias² + variance |
//! | [`z_test`] | every pixel against its standard error |
//! | [`regions`] | the same by regions |
//! | [`maps`] | differences to look at |
//! | [`metric`] | metrics by name |
//!
//! Sums are taken in the order of pixels, so that figures do not depend on the number of threads.

pub mod bias;
mod filter;
pub mod flip;
pub mod maps;
pub mod metric;
pub mod pair;
pub mod psnr;
pub mod regions;
pub mod relative;
mod seen;
pub mod squared;
pub mod ssim;
pub mod z_test;

use crate::film::tile::luminance;
use serde::Serialize;

use pair::Pair;

/// What metrics take beside the pictures.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Settings {
    /// Stops of exposure of what is seen: PSNR, SSIM, FLIP and pictures.
    pub exposure: f32,
    /// Keeps relative errors finite where the reference is dark.
    pub epsilon: f64,
    /// Pixels a degree of the visual angle, for FLIP.
    pub pixels_per_degree: f64,
    /// Regions across and down.
    pub regions: [usize; 2],
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            exposure: 0.0,
            epsilon: relative::EPSILON,
            pixels_per_degree: flip::PIXELS_PER_DEGREE,
            regions: [4, 3],
        }
    }
}

/// A number for each channel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Channels {
    /// Mean over red, green and blue (of PSNR: of their mean error).
    pub rgb: f64,
    /// Red, green, blue.
    pub each: [f64; 3],
    /// Of Rec. 709 luminance, 0.2126 R + 0.7152 G + 0.0722 B.
    pub luminance: f64,
}

impl Channels {
    /// Applies `f` to all of them.
    pub fn map(self, f: impl Fn(f64) -> f64) -> Channels {
        Channels { rgb: f(self.rgb), each: self.each.map(&f), luminance: f(self.luminance) }
    }
}

/// All figures of a comparison. Those that cannot be known are none; a PSNR without error is infinite.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// What metrics took.
    pub settings: Settings,
    /// Pixels that count: both are finite.
    pub pixels: usize,
    /// Pixels left out.
    pub left_out: pair::LeftOut,
    /// All channels of all pixels are the same numbers.
    pub identical: bool,
    /// Mean of A.
    pub mean_a: Channels,
    /// Mean of B.
    pub mean_b: Channels,
    /// Mean squared error.
    pub mse: Channels,
    /// Its root.
    pub rmse: Channels,
    /// Largest absolute difference.
    pub max_abs: Channels,
    /// Mean of (a − b)² / (b² + ε).
    pub relmse: Channels,
    /// Mean of ((a − b) / (b + ε))².
    pub mrse: Channels,
    /// Peak signal-to-noise ratio in decibels.
    pub psnr: Channels,
    /// Structural similarity, if the pictures are large enough.
    pub ssim: Option<f64>,
    /// Mean of the FLIP map.
    pub flip: f64,
    /// Bias and variance apart, if standard errors are known.
    pub bias: Option<bias::Bias>,
    /// Pixels by their standard errors, if they are known.
    pub z_test: Option<z_test::ZTest>,
    /// By regions, row by row from the top left.
    pub regions: Vec<regions::Region>,
}

/// Figures and the map that FLIP makes on its way.
pub struct Compared {
    /// Figures.
    pub figures: Comparison,
    /// FLIP error of every pixel, 0 to 1.
    pub flip_map: Vec<f32>,
}

/// Compares A with the reference B.
pub fn compare(pair: &Pair, settings: Settings) -> Compared {
    let seen = seen::Seen::new(pair, settings.exposure);
    let flip_map = flip::map(pair.width, pair.height, &seen.a, &seen.b, settings.pixels_per_degree);
    let mse = squared::mean(pair);
    let max_abs = squared::largest(pair);
    let figures = Comparison {
        settings,
        pixels: pair.count(),
        left_out: pair.left_out,
        identical: max_abs.each == [0.0; 3],
        mean_a: pair.mean(|a, _| a),
        mean_b: pair.mean(|_, b| b),
        mse,
        rmse: mse.map(f64::sqrt),
        max_abs,
        relmse: relative::relmse(pair, settings.epsilon),
        mrse: relative::mrse(pair, settings.epsilon),
        psnr: psnr::of(pair, &seen),
        ssim: ssim::of(pair, &seen),
        flip: pair.mean_of(|at| flip_map[at]),
        bias: bias::Bias::of(pair),
        z_test: z_test::ZTest::of(pair, z_test::ALPHA),
        regions: regions::of(pair, settings.regions, settings.epsilon),
    };
    Compared { figures, flip_map: flip_map.iter().map(|&v| v as f32).collect() }
}
