//! Pixels whose samples are drawn from known distributions, so that the true mean is known, through the film and the rules of adaptive sampling.
#![allow(dead_code)] // The bench and the test use parts of their own.

use comber::film::convergence::student_t;
use comber::film::develop::develop;
use comber::film::tile::{FilmLayout, Sample, tiles};
use comber::options::{self, Adaptive, Cell, RenderOptions, Trust};
use comber::sampling::sampler::Sampler;
use rayon::prelude::*;

/// Pixels of a tile.
pub const PIXELS: usize = 256;

/// A kind of pixels: by its number in the tile and two numbers in [0, 1), a sample, and the mean of such samples.
pub struct Kind {
    pub name: &'static str,
    pub draw: fn(usize, f64, f64) -> f64,
    pub mean: fn(usize) -> f64,
}

/// In half of the tile a lamp that is seen directly, beside it noise.
fn lamp(pixel: usize) -> bool {
    pixel < PIXELS / 2
}

pub const KINDS: [Kind; 10] = [
    Kind { name: "uniform", draw: |_, u, _| 2.0 * u, mean: |_| 1.0 },
    Kind { name: "edge: 0.2 or 1.8", draw: |_, u, _| if u < 0.5 { 0.2 } else { 1.8 }, mean: |_| 1.0 },
    Kind { name: "exponential", draw: |_, u, _| -(1.0 - u).ln(), mean: |_| 1.0 },
    Kind {
        name: "log-normal, σ = 1.5",
        draw: |_, u, v| {
            let normal = (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos();
            (1.5 * normal - 1.125).exp()
        },
        mean: |_| 1.0,
    },
    Kind { name: "dark: exponential, 0.002", draw: |_, u, _| -0.002 * (1.0 - u).ln(), mean: |_| 0.002 },
    Kind {
        name: "a lamp beside noise",
        draw: |pixel, u, _| if lamp(pixel) { 20.0 } else { -0.5 * (1.0 - u).ln() },
        mean: |pixel| if lamp(pixel) { 20.0 } else { 0.5 },
    },
    Kind { name: "black", draw: |_, _, _| 0.0, mean: |_| 0.0 },
    Kind { name: "lit once in 50", draw: |_, u, _| if u < 0.02 { 50.0 } else { 0.0 }, mean: |_| 1.0 },
    Kind {
        name: "firefly once in 10⁴, over 0.5",
        draw: |_, u, _| 0.5 + if u < 1e-4 { 5000.0 } else { 0.0 },
        mean: |_| 1.0,
    },
    Kind { name: "lit once in 10⁴", draw: |_, u, _| if u < 1e-4 { 1e4 } else { 0.0 }, mean: |_| 1.0 },
];

/// The kind of that name.
pub fn kind(name: &str) -> &'static Kind {
    KINDS.iter().find(|kind| kind.name == name).expect("a kind")
}

/// A rule, and the numbers that it judges by.
#[derive(Clone)]
pub struct Rule {
    pub name: String,
    pub adaptive: Adaptive,
    pub sampler: options::Sampler,
    pub replicates: u32,
}

impl Rule {
    /// Degrees of freedom of the variance that a pixel has in the end.
    pub fn degrees(&self, samples: u32) -> u32 {
        match self.replicates {
            1 => samples.saturating_sub(1),
            replicates if self.adaptive.trust == Trust::Halves => replicates - 2,
            replicates => replicates - 1,
        }
    }

    pub fn options(&self) -> RenderOptions {
        let (adaptive, sampler, replicates) = (Some(self.adaptive), self.sampler, self.replicates);
        RenderOptions { aovs: true, adaptive, sampler, replicates, ..RenderOptions::default() }
    }
}

/// What is known of many pixels after stopping.
#[derive(Default)]
pub struct Known {
    pub pixels: f64,
    /// Whose interval, by the layer of variances, holds the truth.
    covered: f64,
    samples: f64,
    /// Pixels that the rule has stopped, and those of them that are within the tolerance.
    stopped: f64,
    within: f64,
    /// Sum of differences from the truth; those of each tile or picture, closed by [`Known::close`].
    sum: f64,
    sums: Vec<f64>,
    truth: f64,
}

