//! Pictures in, from any program: OpenEXR, PFM and PNG, told apart by their first bytes.
//!
//! [`exr_output::read`](super::exr_output::read) reads all layers of our own files; this reads one colour a pixel of
//! anybody's, to be compared. Every file may be hostile: what it claims is checked against its length before memory is
//! taken.

mod exr;
mod pfm;
mod png;

use std::fs;
use std::path::Path;

use crate::error::{At, Error, Note, Result};

/// A picture as it was found in a file.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Left edge within the full frame.
    pub x: usize,
    /// Top edge within the full frame.
    pub y: usize,
    /// Size of the full frame; differs from `(width, height)` where a part was rendered.
    pub full: (usize, usize),
    /// `width · height` linear colours, top row first. NaN and infinities are as the file has them.
    pub colours: Vec<[f32; 3]>,
    /// Variance of the mean (standard error squared) of each channel, where the file is known to hold that.
    pub variance: Option<Vec<[f32; 3]>>,
    /// There is one channel; all three of `colours` are it.
    pub grey: bool,
    /// Format, kind of numbers and channels, for people.
    pub what: String,
    /// What was left out or assumed.
    pub notes: Vec<Note>,
}

/// Reads the picture at `path`.
///
/// `layer` chooses among those of an EXR file; without it, the colour is taken (see `read/exr.rs` for how it is found).
///
/// # Errors
///
/// [`Error::Io`] if the file cannot be read; [`Error::Import`] if it is no picture of a known format, is damaged, claims
/// more than its length can hold, or has no such layer.
pub fn read(path: &Path, layer: Option<&str>) -> Result<Found> {
    // A pipe or a device may never end.
    if !fs::metadata(path).map_err(|e| Error::io(path, "read", e))?.is_file() {
        return Err(Error::expected(path, At::File, "it is not a regular file", "a picture"));
    }
    let bytes = fs::read(path).map_err(|e| Error::io(path, "read", e))?;
    let found = match bytes.as_slice() {
        [0x76, 0x2f, 0x31, 0x01, ..] => return exr::decode(path, &bytes, layer),
        [b'P', b'F' | b'f', b' ' | b'\t' | b'\r' | b'\n', ..] => pfm::decode(path, &bytes)?,
        [0x89, b'P', b'N', b'G', ..] => png::decode(path, &bytes)?,
        [] => return Err(Error::expected(path, At::Byte(0), "the file is empty", FORMATS)),
        other => {
            let start: Vec<String> = other.iter().take(4).map(|byte| format!("{byte:02x}")).collect();
            let what = format!("it starts with the bytes {}", start.join(" "));
            return Err(Error::expected(path, At::Byte(0), what, FORMATS));
        }
    };
    match layer {
        None => Ok(found),
        Some(_) => {
            Err(Error::expected(path, At::File, "the format has no layers", "an OpenEXR picture, as one is named"))
        }
    }
}

const FORMATS: &str = "an OpenEXR (76 2f 31 01), PFM (PF, Pf) or PNG (89 50 4e 47) picture";
