//! One number a pixel as a false-colour picture with a legend: sample counts, cost of the BVH.
//!
//! The map stands at the top left, one pixel a value. Below it: the title with the unit, a colour bar with ticks, and
//! smallest, mean and largest value. The canvas is widened where the legend needs more room than the map.

use std::path::Path;

use crate::error::{Error, Result};
use crate::film::{font, png_output};
use crate::measure::units;

/// How values spread over the colours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences are equal steps of colour.
    #[default]
    Linear,
    /// Equal ratios are equal steps of colour. Zero and negative values take the colour of the smallest positive one; a
    /// map without positive values falls back to [`Scale::Linear`].
    Logarithmic,
}

/// Which colours stand for values, from the smallest to the largest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Colours {
    /// [`viridis`]: for amounts.
    #[default]
    Viridis,
    /// [`magma`]: for errors, from black; what FLIP's authors show it with.
    Magma,
    /// [`signed`]: blue, white and red, for differences around zero.
    Signed,
}

impl Colours {
    /// The colour at `t` in 0..1.
    fn at(self, t: f64) -> [u8; 3] {
        match self {
            Colours::Viridis => viridis(t),
            Colours::Magma => magma(t),
            Colours::Signed => signed(t),
        }
    }
}

/// A map to be drawn.
#[derive(Clone, Copy, Debug, Default)]
pub struct HeatMap<'a> {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// `width · height` values, top row first. NaN and infinities are drawn in magenta and counted apart.
    pub values: &'a [f32],
    /// What is shown: "samples a pixel".
    pub title: &'a str,
    /// Unit of the values, or nothing.
    pub unit: &'a str,
    /// How values spread over the colours.
    pub scale: Scale,
    /// Which colours.
    pub colours: Colours,
    /// Values at the ends of the colour bar, the first below the second; those beyond take the colour of the end.
    /// Without it, the smallest and the largest value.
    pub range: Option<[f64; 2]>,
}

/// Rows of 8-bit `R G B`, top row first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Canvas {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// `width · height` colours.
    pub pixels: Vec<[u8; 3]>,
}

const BACKGROUND: [u8; 3] = [24, 24, 28];
const INK: [u8; 3] = [235, 235, 235];
/// No colour of any [`Colours`] is near it.
const NOT_A_NUMBER: [u8; 3] = [255, 0, 255];

/// Narrowest canvas: room for the bar with a handful of ticks.
const LEAST_WIDTH: usize = 240;
/// From this width on, letters are twice as large.
const WIDE: usize = 720;

/// Draws `map` and writes it as PNG.
///
/// # Errors
///
/// [`Error::Encode`] if the map is empty or `values` is not `width · height` long; [`Error::Io`] if the file cannot be
/// written.
pub fn write(path: &Path, map: &HeatMap) -> Result<()> {
    if map.values.is_empty() || map.values.len() != map.width * map.height {
        let what = format!("{} values for a map of {} × {}", map.values.len(), map.width, map.height);
        return Err(Error::Encode { path: path.to_path_buf(), what });
    }
    let canvas = draw(map);
    png_output::write_rgb8(path, canvas.width, canvas.height, canvas.pixels.as_flattened())
}

