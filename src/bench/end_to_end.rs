//! Whole renders: waves against the depth-first reference, on the same samples, threads and tree.

use super::interleave::{Effort, Summary, Turn, interleave};
use super::probe::Probe;
use super::statistics::Quartiles;
use crate::bvh::Accel;
use crate::drive::{self, RayCounts, Unobserved};
use crate::error::{Error, Result};
use crate::film::picture::Picture;
use crate::measure::processor;
use crate::options::RenderOptions;
use crate::plan::Plan;
use crate::reference;
use crate::scene::Scene;
use crate::scene::camera::Camera;
use serde::Serialize;
use std::time::Instant;

/// What two ways of rendering the same picture took.
#[derive(Clone, Debug, Serialize)]
pub struct RenderReport {
    /// Threads that render.
    pub threads: usize,
    /// Frame size.
    pub size: [u32; 2],
    /// Samples a pixel.
    pub samples: u32,
    /// Camera paths of a render.
    pub paths: u64,
    /// Rays of a render, by kind.
    pub rays: RayCounts,
    /// Rays a second by waves, all threads together.
    pub waves: Summary,
    /// Rays a second by the depth-first control.
    pub control: Summary,
    /// The first over the second, turn by turn.
    pub ratio: Summary,
    /// The control's processor time over that of waves, turn by turn.
    pub cpu_ratio: Quartiles,
}

impl RenderReport {
    /// All rays of a render.
    pub fn all_rays(&self) -> u64 {
        self.rays.all()
    }

    /// Rays or paths a second by waves, if a render has `count` of them.
    pub fn per_second(&self, count: u64) -> f64 {
        self.waves.rate.median * count as f64 / self.all_rays() as f64
    }
}

/// A scene and how it is rendered.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its tree.
    pub accel: &'a Accel,
    /// From where it is seen.
    pub camera: &'a Camera,
    /// Size, samples, threads and all else.
    pub options: &'a RenderOptions,
}

impl Subject<'_> {
    /// Renders both ways in turns. `step` is called before each render.
    ///
    /// # Errors
    /// Those of rendering; and pictures or rays that are not the same to the bit, for then there is nothing to compare.
    pub fn measure(&self, effort: Effort, probe: &mut Probe, mut step: impl FnMut()) -> Result<RenderReport> {
        step();
        // Once for nothing: it warms caches and page tables, and proves that there is one picture to race for.
        let (picture, rays) = self.by_waves()?;
        step();
        self.check_depth_first(&picture, rays)?;
        let count = rays.all();
        let mut failure = None;
        let options = self.options;
        let threads = options.threads.map_or_else(processor::count, |threads| threads as usize);
        let turns = interleave(2, threads, effort, probe, |way| {
            step();
            let start = Instant::now();
            let done = if way == 0 { self.by_waves() } else { self.depth_first() };
            let seconds = start.elapsed().as_secs_f64();
            failure = failure.take().or(done.err());
            // Its threads are the pool's: what they waited for only the probe and the processor time can tell.
            Turn { rate: count as f64 / seconds, waited: 0.0 }
        });
        if let Some(failure) = failure {
            return Err(failure);
        }
        Ok(RenderReport {
            threads,
            size: [options.width, options.height],
            samples: options.samples,
            paths: u64::from(options.width) * u64::from(options.height) * u64::from(options.samples),
            rays,
            waves: turns.summary(0),
            control: turns.summary(1),
            ratio: turns.ratio(0, 1),
            cpu_ratio: turns.cpu_ratio(1, 0),
        })
    }

    /// As `comber render` does it, with the pool of threads that it starts.
    pub fn by_waves(&self) -> Result<(Picture, RayCounts)> {
        let plan = Plan::new(self.scene, self.accel, self.options)?;
        let outcome = drive::render(self.scene, self.accel, self.camera, &plan, &Unobserved)?;
        Ok((outcome.picture, outcome.stats.rays))
    }

    /// Renders depth first, and compares with what waves rendered. Where these do what the control never does ([`RenderOptions::shares`]),
    /// with what they render without that.
    ///
    /// # Errors
    /// Those of rendering; and pictures or rays that are not the same to the bit.
    pub fn check_depth_first(&self, picture: &Picture, rays: RayCounts) -> Result<()> {
        if self.options.shares() {
            let options = self.options.alone();
            let alone = Subject { options: &options, ..*self };
            let (picture, rays) = alone.by_waves()?;
            return alone.check_depth_first(&picture, rays);
        }
        let (expected, expected_rays) = self.depth_first()?;
        if !picture.same_bits(&expected) || rays != expected_rays {
            return Err(Error::Scene("waves and the depth-first reference render different pictures".into()));
        }
        Ok(())
    }

    /// One path at a time, tiles in parallel, in a pool that is started here because waves start theirs too.
    pub fn depth_first(&self) -> Result<(Picture, RayCounts)> {
        let threads = self.options.threads.map_or(0, |threads| threads as usize);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|e| Error::Options(format!("cannot start {threads} threads: {e}")))?;
        let reference = pool.install(|| reference::render(self.scene, self.accel, self.camera, self.options))?;
        Ok((reference.picture, reference.rays))
    }
}
