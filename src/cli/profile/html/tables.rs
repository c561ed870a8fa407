//! Tables of the page.

use crate::bench::record::{Change, Record};
use crate::cli::html::table;
use crate::cli::profile::cells::{TIMES, percent, times};
use crate::cli::profile::{Placed, Profiled};
use crate::measure::plot::escape;
use crate::measure::{processor, units};
use crate::plan::Plan;
use crate::profile::ceilings::Ceilings;
use crate::profile::stage_table::{StageRow, StageTable};

/// Times of some rows, and below them what the rows did.
fn times_and_work<'a>(class: &'static str, rows: impl Iterator<Item = (String, &'a StageRow)> + Clone) -> String {
    let work_headings = [
        "stage",
        "B read/row",
        "B written/row",
        "GB/s",
        "queue full",
        "lanes active",
        "nodes/ray",
        "leaves/ray",
        "primitives/ray",
        "instructions/row",
    ];
    let times = table(&TIMES, rows.clone().map(|(name, row)| (class, times(name, row).into())));
    let work = table(&work_headings, rows.map(|(name, row)| (class, work(name, row))));
    format!("<div class=\"wide\">{times}</div>\n<div class=\"wide\">{work}</div>\n")
}

fn work(name: String, row: &StageRow) -> Vec<String> {
    let lanes = row.lanes.iter().filter_map(|each| Some(format!("{} {}", each.of, percent(each.lanes.share()?))));
    let lanes: Vec<String> = lanes.collect();
    let number = |value: Option<f64>| value.map_or("–".into(), |value| format!("{value:.2}"));
    vec![
        name,
        format!("{:.0}", row.bytes_read),
        format!("{:.0}", row.bytes_written),
        format!("{:.2}", row.bandwidth * 1e-9),
        percent(row.occupancy),
        if lanes.is_empty() { "–".into() } else { lanes.join(", ") },
        number(row.visits.map(|visits| visits.nodes)),
        number(row.visits.map(|visits| visits.leaves)),
        number(row.visits.map(|visits| visits.primitives)),
        row.counters.map_or("n/a".into(), |counters| number(counters.instructions)),
    ]
}

/// Stages, all bounces together.
pub fn stages(stages: &StageTable) -> String {
    times_and_work("total", stages.stages.iter().map(|row| (row.stage.to_owned(), row)))
}

/// Stages at each bounce.
pub fn bounces(stages: &StageTable) -> String {
    let name = |row: &StageRow| format!("{}, bounce {}", row.stage, row.bounce.unwrap_or(0));
    times_and_work("", stages.bounces.iter().map(|row| (name(row), row)))
}

/// Thread time outside of stages.
pub fn outside(stages: &StageTable) -> String {
    let all = stages.wall * stages.threads as f64;
    let rows = stages.outside.iter().map(|o| (o.what, o.seconds, o.share));
    let rows = rows.chain([("not accounted for", stages.unaccounted * all, stages.unaccounted)]);
    let cells = |(what, seconds, share): (&str, f64, f64)| {
        ("", vec![what.to_owned(), format!("{:.2}", seconds * 1e3), percent(share)])
    };
    table(&["outside of stages", "thread ms", "share"], rows.map(cells))
}

/// Stages beside the ceilings.
pub fn placements(placed: &Placed) -> String {
    let headings = [
        "stage",
        "ns/row",
        "bytes touched",
        "columns at full bandwidth, ns",
        "nodes, leaves, corners overlapped, ns",
        "one after another, ns",
        "box and triangle tests, ns",
        "bound by",
    ];
    let rows = placed.stages.iter().map(|p| {
        let nanos = |value: f64| if value > 0.0 { format!("{value:.2}") } else { "–".into() };
        let share = p.share().map_or(String::new(), |share| format!(", {:.0} %", 100.0 * share));
        let cells = vec![
            p.stage.to_owned(),
            nanos(p.nanos),
            format!("{:.0}", p.bytes),
            nanos(p.bandwidth),
            nanos(p.overlapped),
            nanos(p.dependent),
            nanos(p.arithmetic),
            format!("{}{share}", p.bound.name()),
        ];
        ("", cells)
    });
    table(&headings, rows)
}

