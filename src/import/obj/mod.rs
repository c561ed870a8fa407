//! Wavefront OBJ files: one mesh a material.
//!
//! Read are `v`, `vn`, `f`, `o`, `g`, `usemtl` and `mtllib`; texture coordinates, smoothing groups, lines and points
//! have no effect. An own reader rather than the `tobj` crate, for errors that name a line and for speed; the tests
//! hold the two against each other.

mod assemble;
mod chunk;
mod mtl;

use crate::error::{At, Error, Note, Result};
use crate::import::Around;
use crate::import::lines::{Lines, Text};
use crate::scene::description::{MaterialDescription, SceneDescription};
use chunk::{Chunk, Counts};
use mtl::Libraries;
use rayon::prelude::*;
use std::path::Path;

/// Bytes a thread takes at a time.
const PIECE: usize = 1 << 18;

/// Reads an OBJ file. Material libraries are looked up beside `path`.
pub fn parse(path: &Path, bytes: &[u8]) -> Result<SceneDescription> {
    parse_around(path, bytes, Around::default())
}

/// As [`parse`], with positions taken as `around` says.
pub fn parse_around(path: &Path, bytes: &[u8], around: Around) -> Result<SceneDescription> {
    let text = Text::new(bytes, true);
    let pieces = text.pieces(0..bytes.len(), PIECE);
    // Counting first tells each thread what its relative indices are relative to.
    let counts: Vec<Counts> = pieces.par_iter().map(|piece| chunk::count(text.cursor(piece.clone()))).collect();
    let mut total = Counts::default();
    let before: Vec<Counts> = counts.iter().map(|counts| total.advance(counts)).collect();
    if total.vertices.max(total.normals) >= u64::from(u32::MAX) {
        let what = format!("{} vertices and {} normals are too many", total.vertices, total.normals);
        return Err(Error::expected(path, At::File, what, format!("less than {} of each", u32::MAX)));
    }
    let results: Vec<_> = pieces
        .into_par_iter()
        .zip(before)
        .map(|(piece, before)| chunk::read(text.cursor(piece), before, total, around))
        .collect();
    let mut chunks = Vec::with_capacity(results.len());
    for result in results {
        chunks.push(result.map_err(|fault| text.error(path, fault))?);
    }
    // Each corner can become a vertex of its own.
    let corners: usize = chunks.iter().map(|chunk| chunk.corners.len()).sum();
    if u32::try_from(corners).is_err() {
        let what = format!("the faces have {corners} corners, which is too many");
        return Err(Error::expected(path, At::File, what, format!("at most {}", u32::MAX)));
    }

    let mut notes = Vec::new();
    let libraries = libraries(path, &text, &chunks, &mut notes)?;
    let mut assembly = assemble::assemble(chunks);
    if assembly.meshes.is_empty() {
        let at = if bytes.is_empty() { At::File } else { text.line(bytes.trim_ascii_end().len()) };
        let what = "there are no faces, so nothing to render";
        return Err(Error::expected(path, at, what, "a line “f” with three different vertices"));
    }
    assembly.tell(path, &text, &mut notes);
    let mut materials = Vec::new();
    let mut lines = Lines::new(text);
    for (number, (mesh, offset)) in assembly.meshes.iter_mut().zip(&assembly.offsets).enumerate() {
        mesh.at = lines.at(*offset);
        mesh.material = number as u32;
        let place = format!("{}{}", path.display(), mesh.at);
        materials.push(material(&assembly.materials[number], &libraries, &place, &mut notes));
    }
    Ok(SceneDescription {
        name: super::file_name(path),
        origin: around.origin,
        meshes: assembly.meshes,
        materials,
        notes,
        ..SceneDescription::default()
    })
}

/// Reads all material libraries that the file names.
fn libraries(path: &Path, text: &Text, chunks: &[Chunk], notes: &mut Vec<Note>) -> Result<Libraries> {
    let mut libraries = Libraries::default();
    for (offset, names) in chunks.iter().flat_map(Chunk::libraries) {
        libraries.load(path, || text.line(offset), names, notes)?;
    }
    Ok(libraries)
}

/// The material of this name, or the default one under that name.
fn material(name: &str, libraries: &Libraries, place: &str, notes: &mut Vec<Note>) -> MaterialDescription {
    if name.is_empty() {
        return super::default_material();
    }
    if let Some(material) = libraries.find(name) {
        if let Some(map) = libraries.map(name) {
            notes.push(Note::warning(format!("{map}: material {name} has a map_Kd; textures are not rendered")));
        }
        return material.clone();
    }
    notes.push(Note::warning(format!("{place}: material {name} is not defined; it is diffuse with albedo 0.5")));
    MaterialDescription { name: name.into(), ..super::default_material() }
}
