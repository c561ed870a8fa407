//! What each pixel cost.
//!
//! A wave has rows of many pixels, so the time of one pixel cannot be taken with a clock: it is shared out. Each batch's time
//! is divided among its rows: evenly in generate, lamps, shade, roulette, reuse and retire; by nodes and leaf blocks visited in traverse and
//! shadow, counted by the plain kernel. So the map adds up to the time of all stages.

use super::ledger::Ledger;
use crate::bvh::{Accel, TraversalCounts};
use crate::observer::{Observer, Queue};
use crate::options::Cell;
use crate::plan::Plan;
use crate::stages::number::{GENERATE, LAMPS, RETIRE, REUSE, ROULETTE, SHADE, SHADOW, TRAVERSE};
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// Counts rows and visits by pixel while a render runs.
pub struct PixelCounter<'a> {
    accel: &'a Accel,
    /// Shows progress and stops.
    next: &'a dyn Observer,
    /// Frame width.
    frame: u32,
    /// What of the frame is rendered.
    cell: Cell,
    /// By depth, the last being for all beyond.
    depths: Vec<Depth>,
}

/// Counts of one depth, a pixel each.
struct Depth {
    paths: Vec<AtomicU32>,
    shadows: Vec<AtomicU32>,
    path_visits: Vec<AtomicU32>,
    shadow_visits: Vec<AtomicU32>,
}

/// Depths that are told apart. What lies beyond costs about what the last of them does.
const DEPTHS: usize = 8;

/// Maps of one value a pixel, top row first.
#[derive(Clone, Debug, Default)]
pub struct PixelCost {
    /// Pixels across and down.
    pub size: [usize; 2],
    /// Thread time in microseconds.
    pub time: Vec<f32>,
    /// Nodes and leaf blocks visited.
    pub visits: Vec<f32>,
    /// Bounces a sample: rays beyond the camera's that continue its path.
    pub bounces: Vec<f32>,
    /// Samples.
    pub samples: Vec<f32>,
}

impl PixelCost {
    /// Time, visits, bounces and samples.
    pub fn layers(&self) -> [&[f32]; 4] {
        [&self.time, &self.visits, &self.bounces, &self.samples]
    }
}

impl<'a> PixelCounter<'a> {
    /// For a render of `plan`.
    pub fn new(accel: &'a Accel, plan: &Plan, next: &'a dyn Observer) -> PixelCounter<'a> {
        let pixels = plan.cell.width as usize * plan.cell.height as usize;
        let zeros = || (0..pixels).map(|_| AtomicU32::new(0)).collect::<Vec<_>>();
        let depth = |_| Depth { paths: zeros(), shadows: zeros(), path_visits: zeros(), shadow_visits: zeros() };
        let depths = (0..DEPTHS.min(plan.options.max_depth as usize + 1)).map(depth).collect();
        PixelCounter { accel, next, frame: plan.options.width, cell: plan.cell, depths }
    }

    fn place(&self, pixel: u32) -> usize {
        let Cell { x, y, width, .. } = self.cell;
        ((pixel / self.frame - y) * width + pixel % self.frame - x) as usize
    }

    /// Shares the times of `ledger`, of which there are nanoseconds of thread time, out among the pixels.
    pub fn maps(&self, ledger: &Ledger) -> PixelCost {
        let (width, height) = (self.cell.width as usize, self.cell.height as usize);
        let mut cost = PixelCost { size: [width, height], ..PixelCost::default() };
        let last = self.depths.len() - 1;
        // Nanoseconds of a stage at a depth as it is told apart here.
        let nanos = |stage: usize, depth: usize| -> f64 {
            let entries = &ledger.stages[stage];
            let range = if depth == last { depth.min(entries.len())..entries.len() } else { depth..depth + 1 };
            entries.get(range).unwrap_or_default().iter().map(|entry| entry.nanos as f64).sum()
        };
        let total = |column: &[AtomicU32]| column.iter().map(|n| f64::from(n.load(Relaxed))).sum::<f64>();
        let rate = |nanos: f64, of: &[AtomicU32]| if nanos > 0.0 { nanos / total(of).max(1.0) } else { 0.0 };
        let of_samples = [GENERATE, LAMPS, REUSE, RETIRE];
        let whole: f64 = of_samples.iter().map(|&stage| ledger.stage(stage).nanos as f64).sum();
        let rates: Vec<[f64; 3]> = (0..=last)
            .map(|depth| {
                let at = &self.depths[depth];
                let ends = if depth == 0 { whole } else { 0.0 };
                let rows = ends + nanos(SHADE, depth) + nanos(ROULETTE, depth);
                [
                    rate(rows, &at.paths),
                    rate(nanos(TRAVERSE, depth), &at.path_visits),
                    rate(nanos(SHADOW, depth), &at.shadow_visits),
                ]
            })
            .collect();
        for pixel in 0..width * height {
            let (mut time, mut visits, mut bounces) = (0.0, 0.0, 0.0);
            for (depth, (at, [row, path, ray])) in self.depths.iter().zip(&rates).enumerate() {
                let of = |column: &[AtomicU32]| f64::from(column[pixel].load(Relaxed));
                let (paths, path_visits, shadow_visits) = (of(&at.paths), of(&at.path_visits), of(&at.shadow_visits));
                time += row * paths + path * path_visits + ray * shadow_visits;
                visits += path_visits + shadow_visits;
                bounces += if depth > 0 { paths } else { 0.0 };
            }
            let samples = f64::from(self.depths[0].paths[pixel].load(Relaxed));
            cost.time.push((time * 1e-3) as f32);
            cost.visits.push(visits as f32);
            cost.bounces.push((bounces / samples.max(1.0)) as f32);
            cost.samples.push(samples as f32);
        }
        cost
    }
}

impl Observer for PixelCounter<'_> {
    fn queue(&self, queue: &Queue<'_>) {
        self.next.queue(queue);
        let Queue { query, shadow, depth, rays, slots, pixels } = *queue;
        let at = &self.depths[(depth as usize).min(self.depths.len() - 1)];
        let (count, visited) = if shadow { (&at.shadows, &at.shadow_visits) } else { (&at.paths, &at.path_visits) };
        let mut single = self.accel.single();
        for (row, &slot) in slots.iter().enumerate() {
            let pixel = self.place(pixels[slot as usize]);
            let TraversalCounts { node_visits, leaf_visits, .. } = single.visits(query, &rays.ray(row));
            count[pixel].fetch_add(1, Relaxed);
            // A ray that visits nothing, as in a scene of one leaf, still took its share of time.
            visited[pixel].fetch_add((node_visits + leaf_visits).max(1) as u32, Relaxed);
        }
    }

    fn samples(&self, done: u64, total: u64) {
        self.next.samples(done, total);
    }

    fn stop(&self) -> bool {
        self.next.stop()
    }
}
