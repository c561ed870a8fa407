//! `comber trade`.

pub mod args;
mod cells;
mod csv;
mod equal_time;
mod html;
mod json;
pub mod knobs;
mod measuring;
mod reference;
mod text;
mod trees;

use super::args::ReportArgs;
use super::budget::Budget;
use super::exit::{Done, complain};
use super::interrupt::Interrupt;
use super::load::{self, Loaded, print_notes};
use super::reference::is_of_light;
use super::render::{check_memory, use_threads};
use super::report;
use super::resolve::RenderRequest;
use crate::accumulate::{Spread, about::about};
use crate::compare::bias::Estimate;
use crate::compare::z_test::sidak;
use crate::error::{Error, Note, Result};
use crate::film::atomic_file;
use crate::measure::processor;
use crate::options::{AccelOptions, Precision};
use crate::plan::Plan;
use crate::trade::Configuration;
use crate::trade::figures::{Figures, best_reading};
use crate::trade::front::{Place, places};
use crate::trade::journal::Journal;
use crate::trade::measure::{Effort, End, Measured, Subject};
use crate::trade::slope::slope;
use crate::trade::truth::Truth;
use args::{TradeArgs, TradeOptions, Variation};
use equal_time::EqualTime;
use serde_json::Value;
use std::path::PathBuf;
use trees::Trees;

/// Chance that bias is seen in any configuration though none has one.
const ALPHA: f64 = 0.05;
/// Renders of each combination, if neither their number nor a time is given.
const RUNS: u32 = 16;
/// Most renders within a time.
const MOST_RUNS: u32 = 100_000;

/// What was measured.
struct Traded<'a> {
    loaded: &'a Loaded,
    options: &'a TradeOptions,
    configurations: &'a [Configuration],
    /// Seconds that building the tree of each configuration took.
    build: Vec<f64>,
    /// Of each configuration; none if it was not rendered.
    figures: Vec<Option<Figures>>,
    places: Vec<Place>,
    groups: Vec<Group>,
    /// |z| from which on bias² is told from 0.
    limit: f64,
    end: End,
    plan: &'a Plan,
    /// What renders were compared with.
    reference: String,
    /// Its own errors are known.
    known: bool,
    notes: &'a [Note],
    command: String,
}

/// Configurations that differ in the number of samples alone.
struct Group {
    /// Values of the other knobs.
    name: String,
    /// In the order of samples.
    members: Vec<usize>,
    /// Slope of MSE against samples.
    slope: Option<Estimate>,
}