/// A pixel in the end: mean, variance of that mean, samples.
pub struct Ended {
    pub mean: f64,
    pub variance: f64,
    pub samples: u32,
}

impl Known {
    /// Adds a pixel that may have had up to `most` samples.
    pub fn add(&mut self, rule: &Rule, ended: &Ended, truth: f64, most: u32) {
        let &Ended { mean, variance, samples } = ended;
        self.pixels += 1.0;
        self.samples += f64::from(samples);
        self.sum += mean - truth;
        self.truth += truth;
        let off = (mean - truth).abs();
        self.covered += f64::from(u8::from(off <= student_t(rule.degrees(samples)) * variance.sqrt()));
        if samples < most {
            self.stopped += 1.0;
            let may = f64::from(rule.adaptive.tolerance) * truth.hypot(rule.adaptive.floor.into());
            self.within += f64::from(u8::from(off <= may));
        }
    }

    /// Ends a tile or a picture: what stops together is one draw of luck.
    pub fn close(&mut self) {
        let before: f64 = self.sums.iter().sum();
        self.sums.push(self.sum - before);
    }

    /// Mean number of samples.
    pub fn samples(&self) -> f64 {
        self.samples / self.pixels
    }

    /// Bias in parts of the truth, and in its standard errors.
    pub fn bias(&self) -> (f64, f64) {
        let n = self.sums.len() as f64;
        let mean = self.sums.iter().sum::<f64>() / n;
        let spread = self.sums.iter().map(|sum| (sum - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
        (self.sum / self.truth.max(f64::MIN_POSITIVE), mean / (spread / n).sqrt().max(f64::MIN_POSITIVE))
    }

    /// Share of pixels whose interval holds the truth.
    pub fn covered(&self) -> f64 {
        self.covered / self.pixels
    }

    /// Share of the pixels that have stopped.
    pub fn stopped(&self) -> f64 {
        self.stopped / self.pixels
    }

    /// Share of the pixels that have stopped that are within the tolerance.
    pub fn within(&self) -> f64 {
        self.within / self.stopped
    }
}

/// Tiles of a kind, each to its end or to `most` samples.
pub fn known(kind: &Kind, rule: &Rule, tiles: u32, most: u32) -> Known {
    let ended: Vec<Vec<Ended>> = (0..tiles).into_par_iter().map(|seed| tile(kind, rule, seed, most)).collect();
    let mut known = Known::default();
    for pixels in ended {
        pixels.iter().enumerate().for_each(|(pixel, ended)| known.add(rule, ended, (kind.mean)(pixel), most));
        known.close();
    }
    known
}

fn tile(kind: &Kind, rule: &Rule, seed: u32, most: u32) -> Vec<Ended> {
    let options = RenderOptions { width: 16, height: 16, samples: most, seed, ..rule.options() };
    let cell = Cell { x: 0, y: 0, width: 16, height: 16 };
    let sampler = Sampler::new(&options);
    let mut film = tiles(cell, FilmLayout::new(&options));
    let tile = &mut film[0];
    let mut first = 0;
    while first < most && !tile.active.is_empty() {
        let step = rule.adaptive.step(first).min(most - first);
        for local in tile.active.clone() {
            let local = local as usize;
            let pixel = tile.y[local] * 16 + tile.x[local];
            let (from, stride, count) = tile.wanted(local, first, step);
            for index in (0..count).map(|k| from + k * stride) {
                let [u, v, ..] = sampler.draw(pixel, index, 2).map(f64::from);
                let radiance = [(kind.draw)(pixel as usize, u, v) as f32; 3];
                tile.add(local, index, &Sample { radiance, ..Sample::default() });
            }
        }
        tile.retire(&rule.adaptive);
        first += step;
    }
    let picture = develop(&film, cell, (16, 16));
    let (counts, variances) = (picture.sample_count.expect("counts"), picture.variance.expect("variances"));
    let ended = |pixel: usize| Ended {
        mean: f64::from(picture.beauty[pixel][0]),
        variance: f64::from(variances[pixel][0]),
        samples: counts[pixel],
    };
    (0..PIXELS).map(ended).collect()
}
