//! PNG pictures to look at: 8 bits a channel, sRGB.

use std::path::Path;

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder as _};

use crate::error::{Error, Result};
use crate::film::atomic_file;
use crate::film::picture::Picture;

/// Writes the beauty layer of `picture` to `path`, brightened by `exposure` stops (a factor of `2^exposure`).
///
/// Values are encoded by [`srgb`] without dithering, so the same picture gives the same bytes. The file holds the data
/// window only, and no provenance: the encoder offers no text chunks.
///
/// # Errors
///
/// [`Error::Encode`] if the picture is empty, too large for PNG, or `beauty` is not `width · height` long;
/// [`Error::Io`] if the file cannot be written.
pub fn write(path: &Path, picture: &Picture, exposure: f32) -> Result<()> {
    let scale = exposure.exp2();
    let pixels: Vec<u8> = picture.beauty.iter().flatten().map(|&v| srgb(v * scale)).collect();
    write_rgb8(path, picture.width, picture.height, &pixels)
}

/// The 8-bit sRGB value of a linear one: the piecewise curve of IEC 61966-2-1, rounded to the nearest step.
///
/// Out of range: 1 and above, `+∞` included, is 255; negative values and NaN are 0.
pub fn srgb(linear: f32) -> u8 {
    // The conversion saturates, and turns NaN into 0.
    (srgb_encoded(f64::from(linear)) * 255.0).round() as u8
}

/// The sRGB value of a linear one, both from 0 to 1: the piecewise curve of IEC 61966-2-1.
pub fn srgb_encoded(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The linear value of an sRGB one, both from 0 to 1: the inverse of [`srgb_encoded`].
pub fn srgb_decoded(encoded: f64) -> f64 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// Writes rows of `R G B` bytes, top row first.
///
/// # Errors
///
/// As [`write()`].
pub(crate) fn write_rgb8(path: &Path, width: usize, height: usize, pixels: &[u8]) -> Result<()> {
    let refuse = |what: String| Err(Error::Encode { path: path.to_path_buf(), what });
    let (Ok(w), Ok(h)) = (u32::try_from(width), u32::try_from(height)) else {
        return refuse(format!("{width} × {height} pixels are too many for PNG"));
    };
    if w == 0 || h == 0 {
        return refuse(format!("the picture is empty ({width} × {height})"));
    }
    if pixels.len() != width * height * 3 {
        return refuse(format!("{} colour values for {width} × {height} pixels", pixels.len()));
    }
    atomic_file::write(path, |file| {
        let encoder = PngEncoder::new(file);
        encoder.write_image(pixels, w, h, ExtendedColorType::Rgb8).map_err(|error| match error {
            image::ImageError::IoError(source) => Error::io(path, "write", source),
            other => Error::Encode { path: path.to_path_buf(), what: other.to_string() },
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values_of_the_curve() {
        for (linear, encoded) in [
            (0.0, 0),
            (1.0, 255),
            (0.5, 188),
            (0.18, 118),
            (0.214_041_14, 128),
            (0.003_130_8, 10),
            // Halfway between steps 0 and 1: 1/255/12.92 = 3.0353e-4.
            (1.517e-4, 0),
            (1.518e-4, 1),
        ] {
            assert_eq!(srgb(linear), encoded, "{linear}");
        }
    }

    #[test]
    fn every_step_decodes_to_itself() {
        for step in 0..=255u8 {
            assert_eq!(srgb(srgb_decoded(f64::from(step) / 255.0) as f32), step);
        }
    }

    #[test]
    fn out_of_range() {
        for (linear, encoded) in
            [(f32::NAN, 0), (f32::INFINITY, 255), (f32::NEG_INFINITY, 0), (-1.0, 0), (1.001, 255), (f32::MAX, 255)]
        {
            assert_eq!(srgb(linear), encoded, "{linear}");
        }
    }
}
