//! PNG pictures of 8 or 16 bits a channel, decoded by the sRGB curve to linear values.
//!
//! Chunks that name another curve or colour space (`gAMA`, `cHRM`, `iCCP`, `cICP`) are not followed. Alpha is left out:
//! colours are taken as stored, which in PNG is not multiplied by it.

use std::io::Cursor;
use std::path::Path;

use image::codecs::png::PngDecoder;
use image::{ColorType, DynamicImage, ImageDecoder as _, Limits};

use super::Found;
use crate::error::{At, Error, Note, Result};
use crate::film::exr_output::most_bytes;
use crate::film::png_output::srgb_decoded;

/// Decodes a file that starts as a PNG does.
pub fn decode(path: &Path, bytes: &[u8]) -> Result<Found> {
    let wrong = |e: image::ImageError| Error::expected(path, At::File, e.to_string(), "a PNG picture");
    let mut limits = Limits::no_limits();
    // As for EXR: its compression, too, shrinks no more than 1032 times.
    limits.max_alloc = Some(most_bytes(bytes.len()) as u64);
    let mut decoder = PngDecoder::with_limits(Cursor::new(bytes), limits.clone()).map_err(wrong)?;
    decoder.set_limits(limits).map_err(wrong)?;
    let (width, height) = decoder.dimensions();
    let claimed = decoder.total_bytes();
    if claimed > most_bytes(bytes.len()) as u64 {
        let what = format!("it claims {claimed} bytes of pixels in a file of {} bytes", bytes.len());
        return Err(Error::expected(path, At::File, what, "a PNG picture"));
    }
    let color = decoder.color_type();
    let image = DynamicImage::from_decoder(decoder).map_err(wrong)?;

    let (width, height) = (width as usize, height as usize);
    // Eight bits become sixteen exactly: v/255 = 257·v/65535.
    let pixels = image.into_rgba16();
    let curve: Vec<f32> = (0..=u16::MAX).map(|v| srgb_decoded(f64::from(v) / 65535.0) as f32).collect();
    let mut transparent = 0usize;
    let colours = pixels.pixels().map(|pixel| {
        let [r, g, b, alpha] = pixel.0;
        transparent += usize::from(alpha != u16::MAX);
        [r, g, b].map(|v| curve[usize::from(v)])
    });
    let colours = colours.collect();
    let mut notes = Vec::new();
    if transparent > 0 {
        notes.push(Note::warning(format!(
            "{}: {transparent} pixels are transparent; their colours are compared as stored, alpha is not",
            path.display()
        )));
    }
    let grey = matches!(color, ColorType::L8 | ColorType::La8 | ColorType::L16 | ColorType::La16);
    let bits = 8 * usize::from(color.bytes_per_pixel()) / usize::from(color.channel_count());
    let what = format!("PNG, {}, {bits} bits, sRGB", if grey { "grey" } else { "colour" });
    Ok(Found { width, height, full: (width, height), colours, grey, what, notes, ..Found::default() })
}
