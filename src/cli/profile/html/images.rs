//! Pictures within the page.

use crate::film::heatmap::{self, HeatMap, Scale};
use crate::film::picture::Picture;
use crate::film::png_output::srgb;
use crate::profile::pixel_cost::PixelCost;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder as _};

/// Widest picture, so that the page stays small: four bytes of text hold one pixel.
const WIDEST: usize = 640;
/// Widest map, of which there are four.
const WIDEST_MAP: usize = 400;

/// The rendered picture as an `img`.
pub fn picture(picture: &Picture) -> String {
    let (width, height, pixels) = shrunk(picture.width, picture.height, WIDEST, |at| picture.beauty[at]);
    let bytes: Vec<u8> = pixels.iter().flatten().map(|&v| srgb(v)).collect();
    tag("the rendered picture", width, height, &bytes)
}

/// Maps of what pixels cost, with legends.
pub fn maps(cost: &PixelCost) -> String {
    let titles = [
        (
            "thread time",
            "microseconds",
            "Thread time, shared out among the rows of each batch: the map adds up to the time of all stages.",
        ),
        ("visits", "", "Nodes and leaf blocks that rays of the pixel visited."),
        ("bounces a sample", "", "How often its paths went on."),
        ("samples", "", "Samples a pixel."),
    ];
    let figures = titles.iter().zip(cost.layers()).map(|((title, unit, caption), values)| {
        let (width, height, values) = shrunk(cost.size[0], cost.size[1], WIDEST_MAP, |at| [values[at]]);
        let canvas =
            heatmap::draw(&HeatMap { width, height, values: values.as_flattened(), title, unit, scale: Scale::Linear });
        let image = tag(title, canvas.width, canvas.height, canvas.pixels.as_flattened());
        format!("<figure>{image}<figcaption>{caption}</figcaption></figure>")
    });
    format!("<div class=\"figures\">{}</div>\n", figures.collect::<String>())
}

/// Averages of square blocks, so that no side of the whole is wider than `widest`.
fn shrunk<const N: usize>(
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
fn tag(what: &str, width: usize, height: usize, rgb: &[u8]) -> String {
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
