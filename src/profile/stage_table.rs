//! The table of stages: what each did, what it took, and what took the rest of the time.
//!
//! Thread time is wall time times threads. All of it is accounted for: stages, what workers do between them, what they
//! wait for, and the two ends of a render. What the sum misses is printed.

use super::ledger::{Entry, Ledger};
use super::measure::{Measured, Timed};
use crate::bench::statistics::Quartiles;
use crate::measure::lanes::Lanes;
use crate::plan::{Plan, PlannedStage};
use crate::stages;
use crate::wave::columns::ColumnInfo;
use serde::Serialize;

/// A profile's times and counts.
#[derive(Clone, Debug, Serialize)]
pub struct StageTable {
    /// Worker threads.
    pub threads: usize,
    /// Wall seconds of the render that is shown: the one of median wall time.
    pub wall: f64,
    /// Wall seconds of all timed renders.
    pub walls: Quartiles,
    /// How many those were.
    pub renders: usize,
    /// Each stage, all bounces together, in the order in which they run.
    pub stages: Vec<StageRow>,
    /// Each stage at each bounce.
    pub bounces: Vec<StageRow>,
    /// What each worker did.
    pub workers: Vec<Worker>,
    /// Thread time outside of stages.
    pub outside: Vec<Outside>,
    /// Share of thread time that is neither in a stage nor in `outside`; below 0 if the parts sum to more than the whole.
    pub unaccounted: f64,
}

/// What a stage did.
#[derive(Clone, Debug, Serialize)]
pub struct StageRow {
    /// Its name.
    pub stage: &'static str,
    /// Bounces before; `None` for all together.
    pub bounce: Option<u32>,
    /// Batches.
    pub calls: u64,
    /// Rows consumed.
    pub rows_in: u64,
    /// Rows produced.
    pub rows_out: u64,
    /// Thread seconds.
    pub seconds: f64,
    /// Of all thread time.
    pub share: f64,
    /// Nanoseconds of thread time a row, over all timed renders.
    pub nanos_a_row: Quartiles,
    /// Rays a second of thread time, where rows are rays.
    pub rays_a_second: Option<f64>,
    /// Bytes of columns read a row.
    pub bytes_read: f64,
    /// Bytes of columns written a row.
    pub bytes_written: f64,
    /// Bytes of columns a second of thread time, read and written.
    pub bandwidth: f64,
    /// Rows of a batch, as a share of those that its queue has room for.
    pub occupancy: f64,
    /// Its vector loops.
    pub lanes: Vec<Loop>,
    /// Of rays, what they visited.
    pub visits: Option<Visits>,
    /// What the processor counted.
    pub counters: Option<CountersARow>,
}

/// What the processor counted, a row. `None`: it does not count that.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct CountersARow {
    /// Cycles.
    pub cycles: Option<f64>,
    /// Instructions.
    pub instructions: Option<f64>,
    /// Mispredicted branches.
    pub branch_misses: Option<f64>,
    /// Misses of the last cache.
    pub cache_misses: Option<f64>,
}

/// What a worker did, in seconds of its time.
#[derive(Clone, Debug, Serialize)]
pub struct Worker {
    /// Its number.
    pub worker: usize,
    /// In stages.
    pub in_stages: f64,
    /// Between stages.
    pub between: f64,
    /// Waiting for tiles.
    pub waiting: f64,
    /// By stage, as in the table.
    pub stages: Vec<WorkerStage>,
}

/// A stage on one worker.
#[derive(Clone, Debug, Serialize)]
pub struct WorkerStage {
    /// Its name.
    pub stage: &'static str,
    /// Rows consumed.
    pub rows: u64,
    /// Seconds.
    pub seconds: f64,
    /// What the processor counted.
    pub counters: Option<CountersARow>,
}

/// A vector loop.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Loop {
    /// What a lane is.
    pub of: &'static str,
    /// Its lanes.
    #[serde(flatten)]
    pub lanes: Lanes,
}

/// What a ray visits, on average.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Visits {
    /// Nodes.
    pub nodes: f64,
    /// Leaf blocks.
    pub leaves: f64,
    /// Primitives tested.
    pub primitives: f64,
}

