//! PLY files out: streamed, a batch of records at a time.

use crate::error::{Error, Result};
use crate::export::split::Split;
use crate::film::atomic_file;
use rayon::prelude::*;
use std::io::Write;
use std::path::Path;

/// How numbers are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Encoding {
    /// As text, with as many digits as bring the same number back.
    Ascii,
    /// Binary, lowest byte first.
    Little,
    /// Binary, highest byte first: what scanners' archives ship.
    #[default]
    Big,
}

/// Records a thread encodes at a time.
const PIECE: usize = 1 << 14;
/// Records encoded before they are written.
const BATCH: usize = 64 * PIECE;

/// Writes a mesh to `path`, whole or not at all. `progress` hears how many of all records are written.
///
/// # Errors
/// [`Error::Io`] if the system refuses.
pub fn write(path: &Path, split: &Split, encoding: Encoding, progress: impl Fn(u64)) -> Result<()> {
    let (vertices, triangles) = (split.vertex_count() as usize, split.triangle_count() as usize);
    atomic_file::write(path, |out| {
        let failed = |e| Error::io(path, "write", e);
        out.write_all(header(split, encoding).as_bytes()).map_err(failed)?;
        records(out, vertices, |i, out| vertex(split, encoding, i, out), &progress).map_err(failed)?;
        let triangle = |i, out: &mut Vec<u8>| triangle(split.triangle(i), encoding, out);
        records(out, triangles, triangle, |done| progress(vertices as u64 + done)).map_err(failed)
    })
}

fn header(split: &Split, encoding: Encoding) -> String {
    let format = match encoding {
        Encoding::Ascii => "ascii",
        Encoding::Little => "binary_little_endian",
        Encoding::Big => "binary_big_endian",
    };
    let properties = |names: [&str; 3]| names.map(|name| format!("property float {name}\n")).concat();
    let position = properties(["x", "y", "z"]);
    let normal = if split.normals().is_empty() { String::new() } else { properties(["nx", "ny", "nz"]) };
    format!(
        "ply\nformat {format} 1.0\ncomment written by comber {}\nelement vertex {}\n{position}{normal}\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        env!("CARGO_PKG_VERSION"),
        split.vertex_count(),
        split.triangle_count(),
    )
}

/// Encodes records in parallel and writes them in order.
fn records(
    out: &mut impl Write,
    count: usize,
    encode: impl Fn(usize, &mut Vec<u8>) + Sync,
    progress: impl Fn(u64),
) -> std::io::Result<()> {
    for start in (0..count).step_by(BATCH) {
        let end = (start + BATCH).min(count);
        let pieces = (start..end).into_par_iter().step_by(PIECE).map(|first| {
            let mut bytes = Vec::new();
            (first..(first + PIECE).min(end)).for_each(|i| encode(i, &mut bytes));
            bytes
        });
        for piece in pieces.collect::<Vec<_>>() {
            out.write_all(&piece)?;
        }
        progress(end as u64);
    }
    Ok(())
}

fn vertex(split: &Split, encoding: Encoding, index: usize, out: &mut Vec<u8>) {
    let normal = split.normals().get(index).map(|normal| normal.to_array());
    let numbers = split.vertex(index).to_array().into_iter().chain(normal.into_iter().flatten());
    match encoding {
        Encoding::Ascii => text(numbers, out),
        Encoding::Little => numbers.for_each(|x| out.extend_from_slice(&x.to_le_bytes())),
        Encoding::Big => numbers.for_each(|x| out.extend_from_slice(&x.to_be_bytes())),
    }
}

fn triangle(triangle: [u32; 3], encoding: Encoding, out: &mut Vec<u8>) {
    match encoding {
        Encoding::Ascii => return text([3].into_iter().chain(triangle), out),
        Encoding::Little | Encoding::Big => out.push(3),
    }
    for index in triangle {
        out.extend_from_slice(&if encoding == Encoding::Big { index.to_be_bytes() } else { index.to_le_bytes() });
    }
}

/// A line of numbers.
fn text<T: std::fmt::Display>(numbers: impl Iterator<Item = T>, out: &mut Vec<u8>) {
    for (place, number) in numbers.enumerate() {
        let space = if place > 0 { " " } else { "" };
        // A vector takes all that is written to it.
        let _ = write!(out, "{space}{number}");
    }
    out.push(b'\n');
}
