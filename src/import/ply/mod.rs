//! PLY files, ASCII and binary: one mesh.
//!
//! Read are `x y z` and `nx ny nz` of `vertex`, and the list `vertex_indices` (or `vertex_index`) of `face` and
//! `tristrips`; every other element and property is skipped, in any order and of any type. The format is the one
//! of Greg Turk's “The PLY Polygon File Format” (1994), one record a line in ASCII.

mod ascii;
mod binary;
mod body;
mod faces;
mod header;
mod plan;

use super::Around;
use crate::error::{Error, Note, Result};
use crate::scene::description::{MeshDescription, SceneDescription};
use body::Body;
use faces::Split;
use glam::{DVec3, Vec3};
use header::Format;
use plan::Plan;
use std::path::Path;

/// Reads a PLY file. `path` is for messages and the name.
pub fn parse(path: &Path, bytes: &[u8]) -> Result<SceneDescription> {
    parse_around(path, bytes, Around::default())
}

/// As [`parse`], with positions taken as `around` says.
pub fn parse_around(path: &Path, bytes: &[u8], around: Around) -> Result<SceneDescription> {
    let origin = around.origin;
    let header = header::read(path, bytes)?;
    let plan = Plan::new(path, &header, around)?;
    let body = match header.format {
        Format::Ascii => ascii::read(path, bytes, &header, &plan),
        Format::Little => binary::read::<false>(path, bytes, &header, &plan),
        Format::Big => binary::read::<true>(path, bytes, &header, &plan),
    }?;
    let Body { positions, double, normals, faces, leftover } = body;
    let short = faces.short;
    let split = faces.split(&positions, &double);
    let mut notes = face_notes(path, &plan, short, &split);
    if let Some((at, bytes)) = leftover {
        let text = format!("{}{at}: {bytes} bytes follow the declared data; they are ignored", path.display());
        notes.push(Note::warning(text));
    }
    if split.triangles.is_empty() {
        let what = "no triangle is left, so nothing to render";
        return Err(Error::expected(path, plan.at, what, "a face with three different vertices"));
    }
    if origin != DVec3::ZERO && header.format != Format::Ascii && plan.is_single() {
        let (low, high) =
            positions.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(a, b), p| (a.min(*p), b.max(*p)));
        let lost = super::recentre::lost(origin, f64::from((high - low).max_element()));
        notes.push(Note::warning(format!("{}: {lost}", path.display())));
    }
    let mesh = MeshDescription {
        name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        at: plan.at,
        positions,
        double,
        normals,
        triangles: split.triangles,
        material: 0,
    };
    Ok(SceneDescription {
        name: super::file_name(path),
        origin,
        meshes: vec![mesh],
        materials: vec![super::default_material()],
        notes,
        ..SceneDescription::default()
    })
}

fn face_notes(path: &Path, plan: &Plan, short: u64, split: &Split) -> Vec<Note> {
    let counts = [
        (short, "faces with fewer than three corners are left out"),
        (split.collapsed, "triangles that use a vertex twice are left out"),
        (
            split.uncovered,
            "polygons cross themselves or are too long to split well; their triangles may not cover them",
        ),
    ];
    let note = |(count, what): (u64, &str)| Note::warning(format!("{}{}: {count} {what}", path.display(), plan.at));
    counts.into_iter().filter(|(count, _)| *count > 0).map(note).collect()
}