/// Draws `map` with its legend.
///
/// # Panics
///
/// If `values` is shorter than `width · height`.
pub fn draw(map: &HeatMap) -> Canvas {
    let statistics = Statistics::of(map.values);
    let axis = match map.range {
        Some([low, high]) => Axis { low, high, logarithmic: map.scale == Scale::Logarithmic && low > 0.0 },
        None => Axis::new(&statistics, map.scale),
    };

    let title = match map.unit {
        "" => map.title.to_string(),
        unit => format!("{} [{unit}]", map.title),
    };
    let summary = statistics.summary();
    let zoom = if map.width >= WIDE { 2 } else { 1 };
    let margin = 8 * zoom;
    let text_width = font::width(&title).max(font::width(&summary)) * zoom + 2 * margin;
    let line = (font::HEIGHT + 5) * zoom;
    let bar_height = 10 * zoom;
    let tick = 3 * zoom;

    let width = map.width.max(LEAST_WIDTH).max(text_width);
    let bar_top = map.height + margin + line;
    let labels_top = bar_top + bar_height + tick + 2 * zoom;
    let mut canvas = Canvas::new(width, labels_top + 2 * line + margin / 2);

    for (y, row) in map.values.chunks_exact(map.width.max(1)).take(map.height).enumerate() {
        for (x, &value) in row.iter().enumerate() {
            canvas.pixels[y * width + x] =
                if value.is_finite() { map.colours.at(axis.position(f64::from(value))) } else { NOT_A_NUMBER };
        }
    }

    canvas.text(margin, map.height + margin, zoom, &title);
    let bar_width = width - 2 * margin;
    for x in 0..bar_width {
        let colour = map.colours.at(x as f64 / (bar_width - 1) as f64);
        canvas.rectangle(margin + x, bar_top, 1, bar_height, colour);
    }
    let mut free_from = 0;
    for value in axis.ticks() {
        let x = margin + (axis.position(value) * (bar_width - 1) as f64).round() as usize;
        let label = units::short(value);
        let label_width = font::width(&label) * zoom;
        let left = x.saturating_sub(label_width / 2).clamp(2, width - label_width - 2);
        // A label that would touch the one before is left out, its mark with it.
        if left >= free_from {
            canvas.rectangle(x, bar_top + bar_height, zoom, tick, INK);
            canvas.text(left, labels_top, zoom, &label);
            free_from = left + label_width + font::ADVANCE * zoom;
        }
    }
    canvas.text(margin, labels_top + line, zoom, &summary);
    canvas
}

/// The colour map viridis (S. van der Walt & N. Smith 2015, CC0) at `t` in 0..1: lightness grows evenly, also for
/// readers who do not tell red from green.
///
/// Matt Zucker's polynomial of degree six (2019, CC0), within 4/255 of the table.
pub fn viridis(t: f64) -> [u8; 3] {
    const C: [[f64; 3]; 7] = [
        [0.277_727_327_223_417_7, 0.005_407_344_544_966_578, 0.334_099_805_335_306_1],
        [0.105_093_043_108_577_4, 1.404_613_529_898_575, 1.384_590_162_594_685],
        [-0.330_861_828_725_556_3, 0.214_847_559_468_213, 0.095_095_163_028_236_59],
        [-4.634_230_498_983_486, -5.799_100_973_351_585, -19.332_440_956_279_87],
        [6.228_269_936_347_081, 14.179_933_366_805_09, 56.690_552_600_681_05],
        [4.776_384_997_670_288, -13.745_145_377_746_01, -65.353_032_633_372_34],
        [-5.435_455_855_934_631, 4.645_852_612_178_535, 26.312_435_249_583_2],
    ];
    polynomial(&C, t)
}

/// The colour map magma (S. van der Walt & N. Smith 2015, CC0) at `t` in 0..1: from black to a light yellow, with
/// lightness that grows evenly.
///
/// Matt Zucker's polynomial of degree six (2019, CC0), within 5/255 of the table.
pub fn magma(t: f64) -> [u8; 3] {
    const C: [[f64; 3]; 7] = [
        [-0.002_136_485_053_939_582, -0.000_749_655_052_795_221, -0.005_386_127_855_323_933],
        [0.251_660_540_737_164_2, 0.677_523_243_683_766_8, 2.494_026_599_312_351],
        [8.353_717_279_216_625, -3.577_719_514_958_484, 0.314_467_903_013_257_3],
        [-27.668_733_085_768_66, 14.264_730_780_965_33, -13.649_213_188_139_22],
        [52.176_139_812_340_68, -27.943_606_071_683_51, 12.944_169_442_383_94],
        [-50.768_525_364_735_88, 29.046_582_821_272_91, 4.234_152_993_845_98],
        [18.655_705_065_918_83, -11.489_773_519_977_11, -5.601_961_508_734_096],
    ];
    polynomial(&C, t)
}

