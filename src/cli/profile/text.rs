//! A profile for people.

use super::cells::{self, TIMES, percent};
use super::{Placed, Profiled, rate};
use crate::bench::record::{Change, Record, Verdict};
use crate::cli::report::{self, Facts, table};
use crate::measure::{processor, units};
use crate::profile::bound::Placement;
use crate::profile::measure::Measured;
use crate::profile::stage_table::{CountersARow, Loop, StageRow, StageTable};

/// Bounces that are listed; all are in `--json`.
const BOUNCES: u32 = 8;

/// All of it.
pub fn of(profiled: &Profiled) -> String {
    let Profiled { table: stages, measured, changes, .. } = profiled;
    let mut sections = vec![facts(profiled), times(stages), work(stages), outside(stages), workers(stages)];
    sections.extend(counters(stages));
    sections.extend(profiled.placed.as_ref().map(bounds));
    if !measured.curve.is_empty() {
        sections.push(curve(measured));
    }
    if let Some((earlier, changes)) = changes {
        sections.push(against(changes, earlier));
    }
    sections.join("\n\n") + "\n"
}

fn facts(profiled: &Profiled) -> String {
    let Profiled { loaded, plan, measured, table, .. } = profiled;
    let rays = measured.outcome.stats.rays;
    let ms = |seconds: f64| format!("{:.1}", seconds * 1e3);
    let mut facts = Facts::default();
    facts.add("scene", report::scene_line(loaded));
    facts.add("picture", format!("{}, {} samples", report::picture_line(&plan.options), plan.options.samples));
    let counts = [rays.all(), rays.camera, rays.bounce, rays.shadow].map(units::count);
    facts.add("rays", format!("{}: {} camera, {} bounce, {} shadow", counts[0], counts[1], counts[2], counts[3]));
    let waves = measured.turns.summary(0);
    facts.add(
        "wall time",
        format!(
            "{} ms (quartiles of {} renders {}–{}), {} threads, {}{}",
            ms(table.wall),
            table.renders,
            ms(table.walls.low),
            ms(table.walls.high),
            table.threads,
            rate(waves.rate.median),
            disturbed(waves.disturbed, table.renders),
        ),
    );
    if measured.turns.samples.len() > 1 {
        let (control, ratio) = (measured.turns.summary(1), measured.turns.ratio(0, 1));
        facts.add(
            "depth first",
            format!(
                "{}: waves are {:.2} times as fast ({:.2}–{:.2}), {:.2} by processor time",
                rate(control.rate.median),
                ratio.rate.median,
                ratio.rate.low,
                ratio.rate.high,
                measured.turns.cpu_ratio(1, 0).median,
            ),
        );
    }
    facts.add("counters", profiled.counters_line());
    facts.add("waves", format!("{} rows of {} B, {}", units::count(plan.wave as u64), plan.bytes_per_path, plan.simd));
    facts.text()
}

fn disturbed(disturbed: usize, of: usize) -> String {
    if disturbed == 0 { String::new() } else { format!("; {disturbed} of {of} renders were disturbed") }
}

/// Stages and their bounces, in order.
fn rows(stages: &StageTable) -> impl Iterator<Item = (String, &StageRow)> {
    stages.stages.iter().flat_map(|stage| {
        let bounces = stages.bounces.iter().filter(|row| row.stage == stage.stage);
        let several = bounces.clone().count() > 1;
        let bounces = bounces.filter(move |row| several && row.bounce < Some(BOUNCES));
        let name = |row: &StageRow| row.bounce.map_or(row.stage.to_owned(), |bounce| format!("  bounce {bounce}"));
        [stage].into_iter().chain(bounces).map(move |row| (name(row), row))
    })
}

fn times(stages: &StageTable) -> String {
    table(TIMES, 1, rows(stages).map(|(name, row)| cells::times(name, row)))
}

fn work(stages: &StageTable) -> String {
    let rows = rows(stages).map(|(name, row)| {
        let visits = |of: fn(&crate::profile::stage_table::Visits) -> f64| {
            row.visits.as_ref().map_or("–".into(), |visits| format!("{:.2}", of(visits)))
        };
        [
            name,
            format!("{:.1}", row.bytes_read),
            format!("{:.1}", row.bytes_written),
            format!("{:.2}", row.bandwidth * 1e-9),
            percent(row.occupancy),
            lanes(row, &["rows", "boxes"]),
            lanes(row, &["primitives"]),
            visits(|v| v.nodes),
            visits(|v| v.leaves),
            visits(|v| v.primitives),
        ]
    });
    let headings = [
        "stage",
        "B read/row",
        "B written/row",
        "GB/s",
        "queue full",
        "lanes active",
        "in leaves",
        "nodes/ray",
        "leaves/ray",
        "primitives/ray",
    ];
    table(headings, 1, rows)
}

/// Share of active lanes of the first of some loops that a stage has.
fn lanes(row: &StageRow, of: &[&str]) -> String {
    let found: Option<&Loop> = row.lanes.iter().find(|each| of.contains(&each.of));
    found.and_then(|each| each.lanes.share()).map_or("–".into(), percent)
}

