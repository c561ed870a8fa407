//! `comber profile`.

pub mod args;
mod cells;
mod files;
mod html;
mod text;

use super::exit::{Done, complain};
use super::interrupt::Interrupt;
use super::load::{self, Loaded, phase, print_notes};
use super::render::use_threads;
use super::report;
use super::resolve::RenderRequest;
use crate::bench::end_to_end::Subject;
use crate::bench::interleave::{Effort, Summary};
use crate::bench::record::{self, Change, Record};
use crate::error::Result;
use crate::film::atomic_file;
use crate::measure::progress::Progress;
use crate::measure::{processor, units};
use crate::observer::Observer;
use crate::plan::Plan;
use crate::profile::bound::{Homes, Placement, place};
use crate::profile::ceilings::Ceilings;
use crate::profile::counters::Counters;
use crate::profile::measure::{Measured, Wants, measure};
use crate::profile::stage_table::StageTable;
use crate::wave::features::Features;
use args::ProfileArgs;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// What was found out about a render.
struct Profiled<'a> {
    loaded: &'a Loaded,
    plan: &'a Plan,
    measured: &'a Measured,
    table: &'a StageTable,
    /// Stages beside the machine's ceilings, if it has caches of known size.
    placed: Option<Placed>,
    /// Why the processor's counters are not read, if they are not.
    no_counters: Option<String>,
    /// The earlier figures and how these compare with them.
    changes: Option<(&'a Record, Vec<Change>)>,
    /// The command line.
    command: String,
}

/// Stages beside the machine's ceilings.
struct Placed {
    ceilings: Ceilings,
    homes: Homes,
    stages: Vec<Placement>,
}

impl Profiled<'_> {
    /// Waves over the depth-first control, if that was measured.
    fn control_ratio(&self) -> Option<Summary> {
        let turns = &self.measured.turns;
        (turns.samples.len() > 1).then(|| turns.ratio(0, 1))
    }

    fn counters_line(&self) -> String {
        match &self.no_counters {
            Some(why) => format!("n/a: {why}"),
            None => "cycles, instructions, branch misses, cache misses of each stage and thread".into(),
        }
    }
}

/// Profiles the render that `args` ask for.
pub fn run(args: ProfileArgs) -> anyhow::Result<Done> {
    let wants_picture = !args.render.output.output.is_empty() || args.render.output.rate.is_some();
    let options = args.profile;
    let mut request = RenderRequest::new(args.render)?.is_a_render()?;
    if !wants_picture {
        request.outputs.pictures.clear();
        request.outputs.rate = None;
    }
    print_notes(&request.notes, request.report);
    if request.options.shares() && !request.report.quiet {
        complain("note: the depth-first control renders each path by itself: neither --reuse nor --lamp-rays are its");
    }
    let save = options.save.as_deref().map(|name| record::path("profile", name)).transpose()?;
    let against = options.against.as_deref().map(|name| record::path("profile", name)).transpose()?;
    let earlier = against.as_deref().map(Record::read).transpose()?;
    let files = files::Files::new(&options);
    let outputs: Vec<PathBuf> = request.outputs.paths().map(Into::into).chain(files.paths()).collect();
    Interrupt::watch(outputs.iter().map(PathBuf::as_path).chain(request.scene.storage.kept().as_deref()))?;
    request.outputs.paths().try_for_each(atomic_file::check_writable)?;
    // A report that cannot be written is no reason not to render.
    let unwritable =
        files.paths().into_iter().chain(save.clone().filter(|path| path.parent().is_some_and(Path::is_dir)));
    for error in unwritable.filter_map(|path| atomic_file::check_writable(&path).err()) {
        complain(&format!("warning: {error}; rendering all the same"));
    }
    use_threads(request.options.threads)?;

    let loaded = load::load(&request.scene, &request.view, &request.options, request.report)?;
    let plan = Plan::new(&loaded.scene, &loaded.accel, &request.options)?;
    super::render::check_memory(&plan, request.scene.storage.memory_limit)?;
    let no_counters = Counters::open().err();
    let wants = Wants {
        pixels: options.maps.is_some() || options.html.is_some(),
        control: !options.no_control,
        curve: options.curve || options.html.is_some(),
        timeline: options.trace.is_some() || options.folded.is_some(),
        counters: no_counters.is_none(),
    };
    let ceilings = phase("measuring the machine", !request.report.quiet, || {
        Ok(if options.new_ceilings { Ceilings::renewed(plan.threads) } else { Ceilings::cached(plan.threads) })
    })?
    .0;
    let measured = watch(&loaded, &request, wants, options.repeats as usize)?;
    let table = StageTable::new(&plan, &measured);
    let record = figures(&loaded, &plan, &measured);
    let changes = earlier.as_ref().map(|earlier| (earlier, record.against(earlier)));
    let homes = Homes::of(&ceilings, &plan);
    let stages = place(&ceilings, &homes, &loaded.accel, plan.features.has(Features::SMOOTH), &table.stages);
    let placed = (!stages.is_empty()).then_some(Placed { ceilings, homes, stages });
    let profiled = Profiled {
        loaded: &loaded,
        plan: &plan,
        measured: &measured,
        table: &table,
        placed,
        no_counters,
        changes,
        command: super::html::command(),
    };

    // The picture first: whatever becomes of the profile, the render is done.
    super::render::write(&measured.outcome, &request.outputs)?;
    if request.report.json {
        report::print_json(&as_json(&profiled))?;
    } else if !request.report.quiet {
        report::print(&text::of(&profiled))?;
    }
    let written = files.write(&profiled)?;
    if let Some(path) = &save {
        record.write(path)?;
    }
    if !request.report.quiet && !request.report.json {
        let all =
            outputs_written(&request.outputs.paths().map(Into::into).collect::<Vec<_>>(), &written, save.as_ref());
        report::print(&all)?;
    }
    Ok(Done::Finished)
}