/// Measures what `args` ask for.
pub fn run(args: TradeArgs) -> anyhow::Result<Done> {
    let options = args.trade;
    let folder = options.html.as_ref().or(options.csv.as_ref()).map(|path| path.with_extension("trade"));
    if options.resume && folder.is_none() {
        let what = "--resume goes on from what is kept beside --html or --csv: name the same file";
        return Err(Error::Options(what.into()).into());
    }
    let given = reference::read(&options)?;
    let mut frame = args.frame;
    if let Some(found) = given.as_ref().filter(|_| frame.size.is_none() && args.camera.camera_settings.is_none()) {
        frame.size = Some(vec![found.full.0 as u32, found.full.1 as u32]);
    }
    let mut request = RenderRequest::without_outputs(
        args.scene,
        frame,
        args.sampling,
        args.transport,
        args.camera,
        args.speed,
        args.report,
    )?;
    is_of_light(&request.options)?;
    let configurations = knobs::combinations(&request.options, &options.vary)?;
    print_notes(&request.notes, request.report);
    let files: Vec<PathBuf> = options.html.iter().chain(&options.csv).cloned().collect();
    files.iter().try_for_each(|path| atomic_file::check_writable(path))?;
    if let Some(folder) = &folder {
        std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "make", e))?;
    }
    let inside = folder.as_ref().map(|folder| folder.join("journal"));
    let outputs = files.iter().chain(&inside).chain(&request.scene.storage.kept()).cloned().collect::<Vec<_>>();
    let interrupt = Interrupt::watch(outputs.iter().map(PathBuf::as_path))?;
    use_threads(request.options.threads)?;

    let base = request.options.clone();
    let mut kinds: Vec<AccelOptions> = configurations.iter().map(|c| c.options.accel).collect();
    if given.is_none() {
        kinds.push(base.accel);
    }
    let mut distinct: Vec<AccelOptions> = Vec::new();
    kinds.iter().for_each(|kind| distinct.extend(Some(*kind).filter(|kind| !distinct.contains(kind))));
    request.options.accel = distinct[0];
    if distinct.iter().any(|kind| kind.precision == Precision::F64) {
        request.scene.precision = Precision::F64;
    }
    let loaded = load::load(&request.scene, &request.view, &request.options, request.report)?;
    let trees = Trees::get(&loaded, distinct, &request)?;
    let all = trees.all(&loaded);
    let tree_of: Vec<usize> = configurations.iter().map(|c| trees.number(c.options.accel)).collect();
    let plans = configurations
        .iter()
        .zip(&tree_of)
        .map(|(configuration, &tree)| Plan::new(&loaded.scene, all[tree], &configuration.options));
    let plans = plans.collect::<Result<Vec<Plan>>>()?;
    let limit = request.scene.storage.memory_limit;
    plans.iter().try_for_each(|plan| check_memory(plan, limit))?;
    let plan = &plans[0];
    let pixels = plan.cell.width as usize * plan.cell.height as usize;
    let sums = Spread::BYTES_A_PIXEL * pixels as u64 * (configurations.len() as u64 + 3);
    Budget { limit }.start("adding up the renders of each configuration", sums)?;
    interrupt.rendering();

    let (found, reference_name) = match given {
        Some(found) => (found, options.reference.as_ref().map_or(String::new(), |path| path.display().to_string())),
        None => {
            let accel = all[trees.number(base.accel)];
            let wanted =
                reference::ToMake { loaded: &loaded, accel, base: &base, options: &options, folder: folder.as_deref() };
            match wanted.get(&interrupt, request.report)? {
                Some(made) => made,
                None => return Ok(Done::Interrupted),
            }
        }
    };
    let (truth, mut notes) = Truth::new(&found, plan.cell, (plan.options.width, plan.options.height))?;
    notes.extend(found.notes.clone());

    let about = of_all(&loaded, &base, &options.vary, &configurations, plan, &truth);
    let mut measured = Measured::new(configurations.len(), pixels);
    let journal = match &folder {
        None => None,
        Some(folder) if options.resume => {
            let (journal, earlier, of_journal) = Journal::resume(folder, about, configurations.len(), pixels)?;
            measured = earlier;
            notes.extend(of_journal);
            Some(journal)
        }
        Some(folder) => Some(Journal::start(folder, about)?),
    };
    print_notes(&notes, request.report);
    let effort = Effort {
        runs: options.runs.unwrap_or(if options.budget.is_some() { MOST_RUNS } else { RUNS }),
        budget: options.budget,
    };
    let subject = Subject { scene: &loaded.scene, camera: &loaded.camera, trees: &all, tree_of: &tree_of };
    let measuring = measuring::Measuring::new(&configurations, effort, journal, &interrupt, request.report);
    let end = measuring.run(subject, &truth, &mut measured)?;

    let best = best_reading(measured.runs.iter().flatten());
    let figures: Vec<Option<Figures>> = measured
        .runs
        .iter()
        .zip(&measured.spreads)
        .map(|(runs, spread)| Figures::of(runs, spread, &truth, best))
        .collect();
    if figures.iter().all(Option::is_none) {
        let why = "no render was finished";
        return if end == End::Stopped { interrupted(why) } else { anyhow::bail!("the budget is too small: {why}") };
    }
    let points: Vec<_> = figures.iter().map(|f| f.map(|f| (f.seconds, f.mse))).collect();
    let traded = Traded {
        loaded: &loaded,
        options: &options,
        configurations: &configurations,
        build: tree_of.iter().map(|&tree| all[tree].stats().build_seconds).collect(),
        places: places(&points),
        groups: groups(&options.vary, &configurations, &figures),
        figures,
        limit: sidak(ALPHA, configurations.len()),
        end,
        plan,
        reference: reference_name,
        known: truth.variance.is_some(),
        notes: &notes,
        command: super::html::command(),
    };
    let equal = match (&options.html, end) {
        (Some(_), End::Finished | End::Budget) => {
            EqualTime::render(&traded, subject, &truth, &interrupt, !request.report.quiet)?
        }
        _ => None,
    };
    write(&traded, equal.as_ref(), &truth, request.report)?;
    match interrupt.stop_requested() {
        true => interrupted("the report is of what was done"),
        false => Ok(Done::Finished),
    }
}

