//! What a command did, as tables for people and as JSON for programs.

use super::load::Loaded;
use super::resolve::Outputs;
use crate::drive::{Outcome, RenderStats};
use crate::error::Note;
use crate::measure::memory;
use crate::measure::units;
use crate::options::RenderOptions;
use crate::plan::Plan;
use comfy_table::presets::NOTHING;
use comfy_table::{CellAlignment, Row, Table};
use serde_json::{Value, json};
use std::io::{self, ErrorKind, Write as _};
use std::path::Path;
use std::time::Duration;

/// Everything about a render that is over.
pub struct RenderReport<'a> {
    /// What was rendered.
    pub loaded: &'a Loaded,
    /// How.
    pub plan: &'a Plan,
    /// What came of it.
    pub outcome: &'a Outcome,
    /// Where it is.
    pub outputs: &'a Outputs,
    /// Notes on the options.
    pub notes: &'a [Note],
    /// Seconds from the start of the process to the first samples in the film.
    pub first_pixels: Option<f64>,
    /// Wall time of writing the files.
    pub write_seconds: f64,
}

impl RenderReport<'_> {
    /// The summary.
    pub fn text(&self) -> String {
        let (loaded, stats) = (self.loaded, &self.outcome.stats);
        let rays = stats.rays;
        let all_rays = rays.all();
        let rate = |workers: usize| {
            units::rate(all_rays as f64 / workers.max(1) as f64, Duration::from_secs_f64(stats.seconds), "ray")
        };
        let mut facts = Facts::default();
        facts.add("scene", scene_line(loaded));
        facts.add("picture", picture_line(&self.plan.options));
        facts.add("samples", samples_line(stats, &self.plan.options));
        facts.add(
            "rays",
            format!(
                "{}: {} camera, {} bounce, {} shadow",
                units::count(all_rays),
                units::count(rays.camera),
                units::count(rays.bounce),
                units::count(rays.shadow)
            ),
        );
        facts.add("speed", format!("{} in all, {} a thread, {} threads", rate(1), rate(stats.threads), stats.threads));
        facts.add("waves", format!("{} paths, {}", units::count(stats.wave as u64), stats.simd));
        facts.add("tree", tree_line(loaded));
        facts.add("times", self.times_line());
        if let Some(first) = self.first_pixels {
            facts.add("first pixels", format!("{} after the start", seconds(first)));
        }
        if let (Some(peak), Some(resident)) = (memory::peak_resident(), loaded.resident) {
            facts.add("memory", format!("{} at most, {} once loaded", units::bytes(peak), units::bytes(resident)));
        }
        if let Some((x, y, sample)) = stats.first_non_finite {
            let count = units::count(stats.non_finite_samples);
            facts.add(
                "left out",
                format!("{count} samples that are not finite; the first: --explain --pixel {x},{y} --sample {sample}"),
            );
        }
        for path in self.outputs.paths() {
            facts.add("file", path.display().to_string());
        }
        format!("{}\n\n{}\n", stage_table(stats), facts.text())
    }

    fn times_line(&self) -> String {
        let (load, tree) = (self.loaded.seconds, self.loaded.tree.seconds);
        let always = [(load.read, "reading"), (load.prepare, "preparing")];
        // What a scene that is not kept in the cache does not do takes no time at all.
        let sometimes =
            [(tree.hash, "hashing"), (tree.load, "loading the tree"), (tree.build, "building"), (tree.save, "saving")];
        let end = [(self.outcome.stats.seconds, "rendering"), (self.write_seconds, "writing")];
        let phases = always.into_iter().chain(sometimes.into_iter().filter(|(time, _)| *time > 0.0)).chain(end);
        phases.map(|(time, phase)| format!("{} {phase}", seconds(time))).collect::<Vec<_>>().join(", ")
    }

    /// Everything, as numbers.
    pub fn json(&self) -> Value {
        let load = self.loaded.seconds;
        json!({
            "comber": env!("CARGO_PKG_VERSION"),
            "command": "render",
            "scene": scene_json(self.loaded),
            "camera": self.loaded.camera,
            "plan": self.plan,
            "stats": self.outcome.stats,
            "stopped": self.outcome.stopped,
            "seconds": {
                "read": load.read,
                "prepare": load.prepare,
                "hash": self.loaded.tree.seconds.hash,
                "load_tree": self.loaded.tree.seconds.load,
                "build": self.loaded.tree.seconds.build,
                "save": self.loaded.tree.seconds.save,
                "first_pixels": self.first_pixels,
                "render": self.outcome.stats.seconds,
                "write": self.write_seconds,
            },
            "tree": self.loaded.tree,
            "memory": memory_json(self.loaded),
            "peak_memory": memory::peak_resident(),
            "pictures": self.outputs.pictures.iter().map(|path| path_json(path)).collect::<Vec<_>>(),
            "rate": self.outputs.rate.as_deref().map(path_json),
            "notes": notes_json(self.notes, self.loaded),
        })
    }
}

/// Names and values, one to a line.
#[derive(Default)]
pub struct Facts(Vec<[String; 2]>);

impl Facts {
    /// One more.
    pub fn add(&mut self, name: &str, value: impl Into<String>) {
        self.0.push([name.to_owned(), value.into()]);
    }

