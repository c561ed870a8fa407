//! The report: one HTML file that needs no other, and no script.

mod charts;
mod images;
mod tables;

use super::{Profiled, rate};
use crate::cli::{html, report};
use crate::error::Result;
use crate::measure::plot::escape;
use crate::measure::{processor, units};
use std::path::Path;

/// Writes the report.
///
/// # Errors
/// The system's.
pub fn write(path: &Path, profiled: &Profiled) -> Result<()> {
    html::write(path, &page(profiled))
}

fn page(profiled: &Profiled) -> String {
    let name = escape(&profiled.loaded.name);
    let sections = [
        ("Where the time goes", time(profiled)),
        ("By stage and bounce", bounces(profiled)),
        ("Beside the machine's ceilings", ceilings(profiled)),
        ("What each pixel cost", profiled.measured.pixels.as_ref().map_or(String::new(), images::maps)),
        ("Size of a wave", curve(profiled)),
        ("Compared", compared(profiled)),
        ("Plan", tables::plan(profiled.plan)),
        ("Machine and build", machine(profiled)),
    ];
    let header = format!(
        "<header><h1>{name}</h1>\n<p class=\"soft\">A profile by comber {}: {}</p></header>\n{}",
        env!("CARGO_PKG_VERSION"),
        escape(&report::scene_line(profiled.loaded)),
        head(profiled),
    );
    html::page(&format!("comber profile: {}", profiled.loaded.name), &header, &sections)
}

/// The picture and the figures that matter most.
fn head(profiled: &Profiled) -> String {
    let Profiled { measured, table, plan, .. } = profiled;
    let waves = measured.turns.summary(0);
    let mut cards = vec![
        (format!("{:.0} ms", table.wall * 1e3), format!("wall time, median of {} renders", table.renders)),
        (rate(waves.rate.median), format!("{} threads", table.threads)),
        (units::count(measured.outcome.stats.rays.all()), "rays".to_owned()),
    ];
    if let Some(ratio) = profiled.control_ratio() {
        cards.push((format!("{:.2} ×", ratio.rate.median), "as fast as depth first".to_owned()));
    }
    if let Some(row) = table.hottest(1).first() {
        cards.push((row.stage.to_owned(), format!("hottest stage, {:.0} % of the time", 100.0 * row.share)));
    }
    let options = &plan.options;
    let caption = format!("{}, {} samples a pixel", report::picture_line(options), options.samples);
    format!(
        "{}<figure>{}<figcaption>{}</figcaption></figure>\n",
        html::cards(&cards),
        images::picture(&measured.outcome.picture),
        escape(&caption)
    )
}

fn time(profiled: &Profiled) -> String {
    let table = profiled.table;
    format!(
        "{}{}\n<p class=\"soft\">Thread time is wall time × threads: {:.1} ms. Parts miss it by {:.2} %.</p>\n\
         {}<div class=\"wide\">{}</div>\n",
        charts::whole(table),
        charts::key(),
        table.wall * table.threads as f64 * 1e3,
        100.0 * table.unaccounted,
        tables::stages(table),
        tables::outside(table),
    )
}

fn bounces(profiled: &Profiled) -> String {
    format!("{}{}{}\n", charts::by_bounce(profiled.table), charts::key(), tables::bounces(profiled.table))
}

fn ceilings(profiled: &Profiled) -> String {
    let Some(placed) = &profiled.placed else { return String::new() };
    format!(
        "<p>Each stage by what a row touches and how fast rows go. The lines are what the machine can do at most: copying in order, \
         cache lines in any order with as many under way as it can have, and one after another. A stage that lies on a line is bound by \
         it; one that lies far below all of them executes instructions.</p>\n<figure class=\"wide\">{}</figure>\n\
         <div class=\"wide\">{}</div>\n<div class=\"wide\">{}</div>\n",
        charts::roofline(placed),
        tables::placements(placed),
        tables::ceilings(&placed.ceilings),
    )
}

fn curve(profiled: &Profiled) -> String {
    match profiled.measured.curve.is_empty() {
        true => String::new(),
        false => format!("<figure class=\"wide\">{}</figure>\n", charts::curve(profiled)),
    }
}

fn compared(profiled: &Profiled) -> String {
    let changes = profiled.changes.as_ref().map(|(earlier, changes)| tables::changes(earlier, changes));
    tables::control(profiled) + &changes.unwrap_or_default()
}

fn machine(profiled: &Profiled) -> String {
    let loaded = profiled.loaded;
    let stats = loaded.accel.stats();
    let tree = format!(
        "{} primitives in {} nodes and {} leaf blocks, {}, SAH cost {:.2}, built in {}",
        units::count(stats.primitives as u64),
        units::count(stats.nodes as u64),
        units::count(stats.leaf_blocks as u64),
        units::bytes(stats.bytes as u64),
        stats.sah_cost,
        report::seconds(stats.build_seconds),
    );
    let facts = [
        ("Processor", format!("{}, {} in use", processor::name(), profiled.table.threads)),
        ("Instruction set", profiled.plan.simd.to_owned()),
        ("comber", format!("{} ({})", env!("CARGO_PKG_VERSION"), profile_of_build())),
        ("Tree", tree),
        ("Counters", profiled.counters_line()),
    ];
    let rows: String = facts
        .iter()
        .map(|(name, value)| format!("<tr><td>{name}</td><td class=\"text\">{}</td></tr>", escape(value)))
        .collect();
    format!("<table>{rows}</table>\n<p>Made by:</p><pre>{}</pre>\n", escape(&profiled.command))
}

fn profile_of_build() -> &'static str {
    if cfg!(debug_assertions) { "with debug assertions: times mean little" } else { "release build" }
}
