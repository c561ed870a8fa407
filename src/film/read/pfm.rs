//! Portable float maps: `PF` or `Pf`, width, height, scale, then 32-bit floats, bottom row first.
//!
//! Format: P. Debevec, "Portable FloatMap Image Format". A negative scale says that the lowest byte of a number comes
//! first; values are multiplied by its size, as pbrt does.

use std::path::Path;

use super::Found;
use crate::error::{At, Error, Note, Result};

/// Longest word of a header that makes sense.
const LONGEST: usize = 32;

/// Decodes a file that starts with `PF` or `Pf`.
pub fn decode(path: &Path, bytes: &[u8]) -> Result<Found> {
    let grey = bytes[1] == b'f';
    let mut header = Header { path, bytes, at: 2 };
    let width = header.size("the width")?;
    let height = header.size("the height")?;
    let scale = header.scale()?;
    let channels = if grey { 1 } else { 3 };
    let wanted = width.checked_mul(height).and_then(|n| n.checked_mul(4 * channels));
    // Exactly one byte of white space ends the header: the next may be one of a number. Lines that end in two are told by
    // the length.
    let two = bytes[header.at..].starts_with(b"\r\n") && wanted == bytes.len().checked_sub(header.at + 2);
    let start = header.at + if two { 2 } else { 1 };
    let there = bytes.len().saturating_sub(start);
    let Some(wanted) = wanted.filter(|&wanted| wanted <= there) else {
        let what = format!("{there} bytes of pixels");
        let expected = match wanted {
            Some(wanted) => format!("{wanted} for {width} × {height} pixels of {channels} floats"),
            None => format!("a size that memory can hold, not {width} × {height}"),
        };
        return Err(Error::expected(path, At::Byte(start as u64), what, expected));
    };

    let number: fn([u8; 4]) -> f32 = if scale < 0.0 { f32::from_le_bytes } else { f32::from_be_bytes };
    let factor = scale.abs();
    let values: Vec<f32> = bytes[start..start + wanted]
        .as_chunks::<4>()
        .0
        .iter()
        .map(|&four| if factor == 1.0 { number(four) } else { number(four) * factor })
        .collect();
    let rows = values.chunks_exact(width * channels).rev();
    let colours = match grey {
        true => rows.flatten().map(|&v| [v; 3]).collect(),
        false => rows.flat_map(|row| row.as_chunks::<3>().0.iter().copied()).collect(),
    };
    let mut notes = Vec::new();
    if factor != 1.0 {
        notes.push(Note::info(format!("{}: values are multiplied by its scale, {factor}", path.display())));
    }
    if there > wanted {
        notes.push(Note::warning(format!("{}: {} bytes after the pixels are ignored", path.display(), there - wanted)));
    }
    let order = if scale < 0.0 { "little-endian" } else { "big-endian" };
    let kind = if grey { "grey" } else { "colour" };
    let what = format!("PFM, {kind}, {order}");
    Ok(Found { width, height, full: (width, height), colours, grey, what, notes, ..Found::default() })
}

/// The words before the pixels.
struct Header<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Header<'a> {
    /// The next word and where it starts.
    fn word(&mut self, what: &str) -> Result<(&'a str, usize)> {
        let white = |byte: &u8| byte.is_ascii_whitespace();
        let rest = &self.bytes[self.at..];
        let start = self.at + rest.iter().position(|byte| !white(byte)).unwrap_or(rest.len());
        let rest = &self.bytes[start..];
        let length = rest.iter().take(LONGEST + 1).position(white);
        let word = length.filter(|&n| n > 0).and_then(|n| std::str::from_utf8(&rest[..n]).ok());
        let Some(word) = word else {
            let expected = format!("{what} as a number, and white space after it");
            return Err(Error::expected(self.path, At::Byte(start as u64), "the header ends early", expected));
        };
        self.at = start + word.len();
        Ok((word, start))
    }

    fn size(&mut self, what: &str) -> Result<usize> {
        let (word, at) = self.word(what)?;
        // Signs parse, too.
        let size = word.bytes().all(|c| c.is_ascii_digit()).then(|| word.parse::<usize>().ok()).flatten();
        size.filter(|&size| size > 0).ok_or_else(|| {
            let expected = format!("{what}, a whole number above 0");
            Error::expected(self.path, At::Byte(at as u64), format!("'{}'", word.escape_debug()), expected)
        })
    }

    fn scale(&mut self) -> Result<f32> {
        let (word, at) = self.word("the scale")?;
        word.parse::<f32>().ok().filter(|scale| scale.is_finite() && *scale != 0.0).ok_or_else(|| {
            let expected = "the scale, a number other than 0, negative if the lowest byte comes first";
            Error::expected(self.path, At::Byte(at as u64), format!("'{}'", word.escape_debug()), expected)
        })
    }
}
