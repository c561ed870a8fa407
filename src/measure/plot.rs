//! Pictures of measurements: panels of series on logarithmic axes, as SVG.
//!
//! All lengths are pixels from the top left.

use std::fmt::Write;

/// Panels under a title.
pub struct Picture {
    /// Width and height.
    pub size: [f64; 2],
    /// What it shows.
    pub title: String,
    /// A line under the title: what was measured, and where.
    pub subtitle: String,
    /// What stands where.
    pub panels: Vec<Panel>,
    /// Its colours.
    pub theme: Theme,
}

/// Colours of all but the series, as SVG spells them.
#[derive(Clone, Copy)]
pub struct Theme {
    /// Text and frames.
    pub ink: &'static str,
    /// Background.
    pub paper: &'static str,
    /// Lines of labelled values.
    pub major: &'static str,
    /// Lines between those.
    pub minor: &'static str,
}

impl Theme {
    /// For pictures that stand alone: they look the same on light and dark pages.
    pub const LIGHT: Theme = Theme { ink: "#222", paper: "#fff", major: "#ccc", minor: "#eee" };
    /// For pictures that are part of a page, and take its colours.
    pub const PAGE: Theme =
        Theme { ink: "var(--ink)", paper: "var(--paper)", major: "var(--line)", minor: "var(--faint)" };
}

/// Series in one frame.
pub struct Panel {
    /// Left, top, width and height of the frame; labels and legend are outside of it.
    pub frame: [f64; 4],
    /// Label and unit of the axis across.
    pub x: String,
    /// Label and unit of the axis up.
    pub y: String,
    /// What is drawn.
    pub series: Vec<Series>,
}

/// Points of one colour. Those without a logarithm are left out.
pub struct Series {
    /// For the legend; none if empty.
    pub name: String,
    /// As SVG spells it.
    pub color: &'static str,
    /// Across, up.
    pub points: Vec<[f64; 2]>,
    /// How.
    pub marks: Marks,
}

/// How points are drawn.
#[derive(Clone, Copy, PartialEq)]
pub enum Marks {
    /// Filled, joined in order.
    Joined,
    /// Hollow, each by itself.
    Single,
    /// As single ones, with the name beside each and not in the legend.
    Named,
    /// A thin line without points, its name along it and not in the legend.
    Line,
    /// A wide ring around each, which leaves room for a point of another series.
    Ring,
}

/// Colours that people with any colour vision can tell apart (Okabe and Ito 2008, without those too light for lines).
pub const COLORS: [&str; 4] = ["#0072b2", "#d55e00", "#009e73", "#9c4f86"];

impl Picture {
    /// The picture as an SVG document.
    pub fn svg(&self) -> String {
        let [width, height] = self.size;
        let paper = self.theme.paper;
        let mut svg = Svg { text: String::new(), theme: self.theme };
        svg.text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"13\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"{paper}\"/>\n"
        );
        svg.words([20.0, 30.0], "font-size=\"18\" font-weight=\"bold\"", &self.title);
        svg.words([20.0, 50.0], "", &self.subtitle);
        self.panels.iter().for_each(|panel| panel.draw(&mut svg));
        svg.text + "</svg>\n"
    }
}

