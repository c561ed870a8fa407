//! Runs a plan: workers, waves, tiles, progress, cancellation. The only file that knows all stages.

use crate::bvh::Accel;
use crate::error::Result;
use crate::film::picture::Picture;
use crate::plan::Plan;
use crate::scene::Scene;
use crate::scene::camera::Camera;
use serde::Serialize;

/// Who watches a render, and may stop it. Called from worker threads, between waves.
pub trait Observer: Sync {
    /// `done` of at most `total` samples are in the film (adaptive renders may end with fewer).
    fn samples(&self, done: u64, total: u64);
    /// `true`: finish the waves under way and return what there is.
    fn stop(&self) -> bool;
}

/// Watches nothing, never stops.
pub struct Unobserved;

impl Observer for Unobserved {
    fn samples(&self, _done: u64, _total: u64) {}
    fn stop(&self) -> bool {
        false
    }
}

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

/// A finished, or stopped, render.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The layers that the plan asked for; provenance is filled in by the caller.
    pub picture: Picture,
    /// BVH nodes visited by each pixel's camera rays (mean), for [`crate::options::Integrator::BvhCost`].
    pub cost: Option<Vec<f32>>,
    /// What it took.
    pub stats: RenderStats,
    /// The observer asked to stop before all samples were done.
    pub stopped: bool,
}

/// Renders `scene` as `plan` says.
pub fn render(scene: &Scene, accel: &Accel, camera: &Camera, plan: &Plan, observer: &dyn Observer) -> Result<Outcome> {
    let _ = (scene, accel, camera, plan, observer);
    todo!()
}
