//! Pictures within pages.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder as _};

/// Averages of square blocks, so that no side of the whole is wider than `widest`.
pub fn shrunk<const N: usize>(
    width: usize,
    height: usize,
    widest: usize,
    pixel: impl Fn(usize) -> [f32; N],
) -> (usize, usize, Vec<[f32; N]>) {
    let block = width.div_ceil(widest).max(1);
    let (across, down) = (width.div_ceil(block), height.div_ceil(block));
    let mean = |at: usize| {
        let (x, y) = (at % across * block, at / across * block);
        let rows = y..(y + block).min(height);
        let inside = rows.flat_map(|y| (x..(x + block).min(width)).map(move |x| y * width + x));
        let (mut sum, mut count) = ([0.0f64; N], 0.0);
        for at in inside {
            sum.iter_mut().zip(pixel(at)).for_each(|(sum, value)| *sum += f64::from(value));
            count += 1.0;
        }
        sum.map(|sum| (sum / count) as f32)
    };
    (across, down, (0..across * down).map(mean).collect())
}

/// An `img` with its data. A picture that cannot be encoded says so instead.
pub fn tag(what: &str, width: usize, height: usize, rgb: &[u8]) -> String {
    let mut png = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut png, CompressionType::Best, FilterType::Adaptive);
    match encoder.write_image(rgb, width as u32, height as u32, ExtendedColorType::Rgb8) {
        Ok(()) => format!(
            "<img alt=\"{what}\" width=\"{width}\" height=\"{height}\" src=\"data:image/png;base64,{}\">",
            STANDARD.encode(png)
        ),
        Err(error) => format!("<p>{what}: {error}</p>"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shrinking_keeps_the_mean_of_what_is_there() {
        let values: Vec<f32> = (0..15).map(|v| v as f32).collect();
        let (width, height, small) = shrunk(5, 3, 3, |at| [values[at]]);
        assert_eq!((width, height), (3, 2));
        assert_eq!(small[0], [(0.0 + 1.0 + 5.0 + 6.0) / 4.0]);
        assert_eq!(small[5], [14.0], "the last block has one pixel");
    }
}
