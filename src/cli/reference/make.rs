//! Rounds until a reference is known well enough, with progress, sums on disk and a limit of time.

use crate::accumulate::rounds::{self, Subject};
use crate::accumulate::{Spread, about::about, sums_file};
use crate::bvh::Accel;
use crate::cli::exit::complain;
use crate::cli::interrupt::Interrupt;
use crate::cli::load::Loaded;
use crate::compare::relative::EPSILON;
use crate::drive::RayCounts;
use crate::error::Result;
use crate::film::picture::Picture;
use crate::measure::progress::Progress;
use crate::observer::Observer;
use crate::options::RenderOptions;
use serde_json::{Value, json};
use std::path::Path;
use std::time::{Duration, Instant};

/// Between two writings of the sums.
const INTERVAL: Duration = Duration::from_secs(10);

/// What is wanted.
pub struct Wanted<'a> {
    /// The scene.
    pub loaded: &'a Loaded,
    /// Its tree.
    pub accel: &'a Accel,
    /// How it is rendered, but for the number of samples.
    pub options: &'a RenderOptions,
    /// The relative error to reach.
    pub target: f64,
    /// Where sums are kept, if anywhere.
    pub sums: Option<&'a Path>,
    /// Whether to go on from them.
    pub resume: bool,
    /// The most time to render.
    pub max_time: Option<Duration>,
    /// Ends it early.
    pub interrupt: &'a Interrupt,
    /// Whether progress is shown.
    pub show: bool,
}

/// What came of it.
pub struct Made {
    /// All rounds, earlier ones included.
    pub spread: Spread,
    /// The relative error.
    pub error: f64,
    /// It is as small as it was to be.
    pub reached: bool,
    /// Rounds that were there already.
    pub earlier: u32,
    /// Rays of the rounds rendered now.
    pub rays: RayCounts,
    /// Their time.
    pub seconds: f64,
    /// Their samples that were left out because they were not finite.
    pub non_finite: u64,
}

/// What a reference depends on: samples and the rule when to end are no part of it.
pub fn subject_of(loaded: &Loaded, options: &RenderOptions) -> Value {
    let options = RenderOptions { samples: 0, adaptive: None, ..options.clone() };
    about(&loaded.name, &loaded.scene, &loaded.camera, &options)
}

impl Wanted<'_> {
    /// Renders, and keeps the sums.
    pub fn make(&self) -> Result<Made> {
        let cell = self.options.rendered();
        let pixels = cell.width as usize * cell.height as usize;
        let about = subject_of(self.loaded, self.options);
        let kept = match self.sums.filter(|_| self.resume) {
            Some(path) => sums_file::read(path, &about, pixels)?,
            None => None,
        };
        if self.resume && kept.is_none() && self.show {
            complain("note: there is nothing to go on from; starting anew");
        }
        let mut spread = kept.unwrap_or_else(|| Spread::new(pixels));
        let earlier = spread.rounds;
        let (mut rays, mut seconds, mut non_finite) = (RayCounts::default(), 0.0, 0);
        let subject = Subject {
            scene: &self.loaded.scene,
            accel: self.accel,
            camera: &self.loaded.camera,
            options: self.options,
        };
        let progress = Progress::new("reference", 1, self.show);
        let deadline = self.max_time.and_then(|time| Instant::now().checked_add(time));
        let watch = Watch { interrupt: self.interrupt, deadline };
        let mut written = Instant::now();
        let reached = subject.converge(&mut spread, self.target, &watch, |spread, error, outcome| {
            let stats = &outcome.stats;
            rays += stats.rays;
            seconds += stats.seconds;
            non_finite += stats.non_finite_samples;
            self.show_progress(&progress, spread.rounds, error);
            if let Some(path) = self.sums.filter(|_| written.elapsed() >= INTERVAL) {
                sums_file::write(path, &about, spread)?;
                written = Instant::now();
            }
            Ok(())
        })?;
        progress.finish();
        if let Some(path) = self.sums.filter(|_| spread.rounds > earlier) {
            sums_file::write(path, &about, &spread)?;
        }
        let error = spread.relative_error(EPSILON);
        Ok(Made { spread, error, reached, earlier, rays, seconds, non_finite })
    }

    /// The error falls as the root of the number of samples, whence how many there will be in all.
    fn show_progress(&self, progress: &Progress, rounds: u32, error: f64) {
        let done = rounds::samples_of_all(rounds);
        let least = rounds::samples_of_all(rounds::FEWEST);
        let all = if error.is_finite() { done as f64 * (error / self.target).powi(2) } else { f64::INFINITY };
        if all.is_finite() {
            progress.relabel(format!("reference, error {} of {}", percent(error), percent(self.target)));
            progress.set_of(done, (all as u64).max(done).max(least));
        }
    }
}

/// The picture, with what it is in its provenance.
pub fn picture(made: &Made, options: &RenderOptions, mut provenance: Value, about: Value) -> Picture {
    provenance["reference"] =
        json!({ "relative_error": made.error, "epsilon": EPSILON, "rounds": made.spread.rounds, "of": about });
    let picture = rounds::picture(&made.spread, options.rendered(), (options.width, options.height));
    Picture { provenance, ..picture }
}

/// A share of one, to three digits.
pub fn percent(share: f64) -> String {
    format!("{} %", crate::measure::units::short(100.0 * share))
}

struct Watch<'a> {
    interrupt: &'a Interrupt,
    deadline: Option<Instant>,
}

impl Observer for Watch<'_> {
    fn stop(&self) -> bool {
        self.interrupt.stop_requested() || self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }
}