/// Thread time outside of stages.
#[derive(Clone, Debug, Serialize)]
pub struct Outside {
    /// What it was spent on.
    pub what: &'static str,
    /// Thread seconds.
    pub seconds: f64,
    /// Of all thread time.
    pub share: f64,
}

impl CountersARow {
    fn of(entry: &Entry) -> Option<CountersARow> {
        let each = |count: Option<u64>| count.map(|count| count as f64 / entry.rows.max(1) as f64);
        entry.counters.map(|reading| CountersARow {
            cycles: each(reading.cycles()),
            instructions: each(reading.instructions()),
            branch_misses: each(reading.branch_misses()),
            cache_misses: each(reading.cache_misses()),
        })
    }
}

impl StageTable {
    /// The table of `measured`, of which `plan` was the plan.
    pub fn new(plan: &Plan, measured: &Measured) -> StageTable {
        let timed = measured.median();
        let (ledger, threads) = (&timed.ledger, plan.threads as f64);
        let wall = timed.wall as f64 * 1e-9;
        let all = wall * threads;
        let rows = Rows { plan, measured, all };
        let used = || (0..stages::ALL.len()).filter(|&stage| ledger.stage(stage).calls > 0);
        let depths = |stage: usize| (0..ledger.stages[stage].len()).filter(move |&d| ledger.stages[stage][d].calls > 0);

        let seconds = |nanos: u64| nanos as f64 * 1e-9;
        let (passes, groups) = (seconds(ledger.passes.nanos) * threads, seconds(ledger.groups.nanos));
        let [start, develop] = [ledger.start.nanos, ledger.develop.nanos].map(|nanos| seconds(nanos) * threads);
        let outside = [
            ("between stages: cutting waves, allocating, adding up", groups - seconds(ledger.stage_nanos())),
            ("waiting: workers without tiles, at the end of a pass", passes - groups),
            ("starting threads, laying out the film", start),
            ("ending threads, developing the picture", develop),
        ];
        let outside: Vec<Outside> =
            outside.into_iter().map(|(what, seconds)| Outside { what, seconds, share: seconds / all }).collect();
        let accounted = seconds(ledger.stage_nanos()) + outside.iter().map(|o| o.seconds).sum::<f64>();
        StageTable {
            threads: plan.threads,
            wall,
            walls: measured.quartiles(|timed| timed.wall as f64 * 1e-9),
            renders: measured.renders.len(),
            stages: used().map(|stage| rows.row(stage, None)).collect(),
            bounces: used()
                .flat_map(|stage| depths(stage).map(move |depth| (stage, depth)))
                .map(|(stage, depth)| rows.row(stage, Some(depth)))
                .collect(),
            workers: workers(timed),
            outside,
            unaccounted: 1.0 - accounted / all,
        }
    }

    /// The `n` stages that take most time.
    pub fn hottest(&self, n: usize) -> Vec<&StageRow> {
        let mut rows: Vec<&StageRow> = self.stages.iter().collect();
        rows.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
        rows.truncate(n);
        rows
    }
}

/// What each worker did in a render.
fn workers(timed: &Timed) -> Vec<Worker> {
    let seconds = |nanos: u64| nanos as f64 * 1e-9;
    // The last is the calling thread, which only starts and ends.
    let workers = timed.workers.iter().enumerate().take(timed.workers.len().saturating_sub(1));
    let worker = |(worker, ledger): (usize, &Ledger)| {
        let (in_stages, groups) = (seconds(ledger.stage_nanos()), seconds(ledger.groups.nanos));
        let used = (0..stages::ALL.len()).filter(|&stage| ledger.stage(stage).calls > 0);
        let stage = |stage: usize| {
            let entry = ledger.stage(stage);
            WorkerStage {
                stage: stages::ALL[stage].name,
                rows: entry.rows,
                seconds: seconds(entry.nanos),
                counters: CountersARow::of(&entry),
            }
        };
        Worker {
            worker,
            in_stages,
            between: groups - in_stages,
            waiting: seconds(timed.ledger.passes.nanos) - groups,
            stages: used.map(stage).collect(),
        }
    };
    workers.map(worker).collect()
}