fn outputs_written(pictures: &[PathBuf], written: &[PathBuf], save: Option<&PathBuf>) -> String {
    let mut facts = report::Facts::default();
    for path in pictures.iter().chain(written).chain(save) {
        facts.add("file", path.display().to_string());
    }
    let text = facts.text();
    if text.is_empty() { text } else { format!("\n{text}\n") }
}

/// Parts of a render that progress tells apart.
const STEPS: u64 = 1000;

/// Measures, with progress on the terminal.
fn watch(loaded: &Loaded, request: &RenderRequest, wants: Wants, repeats: usize) -> Result<Measured> {
    let progress = Progress::new("profiling", STEPS, !request.report.quiet);
    let watch = Watch { progress: &progress, render: AtomicU64::new(0), renders: AtomicU64::new(1) };
    let subject =
        Subject { scene: &loaded.scene, accel: &loaded.accel, camera: &loaded.camera, options: &request.options };
    let effort = Effort { rounds: repeats, time: Duration::MAX, turn: Duration::ZERO };
    let measured = measure(&subject, wants, effort, &watch, |render, renders| {
        watch.render.store(render as u64, Ordering::Relaxed);
        watch.renders.store(renders as u64, Ordering::Relaxed);
        progress.set_of(render as u64 * STEPS, renders as u64 * STEPS);
    });
    progress.finish();
    measured
}

/// Shows progress over all renders.
struct Watch<'a> {
    progress: &'a Progress,
    render: AtomicU64,
    renders: AtomicU64,
}

impl Observer for Watch<'_> {
    fn samples(&self, done: u64, total: u64) {
        let (render, renders) = (self.render.load(Ordering::Relaxed), self.renders.load(Ordering::Relaxed));
        let part = (STEPS * done).checked_div(total).unwrap_or(0);
        self.progress.set_of(render * STEPS + part, renders * STEPS);
    }
}

/// Rates by stage and bounce, to be kept and compared.
fn figures(loaded: &Loaded, plan: &Plan, measured: &Measured) -> Record {
    let mut record = Record::new();
    let mut add = |what: &str, who: &str, summary| record.add(&loaded.name, what, plan.threads, who, &summary);
    add("render", "waves", measured.turns.summary(0));
    if measured.turns.samples.len() > 1 {
        add("render", "depth-first", measured.turns.summary(1));
    }
    for (name, rows) in measured.rates() {
        add(&name, "waves", rows);
    }
    record
}

fn as_json(profiled: &Profiled) -> Value {
    let Profiled { loaded, plan, measured, table, changes, placed, .. } = profiled;
    json!({
        "comber": env!("CARGO_PKG_VERSION"),
        "command": "profile",
        "machine": { "processor": processor::name(), "processors": processor::count() },
        "scene": report::scene_json(loaded),
        "plan": plan,
        "stats": measured.outcome.stats,
        "profile": table,
        "waves": measured.turns.summary(0),
        "control": control(measured),
        "curve": measured.curve,
        "ceilings": placed.as_ref().map(|placed| &placed.ceilings),
        "homes": placed.as_ref().map(|placed| placed.homes),
        "bounds": placed.as_ref().map(|placed| &placed.stages),
        "no_counters": profiled.no_counters,
        "command_line": profiled.command,
        "against": changes.as_ref().map(|(_, changes)| changes),
    })
}

/// The depth-first control beside waves.
fn control(measured: &Measured) -> Option<Value> {
    (measured.turns.samples.len() > 1).then(|| {
        json!({
            "rate": measured.turns.summary(1),
            "ratio": measured.turns.ratio(0, 1),
            "cpu_ratio": measured.turns.cpu_ratio(1, 0),
        })
    })
}

/// A rate of rays, for people.
fn rate(rays: f64) -> String {
    units::rate(rays, Duration::from_secs(1), "ray")
}
