//! The report.

use super::cells::{SLOPE_HEADINGS, headings, number, row, share, slope_row};
use super::equal_time::EqualTime;
use super::{Traded, text};
use crate::cli::html::{self, cards, images, table};
use crate::cli::report;
use crate::film::png_output::srgb;
use crate::measure::plot::{COLORS, Marks, Panel, Picture, Series, Theme, escape};
use crate::measure::units;
use crate::trade::figures::Figures;
use crate::trade::front::Place;
use crate::trade::truth::Truth;

/// Widest picture, so that the page stays small: four bytes of text hold one pixel.
const WIDEST: usize = 400;

/// The page.
pub fn page(traded: &Traded, equal: Option<&EqualTime>, truth: &Truth) -> String {
    let title = format!("{}: what accuracy costs", traded.loaded.name);
    let header = format!(
        "<header><h1>{}</h1>\n<p class=\"soft\">A trade by comber {}: {}</p></header>\n{}",
        escape(&title),
        env!("CARGO_PKG_VERSION"),
        escape(&report::scene_line(traded.loaded)),
        cards(&most(traded)),
    );
    let rows = (0..traded.configurations.len()).map(|number| {
        let class = if traded.places[number] == Place::Front { "total" } else { "" };
        (class, row(traded, number).iter().map(|cell| escape(cell)).collect())
    });
    let slopes: Vec<_> = traded.groups.iter().filter_map(|group| slope_row(traded, group)).collect();
    let slopes = match slopes.is_empty() {
        true => String::new(),
        false => format!(
            "<p>The slope of MSE against samples a pixel, both logarithmic: −1 where samples are independent, nearer to 0 \
             where bias is all that is left.</p>\n<div class=\"wide\">{}</div>\n",
            table(&SLOPE_HEADINGS, slopes.iter().map(|row| ("", row.iter().map(|cell| escape(cell)).collect())))
        ),
    };
    let notes: String = traded.notes.iter().map(|note| format!("<li>{}</li>", escape(&note.text))).collect();
    let notes = if notes.is_empty() { notes } else { format!("<ul>{notes}</ul>\n") };
    html::page(
        &title,
        &header,
        &[
            ("Error against time", chart(traded)),
            ("Configurations", format!("<div class=\"wide\">{}</div>\n", table(&headings(traded), rows))),
            ("How fast the error falls", slopes),
            ("At equal time", equal.map_or(String::new(), |equal| pictures(traded, equal, truth))),
            ("Notes", notes),
            ("How it was measured", facts(traded)),
        ],
    )
}

/// The configurations that matter most.
fn most(traded: &Traded) -> Vec<(String, String)> {
    let known = || traded.figures.iter().enumerate().filter_map(|(number, figures)| Some((number, figures.as_ref()?)));
    let best = |value: fn(&Figures) -> f64| {
        let finite = known().filter(|(_, f)| value(f).is_finite() && f.mse.value > 0.0);
        finite.max_by(|a, b| value(a.1).total_cmp(&value(b.1)))
    };
    let name = |number: usize| traded.configurations[number].values.join(", ");
    let runs: usize = known().map(|(_, f)| f.runs).sum();
    let mut most = vec![(units::count(runs as u64), format!("renders of {} configurations", traded.figures.len()))];
    if let Some((number, f)) = best(|f| f.efficiency.value) {
        most.push((name(number), format!("most efficient: 1/(MSE·s) = {}", share(f.efficiency))));
    }
    if let Some((number, f)) = best(|f| -f.mse.value) {
        most.push((
            name(number),
            format!("most accurate: MSE {} in {}", self::number(f.mse.value), report::seconds(f.seconds.median)),
        ));
    }
    if let Some((number, f)) = best(|f| -f.seconds.median) {
        most.push((
            name(number),
            format!("fastest: {}, MSE {}", report::seconds(f.seconds.median), self::number(f.mse.value)),
        ));
    }
    let biased = known().filter(|(_, f)| !f.bias_is_in_the_noise(traded.limit)).count();
    most.push((biased.to_string(), "configurations whose bias is seen".into()));
    most
}

/// Groups that have a colour of their own; more have names at their ends.
const COLOURED: usize = COLORS.len();