impl Panel {
    fn draw(&self, svg: &mut Svg) {
        let [left, top, width, height] = self.frame;
        let (right, bottom) = (left + width, top + height);
        let across = LogAxis::over(self.values(0), left, right);
        let up = LogAxis::over(self.values(1), bottom, top);
        let (across_ticks, up_ticks) = (across.ticks(), up.ticks());
        // Minor lines first: no line crosses over a stronger one.
        for major in [false, true] {
            let color = if major { svg.theme.major } else { svg.theme.minor };
            for tick in across_ticks.iter().filter(|tick| tick.major == major) {
                svg.line([tick.at, top, tick.at, bottom], color);
            }
            for tick in up_ticks.iter().filter(|tick| tick.major == major) {
                svg.line([left, tick.at, right, tick.at], color);
            }
        }
        for tick in across_ticks.iter().filter(|tick| tick.major) {
            svg.words([tick.at, bottom + 18.0], "text-anchor=\"middle\"", &number(tick.value));
        }
        for tick in up_ticks.iter().filter(|tick| tick.major) {
            svg.words([left - 7.0, tick.at + 4.5], "text-anchor=\"end\"", &number(tick.value));
        }
        svg.words([left + width / 2.0, bottom + 38.0], "text-anchor=\"middle\"", &self.x);
        let (x, y) = (left - 52.0, top + height / 2.0);
        svg.words([x, y], &format!("text-anchor=\"middle\" transform=\"rotate(-90 {x} {y})\""), &self.y);
        let ink = svg.theme.ink;
        writeln!(
            svg.text,
            "<rect x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\" fill=\"none\" stroke=\"{ink}\"/>"
        )
        .expect("strings take all");
        let mut lines = 0;
        let named = self.series.iter().filter(|series| series.marks == Marks::Named).flat_map(Series::drawn);
        let named: Vec<[f64; 2]> = named.map(|[x, y]| [across.place(x), up.place(y)]).collect();
        for series in &self.series {
            let points: Vec<[f64; 2]> = series.drawn().map(|[x, y]| [across.place(x), up.place(y)]).collect();
            if let (Marks::Line, Some(&from), Some(&to)) = (series.marks, points.first(), points.last()) {
                // Lines may lie close together: each name stands further to the left than the one before.
                let at = 1.0 - f64::from(lines) * 0.26;
                let [x, y] = [0, 1].map(|axis: usize| from[axis] + (to[axis] - from[axis]) * at);
                svg.words([x - 4.0, y - 5.0], "text-anchor=\"end\" font-size=\"11\"", &series.name);
                lines = (lines + 1) % 4;
            }
            if series.marks == Marks::Named {
                points.iter().for_each(|&point| name(svg, point, &series.name, &named));
            }
            series.draw(svg, points);
        }
        self.legend(svg);
    }

    /// The finite values across (0) or up (1) that are drawn.
    fn values(&self, dimension: usize) -> impl Iterator<Item = f64> {
        self.series.iter().flat_map(Series::drawn).map(move |point| point[dimension])
    }

    /// Above the frame, from the left.
    fn legend(&self, svg: &mut Svg) {
        let [mut x, y] = [self.frame[0], self.frame[1] - 13.0];
        for series in self.series.iter().filter(|series| !series.name.is_empty()) {
            let sample = match series.marks {
                Marks::Joined => vec![[x + 4.0, y], [x + 24.0, y]],
                Marks::Single | Marks::Ring => vec![[x + 12.0, y]],
                Marks::Named | Marks::Line => continue,
            };
            series.draw(svg, sample);
            svg.words([x + 34.0, y + 4.5], "", &series.name);
            // No font is known here: a guess at its width.
            x += 52.0 + 7.0 * series.name.chars().count() as f64;
        }
    }
}

impl Series {
    fn drawn(&self) -> impl Iterator<Item = [f64; 2]> {
        self.points.iter().copied().filter(|point| point.iter().all(|v| v.is_finite() && *v > 0.0))
    }

    fn draw(&self, svg: &mut Svg, places: Vec<[f64; 2]>) {
        let color = self.color;
        if matches!(self.marks, Marks::Joined | Marks::Line) && places.len() > 1 {
            let stroke = if self.marks == Marks::Joined { 2.0 } else { 1.2 };
            let corners: Vec<String> = places.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
            let corners = corners.join(" ");
            writeln!(
                svg.text,
                "<polyline points=\"{corners}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"{stroke}\"/>"
            )
            .expect("strings take all");
        }
        if self.marks == Marks::Line {
            return;
        }
        let (fill, radius) = match self.marks {
            Marks::Joined => (color, 3.5),
            Marks::Ring => ("none", 7.0),
            _ => (svg.theme.paper, 3.5),
        };
        for [x, y] in places {
            writeln!(
                svg.text,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" fill=\"{fill}\" stroke=\"{color}\" stroke-width=\"1.5\"/>"
            )
            .expect("strings take all");
        }
    }
}

/// Writes the name of a point to its right, or to its left if another stands there.
fn name(svg: &mut Svg, [x, y]: [f64; 2], name: &str, others: &[[f64; 2]]) {
    let taken = others.iter().any(|[ox, oy]| *ox > x && *ox - x < 90.0 && (oy - y).abs() < 14.0);
    let (x, anchor) = if taken { (x - 7.0, "end") } else { (x + 7.0, "start") };
    let attributes = format!("font-size=\"12\" font-weight=\"bold\" text-anchor=\"{anchor}\"");
    svg.words([x, y + 4.0], &attributes, name);
}

