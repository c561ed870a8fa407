//! What a render did, in numbers.

use crate::film::tile::Tile;
use crate::plan::Plan;
use crate::stages::{self, Stage};
use serde::Serialize;
use std::iter::Sum;
use std::ops::AddAssign;
use std::time::Duration;

/// Rays traced, by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RayCounts {
    /// From the camera.
    pub camera: u64,
    /// Continuing a path.
    pub bounce: u64,
    /// Towards a light, or over the hemisphere, to estimate direct light.
    pub shadow: u64,
}

impl RayCounts {
    /// Of all kinds.
    pub fn all(&self) -> u64 {
        self.camera + self.bounce + self.shadow
    }
}

impl AddAssign for RayCounts {
    fn add_assign(&mut self, other: RayCounts) {
        self.camera += other.camera;
        self.bounce += other.bounce;
        self.shadow += other.shadow;
    }
}

impl Sum for RayCounts {
    fn sum<I: Iterator<Item = RayCounts>>(all: I) -> RayCounts {
        all.fold(RayCounts::default(), |mut sum, one| {
            sum += one;
            sum
        })
    }
}

/// What one stage cost, summed over all workers.
#[derive(Clone, Debug, Default, Serialize)]
pub struct StageCost {
    /// The stage's name.
    pub name: &'static str,
    /// Batches run.
    pub calls: u64,
    /// Rows consumed.
    pub rows: u64,
    /// Seconds of worker time.
    pub seconds: f64,
}

/// What a render did.
#[derive(Clone, Debug, Default, Serialize)]
pub struct RenderStats {
    /// Rays by kind.
    pub rays: RayCounts,
    /// Cost by stage, in schedule order.
    pub stages: Vec<StageCost>,
    /// Wall time of the render, without loading, building or writing.
    pub seconds: f64,
    /// Worker threads.
    pub threads: usize,
    /// Rows a wave.
    pub wave: usize,
    /// Instruction set used.
    pub simd: &'static str,
    /// Samples in the film.
    pub samples: u64,
    /// Fewest, mean and most samples of a pixel.
    pub samples_per_pixel: (u32, f64, u32),
    /// Pixels that met the adaptive test.
    pub converged_pixels: u64,
    /// Pixels rendered.
    pub pixels: u64,
    /// Samples that were NaN or infinite and were left out of the film.
    pub non_finite_samples: u64,
    /// The first such sample: pixel x, y, sample index.
    pub first_non_finite: Option<(u32, u32, u32)>,
}

/// Rays and times of all workers.
#[derive(Clone, Copy, Debug, Default)]
pub struct Totals {
    /// In the film.
    pub samples: u64,
    /// By kind.
    pub rays: RayCounts,
    /// As in [`stages::ALL`].
    pub stages: [StageTotals; stages::ALL.len()],
}

/// What one stage cost.
#[derive(Clone, Copy, Debug, Default)]
pub struct StageTotals {
    calls: u64,
    rows: u64,
    seconds: f64,
}

impl Totals {
    /// Adds what other waves cost.
    pub fn add(&mut self, other: &Totals) {
        self.samples += other.samples;
        self.rays += other.rays;
        for (a, b) in self.stages.iter_mut().zip(&other.stages) {
            a.calls += b.calls;
            a.rows += b.rows;
            a.seconds += b.seconds;
        }
    }

    /// As reported, with what the film tells.
    pub fn statistics(&self, tiles: &[Tile], plan: &Plan, seconds: f64) -> RenderStats {
        let counts = || tiles.iter().flat_map(|t| t.count.iter().copied());
        let pixels = u64::from(plan.cell.width) * u64::from(plan.cell.height);
        let held: u64 = counts().map(u64::from).sum();
        let cost = |(stage, total): (&&Stage, &StageTotals)| StageCost {
            name: stage.name,
            calls: total.calls,
            rows: total.rows,
            seconds: total.seconds,
        };
        RenderStats {
            rays: self.rays,
            stages: stages::ALL.iter().zip(&self.stages).filter(|(_, t)| t.calls > 0).map(cost).collect(),
            seconds,
            threads: plan.threads,
            wave: plan.wave,
            simd: plan.simd,
            samples: self.samples,
            samples_per_pixel: (counts().min().unwrap_or(0), held as f64 / pixels as f64, counts().max().unwrap_or(0)),
            converged_pixels: tiles.iter().map(|t| u64::from(t.converged)).sum(),
            pixels,
            non_finite_samples: tiles.iter().map(|t| t.non_finite).sum(),
            first_non_finite: tiles.iter().find_map(|t| t.first_non_finite),
        }
    }
}

impl StageTotals {
    /// One more batch.
    pub fn add(&mut self, rows: usize, time: Duration) {
        self.calls += 1;
        self.rows += rows as u64;
        self.seconds += time.as_secs_f64();
    }
}
