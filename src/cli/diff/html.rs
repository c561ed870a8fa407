//! The report.

use super::Diffed;
use super::maps::Map;
use super::tables::{METRIC_HEADINGS, REGION_HEADINGS, bias, metrics, number, pictures, region, z_test};
use crate::cli::html::{self, cards, command, images, table};
use crate::film::heatmap;
use crate::film::png_output::srgb;
use crate::measure::plot::escape;

/// Widest picture, so that the page stays small: four bytes of text hold one pixel.
const WIDEST: usize = 640;

/// The page.
pub fn page(diffed: &Diffed, maps: &[Map]) -> String {
    let name = |path: &std::path::Path| path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    let title = format!("{} beside {}", name(&diffed.args.a), name(&diffed.args.b));
    let figures = &diffed.compared.figures;
    let header = format!(
        "<header><h1>{}</h1>\n<p class=\"soft\">A comparison by comber {}</p></header>\n{}{}",
        escape(&title),
        env!("CARGO_PKG_VERSION"),
        cards(&most(diffed)),
        both(diffed),
    );
    let bias_rows = figures.bias.as_ref().map(bias).map(|rows| facts(&rows)).unwrap_or_default();
    let z_rows = figures.z_test.as_ref().map(z_test).map(|rows| facts(&rows)).unwrap_or_default();
    let regions = table(&REGION_HEADINGS, figures.regions.iter().map(|r| ("", region(r).to_vec())));
    let notes: String = diffed.notes.iter().map(|note| format!("<li>{}</li>", escape(&note.text))).collect();
    let notes = if notes.is_empty() { notes } else { format!("<ul>{notes}</ul>\n") };
    html::page(
        &title,
        &header,
        &[
            ("Where they differ", differences(diffed, maps)),
            ("Metrics", wide(&table(&METRIC_HEADINGS, metrics(figures).into_iter().map(|row| ("", row.to_vec()))))),
            ("Bias and variance", bias_rows),
            ("Every pixel against its standard error", z_rows),
            ("Luminance by region", wide(&regions)),
            ("Notes", notes),
            ("Pictures", format!("{}<p>Made by:</p><pre>{}</pre>\n", facts(&pictures(diffed)), escape(&command()))),
        ],
    )
}

fn wide(table: &str) -> String {
    format!("<div class=\"wide\">{table}</div>\n")
}

fn facts(rows: &[[String; 2]]) -> String {
    let row = |[name, value]: &[String; 2]| {
        format!("<tr><td>{}</td><td class=\"text\">{}</td></tr>", escape(name), escape(value))
    };
    format!("<table>{}</table>\n", rows.iter().map(row).collect::<String>())
}

/// The figures that matter most.
fn most(diffed: &Diffed) -> Vec<(String, String)> {
    let figures = &diffed.compared.figures;
    let mut most = vec![
        (number(figures.rmse.rgb), "RMSE"),
        (number(figures.relmse.rgb), "relMSE"),
        (number(figures.psnr.rgb), "PSNR, dB"),
        (number(figures.flip), "FLIP"),
    ];
    most.extend(figures.ssim.map(|ssim| (number(ssim), "SSIM")));
    most.extend(figures.z_test.map(|test| (number(test.mean_square.value), "mean z²")));
    most.into_iter().map(|(value, what)| (value, what.to_owned())).collect()
}

/// A and B, as seen.
fn both(diffed: &Diffed) -> String {
    let (pair, exposure) = (diffed.pair, diffed.args.exposure);
    let factor = exposure.exp2();
    let figure = |name: &str, layer: &[[f32; 3]]| {
        let (width, height, pixels) = images::shrunk(pair.width, pair.height, WIDEST, |at| layer[at]);
        let bytes: Vec<u8> = pixels.iter().flatten().map(|&v| srgb(v * factor)).collect();
        let stops = if exposure == 0.0 { String::new() } else { format!(", {exposure:+} stops") };
        format!("<figure>{}<figcaption>{name}{stops}</figcaption></figure>", images::tag(name, width, height, &bytes))
    };
    format!("<div class=\"figures\">{}{}</div>\n", figure("A", &pair.a), figure("B, the reference", &pair.b))
}

/// The maps, smaller where they are wide.
fn differences(diffed: &Diffed, maps: &[Map]) -> String {
    let pair = diffed.pair;
    let figures = maps.iter().map(|map| {
        let (width, height, values) = images::shrunk(pair.width, pair.height, WIDEST, |at| [map.values[at]]);
        let canvas = heatmap::draw(&map.of(width, height, values.as_flattened()));
        let averaged = if width < pair.width { " Averaged over blocks of pixels." } else { "" };
        let image = images::tag(&map.title, canvas.width, canvas.height, canvas.pixels.as_flattened());
        format!("<figure>{image}<figcaption>{}{averaged}</figcaption></figure>", map.caption)
    });
    format!("<div class=\"figures\">{}</div>\n", figures.collect::<String>())
}
