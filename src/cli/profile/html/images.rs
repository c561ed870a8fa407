//! Pictures within the page.

use crate::cli::html::images::{shrunk, tag};
use crate::film::heatmap::{self, HeatMap};
use crate::film::picture::Picture;
use crate::film::png_output::srgb;
use crate::profile::pixel_cost::PixelCost;

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
            heatmap::draw(&HeatMap { width, height, values: values.as_flattened(), title, unit, ..HeatMap::default() });
        let image = tag(title, canvas.width, canvas.height, canvas.pixels.as_flattened());
        format!("<figure>{image}<figcaption>{caption}</figcaption></figure>")
    });
    format!("<div class=\"figures\">{}</div>\n", figures.collect::<String>())
}
