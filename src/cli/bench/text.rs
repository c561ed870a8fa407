//! What `comber bench` prints.

use super::subject::SceneReport;
use crate::bench::end_to_end::RenderReport;
use crate::bench::interleave::Summary;
use crate::bench::record::{Change, Record};
use crate::bench::set_report::{ContestantReport, SetReport};
use crate::cli::report::{self, table};
use crate::measure::{processor, units};

/// All that was found of a scene.
pub fn of(scene: &SceneReport) -> String {
    let bvh = &scene.bvh;
    let mut lines = vec![
        scene.title.clone(),
        format!(
            "comber, {}: built in {}, {}, {:.1} bytes a primitive; SAH cost {:.2}; waves of {}",
            scene.simd,
            report::seconds(bvh.build_seconds),
            units::bytes(bvh.bytes as u64),
            bvh.bytes_per_primitive,
            bvh.sah_cost,
            units::count(scene.wave as u64),
        ),
    ];
    lines.extend(scene.peer_lines.iter().cloned());
    if let Some(once) = &scene.once {
        lines.push(format!("traced once: {once}"));
    }
    if !scene.sets.is_empty() {
        lines.extend([String::new(), rates(&scene.sets), String::new(), visits(&scene.sets)]);
    }
    if let Some(rays) = scene.spot_checked {
        lines.push(format!("{rays} rays compared with testing every primitive: the same"));
    }
    lines.extend(scene.empty.iter().map(|set| format!("{set} has no rays: nothing was hit that it could start from")));
    let mut busy: Vec<&str> = scene.sets.iter().filter(|set| set.all_disturbed).map(|set| set.set.as_str()).collect();
    busy.dedup();
    if !busy.is_empty() {
        lines.push(format!(
            "do not trust {}: something else kept the machine busy, and every sample was disturbed",
            busy.join(", ")
        ));
    }
    for set in &scene.sets {
        let all = set.contestants.iter().filter(|contestant| contestant.disagreements > 0);
        lines
            .extend(all.map(|c| format!("{}: {} of {} rays of {} differ", c.name, c.disagreements, set.rays, set.set)));
    }
    if !scene.render.is_empty() {
        lines.extend([String::new(), renders(&scene.render)]);
    }
    lines.join("\n") + "\n\n"
}

/// Rays a second, by set and contestant.
fn rates(sets: &[SetReport]) -> String {
    let row = |set: &SetReport, contestant: &ContestantReport| {
        let million = |rate: f64| format!("{:.2}", rate * 1e-6);
        [
            set.set.clone(),
            set.threads.to_string(),
            contestant.name.clone(),
            million(contestant.rate.rate.median),
            format!("{}–{}", million(contestant.rate.rate.low), million(contestant.rate.rate.high)),
            million(contestant.rate.rate.median / set.threads as f64),
            contestant.ratio.map_or(String::new(), |ratio| format!("{:.2}", ratio.rate.median)),
            contestant.ratio.map_or(String::new(), |ratio| spread(&ratio)),
            samples(&contestant.rate, 1e-6),
        ]
    };
    let rows = sets.iter().flat_map(|set| set.contestants.iter().map(move |contestant| row(set, contestant)));
    let headings = [
        "set",
        "threads",
        "who",
        "Mray/s",
        "quartiles",
        "a core",
        "÷ best peer",
        "quartiles",
        "samples (disturbed: median)",
    ];
    table(headings, 3, rows)
}

fn spread(summary: &Summary) -> String {
    format!("{:.2}–{:.2}", summary.rate.low, summary.rate.high)
}

/// How many samples were taken, and what the disturbed ones say.
fn samples(summary: &Summary, scale: f64) -> String {
    match summary.disturbed_rate {
        Some(_) if summary.all_disturbed => {
            format!("{} ({}: all)", summary.samples - summary.disturbed, summary.disturbed)
        }
        Some(rate) => format!("{} ({}: {:.2})", summary.samples, summary.disturbed, rate * scale),
        None => summary.samples.to_string(),
    }
}

/// What a ray of each set visits, by the renderer's choice of kernel.
fn visits(sets: &[SetReport]) -> String {
    let mut seen: Vec<&str> = Vec::new();
    let first = sets.iter().filter(|set| {
        let new = !seen.contains(&set.set.as_str());
        seen.push(&set.set);
        new
    });
    let counted = first.flat_map(|set| {
        let counts = set.contestants.iter().filter_map(|c| c.counts.map(|counts| (c.name.as_str(), counts)));
        // The kernels of one tree visit the same, give or take the order: rows that differ are shown.
        let mut rows: Vec<(&str, _)> = Vec::new();
        for (name, counts) in counts {
            if rows.iter().all(|row| row.1 != counts) {
                rows.push((name, counts));
            }
        }
        rows.into_iter().map(move |(name, counts)| (set, name, counts))
    });
    let rows = counted.map(|(set, name, counts)| {
        let each = |count: u64| format!("{:.2}", count as f64 / set.rays.max(1) as f64);
        [
            set.set.clone(),
            name.to_owned(),
            units::count(set.rays as u64),
            format!("{:.1} %", 100.0 * set.hits as f64 / set.rays.max(1) as f64),
            each(counts.node_visits),
            each(counts.leaf_visits),
            each(counts.primitive_tests),
        ]
    });
    table(["set", "who", "rays", "hit", "nodes a ray", "leaves a ray", "primitives a ray"], 2, rows)
}

/// Whole renders.
fn renders(reports: &[RenderReport]) -> String {
    let row = |r: &RenderReport| {
        let million = |rate: f64| format!("{:.2}", rate * 1e-6);
        [
            r.threads.to_string(),
            million(r.per_second(r.paths)),
            million(r.waves.rate.median),
            million(r.per_second(r.rays.camera)),
            million(r.per_second(r.rays.bounce)),
            million(r.per_second(r.rays.shadow)),
            million(r.control.rate.median),
            format!("{:.2}", r.ratio.rate.median),
            spread(&r.ratio),
            format!("{:.2}", r.cpu_ratio.median),
            samples(&r.ratio, 1.0),
        ]
    };
    let headings = [
        "threads",
        "Mpath/s",
        "Mray/s",
        "camera",
        "bounce",
        "shadow",
        "depth-first",
        "waves ÷ depth-first",
        "quartiles",
        "by processor time",
        "samples (disturbed: median)",
    ];
    let frame = reports.first().map_or(String::new(), |r| {
        format!("whole renders, {} × {} pixels, {} samples a pixel:\n", r.size[0], r.size[1], r.samples)
    });
    frame + &table(headings, 0, reports.iter().map(row))
}

/// Figures beside earlier ones.
pub fn changes(changes: &[Change], earlier: &Record) -> String {
    let mut text = String::new();
    if earlier.machine != processor::name() {
        text += &format!("warning: the earlier figures are of another machine, {}\n", earlier.machine);
    }
    if changes.is_empty() {
        return text + "nothing to compare: the earlier figures are of other scenes, sets, threads or kernels\n";
    }
    let row = |change: &Change| {
        let million = |rate: f64| format!("{:.2}", rate * 1e-6);
        [
            change.now.scene.clone(),
            change.now.what.clone(),
            change.now.threads.to_string(),
            change.now.who.clone(),
            million(change.now.rate.median),
            million(change.then.median),
            format!("{:.3}", change.ratio),
            change.verdict.name().into(),
        ]
    };
    text + &table(["scene", "set", "threads", "who", "Mray/s", "before", "ratio", ""], 4, changes.iter().map(row))
        + "\n"
}