    /// The lines.
    pub fn text(self) -> String {
        let mut table = Table::new();
        table.load_style(NOTHING).add_rows(self.0);
        table.trim_fmt()
    }
}

/// A table with headings, its columns from `numbers` on aligned to the right.
pub fn table<R: Into<Row>>(headings: impl Into<Row>, numbers: usize, rows: impl Iterator<Item = R>) -> String {
    let mut table = Table::new();
    table.load_style(NOTHING).set_header(headings).add_rows(rows);
    for column in table.column_iter_mut().skip(numbers) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table.trim_fmt()
}

/// Cost by stage.
fn stage_table(stats: &RenderStats) -> String {
    let all: f64 = stats.stages.iter().map(|stage| stage.seconds).sum();
    let share = |part: f64| if all > 0.0 { format!("{:.1} %", 100.0 * part / all) } else { "–".into() };
    let per_row =
        |seconds: f64, rows: u64| if rows > 0 { format!("{:.1}", seconds * 1e9 / rows as f64) } else { "–".into() };
    let rows = stats.stages.iter().map(|stage| {
        [
            stage.name.to_owned(),
            units::count(stage.calls),
            units::count(stage.rows),
            format!("{:.3}", stage.seconds),
            share(stage.seconds),
            per_row(stage.seconds, stage.rows),
        ]
    });
    table(["stage", "calls", "rows", "thread s", "share", "ns/row"], 1, rows)
}

/// Name and size of a scene.
pub fn scene_line(loaded: &Loaded) -> String {
    let shapes = &loaded.scene.shapes;
    let mut line = format!("{}: {} triangles", loaded.name, units::count(shapes.triangles.len() as u64));
    if !shapes.spheres.is_empty() {
        let plural = if shapes.spheres.len() == 1 { "" } else { "s" };
        line += &format!(", {} sphere{plural}", units::count(shapes.spheres.len() as u64));
    }
    if loaded.stage != "none" {
        line += &format!(", on the {} stage", loaded.stage);
    }
    line
}

/// Where a tree came from.
fn tree_line(loaded: &Loaded) -> String {
    let (stats, tree) = (loaded.accel.stats(), &loaded.tree);
    let size = format!("{}, {:.1} B a primitive", units::bytes(stats.bytes as u64), stats.bytes_per_primitive);
    match (&tree.file, tree.source) {
        (Some(file), "cache") => format!("{size}, from the cache: {}", file.display()),
        (Some(file), _) => format!("{size}, built, and kept as {}", file.display()),
        (None, _) => format!("{size}, built"),
    }
}

/// What memory was predicted and taken.
pub fn memory_json(loaded: &Loaded) -> Value {
    json!({ "read": loaded.read_memory, "build": loaded.tree.memory, "resident": loaded.resident })
}

/// Size of a picture.
pub fn picture_line(options: &RenderOptions) -> String {
    let frame = format!("{} × {} pixels", options.width, options.height);
    match options.cell {
        Some(cell) => format!("{} × {} pixels at {}, {} of {frame}", cell.width, cell.height, cell.x, cell.y),
        None => frame,
    }
}

/// Samples a pixel.
fn samples_line(stats: &RenderStats, options: &RenderOptions) -> String {
    let (fewest, mean, most) = stats.samples_per_pixel;
    if fewest == most && options.adaptive.is_none() {
        return format!("{most} a pixel");
    }
    let mut line = format!("{mean:.1} a pixel, from {fewest} to {most} of {}", options.samples);
    if options.adaptive.is_some() {
        line +=
            &format!("; {} of {} pixels converged", units::count(stats.converged_pixels), units::count(stats.pixels));
    }
    line
}

/// What a scene is made of, as numbers.
pub fn scene_json(loaded: &Loaded) -> Value {
    let (scene, (min, max)) = (&loaded.scene, loaded.scene.bounds());
    json!({
        "name": loaded.name,
        "stage": loaded.stage,
        "triangles": scene.shapes.triangles.len(),
        "spheres": scene.shapes.spheres.len(),
        "vertices": scene.shapes.positions.len(),
        "geometries": scene.shapes.geometries.len(),
        "bytes": scene.bytes(),
        "origin": scene.origin,
        "bounds": [min, max],
    })
}

/// Notes on options and scene.
pub fn notes_json(notes: &[Note], loaded: &Loaded) -> Value {
    notes.iter().chain(&loaded.scene.notes).map(note_json).collect()
}

/// One note.
pub fn note_json(note: &Note) -> Value {
    json!({ "warning": note.warning, "text": note.text })
}

/// A path as text, as JSON has no other names; what is not UTF-8 is replaced.
pub fn path_json(path: &Path) -> Value {
    path.to_string_lossy().into()
}

/// A length of time.
pub fn seconds(seconds: f64) -> String {
    units::duration(Duration::from_secs_f64(seconds))
}

/// Prints JSON on standard output.
pub fn print_json(value: &Value) -> io::Result<()> {
    print(&format!("{value:#}\n"))
}

/// Prints on standard output. A reader that has seen enough and left is no failure.
pub fn print(text: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        result => result,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_aligned() {
        let rows = [["a", "1"], ["long name", "1,000"]].map(|row| row.map(str::to_owned));
        let text = table(["name", "rows"], 1, rows.into_iter());
        assert_eq!(text, " name        rows\n a              1\n long name  1,000");
    }
}