fn interrupted(why: &str) -> anyhow::Result<Done> {
    complain(&format!("comber: interrupted: {why}"));
    Ok(Done::Interrupted)
}

fn write(traded: &Traded, equal: Option<&EqualTime>, truth: &Truth, report: ReportArgs) -> anyhow::Result<()> {
    if let Some(path) = &traded.options.csv {
        csv::write(path, traded)?;
    }
    if let Some(path) = &traded.options.html {
        super::html::write(path, &html::page(traded, equal, truth))?;
    }
    if report.json {
        report::print_json(&json::of(traded))?;
    } else if !report.quiet {
        report::print(&text::of(traded))?;
    }
    Ok(())
}

/// All that the measurements depend on: a journal of anything else is not added to.
fn of_all(
    loaded: &Loaded,
    base: &crate::options::RenderOptions,
    vary: &[Variation],
    configurations: &[Configuration],
    plan: &Plan,
    truth: &Truth,
) -> Value {
    let usable: Vec<u8> = truth.usable.iter().map(|&usable| usable.into()).collect();
    let variance = truth.variance.as_deref().unwrap_or_default();
    let tables = [bytemuck::cast_slice(&truth.colours), bytemuck::cast_slice(variance), &usable[..]];
    let values: Vec<&Vec<String>> = configurations.iter().map(|configuration| &configuration.values).collect();
    serde_json::json!({
        "render": about(&loaded.name, &loaded.scene, &loaded.camera, base),
        "knobs": vary.iter().map(|each| each.knob.name).collect::<Vec<_>>(),
        "values": values,
        "reference": format!("{:032x}", crate::cache::digest::digest(&tables)),
        "machine": processor::name(),
        "threads": plan.threads,
        "simd": plan.simd,
        "wave": base.wave,
        "tree": base.accel,
    })
}

/// Configurations by all knobs but the number of samples.
fn groups(vary: &[Variation], configurations: &[Configuration], figures: &[Option<Figures>]) -> Vec<Group> {
    let samples = vary.iter().position(|each| each.knob.name == knobs::SAMPLES);
    let others = |configuration: &Configuration| -> String {
        let values = configuration.values.iter().enumerate().filter(|(knob, _)| Some(*knob) != samples);
        let names: Vec<&str> = values.map(|(_, value)| value.as_str()).collect();
        if names.is_empty() { "as asked".into() } else { names.join(", ") }
    };
    let mut groups: Vec<Group> = Vec::new();
    for (number, configuration) in configurations.iter().enumerate() {
        let name = others(configuration);
        match groups.iter_mut().find(|group| group.name == name) {
            Some(group) => group.members.push(number),
            None => groups.push(Group { name, members: vec![number], slope: None }),
        }
    }
    for group in &mut groups {
        group.members.sort_by_key(|&number| configurations[number].options.samples);
        let points = group.members.iter().filter_map(|&number| figures[number].map(|f| (f.samples, f.mse)));
        group.slope = slope(&points.collect::<Vec<_>>());
    }
    groups
}
