//! `comber reference`.

pub mod args;
pub mod make;

use super::args::SamplingArgs;
use super::budget::Budget;
use super::exit::{Done, complain};
use super::interrupt::Interrupt;
use super::load::{self, Loaded, print_notes};
use super::provenance::{creation_time, provenance};
use super::render::{check_memory, use_threads};
use super::report::{self, Facts};
use super::resolve::{RenderRequest, is};
use crate::accumulate::Spread;
use crate::accumulate::rounds::samples_of_all;
use crate::error::{Error, Result};
use crate::film::output::Format;
use crate::film::picture::Picture;
use crate::film::{atomic_file, exr_output};
use crate::measure::units;
use crate::options::{Integrator, RenderOptions};
use crate::plan::Plan;
use args::ReferenceArgs;
use make::{Made, Wanted, percent};
use serde_json::{Value, json};
use std::path::Path;
use std::time::Duration;

/// Renders the reference that `args` ask for.
pub fn run(args: ReferenceArgs) -> anyhow::Result<Done> {
    let target = args.target;
    if !is(&target.output, Format::Exr) {
        let output = target.output.display();
        return Err(
            Error::Options(format!("{output}: a reference must end in .exr, which keeps standard errors")).into()
        );
    }
    let sampling = SamplingArgs { samples: 1, seed: target.seed, ..SamplingArgs::default() };
    let request = RenderRequest::without_outputs(
        args.scene,
        args.frame,
        sampling,
        args.transport,
        args.camera,
        args.speed,
        args.report,
    )?;
    is_of_light(&request.options)?;
    let created = creation_time()?;
    print_notes(&request.notes, request.report);
    let sums = target.output.with_extension("sums");
    atomic_file::check_writable(&target.output)?;
    atomic_file::check_writable(&sums)?;
    let kept = request.scene.storage.kept();
    let files = [target.output.as_path(), &sums];
    let interrupt = Interrupt::watch(files.into_iter().chain(kept.as_deref()))?;
    use_threads(request.options.threads)?;

    let loaded = load::load(&request.scene, &request.view, &request.options, request.report)?;
    let plan = Plan::new(&loaded.scene, &loaded.accel, &request.options)?;
    check_memory(&plan, request.scene.storage.memory_limit)?;
    let pixels = u64::from(plan.cell.width) * u64::from(plan.cell.height);
    // The sums, and once more the file that they are written as.
    Budget { limit: request.scene.storage.memory_limit }
        .start("adding rounds up", 2 * Spread::BYTES_A_PIXEL * pixels)?;
    interrupt.rendering();
    let made = Wanted {
        loaded: &loaded,
        accel: &loaded.accel,
        options: &request.options,
        target: target.rel_error,
        sums: Some(&sums),
        resume: target.resume,
        max_time: target.max_time,
        interrupt: &interrupt,
        show: !request.report.quiet,
    }
    .make()?;
    let far = format!("{} rounds, {} samples a pixel", made.spread.rounds, samples_of_all(made.spread.rounds));
    if made.spread.rounds < 2 {
        let why = format!("ended after {far}: standard errors need two rounds, so no picture is written");
        return ended_early(&interrupt, &why);
    }
    write(&target.output, &loaded, &request.options, &made, &created)?;
    let report = Report { loaded: &loaded, plan: &plan, made: &made, target: target.rel_error, files };
    if request.report.json {
        report::print_json(&report.json())?;
    } else if !request.report.quiet {
        report::print(&report.text())?;
    }
    if made.reached {
        return Ok(Done::Finished);
    }
    let (error, target) = (percent(made.error), percent(target.rel_error));
    ended_early(&interrupt, &format!("ended after {far}: the error is {error} of {target}; --resume goes on"))
}

fn ended_early(interrupt: &Interrupt, why: &str) -> anyhow::Result<Done> {
    match interrupt.stop_requested() {
        true => {
            complain(&format!("comber: interrupted: {why}"));
            Ok(Done::Interrupted)
        }
        false => anyhow::bail!("time is up: {why}"),
    }
}

/// Refuses pictures that have no noise to be averaged.
pub fn is_of_light(options: &RenderOptions) -> Result<()> {
    match options.integrator {
        Integrator::BvhCost => {
            Err(Error::Options("--integrator bvh-cost counts nodes: it has no error to speak of".into()))
        }
        _ => Ok(()),
    }
}

/// Writes the picture, with where it comes from.
pub fn write(path: &Path, loaded: &Loaded, options: &RenderOptions, made: &Made, created: &str) -> Result<()> {
    let (cell, each) = (options.rendered(), samples_of_all(made.spread.rounds));
    let rendered = RenderOptions { samples: each.try_into().unwrap_or(u32::MAX), adaptive: None, ..options.clone() };
    let samples = each * u64::from(cell.width) * u64::from(cell.height);
    let provenance = provenance(loaded, &rendered, samples, !made.reached, created);
    exr_output::write(path, &make::picture(made, options, provenance, make::subject_of(loaded, options)))
}

/// What is said at the end.
struct Report<'a> {
    loaded: &'a Loaded,
    plan: &'a Plan,
    made: &'a Made,
    target: f64,
    files: [&'a Path; 2],
}

impl Report<'_> {
    fn text(&self) -> String {
        let Made { spread, rays, seconds, earlier, non_finite, .. } = self.made;
        let mut facts = Facts::default();
        facts.add("scene", report::scene_line(self.loaded));
        facts.add("picture", report::picture_line(&self.plan.options));
        let mut rounds = format!("{}, {} samples a pixel", spread.rounds, units::count(samples_of_all(spread.rounds)));
        if *earlier > 0 {
            rounds += &format!("; {earlier} of them earlier");
        }
        facts.add("rounds", rounds);
        let (error, target) = (percent(self.made.error), percent(self.target));
        facts.add("error", format!("{error} of {target}: √ of mean (standard error)² / (mean² + 0.01)"));
        let time = Duration::from_secs_f64(*seconds);
        let rate = units::rate(rays.all() as f64, time, "ray");
        facts.add("rays", format!("{} in {}, {rate}", units::count(rays.all()), units::duration(time)));
        if *non_finite > 0 {
            facts.add("left out", format!("{} samples that are not finite", units::count(*non_finite)));
        }
        for path in self.files {
            facts.add("file", path.display().to_string());
        }
        format!("{}\n", facts.text())
    }

    fn json(&self) -> Value {
        let Made { spread, rays, seconds, earlier, non_finite, error, reached } = self.made;
        json!({
            "comber": env!("CARGO_PKG_VERSION"),
            "command": "reference",
            "scene": report::scene_json(self.loaded),
            "camera": self.loaded.camera,
            "plan": self.plan,
            "relative_error": error,
            "target": self.target,
            "reached": reached,
            "rounds": spread.rounds,
            "earlier_rounds": earlier,
            "samples": samples_of_all(spread.rounds),
            "rays": rays,
            "seconds": seconds,
            "non_finite_samples": non_finite,
            "picture": report::path_json(self.files[0]),
            "sums": report::path_json(self.files[1]),
            "notes": report::notes_json(&[], self.loaded),
        })
    }
}

/// A reference that is there already, if it is of `about` and good enough.
pub fn reusable(path: &Path, about: &Value, target: f64) -> Option<Picture> {
    let picture = exr_output::read(path).ok()?;
    let of = &picture.provenance["reference"];
    let good = of["relative_error"].as_f64().is_some_and(|error| error <= target);
    (good && of["of"] == *about && picture.variance.is_some()).then_some(picture)
}