/// A logarithmic axis, from a value 1, 2 or 5 · 10ⁿ to another.
struct LogAxis {
    /// Values at its ends.
    values: [f64; 2],
    /// Pixels at its ends.
    pixels: [f64; 2],
}

struct Tick {
    value: f64,
    at: f64,
    /// With a label.
    major: bool,
}

/// An axis of more decades than this has labels at powers of ten alone.
const DECADES: f64 = 3.1;

impl LogAxis {
    /// As short as has room for all of `values`, which are above zero.
    fn over(values: impl Iterator<Item = f64>, start: f64, end: f64) -> LogAxis {
        let [low, high] = values.fold([f64::INFINITY, 0.0], |[low, high], v| [low.min(v), high.max(v)]);
        let values = if low <= high { [low, high] } else { [1.0, 10.0] };
        let round: Vec<f64> = steps(values).filter(|(_, digit)| [1, 2, 5].contains(digit)).map(|(v, _)| v).collect();
        // Values are often round themselves, but for the last bit.
        let below = round.iter().copied().rfind(|v| *v <= values[0] * (1.0 + 1e-9));
        let above = round.iter().copied().find(|v| *v >= values[1] * (1.0 - 1e-9) && Some(*v) > below);
        LogAxis { values: [below.unwrap_or(values[0]), above.unwrap_or(values[1])], pixels: [start, end] }
    }

    fn place(&self, value: f64) -> f64 {
        let [low, high] = self.values.map(f64::ln);
        self.pixels[0] + (value.ln() - low) / (high - low) * (self.pixels[1] - self.pixels[0])
    }

    fn ticks(&self) -> Vec<Tick> {
        let [low, high] = self.values;
        let labelled: &[u32] = if (high / low).log10() > DECADES { &[1] } else { &[1, 2, 5] };
        let inside = |(value, _): &(f64, u32)| (low * (1.0 - 1e-9)..=high * (1.0 + 1e-9)).contains(value);
        let tick = |(value, digit)| Tick { value, at: self.place(value), major: labelled.contains(&digit) };
        steps(self.values).filter(inside).map(tick).collect()
    }
}

/// All of 1, 2, … 9 · 10ⁿ around `values`, with those digits; from a decade below to a decade above.
fn steps(values: [f64; 2]) -> impl Iterator<Item = (f64, u32)> {
    let [first, last] = values.map(|value| value.log10().floor() as i32);
    (first - 1..=last + 1).flat_map(|n| (1..=9).map(move |digit| (f64::from(digit) * 10f64.powi(n), digit)))
}

/// `0.01`, `500`, `30k`, `1M`.
fn number(value: f64) -> String {
    let (scaled, unit) = match value {
        1e6.. => (value * 1e-6, "M"),
        1e3.. => (value * 1e-3, "k"),
        _ => (value, ""),
    };
    // Not all of the digits that 3 · 0.1 has.
    format!("{}{unit}", format!("{scaled:.9}").trim_end_matches('0').trim_end_matches('.'))
}

/// What is being drawn.
struct Svg {
    text: String,
    theme: Theme,
}

impl Svg {
    fn line(&mut self, [x1, y1, x2, y2]: [f64; 4], color: &str) {
        writeln!(self.text, "<path d=\"M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}\" stroke=\"{color}\"/>")
            .expect("strings take all");
    }

    /// Text may have characters that XML does not: names of files are shown.
    fn words(&mut self, [x, y]: [f64; 2], attributes: &str, words: &str) {
        let ink = self.theme.ink;
        let words = escape(words);
        writeln!(self.text, "<text x=\"{x:.1}\" y=\"{y:.1}\" fill=\"{ink}\" {attributes}>{words}</text>")
            .expect("strings take all");
    }
}

/// Text as HTML and SVG have it, in elements and in attributes.
pub fn escape(text: &str) -> String {
    let text: String = text.chars().map(|c| if c.is_control() { '?' } else { c }).collect();
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