/// Error against time, with the front.
fn chart(traded: &Traded) -> String {
    let total = |number: usize| {
        let figures = traded.figures[number].as_ref()?;
        Some([traded.build[number] + figures.seconds.median, figures.mse.value])
    };
    let mut series = Vec::new();
    let mut front: Vec<[f64; 2]> = (0..traded.configurations.len())
        .filter(|&number| traded.places[number] == Place::Front)
        .filter_map(total)
        .filter(|[_, mse]| *mse > 0.0)
        .collect();
    front.sort_by(|a, b| a[0].total_cmp(&b[0]));
    // Steps: no configuration between two of the front is better than the first.
    let corners = front.windows(2).flat_map(|pair| [pair[0], [pair[1][0], pair[0][1]]]);
    let steps: Vec<[f64; 2]> = corners.chain(front.last().copied()).collect();
    series.push(Series { name: String::new(), color: "var(--soft)", points: steps, marks: Marks::Line });
    for (index, group) in traded.groups.iter().enumerate() {
        let color = COLORS[index % COLOURED];
        let points: Vec<[f64; 2]> = group.members.iter().filter_map(|&number| total(number)).collect();
        for &member in &group.members {
            let (Some([x, y]), Some(figures)) = (total(member), &traded.figures[member]) else { continue };
            let bar = vec![[x, y - figures.mse.error], [x, y + figures.mse.error]];
            series.push(Series { name: String::new(), color, points: bar, marks: Marks::Line });
        }
        let named = traded.groups.len() > COLOURED;
        if let Some(&last) = points.last().filter(|_| named) {
            series.push(Series { name: group.name.clone(), color, points: vec![last], marks: Marks::Named });
        }
        let name = if named { String::new() } else { group.name.clone() };
        series.push(Series { name, color, points, marks: Marks::Joined });
    }
    series.push(Series { name: "on the front".into(), color: "var(--ink)", points: front, marks: Marks::Ring });
    let picture = Picture {
        size: [1140.0, 600.0],
        title: "Mean squared error against seconds of a render".into(),
        subtitle: "median render time with the building of the tree; MSE ± one standard error; steps: the Pareto front"
            .into(),
        theme: Theme::PAGE,
        panels: vec![Panel {
            frame: [90.0, 85.0, 1030.0, 455.0],
            x: "seconds, the tree's building included".into(),
            y: "MSE".into(),
            series,
        }],
    };
    format!("<figure class=\"wide\">{}</figure>\n", picture.svg())
}

fn pictures(traded: &Traded, equal: &EqualTime, truth: &Truth) -> String {
    let (width, height) = (traded.plan.cell.width as usize, traded.plan.cell.height as usize);
    let figure = |name: &str, caption: &str, pixel: &dyn Fn(usize) -> [f32; 3]| {
        let (width, height, pixels) = images::shrunk(width, height, WIDEST, pixel);
        let bytes: Vec<u8> = pixels.iter().flatten().map(|&v| srgb(v)).collect();
        format!(
            "<figure>{}<figcaption>{}</figcaption></figure>",
            images::tag(&escape(name), width, height, &bytes),
            escape(caption)
        )
    };
    let mut figures: String = equal
        .pictures
        .iter()
        .map(|picture| {
            let name = &traded.groups[picture.group].name;
            let run = &picture.run;
            let mean = run.samples as f64 / (width * height) as f64;
            let caption = format!(
                "{name}: {} samples a pixel in {}, relMSE {}",
                units::short(mean),
                report::seconds(run.seconds),
                number(run.relmse)
            );
            figure(name, &caption, &|at| picture.pixels[at])
        })
        .collect();
    figures += &figure("the reference", "the reference", &|at| truth.colours[at].map(|c| c as f32));
    let left = traded.groups.len() - equal.pictures.len();
    let more = if left > 0 { format!(" {left} more are left out.") } else { String::new() };
    format!(
        "<p>One render each, with as many samples as take {}.{more}</p>\n<div class=\"figures\">{figures}</div>\n",
        report::seconds(equal.seconds)
    )
}

fn facts(traded: &Traded) -> String {
    let rows: String = text::all_facts(traded)
        .iter()
        .map(|[name, value]| format!("<tr><td>{}</td><td class=\"text\">{}</td></tr>", escape(name), escape(value)))
        .collect();
    format!("<table>{rows}</table>\n<p>Made by:</p><pre>{}</pre>\n", escape(&traded.command))
}