fn outside(stages: &StageTable) -> String {
    let in_stages: f64 = stages.stages.iter().map(|row| row.seconds).sum();
    let all = stages.wall * stages.threads as f64;
    let row = |what: &str, seconds: f64, share: f64| [what.to_owned(), format!("{:.2}", seconds * 1e3), percent(share)];
    let rows = [row("in stages", in_stages, in_stages / all)]
        .into_iter()
        .chain(stages.outside.iter().map(|outside| row(outside.what, outside.seconds, outside.share)))
        .chain([row("not accounted for", stages.unaccounted * all, stages.unaccounted)])
        .chain([row("wall time × threads", all, 1.0)]);
    table(["where thread time goes", "ms", "share"], 1, rows)
}

fn workers(stages: &StageTable) -> String {
    let rows = stages.workers.iter().map(|worker| {
        let [a, b, c] = [worker.in_stages, worker.between, worker.waiting].map(|s| format!("{:.2}", s * 1e3));
        [worker.worker.to_string(), a, b, c]
    });
    table(["worker", "in stages, ms", "between, ms", "waiting, ms"], 1, rows)
}

/// What the processor counted, a row.
fn counters(stages: &StageTable) -> Option<String> {
    stages.stages.iter().find(|row| row.counters.is_some())?;
    let rows = rows(stages).filter_map(|(name, row)| {
        let counters = row.counters?;
        let show = |count: Option<f64>| count.map_or("n/a".into(), |count| format!("{count:.2}"));
        let ratio = counters.instructions.zip(counters.cycles).map(|(instructions, cycles)| instructions / cycles);
        let CountersARow { cycles, instructions, branch_misses, cache_misses } = counters;
        let [a, b, c, d, e] = [cycles, instructions, ratio, branch_misses, cache_misses].map(show);
        Some([name, a, b, c, d, e])
    });
    let headings = ["stage", "cycles/row", "instructions/row", "a cycle", "branch misses/row", "cache misses/row"];
    Some(table(headings, 1, rows))
}

/// Stages beside the machine's ceilings, the hottest first.
fn bounds(placed: &Placed) -> String {
    let mut stages: Vec<&Placement> = placed.stages.iter().collect();
    stages.sort_by(|a, b| (b.nanos * b.rows).total_cmp(&(a.nanos * a.rows)));
    let nanos = |value: f64| if value > 0.0 { format!("{value:.2}") } else { "–".into() };
    let rows = stages.into_iter().map(|p| {
        let share = p.share().map_or(String::new(), |share| format!(" ({:.0} %)", 100.0 * share));
        [
            p.stage.to_owned(),
            nanos(p.nanos),
            nanos(p.bandwidth),
            nanos(p.overlapped),
            nanos(p.dependent),
            nanos(p.arithmetic),
            format!("{}{share}", p.bound.name()),
        ]
    });
    let homes = placed.homes;
    let lie = format!(
        "a wave's columns lie in {}, the scene's tables in {}, the tree in {} on {} pages",
        homes.wave.level.name(),
        homes.tables.level.name(),
        homes.tree.level.name(),
        homes.tree.pages.name()
    );
    let headings = ["hottest first", "ns/row", "columns", "lines overlapped", "one by one", "arithmetic", "bound by"];
    format!("what ceilings allow, ns/row: {lie}\n{}", table(headings, 1, rows))
}

fn curve(measured: &Measured) -> String {
    let best = measured.curve.iter().map(|point| point.rate.rate.median).fold(0.0, f64::max);
    let rows = measured.curve.iter().map(|point| {
        let median = point.rate.rate.median;
        [
            units::count(point.rows.into()),
            units::bytes(point.bytes),
            format!("{:.2}", median * 1e-6),
            percent(median / best),
        ]
    });
    table(["rows a wave", "columns", "Mray/s", "of best"], 0, rows)
}

/// Figures beside earlier ones.
fn against(changes: &[Change], earlier: &Record) -> String {
    let mut text = String::new();
    if earlier.machine != processor::name() {
        text += &format!("warning: the earlier figures are of another machine, {}\n", earlier.machine);
    }
    if changes.is_empty() {
        return text + "nothing to compare: the earlier figures are of other scenes or threads";
    }
    if let Some(control) = changes.iter().find(|c| c.now.who == "depth-first" && c.verdict != Verdict::Tie) {
        text += &format!(
            "warning: the depth-first control, which the change may not have touched, ran at {:.2} of its earlier rate: the machine \
             itself was not the same\n",
            control.ratio
        );
    }
    let million = |rate: f64| format!("{:.2}", rate * 1e-6);
    let rows = changes.iter().map(|change| {
        let spread = |low: f64, high: f64| format!("{}–{}", million(low), million(high));
        [
            format!("{}, {}", change.now.what, change.now.who),
            million(change.now.rate.median),
            spread(change.now.rate.low, change.now.rate.high),
            million(change.then.median),
            spread(change.then.low, change.then.high),
            format!("{:.3}", change.ratio),
            change.verdict.name().into(),
        ]
    });
    text + &table(["stage/bounce", "Mrow/s", "quartiles", "before", "quartiles", "ratio", ""], 1, rows)
}
