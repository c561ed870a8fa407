//! Renders in turns.

use super::truth::Truth;
use super::{Configuration, Run};
use crate::accumulate::{Spread, TRADE_SEEDS, seed};
use crate::bench::probe::Probe;
use crate::bvh::Accel;
use crate::drive;
use crate::error::{Error, Result};
use crate::observer::Observer;
use crate::options::RenderOptions;
use crate::plan::Plan;
use crate::scene::Scene;
use crate::scene::camera::Camera;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Most configurations, and most runs of each: their seeds are then different.
pub const MOST: (u32, u32) = (1 << 11, 1 << 20);

/// How much to measure.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Renders of each configuration.
    pub runs: u32,
    /// Time for all of them.
    pub budget: Option<Duration>,
}

/// Why measuring ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// All renders are done.
    Finished,
    /// Time is up: the next render would have taken longer than was left, or did.
    Budget,
    /// The watcher asked to stop.
    Stopped,
}

/// What has been measured of each configuration.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Its renders.
    pub runs: Vec<Vec<Run>>,
    /// Their pictures, added up with weight 1.
    pub spreads: Vec<Spread>,
}

impl Measured {
    /// Nothing yet.
    pub fn new(configurations: usize, pixels: usize) -> Measured {
        Measured { runs: vec![Vec::new(); configurations], spreads: vec![Spread::new(pixels); configurations] }
    }
}

/// Who is told of renders.
pub trait Watcher: Sync {
    /// Part of a render is done: samples of at most `total`.
    fn part(&self, configuration: usize, done: u64, total: u64);

    /// A render is done; `spread` has it.
    ///
    /// # Errors
    /// Measuring ends with them.
    fn finished(&self, run: &Run, spread: &Spread) -> Result<()>;

    /// Whether to stop.
    fn stop(&self) -> bool;
}

/// The run that [`measure`] never makes, for one more render: its seed is no other's.
pub const EXTRA_RUN: u32 = MOST.1 - 1;

/// What is rendered: the tree of each configuration is `trees[tree_of[configuration]]`.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// From where it is seen.
    pub camera: &'a Camera,
    /// Its trees.
    pub trees: &'a [&'a Accel],
    /// Which tree a configuration takes.
    pub tree_of: &'a [usize],
}

/// Renders all configurations in turns, so that whatever else the machine does meets all of them alike, and goes on from what is
/// measured already. Every configuration gets the same number of renders, but for the last turn of a budget.
///
/// # Errors
/// Those of planning and rendering, and of the watcher.
pub fn measure(
    subject: Subject,
    configurations: &[Configuration],
    truth: &Truth,
    effort: Effort,
    measured: &mut Measured,
    watcher: &dyn Watcher,
) -> Result<End> {
    if configurations.len() > MOST.0 as usize || effort.runs >= MOST.1 {
        return Err(Error::Options(format!("at most {} configurations of {} runs can be told apart", MOST.0, MOST.1)));
    }
    let start = Instant::now();
    let deadline = effort.budget.and_then(|budget| start.checked_add(budget));
    let mut probe = Probe::new();
    for run in 0..effort.runs {
        for (number, configuration) in configurations.iter().enumerate() {
            if measured.runs[number].len() > run as usize {
                continue;
            }
            let expected = measured.runs[number]
                .last()
                .map_or(Duration::ZERO, |run| Duration::try_from_secs_f64(run.seconds).unwrap_or(Duration::ZERO));
            if deadline.is_some_and(|deadline| Instant::now() + expected > deadline) {
                return Ok(End::Budget);
            }
            let watch = Watch { watcher, number, deadline, stopped: AtomicBool::new(false) };
            let Some((run, picture)) = render(subject, configuration, number, run, truth, &mut probe, &watch)? else {
                let stopped = watch.stopped.load(Ordering::Relaxed);
                return Ok(if stopped { End::Stopped } else { End::Budget });
            };
            measured.spreads[number].add(&picture, 1.0)?;
            measured.runs[number].push(run);
            watcher.finished(&run, &measured.spreads[number])?;
            if watcher.stop() {
                return Ok(End::Stopped);
            }
        }
    }
    Ok(End::Finished)
}

/// One render, and its picture; none if it was stopped.
///
/// # Errors
/// Those of planning and rendering.
pub fn render(
    subject: Subject,
    configuration: &Configuration,
    number: usize,
    run: u32,
    truth: &Truth,
    probe: &mut Probe,
    watch: &dyn Observer,
) -> Result<Option<(Run, Vec<[f32; 3]>)>> {
    let options = &configuration.options;
    let seed = seed(options.seed, TRADE_SEEDS + number as u32 * MOST.1 + run);
    let options = RenderOptions { seed, aovs: false, ..options.clone() };
    let accel = subject.trees[subject.tree_of[number]];
    let plan = Plan::new(subject.scene, accel, &options)?;
    let before = probe.read(plan.threads);
    let outcome = drive::render(subject.scene, accel, subject.camera, &plan, watch)?;
    if outcome.stopped {
        return Ok(None);
    }
    let [mse, relmse] = truth.errors(&outcome.picture.beauty);
    let stats = &outcome.stats;
    let run = Run {
        configuration: number as u32,
        run,
        seed,
        seconds: stats.seconds,
        rays: stats.rays.all(),
        samples: stats.samples,
        non_finite: stats.non_finite_samples,
        mse,
        relmse,
        probe: before.max(probe.read(plan.threads)),
    };
    Ok(Some((run, outcome.picture.beauty)))
}

/// Ends a render when its time is up.
struct Watch<'a> {
    watcher: &'a dyn Watcher,
    number: usize,
    deadline: Option<Instant>,
    /// By the watcher, and not by the clock.
    stopped: AtomicBool,
}

impl Observer for Watch<'_> {
    fn samples(&self, done: u64, total: u64) {
        self.watcher.part(self.number, done, total);
    }

    fn stop(&self) -> bool {
        if self.watcher.stop() {
            self.stopped.store(true, Ordering::Relaxed);
            return true;
        }
        self.deadline.is_some_and(|deadline| Instant::now() > deadline)
    }
}
