//! `comber render`.

use super::args::RenderArgs;
use super::budget::Budget;
use super::exit::{Done, complain};
use super::interrupt::Interrupt;
use super::load::{self, Loaded, print_notes};
use super::provenance::{creation_time, provenance};
use super::report::{self, RenderReport};
use super::resolve::{Outputs, RenderRequest, is};
use crate::drive::{self, Observer, Outcome};
use crate::error::{Error, Result};
use crate::film::heatmap::{self, HeatMap};
use crate::film::output::{self, Format};
use crate::film::picture::Picture;
use crate::measure::progress::Progress;
use crate::measure::units;
use crate::plan::Plan;
use anyhow::Context as _;
use std::path::Path;
use std::sync::OnceLock;
use std::time::Instant;

/// Renders what `args` ask for, and leaves it where they say. `started`: when the process was.
pub fn run(args: RenderArgs, started: Instant) -> anyhow::Result<Done> {
    let request = RenderRequest::new(args)?;
    if let Some((pixel, sample)) = request.explain {
        return super::explain::run(&request, pixel, sample);
    }
    let created = creation_time()?;
    print_notes(&request.notes, request.report);
    for path in request.outputs.paths() {
        output::check(path)?;
    }
    let kept = request.scene.storage.kept();
    let interrupt = Interrupt::watch(request.outputs.paths().chain(kept.as_deref()))?;
    use_threads(request.options.threads)?;

    let loaded = load::load(&request.scene, &request.view, &request.options, request.report)?;
    let plan = Plan::new(&loaded.scene, &loaded.accel, &request.options)?;
    check_memory(&plan, request.scene.storage.memory_limit)?;
    interrupt.rendering();
    let (mut outcome, first_pixels) = render(&loaded, &plan, &interrupt, !request.report.quiet)?;
    outcome.picture.provenance =
        provenance(&loaded, &request.options, outcome.stats.samples, outcome.stopped, &created);
    let start = Instant::now();
    write(&outcome, &request.outputs)?;
    let write_seconds = start.elapsed().as_secs_f64();

    if outcome.stopped {
        complain(&interruption(&outcome, &plan));
    }
    let report = RenderReport {
        loaded: &loaded,
        plan: &plan,
        outcome: &outcome,
        outputs: &request.outputs,
        notes: &request.notes,
        first_pixels: first_pixels.map(|time| time.duration_since(started).as_secs_f64()),
        write_seconds,
    };
    if request.report.json {
        report::print_json(&report.json())?;
    } else if !request.report.quiet {
        report::print(&report.text())?;
    }
    Ok(if outcome.stopped { Done::Interrupted } else { Done::Finished })
}

/// Refuses a render that there is no memory for, rather than to be killed in the middle of it.
pub fn check_memory(plan: &Plan, limit: Option<u64>) -> Result<()> {
    let needed = plan.memory.to_come();
    match (Budget { limit }).refusal(needed) {
        Some(why) => Err(Error::Options(format!(
            "the render needs {} for {} of waves and {} of film, and {why}: \
             take fewer pixels (-r, -p), a smaller --wave or fewer --threads",
            units::bytes(needed),
            units::bytes(plan.memory.waves),
            units::bytes(plan.memory.film),
        ))),
        None => Ok(()),
    }
}

/// Makes `threads` the size of the pool in which scenes are read and trees are built.
pub fn use_threads(threads: Option<u32>) -> anyhow::Result<()> {
    let threads = threads.map_or(0, |threads| threads as usize);
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().context("cannot start the worker threads")
}

/// Renders, with progress on the terminal; tells when the first samples were in the film.
pub fn render(loaded: &Loaded, plan: &Plan, interrupt: &Interrupt, show: bool) -> Result<(Outcome, Option<Instant>)> {
    let pixels = plan.options.cell.map_or(u64::from(plan.options.width) * u64::from(plan.options.height), |cell| {
        u64::from(cell.width) * u64::from(cell.height)
    });
    let progress = Progress::new("rendering", pixels * u64::from(plan.options.samples), show);
    let watch = Watch { progress: &progress, interrupt, first: OnceLock::new() };
    let outcome = drive::render(&loaded.scene, &loaded.accel, &loaded.camera, plan, &watch);
    progress.finish();
    Ok((outcome?, watch.first.into_inner()))
}

/// Shows progress, and stops when a signal asks for it.
struct Watch<'a> {
    progress: &'a Progress,
    interrupt: &'a Interrupt,
    /// When the first wave had come to its end.
    first: OnceLock<Instant>,
}

impl Observer for Watch<'_> {
    fn samples(&self, done: u64, total: u64) {
        self.first.get_or_init(Instant::now);
        // The total shrinks while adaptive sampling retires pixels: so does the time left.
        self.progress.set_of(done, total);
    }

    fn stop(&self) -> bool {
        self.interrupt.stop_requested()
    }
}

/// Writes all files.
pub fn write(outcome: &Outcome, outputs: &Outputs) -> Result<()> {
    let picture = &outcome.picture;
    for path in &outputs.pictures {
        match &outcome.cost {
            // Counts of nodes are read off a legend, not from colours.
            Some(cost) if is(path, Format::Png) => {
                write_map(path, picture, cost, "BVH nodes visited by a camera ray", "nodes")?;
            }
            _ => output::write(path, picture, outputs.exposure)?,
        }
    }
    if let (Some(path), Some(counts)) = (&outputs.rate, &picture.sample_count) {
        let counts: Vec<f32> = counts.iter().map(|&count| count as f32).collect();
        write_map(path, picture, &counts, "samples a pixel", "")?;
    }
    Ok(())
}

/// Writes one number a pixel of `picture` as colours.
fn write_map(path: &Path, picture: &Picture, values: &[f32], title: &str, unit: &str) -> Result<()> {
    let (width, height) = (picture.width, picture.height);
    heatmap::write(path, &HeatMap { width, height, values, title, unit, ..HeatMap::default() })
}

/// What an interrupted render has.
fn interruption(outcome: &Outcome, plan: &Plan) -> String {
    let stats = &outcome.stats;
    let (fewest, mean, most) = stats.samples_per_pixel;
    format!(
        "comber: interrupted: the files hold {} samples, {mean:.1} of {} a pixel (from {fewest} to {most})",
        units::count(stats.samples),
        plan.options.samples,
    )
}
