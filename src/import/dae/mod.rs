//! COLLADA 1.4.1 (`.dae`), with the `<extra>` profiles `CGL` and `CMU462` of the CS184 and 15-462 courses.
//!
//! Read: the node hierarchy with its transforms, triangles, polylists and polygons, perspective cameras, the common
//! profile's colours, and from the course's profiles area lights, spheres and materials. What cannot be represented is
//! either a located error or a note that names it.
//!
//! Axes become +y up by a rotation: `Z_UP` (x, y, z) → (−x, z, y), as the course does, `X_UP` (x, y, z) → (−y, x, z).
//! The file's unit is left as it is. Triangles of zero area are dropped with one counted warning; duplicate ones are
//! kept. A lamp that the file holds twice is counted once: an area light's emissive quad is dropped, and so is a point
//! light that stands in an emissive quad.
//!
//! The reader trusts nothing: sizes stated in the file never allocate, the walk is iterative, and nesting, instancing
//! and polygon splitting have limits with messages of their own.

mod bindings;
mod camera;
mod document;
mod geometry;
mod instance;
mod lamps;
mod lights;
mod lines;
mod materials;
mod numbers;
mod placement;
mod polygon;
mod prescan;
mod primitives;
mod source;
mod transform;
mod walk;

use super::Around;
use crate::error::{At, Error, Note, Result};
use crate::scene::description::SceneDescription;
use document::Document;
use glam::{DMat4, DVec3};
use lines::Lines;
use std::path::Path;

/// Most XML nodes a document may have: what a mesh of a million `<p>` polygons needs, several times over.
const MAX_XML_NODES: u32 = 1 << 23;

/// Reads the COLLADA document `bytes`; `path` is only used in messages.
///
/// The result is in world space, +y up, in the file's unit.
///
/// # Errors
///
/// [`Error::Import`] with line and column when the document is not well-formed XML, refers to what is not there, holds
/// numbers that cannot be used, exceeds one of the reader's limits, or needs a feature that is not supported.
pub fn parse(path: &Path, bytes: &[u8]) -> Result<SceneDescription> {
    parse_around(path, bytes, Around::default())
}

/// As [`parse`], with positions taken as `around` says; its origin is in the result's axes.
///
/// # Errors
///
/// As [`parse`].
pub fn parse_around(path: &Path, bytes: &[u8], around: Around) -> Result<SceneDescription> {
    let origin = around.origin;
    let lines = Lines::new(bytes);
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let at = lines.line_column(error.valid_up_to());
        Error::expected(path, at, "a byte sequence that is not UTF-8", "a COLLADA document in UTF-8")
    })?;
    if text.trim_start_matches('\u{feff}').trim_ascii().is_empty() {
        return Err(Error::expected(path, At::LineColumn(1, 1), "the file is empty", "a COLLADA document"));
    }
    prescan::check(text)
        .map_err(|excess| Error::expected(path, lines.line_column(excess.offset), excess.what, excess.expected))?;
    let options = roxmltree::ParsingOptions { nodes_limit: MAX_XML_NODES, ..Default::default() };
    let tree = roxmltree::Document::parse_with_options(text, options)
        .map_err(|error| xml_error(path, &lines, text, &error))?;

    let document = Document::new(path, lines, &tree);
    let root = document.root();
    if root.tag_name().name() != "COLLADA" {
        let what = format!("the root element is <{}>", document::clip(root.tag_name().name()));
        return Err(document.expected(root, what, "<COLLADA>"));
    }
    let mut notes = Vec::new();
    asset_notes(&document, &mut notes);
    let axes = DMat4::from_translation(DVec3::ZERO - origin) * transform::up_axis(&document)?;
    let (mut scene, lamps) = walk::walk(&document, (axes, around.precision), notes)?;
    lamps::count_once(&mut scene, lamps);
    scene.name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    scene.origin = origin;
    if let Some(camera) = &mut scene.camera {
        camera.origin = origin;
    }
    scene.course_profile = document.has_course_profile();
    Ok(scene)
}

/// An XML error at its own place, or at the end of the file when that is where it shows.
fn xml_error(path: &Path, lines: &Lines<'_>, text: &str, error: &roxmltree::Error) -> Error {
    use roxmltree::Error as Xml;
    let at = match error {
        Xml::UnexpectedEndOfStream | Xml::UnclosedRootNode | Xml::NoRootNode => lines.line_column(text.len()),
        _ => At::LineColumn(u64::from(error.pos().row), u64::from(error.pos().col)),
    };
    let message = match error {
        Xml::NodesLimitReached => format!("more than {MAX_XML_NODES} XML nodes"),
        Xml::DtdDetected => "a document type declaration (entities are not expanded)".to_string(),
        _ => format!("not well-formed XML: {}", document::clip(&error.to_string())),
    };
    Error::expected(path, at, message, "a complete COLLADA document")
}

/// Notes on the version and the unit, neither of which changes how the file is read.
fn asset_notes(document: &Document<'_>, notes: &mut Vec<Note>) {
    let root = document.root();
    let version = root.attribute("version").unwrap_or("(none)");
    if !version.starts_with("1.4") {
        let version = document::clip(version);
        notes.push(Note::warning(format!("COLLADA version {version}: the file is read as if it were 1.4.1")));
    }
    let unit = document.child(root, "asset").and_then(|asset| document.child(asset, "unit"));
    if let Some((unit, meter)) = unit.and_then(|unit| unit.attribute("meter").map(|meter| (unit, meter)))
        && meter.trim().parse::<f64>() != Ok(1.0)
    {
        let (line, meter) = (document.line(unit), document::clip(meter));
        notes.push(Note::info(format!("line {line}: the unit is {meter} metres; lengths are kept in that unit")));
    }
}