/// Blue at 0, nearly white in the middle, red at 1: ColorBrewer's RdBu of eleven classes (C. Brewer, Apache 2.0),
/// turned round and joined by straight lines. Told apart with any colour vision.
pub fn signed(t: f64) -> [u8; 3] {
    const C: [[u8; 3]; 11] = [
        [5, 48, 97],
        [33, 102, 172],
        [67, 147, 195],
        [146, 197, 222],
        [209, 229, 240],
        [247, 247, 247],
        [253, 219, 199],
        [244, 165, 130],
        [214, 96, 77],
        [178, 24, 43],
        [103, 0, 31],
    ];
    let place = t.clamp(0.0, 1.0) * 10.0;
    let below = place.floor() as usize;
    let above = (below + 1).min(10);
    std::array::from_fn(|i| {
        let [low, high] = [below, above].map(|at| f64::from(C[at][i]));
        (low + (high - low) * place.fract()).round() as u8
    })
}

/// A polynomial at `t` in 0..1 for each of red, green and blue.
fn polynomial(coefficients: &[[f64; 3]; 7], t: f64) -> [u8; 3] {
    let t = t.clamp(0.0, 1.0);
    std::array::from_fn(|i| {
        let value = coefficients.iter().rev().fold(0.0, |sum, c| sum * t + c[i]);
        (value * 255.0).round() as u8
    })
}

/// What the values of a map are like.
struct Statistics {
    min: f64,
    max: f64,
    mean: f64,
    /// Smallest value above zero; infinite if there is none.
    least_positive: f64,
    not_finite: usize,
}

impl Statistics {
    fn of(values: &[f32]) -> Self {
        let (mut min, mut max, mut sum) = (f64::INFINITY, f64::NEG_INFINITY, 0.0);
        let (mut least_positive, mut not_finite) = (f64::INFINITY, 0);
        for value in values.iter().map(|&v| f64::from(v)) {
            if !value.is_finite() {
                not_finite += 1;
                continue;
            }
            min = min.min(value);
            max = max.max(value);
            sum += value;
            if value > 0.0 {
                least_positive = least_positive.min(value);
            }
        }
        Statistics { min, max, mean: sum / (values.len() - not_finite) as f64, least_positive, not_finite }
    }

    fn summary(&self) -> String {
        let invalid = match self.not_finite {
            0 => String::new(),
            n => format!("  not finite {} px", units::count(n as u64)),
        };
        if self.min > self.max {
            return invalid.trim_start().to_string();
        }
        let [min, mean, max] = [self.min, self.mean, self.max].map(units::short);
        format!("min {min}  mean {mean}  max {max}{invalid}")
    }
}

/// From values to positions on the bar.
struct Axis {
    low: f64,
    high: f64,
    logarithmic: bool,
}

impl Axis {
    fn new(statistics: &Statistics, scale: Scale) -> Self {
        let logarithmic = scale == Scale::Logarithmic && statistics.least_positive.is_finite();
        let low = if logarithmic { statistics.least_positive } else { statistics.min };
        Axis { low, high: statistics.max, logarithmic }
    }

    /// 0 at the smallest value, 1 at the largest; the middle if they are the same.
    fn position(&self, value: f64) -> f64 {
        let map = |v: f64| if self.logarithmic { v.max(self.low).ln() } else { v };
        let (low, high) = (map(self.low), map(self.high));
        if high > low { ((map(value) - low) / (high - low)).clamp(0.0, 1.0) } else { 0.5 }
    }

