//! What bounds each stage: its time beside what the machine's ceilings would allow.
//!
//! Three estimates are made of a row's time, each as if nothing else took any:
//!
//! - *bandwidth*: the bytes of columns that the stage declares, at the copying rate of the cache that holds a wave;
//! - *latency*: the nodes and leaf blocks that a ray visits, and the triangle and corners that shade gathers, a cache line at a
//!   time, as if each came from the level that is as large as the tree or the scene's tables: the *overlapped* estimate has as many
//!   lines under way as the processor can, the *dependent* one has each wait for the one before;
//! - *arithmetic*: the operations of its box and triangle tests, at the peak rate of the widest vectors.
//!
//! A stage is bound by the largest estimate if that makes up at least half of its time. If none does, what is left is
//! bound by instructions: address arithmetic, shuffles, branches and their mispredictions. That is by elimination;
//! hardware counters, where there are some, say it directly.

use super::ceilings::{Ceilings, Level};
use super::stage_table::StageRow;
use crate::bvh::Accel;
use crate::plan::Plan;
use crate::system::Pages;
use serde::Serialize;

/// Operations on a child in a box test: six differences, six products, eleven minima, maxima and a comparison.
const BOX_OPERATIONS: f64 = 23.0;
/// Operations on a triangle in the watertight test: nine differences, three shears of four, three edges of three, the
/// determinant's two, the distance's five, and eight comparisons and selections.
const TRIANGLE_OPERATIONS: f64 = 45.0;
/// Bytes of a cache line.
const LINE: f64 = 64.0;

/// What takes most of a stage's time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Bound {
    /// Moving columns.
    Bandwidth,
    /// Waiting for nodes and leaves, as many at once as the processor can.
    Latency,
    /// Multiplying, adding, comparing in full vectors.
    Arithmetic,
    /// All else that is executed.
    Instructions,
}

impl Bound {
    /// For reports.
    pub fn name(self) -> &'static str {
        match self {
            Bound::Bandwidth => "bandwidth",
            Bound::Latency => "latency",
            Bound::Arithmetic => "arithmetic",
            Bound::Instructions => "instructions",
        }
    }
}

/// A stage beside the ceilings. Times are nanoseconds a row.
#[derive(Clone, Debug, Serialize)]
pub struct Placement {
    /// The stage.
    pub stage: &'static str,
    /// How many there were.
    pub rows: f64,
    /// As measured, the median.
    pub nanos: f64,
    /// Bytes touched: columns, nodes and blocks, lines of the scene's tables.
    pub bytes: f64,
    /// Estimate of bandwidth.
    pub bandwidth: f64,
    /// Estimate of latency, overlapped.
    pub overlapped: f64,
    /// Estimate of latency, dependent.
    pub dependent: f64,
    /// Estimate of arithmetic; 0 where operations are not counted.
    pub arithmetic: f64,
    /// The verdict.
    pub bound: Bound,
}

impl Placement {
    /// The estimate that the verdict rests on, as a share of the time; `None` for instructions, where all are small.
    pub fn share(&self) -> Option<f64> {
        let estimate = match self.bound {
            Bound::Bandwidth => self.bandwidth,
            Bound::Latency => self.overlapped,
            Bound::Arithmetic => self.arithmetic,
            Bound::Instructions => return None,
        };
        Some(estimate / self.nanos)
    }
}

/// The level and the pages of what a render reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Home {
    /// The smallest level that holds it.
    pub level: Level,
    /// The pages it lies on, if the system had them.
    pub pages: Pages,
}

/// Where a wave and the tree lie.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Homes {
    /// Columns of one worker.
    pub wave: Home,
    /// Nodes and leaf blocks.
    pub tree: Home,
    /// Triangles, positions and normals.
    pub tables: Home,
}

impl Homes {
    /// By size.
    pub fn of(ceilings: &Ceilings, plan: &Plan) -> Homes {
        let wave = plan.wave as u64 * plan.bytes_per_path as u64;
        let caches = ceilings.key.caches;
        let level = |bytes: u64| {
            let levels = [(caches.l1, Level::L1), (caches.l2, Level::L2), (caches.l3, Level::L3)];
            let holds = |(size, level): (Option<u64>, Level)| size.filter(|&size| bytes <= size).map(|_| level);
            levels.into_iter().find_map(holds).unwrap_or(Level::Dram)
        };
        let pages = |bytes: u64| if bytes >= crate::system::HUGE_FROM as u64 { Pages::Huge } else { Pages::Small };
        Homes {
            wave: Home { level: level(wave), pages: Pages::Small },
            tree: Home { level: level(plan.memory.accel), pages: pages(plan.memory.accel) },
            tables: Home { level: level(plan.memory.scene), pages: Pages::Small },
        }
    }
}

/// Places the stages in `rows`; `smooth`: shade gathers normals, too.
pub fn place(ceilings: &Ceilings, homes: &Homes, accel: &Accel, smooth: bool, rows: &[StageRow]) -> Vec<Placement> {
    let at = |home: Home| ceilings.at(home.level, home.pages);
    let (Some(wave), Some(tree), Some(tables)) = (at(homes.wave), at(homes.tree), at(homes.tables)) else {
        return Vec::new();
    };
    let [node, block] = accel.row_bytes().map(|bytes| bytes as f64);
    let of = |row: &StageRow| {
        let columns = row.bytes_read + row.bytes_written;
        let (nodes, leaves) = row.visits.map_or((0.0, 0.0), |visits| (visits.nodes, visits.leaves));
        let touched = nodes * node + leaves * block;
        let rows = row.rows_in.max(1) as f64;
        // Of rows that scatter: a triangle, then its corners, then their normals.
        let gathered = if row.stage == "shade" { if smooth { 7.0 } else { 4.0 } } else { 0.0 };
        let scatter = row.lanes.iter().filter(|l| l.of == "rows").map(|l| l.lanes.active as f64).sum::<f64>() / rows;
        let (lines, steps) = (gathered * scatter, if gathered > 0.0 { 2.0 * scatter } else { 0.0 });
        let lanes = |name: &str| row.lanes.iter().filter(|l| l.of == name).map(|l| l.lanes.total as f64).sum::<f64>();
        let operations = BOX_OPERATIONS * lanes("boxes") + TRIANGLE_OPERATIONS * lanes("primitives");
        let mut placement = Placement {
            stage: row.stage,
            rows,
            nanos: row.nanos_a_row.median,
            bytes: columns + touched + lines * LINE,
            bandwidth: columns / wave.copy.best * 1e9,
            overlapped: touched / LINE * tree.gather.best + lines * tables.gather.best,
            dependent: (nodes + leaves) * tree.latency.best + steps * tables.latency.best,
            arithmetic: operations / rows / ceilings.compute.vector.best * 1e9,
            bound: Bound::Instructions,
        };
        let estimates = [
            (Bound::Bandwidth, placement.bandwidth),
            (Bound::Latency, placement.overlapped),
            (Bound::Arithmetic, placement.arithmetic),
        ];
        let largest = estimates.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((bound, estimate)) = largest
            && 2.0 * estimate >= placement.nanos
        {
            placement.bound = bound;
        }
        placement
    };
    rows.iter().map(of).collect()
}
