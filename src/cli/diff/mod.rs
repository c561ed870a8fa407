//! `comber diff`.

pub mod args;
mod files;
mod html;
mod maps;
mod tables;

use super::budget::Budget;
use super::exit::Done;
use super::interrupt::Interrupt;
use super::load::print_notes;
use super::report;
use crate::compare::metric::Better;
use crate::compare::pair::Pair;
use crate::compare::{Compared, Settings, compare};
use crate::error::{Error, Note, Result};
use crate::film::atomic_file;
use crate::film::read::{self, Found};
use crate::options::Cell;
use args::{DiffArgs, Limit};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Bytes a pixel that a comparison takes at its peak, which is in FLIP, beside the two pictures.
const BYTES_A_PIXEL: u64 = 300;

/// A comparison that was made.
struct Diffed<'a> {
    args: &'a DiffArgs,
    /// A and B.
    found: [&'a Found; 2],
    pair: &'a Pair,
    compared: &'a Compared,
    notes: &'a [Note],
}

/// Compares the pictures that `args` name.
pub fn run(args: DiffArgs) -> anyhow::Result<Done> {
    let files = files::Files::new(&args);
    let paths: Vec<PathBuf> = files.paths();
    Interrupt::watch(paths.iter().map(PathBuf::as_path))?;
    paths.iter().try_for_each(|path| atomic_file::check_writable(path))?;

    let layer = args.layer.as_deref();
    let a = found(&args.a, args.stderr_a.as_deref(), layer)?;
    let b = found(&args.b, args.stderr_b.as_deref(), layer)?;
    let crop = args.crop.as_deref().map(|at| Cell { x: at[0], y: at[1], width: at[2], height: at[3] });
    if crop.is_some_and(|cell| cell.width == 0 || cell.height == 0) {
        return Err(Error::Options("--crop is empty: DX and DY must be at least 1".into()).into());
    }
    let pixels = (a.colours.len() + b.colours.len()) as u64 / 2;
    Budget { limit: None }.start("comparing the pictures", BYTES_A_PIXEL * pixels)?;
    let (pair, of_pair) = Pair::new(&a, &b, crop)?;
    let compared = compare(&pair, settings(&args));
    let mut notes: Vec<Note> = a.notes.iter().chain(&b.notes).cloned().chain(of_pair).collect();
    if a.grey != b.grey {
        notes.push(Note::info("one picture is grey: it counts as red, green and blue"));
    }
    if compared.figures.z_test.is_none() {
        let why =
            if pair.has_variance() { "no pixel has a standard error" } else { "neither picture has standard errors" };
        notes.push(Note::info(format!("{why}: bias and variance are not told apart")));
    }
    print_notes(&notes, args.report);

    let diffed = Diffed { args: &args, found: [&a, &b], pair: &pair, compared: &compared, notes: &notes };
    if args.report.json {
        report::print_json(&as_json(&diffed))?;
    } else if !args.report.quiet {
        report::print(&tables::text(&diffed))?;
    }
    let written = files.write(&diffed)?;
    if !args.report.quiet && !args.report.json {
        for path in written {
            report::print(&format!("file  {}\n", path.display()))?;
        }
    }
    let beyond: Vec<String> = judged(&diffed).filter_map(|judged| judged.complaint()).collect();
    if !beyond.is_empty() {
        anyhow::bail!(beyond.join("; "));
    }
    Ok(Done::Finished)
}

fn settings(args: &DiffArgs) -> Settings {
    let regions = args.regions.as_deref().map(|grid| [grid[0] as usize, grid[1] as usize]);
    Settings {
        exposure: args.exposure,
        epsilon: args.epsilon,
        pixels_per_degree: args.ppd,
        regions: regions.unwrap_or(Settings::default().regions),
    }
}

/// A picture with the standard errors that a file of their own holds, if there is one.
pub(super) fn found(path: &Path, errors: Option<&Path>, layer: Option<&str>) -> Result<Found> {
    let mut picture = read::read(path, layer)?;
    let Some(errors_path) = errors else { return Ok(picture) };
    let errors = read::read(errors_path, None)?;
    let place = |p: &Found| (p.width, p.height, p.x, p.y, p.full);
    if place(&errors) != place(&picture) {
        let [errors_name, name] = [errors_path, path].map(|path| path.display().to_string());
        return Err(Error::Pictures(format!("{errors_name} does not hold the same pixels as {name}")));
    }
    // An error below zero is none: its square must not hide that.
    let squared = |e: f32| if e >= 0.0 { e * e } else { f32::NAN };
    picture.variance = Some(errors.colours.iter().map(|pixel| pixel.map(squared)).collect());
    picture.notes.extend(errors.notes);
    Ok(picture)
}

/// A limit and what it limits.
struct Judged {
    limit: Limit,
    value: Option<f64>,
}

impl Judged {
    fn holds(&self) -> bool {
        // What is not a number is beyond any limit.
        self.value.is_some_and(|value| match self.limit.metric.better {
            Better::Smaller => value <= self.limit.value,
            Better::Larger => value >= self.limit.value,
        })
    }

    fn complaint(&self) -> Option<String> {
        let Limit { metric, value: limit } = self.limit;
        let side = match metric.better {
            Better::Smaller => "more than",
            Better::Larger => "less than",
        };
        (!self.holds()).then(|| match self.value {
            Some(value) => format!("{} is {value}, {side} {limit}", metric.name),
            None => format!("{} ({}) cannot be known of these pictures", metric.name, metric.help),
        })
    }
}

fn judged<'a>(diffed: &'a Diffed) -> impl Iterator<Item = Judged> + 'a {
    let figures = &diffed.compared.figures;
    let limits = diffed.args.max.iter().chain(&diffed.args.min);
    limits.map(|&limit| Judged { limit, value: (limit.metric.value)(figures) })
}

fn as_json(diffed: &Diffed) -> Value {
    let picture = |path: &Path, found: &Found| {
        json!({
            "path": report::path_json(path),
            "what": found.what,
            "size": [found.width, found.height],
            "at": [found.x, found.y],
            "frame": found.full,
            "standard_errors": found.variance.is_some(),
        })
    };
    let limits = judged(diffed).map(|judged| {
        json!({
            "metric": judged.limit.metric.name,
            "limit": judged.limit.value,
            "value": judged.value,
            "holds": judged.holds(),
        })
    });
    let pair = diffed.pair;
    json!({
        "comber": env!("CARGO_PKG_VERSION"),
        "command": "diff",
        "a": picture(&diffed.args.a, diffed.found[0]),
        "b": picture(&diffed.args.b, diffed.found[1]),
        "compared": { "size": [pair.width, pair.height], "at": [pair.x, pair.y] },
        "figures": diffed.compared.figures,
        "limits": limits.collect::<Vec<_>>(),
        "notes": diffed.notes.iter().map(report::note_json).collect::<Value>(),
    })
}