    /// Round values along the bar, in order; the only value if all are the same, none if there is no value.
    fn ticks(&self) -> Vec<f64> {
        if self.low > self.high {
            return Vec::new();
        }
        if self.low == self.high {
            return vec![self.low];
        }
        let inside = |v: &f64| (self.low..=self.high).contains(v);
        if self.logarithmic && self.high / self.low >= 10.0 {
            let decades = self.low.log10().floor() as i32..=self.high.log10().ceil() as i32;
            // Over many decades, powers of ten alone.
            let steps: &[f64] = if self.high / self.low < 1e3 { &[1.0, 2.0, 5.0] } else { &[1.0] };
            return decades.flat_map(|d| steps.iter().map(move |s| s * 10f64.powi(d))).filter(inside).collect();
        }
        let rough = (self.high - self.low) / 5.0;
        let decade = 10f64.powf(rough.log10().floor());
        let step = decade * [1.0, 2.0, 5.0].into_iter().find(|s| s * decade >= rough).unwrap_or(10.0);
        let first = (self.low / step).ceil();
        (0..8).map(|i| (first + f64::from(i)) * step).filter(inside).collect()
    }
}

impl Canvas {
    fn new(width: usize, height: usize) -> Self {
        Canvas { width, height, pixels: vec![BACKGROUND; width * height] }
    }

    fn rectangle(&mut self, left: usize, top: usize, width: usize, height: usize, colour: [u8; 3]) {
        for y in top..(top + height).min(self.height) {
            for x in left..(left + width).min(self.width) {
                self.pixels[y * self.width + x] = colour;
            }
        }
    }

    fn text(&mut self, left: usize, top: usize, zoom: usize, text: &str) {
        font::draw(text, |x, y| self.rectangle(left + x * zoom, top + y * zoom, zoom, zoom, INK));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(width: usize, height: usize, values: &[f32], scale: Scale) -> HeatMap<'_> {
        HeatMap { width, height, values, title: "samples a pixel", scale, ..HeatMap::default() }
    }

    #[test]
    fn the_colours_are_viridis_and_get_lighter() {
        // Anchors from the published table.
        for (t, expected) in [(0.0, [68, 1, 84]), (0.25, [59, 82, 139]), (0.5, [33, 145, 140]), (1.0, [253, 231, 37])] {
            for (got, want) in viridis(t).into_iter().zip(expected) {
                assert!((i32::from(got) - want).abs() <= 4, "{t}: {:?} instead of {expected:?}", viridis(t));
            }
        }
        let luminance = |t: f64| {
            let linear = viridis(t).map(|v| (f64::from(v) / 255.0).powf(2.2));
            0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
        };
        for i in 0..64 {
            assert!(luminance(f64::from(i) / 64.0) < luminance(f64::from(i + 1) / 64.0), "{i}");
        }
    }

    #[test]
    fn other_colours_meet_their_tables() {
        for (t, expected) in [(0.0, [0, 0, 4]), (64.0 / 255.0, [81, 18, 124]), (1.0, [252, 253, 191])] {
            for (got, want) in magma(t).into_iter().zip(expected) {
                assert!((i32::from(got) - want).abs() <= 5, "{t}: {:?} instead of {expected:?}", magma(t));
            }
        }
        assert_eq!([0.0, 0.5, 0.95, 1.0].map(signed), [[5, 48, 97], [247; 3], [141, 12, 37], [103, 0, 31]]);
        assert_eq!([-1.0, f64::NAN, 2.0].map(signed)[2], [103, 0, 31]);
    }

    #[test]
    fn a_range_holds_whatever_the_values() {
        let values = [-9.0, -1.0, 0.0, 0.5, 7.0];
        let map = HeatMap { colours: Colours::Signed, range: Some([-1.0, 1.0]), ..map(5, 1, &values, Scale::Linear) };
        let canvas = draw(&map);
        assert_eq!(canvas.pixels[..5], [0.0, 0.0, 0.5, 0.75, 1.0].map(signed));
    }