/// What rows are made from.
struct Rows<'a> {
    plan: &'a Plan,
    measured: &'a Measured,
    /// Thread seconds in all.
    all: f64,
}

impl Rows<'_> {
    fn row(&self, stage: usize, depth: Option<usize>) -> StageRow {
        let (plan, measured) = (self.plan, self.measured);
        let entry = entry_of(&measured.median().ledger, stage, depth);
        let counts = entry_of(&measured.counted, stage, depth).counts;
        let name = stages::ALL[stage].name;
        let is_ray = matches!(name, "traverse" | "shadow");
        let seconds = entry.nanos as f64 * 1e-9;
        let rows = entry.rows.max(1) as f64;
        let planned = plan.stages.iter().find(|planned| planned.name == name);
        let [read, written] = planned.map_or([0.0; 2], |planned| self.bytes(planned, stage, depth));
        let capacity = plan.wave as f64 * if name == "shadow" { shadow_rows(plan) } else { 1.0 };
        let lanes = [("rows", entry.lanes), ("boxes", counts.box_lanes), ("primitives", counts.primitive_lanes)];
        StageRow {
            stage: name,
            bounce: depth.map(|depth| depth as u32),
            calls: entry.calls,
            rows_in: entry.rows,
            rows_out: entry.produced,
            seconds,
            share: seconds / self.all,
            nanos_a_row: measured.quartiles(|timed| {
                let entry = entry_of(&timed.ledger, stage, depth);
                entry.nanos as f64 / entry.rows.max(1) as f64
            }),
            rays_a_second: is_ray.then(|| entry.rows as f64 / seconds),
            bytes_read: read / rows,
            bytes_written: written / rows,
            bandwidth: (read + written) / seconds,
            occupancy: rows / (entry.calls.max(1) as f64 * capacity),
            lanes: lanes
                .into_iter()
                .filter(|(_, lanes)| lanes.reached > 0)
                .map(|(of, lanes)| Loop { of, lanes })
                .collect(),
            counters: CountersARow::of(&entry),
            visits: (is_ray && counts.rays > 0).then(|| {
                let each = |count: u64| count as f64 / counts.rays as f64;
                Visits {
                    nodes: each(counts.node_visits),
                    leaves: each(counts.leaf_visits),
                    primitives: each(counts.primitive_tests),
                }
            }),
        }
    }

    /// Bytes of columns that a stage reads and writes in all: each column has as many rows as its table has then.
    fn bytes(&self, planned: &PlannedStage, stage: usize, depth: Option<usize>) -> [f64; 2] {
        let ledger = &self.measured.median().ledger;
        let entry = entry_of(ledger, stage, depth);
        let shadow = stages::ALL.iter().position(|stage| stage.name == "shadow").unwrap_or(stage);
        let rows_of = |column: &String, written: bool| {
            let table = column.split('.').next().unwrap_or_default();
            match (planned.name, table) {
                ("shade", "next") => entry.produced,
                ("shade", "shadow") => entry_of(ledger, shadow, depth).rows,
                ("roulette", "path") if written => entry.produced,
                _ => entry.rows,
            }
        };
        [(&planned.reads, false), (&planned.writes, true)].map(|(columns, written)| {
            columns.iter().map(|column| rows_of(column, written) * ColumnInfo::BYTES as u64).sum::<u64>() as f64
        })
    }
}

/// Most shadow rays a path.
fn shadow_rows(plan: &Plan) -> f64 {
    let bytes = |name: &str| plan.columns.iter().find(|column| column.name == name).map_or(0, |column| column.bytes);
    (bytes("shadow.ox") / ColumnInfo::BYTES).max(1) as f64
}

/// A stage at one depth, or at all.
fn entry_of(ledger: &Ledger, stage: usize, depth: Option<usize>) -> Entry {
    match depth {
        Some(depth) => ledger.stages[stage].get(depth).copied().unwrap_or_default(),
        None => ledger.stage(stage),
    }
}
