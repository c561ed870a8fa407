//! `comber mesh`.

use super::args::{MeshArgs, ReportArgs};
use super::budget::{self, Budget};
use super::exit::Done;
use super::interrupt::Interrupt;
use super::load::{describe, print_notes};
use super::render::use_threads;
use super::report::{self, Facts};
use super::resolve::scene_source;
use crate::error::{Error, Note, Result};
use crate::export::ply::{self, Encoding};
use crate::export::split::{Mesh, Split};
use crate::film::atomic_file;
use crate::measure::progress::Progress;
use crate::measure::units;
use crate::options::Precision;
use crate::scene::description::SceneDescription;
use glam::DVec3;
use serde_json::json;
use std::path::Path;
use std::time::Instant;

/// Reads a mesh, splits it as `args` ask for, and writes it.
pub fn run(args: MeshArgs) -> anyhow::Result<Done> {
    let encoding = match (args.ascii, args.little_endian) {
        (true, _) => Encoding::Ascii,
        (false, true) => Encoding::Little,
        (false, false) => Encoding::Big,
    };
    let output = &args.output;
    if !output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("ply")) {
        return Err(Error::Options(format!("{}: meshes are written as .ply", output.display())).into());
    }
    atomic_file::check_writable(output)?;
    Interrupt::watch([output.as_path()])?;
    use_threads(args.threads)?;
    let start = Instant::now();
    let source = scene_source(args.scene);
    Budget { limit: None }.start("reading the mesh", budget::reading(&source)?)?;
    let progress = Progress::busy("reading", !args.report.quiet);
    let (description, _) = describe(&source, Precision::F32)?;
    let mut notes = description.notes.clone();
    notes.extend(left_out(&description));
    let origin = description.origin;
    if origin != DVec3::ZERO {
        let text = format!("{}: positions are written as read, relative to {origin}", description.name);
        notes.push(Note::warning(text));
    }
    let name = description.name.clone();
    let split = split(description, args.split, args.noise)?;
    progress.finish();
    print_notes(&notes, args.report);
    write(output, &split, encoding, args.report)?;
    let seconds = start.elapsed().as_secs_f64();
    let bytes = std::fs::metadata(output).map_err(|e| Error::io(output, "read", e))?.len();
    if args.report.json {
        report::print_json(&json!({
            "comber": env!("CARGO_PKG_VERSION"),
            "command": "mesh",
            "input": name,
            "output": report::path_json(output),
            "origin": origin,
            "vertices": split.vertex_count(),
            "triangles": split.triangle_count(),
            "bytes": bytes,
            "seconds": seconds,
            "notes": notes.iter().map(report::note_json).collect::<Vec<_>>(),
        }))?;
    } else if !args.report.quiet {
        let mut facts = Facts::default();
        let (vertices, triangles) = (units::count(split.vertex_count()), units::count(split.triangle_count()));
        facts.add("mesh", format!("{name}: {triangles} triangles, {vertices} vertices"));
        facts.add("file", format!("{}, {}", output.display(), units::bytes(bytes)));
        facts.add("time", report::seconds(seconds));
        report::print(&format!("{}\n", facts.text()))?;
    }
    Ok(Done::Finished)
}

fn split(description: SceneDescription, n: u32, noise: f32) -> Result<Split> {
    let name = description.name.clone();
    let mesh = Mesh::of(description).filter(|mesh| !mesh.triangles.is_empty());
    let mesh =
        mesh.ok_or_else(|| Error::Scene(format!("{name}: it has no triangles, or more vertices than 2³¹ − 1")))?;
    Split::new(mesh, n, noise).map_err(|count| {
        let (count, most) = (units::count(count), units::count(i32::MAX as u64));
        Error::Options(format!("--split {n} of {name} gives {count} triangles or vertices; at most {most} are allowed"))
    })
}

/// What a PLY file has no place for.
fn left_out(description: &SceneDescription) -> Option<Note> {
    let parts = [
        (description.spheres.len(), "spheres"),
        (description.area_lights.len(), "area lights"),
        (usize::from(description.camera.is_some()), "camera"),
        (description.materials.len().saturating_sub(1), "further materials"),
    ];
    let parts: Vec<String> =
        parts.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}")).collect();
    (!parts.is_empty()).then(|| Note::warning(format!("{}: left out: {}", description.name, parts.join(", "))))
}

fn write(path: &Path, split: &Split, encoding: Encoding, report: ReportArgs) -> Result<()> {
    let progress = Progress::new("writing", split.vertex_count() + split.triangle_count(), !report.quiet);
    ply::write(path, split, encoding, |done| progress.set(done))
}