    #[test]
    fn any_size_keeps_its_pixels_and_a_legible_legend() {
        for (width, height) in [(1, 1), (2, 50), (64, 3), (300, 200), (1000, 40)] {
            let values: Vec<f32> = (0..width * height).map(|i| i as f32).collect();
            for scale in [Scale::Linear, Scale::Logarithmic] {
                let canvas = draw(&map(width, height, &values, scale));
                assert!(canvas.width >= width.max(LEAST_WIDTH) && canvas.height > height + 40);
                assert_eq!(canvas.pixels.len(), canvas.width * canvas.height);
                let last = canvas.pixels[(height - 1) * canvas.width + width - 1];
                assert_eq!(last, viridis(if values.len() == 1 { 0.5 } else { 1.0 }));
                assert!(canvas.pixels[height * canvas.width..].contains(&INK));
            }
        }
    }

    #[test]
    fn a_long_title_widens_the_canvas() {
        let title = "a title that does not fit into the narrowest canvas that there is";
        let canvas = draw(&HeatMap { title, ..map(1, 1, &[1.0], Scale::Linear) });
        assert_eq!(canvas.width, font::width(title) + 16);
    }

    #[test]
    fn constant_and_invalid_maps() {
        let colour = |values: &[f32], i: usize, scale| draw(&map(values.len(), 1, values, scale)).pixels[i];
        for scale in [Scale::Linear, Scale::Logarithmic] {
            assert_eq!(colour(&[7.0, 7.0], 0, scale), viridis(0.5));
            assert_eq!(colour(&[0.0, 0.0], 0, scale), viridis(0.5));
            assert_eq!(colour(&[1.0, f32::NAN, 2.0], 1, scale), NOT_A_NUMBER);
            assert_eq!(colour(&[1.0, f32::INFINITY, 2.0], 2, scale), viridis(1.0));
            assert_eq!(colour(&[f32::NAN], 0, scale), NOT_A_NUMBER);
            assert_eq!(
                colour(&[f32::MIN, f32::MAX], 1, scale),
                viridis(if scale == Scale::Linear { 1.0 } else { 0.5 })
            );
        }
        assert_eq!(colour(&[0.0, 1.0, 10.0, 100.0], 2, Scale::Logarithmic), viridis(0.5));
        assert_eq!(colour(&[0.0, 1.0, 10.0, 100.0], 0, Scale::Logarithmic), viridis(0.0));
    }

    #[test]
    fn the_legend_tells_the_numbers() {
        assert_eq!(Statistics::of(&[32.0, 64.0, 2048.0]).summary(), "min 32  mean 715  max 2048");
        assert_eq!(Statistics::of(&[1.0, f32::NAN]).summary(), "min 1  mean 1  max 1  not finite 1 px");
        assert_eq!(Statistics::of(&[f32::NAN]).summary(), "not finite 1 px");
    }

    #[test]
    fn ticks_are_round() {
        let ticks = |values: &[f32], scale| Axis::new(&Statistics::of(values), scale).ticks();
        assert_eq!(ticks(&[0.0, 100.0], Scale::Linear), [0.0, 20.0, 40.0, 60.0, 80.0, 100.0]);
        assert_eq!(ticks(&[33.0, 47.0], Scale::Linear), [35.0, 40.0, 45.0]);
        assert_eq!(ticks(&[32.0, 2048.0], Scale::Logarithmic), [50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0]);
        assert_eq!(ticks(&[1.0, 1e6], Scale::Logarithmic).len(), 7);
        assert_eq!(ticks(&[5.0], Scale::Linear), [5.0]);
        assert!(ticks(&[f32::NAN], Scale::Linear).is_empty());
    }

    #[test]
    fn writes_a_png_and_refuses_what_does_not_fit() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("map.png");
        write(&path, &map(3, 2, &[1.0; 6], Scale::Linear)).unwrap();
        let decoded = image::open(&path).unwrap().into_rgb8();
        let canvas = draw(&map(3, 2, &[1.0; 6], Scale::Linear));
        assert_eq!((decoded.width() as usize, decoded.height() as usize), (canvas.width, canvas.height));
        assert!(write(&path, &map(3, 2, &[1.0; 5], Scale::Linear)).is_err());
        assert!(write(&path, &map(0, 0, &[], Scale::Linear)).is_err());
    }
}