/// The machine.
pub fn ceilings(ceilings: &Ceilings) -> String {
    let headings = ["level", "pages", "working set", "read GB/s", "copy GB/s", "latency ns", "overlapped ns a line"];
    let rows = ceilings.memory.iter().map(|m| {
        let giga = |rate: f64| format!("{:.1}", rate * 1e-9);
        let nanos = |value: f64| format!("{value:.2}");
        let cells = vec![
            m.level.name().to_owned(),
            m.pages.name().to_owned(),
            units::bytes(m.bytes),
            giga(m.read.best),
            giga(m.copy.best),
            nanos(m.latency.best),
            nanos(m.gather.best),
        ];
        ("", cells)
    });
    let compute = &ceilings.compute;
    format!(
        "{}<p class=\"soft\">Vectors of {} lanes: {:.1} G operations/s. Integers: {:.1} G operations/s. One thread.</p>\n",
        table(&headings, rows),
        compute.lanes,
        compute.vector.best * 1e-9,
        compute.integer.best * 1e-9,
    )
}

/// Waves beside the depth-first control.
pub fn control(profiled: &Profiled) -> String {
    let Some(ratio) = profiled.control_ratio() else { return String::new() };
    let turns = &profiled.measured.turns;
    let rows = [("waves", turns.summary(0)), ("one path at a time (depth first)", turns.summary(1))];
    let cells = rows.iter().map(|(name, summary)| {
        let rate = summary.rate;
        let cells = vec![
            (*name).to_owned(),
            format!("{:.2}", rate.median * 1e-6),
            format!("{:.2}–{:.2}", rate.low * 1e-6, rate.high * 1e-6),
            format!("{} ({} disturbed)", summary.samples, summary.disturbed),
        ];
        ("", cells)
    });
    format!(
        "{}<p>Waves are {:.2} times as fast ({:.2}–{:.2}), {:.2} times by processor time. The pictures are the same to the bit.</p>\n",
        table(&["", "Mray/s", "quartiles", "renders"], cells),
        ratio.rate.median,
        ratio.rate.low,
        ratio.rate.high,
        turns.cpu_ratio(1, 0).median,
    )
}

/// Figures beside earlier ones.
pub fn changes(earlier: &Record, changes: &[Change]) -> String {
    let rows = changes.iter().map(|change| {
        let million = |rate: f64| format!("{:.2}", rate * 1e-6);
        let cells = vec![
            escape(&format!("{}, {}", change.now.what, change.now.who)),
            million(change.now.rate.median),
            million(change.then.median),
            format!("{:.3}", change.ratio),
            change.verdict.name().to_owned(),
        ];
        ("", cells)
    });
    let other = match earlier.machine == processor::name() {
        true => String::new(),
        false => format!("<p>The earlier figures are of another machine, {}.</p>\n", escape(&earlier.machine)),
    };
    other + &table(&["stage/bounce", "Mrow/s", "before", "ratio", ""], rows)
}

/// The stages as planned.
pub fn plan(plan: &Plan) -> String {
    let rows = plan.stages.iter().map(|stage| {
        format!(
            "<tr><td>{}</td><td class=\"text\">{}</td><td class=\"text\">{}</td></tr>\n",
            stage.name,
            escape(&stage.kernel),
            escape(&stage.why)
        )
    });
    format!(
        "<div class=\"wide\"><table><thead><tr><th>stage</th><th class=\"text\">kernel</th><th class=\"text\">why</th></tr></thead>\
         <tbody>\n{}</tbody></table></div>\n<p class=\"soft\">{} rows a wave, {} B each: {}.</p>\n",
        rows.collect::<String>(),
        units::count(plan.wave as u64),
        plan.bytes_per_path,
        escape(&plan.wave_why),
    )
}
