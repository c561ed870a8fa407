//! Bars and curves.

use crate::cli::profile::{Placed, Profiled};
use crate::measure::plot::{COLORS, Marks, Panel, Picture, Series, Theme};
use crate::profile::ceilings::Level;
use crate::profile::stage_table::StageTable;
use crate::stages;
use crate::system::Pages;

/// What stands for which stage.
pub fn key() -> String {
    let names = stages::ALL.iter().map(|stage| stage.name).chain(["outside"]);
    let entries: String = names.map(|name| format!("<span><i class=\"{name}\"></i>{name}</span>")).collect();
    format!("<div class=\"key\">{entries}</div>\n")
}

fn segment(class: &str, share: f64, title: &str) -> String {
    format!("<i class=\"{class}\" style=\"width:{:.3}%\" title=\"{title}\"></i>", 100.0 * share.max(0.0))
}

/// All thread time in one bar.
pub fn whole(table: &StageTable) -> String {
    let mut bar: String = table
        .stages
        .iter()
        .map(|row| segment(row.stage, row.share, &format!("{} {:.1} %", row.stage, 100.0 * row.share)))
        .collect();
    let outside: f64 = table.outside.iter().map(|outside| outside.share).sum();
    bar += &segment("outside", outside, &format!("outside of stages {:.1} %", 100.0 * outside));
    format!("<div class=\"bar\" role=\"img\" aria-label=\"thread time by stage\">{bar}</div>\n")
}

/// Bounces that have a bar of their own.
const BOUNCES: u32 = 12;

/// A bar for each bounce, as long as its time.
pub fn by_bounce(table: &StageTable) -> String {
    let all = table.wall * table.threads as f64;
    let last = table.bounces.iter().filter_map(|row| row.bounce).max().unwrap_or(0);
    let seconds = |bounce: u32| -> f64 {
        table.bounces.iter().filter(|row| row.bounce == Some(bounce)).map(|row| row.seconds).sum()
    };
    let longest = (0..=last).map(seconds).fold(0.0, f64::max);
    let mut bars = String::new();
    for bounce in 0..=last.min(BOUNCES - 1) {
        let rows = table.bounces.iter().filter(|row| row.bounce == Some(bounce));
        let bar: String = rows
            .map(|row| segment(row.stage, row.seconds / longest, &format!("{} {:.2} ms", row.stage, row.seconds * 1e3)))
            .collect();
        let share = 100.0 * seconds(bounce) / all;
        bars += &format!("<span>bounce {bounce}</span><div class=\"bar\">{bar}</div><span>{share:.1} %</span>\n");
    }
    format!("<div class=\"bars\">{bars}</div>\n")
}

/// Stages among the ceilings.
pub fn roofline(placed: &Placed) -> String {
    let points: Vec<(f64, f64, &str)> =
        placed.stages.iter().map(|p| (1024.0 / p.bytes.max(1.0), 1e3 / p.nanos, p.stage)).collect();
    let fold =
        |of: fn(&(f64, f64, &str)) -> f64, start, pick: fn(f64, f64) -> f64| points.iter().map(of).fold(start, pick);
    let from = fold(|p| p.0, f64::INFINITY, f64::min) / 2.0;
    let to = fold(|p| p.0, 0.0, f64::max) * 2.0;
    // A line of `bytes` a second: rows a second in millions at `x` rows a KiB.
    let line = |name: String, bytes: f64, color| Series {
        name,
        color,
        points: [from, to].map(|x| [x, x * bytes / 1024.0 * 1e-6]).to_vec(),
        marks: Marks::Line,
    };
    let mut series = Vec::new();
    let homes = placed.homes;
    if let Some(wave) = placed.ceilings.at(homes.wave.level, Pages::Small) {
        series.push(line(format!("{}, copying in order", homes.wave.level.name()), wave.copy.best, COLORS[2]));
    }
    let lines = |nanos: f64| 64.0 / nanos * 1e9;
    if let Some(tree) = placed.ceilings.at(homes.tree.level, homes.tree.pages) {
        let level = homes.tree.level.name();
        series.push(line(format!("{level}, any order, overlapped"), lines(tree.gather.best), COLORS[1]));
        series.push(line(format!("{level}, one after another"), lines(tree.latency.best), COLORS[3]));
    }
    if homes.tree.level != Level::Dram
        && let Some(memory) = placed.ceilings.at(Level::Dram, homes.tree.pages)
    {
        series.push(line("DRAM, any order, overlapped".into(), lines(memory.gather.best), COLORS[1]));
    }
    series.extend(points.iter().map(|&(x, y, name)| Series {
        name: name.to_owned(),
        color: COLORS[0],
        points: vec![[x, y]],
        marks: Marks::Named,
    }));
    Picture {
        size: [860.0, 470.0],
        title: "Rows a second and bytes a row".into(),
        subtitle: "one thread; columns, nodes and leaf blocks count as bytes".into(),
        theme: Theme::PAGE,
        panels: vec![Panel {
            frame: [80.0, 75.0, 750.0, 335.0],
            x: "rows a KiB touched".into(),
            y: "Mrow/s a thread".into(),
            series,
        }],
    }
    .svg()
}

/// Rays a second by rows a wave.
pub fn curve(profiled: &Profiled) -> String {
    let points = profiled.measured.curve.iter().map(|p| [f64::from(p.rows), p.rate.rate.median * 1e-6]).collect();
    let series = vec![Series { name: String::new(), color: COLORS[0], points, marks: Marks::Joined }];
    Picture {
        size: [860.0, 330.0],
        title: "Rays a second by rows a wave".into(),
        subtitle: format!(
            "fewer samples than above; a row is {} B; this render has {} rows a wave",
            profiled.plan.bytes_per_path, profiled.plan.wave
        ),
        theme: Theme::PAGE,
        panels: vec![Panel { frame: [80.0, 75.0, 750.0, 195.0], x: "rows a wave".into(), y: "Mray/s".into(), series }],
    }
    .svg()
}
