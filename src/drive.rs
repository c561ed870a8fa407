//! Runs a plan: workers, waves, tiles, progress, cancellation. The only file that knows all stages.

use crate::bvh::{Accel, Query, RayColumns};
use crate::error::{Error, Result};
use crate::film::develop::develop;
use crate::film::picture::Picture;
use crate::film::{self, tile::Tile};
use crate::plan::Plan;
use crate::scene::Scene;
use crate::scene::camera::Camera;
use crate::simd::Tier;
use crate::stages::{self, Context, Stage};
use crate::transport::Transport;
use crate::wave::Wave;
use crate::wave::features::Features;
use crate::wave::span::Span;
use rayon::prelude::*;
use serde::Serialize;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Who watches a render, and may stop it. Called from worker threads, between waves.
pub trait Observer: Sync {
    /// `done` of at most `total` samples are in the film (adaptive renders may end with fewer).
    fn samples(&self, done: u64, total: u64);
    /// `true`: finish the waves under way and return what there is.
    fn stop(&self) -> bool;
    /// A queue of rays is about to be traced, all at vertex `depth` (0: from the camera).
    fn queue(&self, _query: Query, _depth: u32, _rays: RayColumns<'_>) {}
}

/// Watches nothing, never stops.
pub struct Unobserved;

impl Observer for Unobserved {
    fn samples(&self, _done: u64, _total: u64) {}
    fn stop(&self) -> bool {
        false
    }
}

/// Rays traced, by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RayCounts {
    /// From the camera.
    pub camera: u64,
    /// Continuing a path.
    pub bounce: u64,
    /// Towards a light, or over the hemisphere, to estimate direct light.
    pub shadow: u64,
}

/// What one stage cost, summed over all workers.
#[derive(Clone, Debug, Default, Serialize)]
pub struct StageCost {
    /// The stage's name.
    pub name: &'static str,
    /// Batches run.
    pub calls: u64,
    /// Rows consumed.
    pub rows: u64,
    /// Seconds of worker time.
    pub seconds: f64,
}

/// What a render did.
#[derive(Clone, Debug, Default, Serialize)]
pub struct RenderStats {
    /// Rays by kind.
    pub rays: RayCounts,
    /// Cost by stage, in schedule order.
    pub stages: Vec<StageCost>,
    /// Wall time of the render, without loading, building or writing.
    pub seconds: f64,
    /// Worker threads.
    pub threads: usize,
    /// Rows a wave.
    pub wave: usize,
    /// Instruction set used.
    pub simd: &'static str,
    /// Samples in the film.
    pub samples: u64,
    /// Fewest, mean and most samples of a pixel.
    pub samples_per_pixel: (u32, f64, u32),
    /// Pixels that met the adaptive test.
    pub converged_pixels: u64,
    /// Pixels rendered.
    pub pixels: u64,
    /// Samples that were NaN or infinite and were left out of the film.
    pub non_finite_samples: u64,
    /// The first such sample: pixel x, y, sample index.
    pub first_non_finite: Option<(u32, u32, u32)>,
}

/// A finished, or stopped, render.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The layers that the plan asked for; provenance is filled in by the caller.
    pub picture: Picture,
    /// BVH nodes visited by each pixel's camera rays (mean), for [`crate::options::Integrator::BvhCost`].
    pub cost: Option<Vec<f32>>,
    /// What it took.
    pub stats: RenderStats,
    /// The observer asked to stop before all samples were done.
    pub stopped: bool,
}

/// Most samples a pixel in one pass of a render that is not adaptive: enough that rows of a pixel, which are near each
/// other in the scene, stay together. The first passes are shorter (1, 1, 2, 4, 8), so that a render that is stopped early
/// has seen every pixel.
const PASS: u32 = 16;

/// Renders `scene` as `plan` says.
///
/// # Errors
/// A thread pool that the system refuses.
pub fn render(scene: &Scene, accel: &Accel, camera: &Camera, plan: &Plan, observer: &dyn Observer) -> Result<Outcome> {
    let options = &plan.options;
    let context = Context {
        scene,
        accel,
        lens: camera.lens(options.width, options.height),
        transport: Transport::new(options, &scene.lights),
        features: plan.features,
        seed: options.seed,
        tier: Tier::detect(options.simd)?,
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(plan.threads).build();
    let pool = pool.map_err(|e| Error::Options(format!("cannot start {} threads: {e}", plan.threads)))?;
    let mut tiles = film::tile::tiles(plan.cell, plan.film);
    let shared = Shared { context: &context, plan, observer, waves: Mutex::new(Vec::new()), totals: Mutex::default() };
    let start = Instant::now();
    let stopped = pool.install(|| passes(&shared, &mut tiles));
    let seconds = start.elapsed().as_secs_f64();
    let totals = shared.totals.into_inner().unwrap_or_else(PoisonError::into_inner);
    let picture = develop(&tiles, plan.cell, (options.width, options.height));
    let cost = plan.features.has(Features::COST).then(|| picture.beauty.iter().map(|p| p[0]).collect());
    Ok(Outcome { picture, cost, stats: statistics(&tiles, plan, totals, seconds), stopped })
}

/// What all workers of a render see.
struct Shared<'a> {
    context: &'a Context<'a>,
    plan: &'a Plan,
    observer: &'a dyn Observer,
    /// Waves that no worker is using.
    waves: Mutex<Vec<Wave>>,
    totals: Mutex<Totals>,
}

/// Rays and times of all workers.
#[derive(Clone, Copy, Debug, Default)]
struct Totals {
    samples: u64,
    rays: RayCounts,
    stages: [StageTotals; stages::ALL.len()],
}

#[derive(Clone, Copy, Debug, Default)]
struct StageTotals {
    calls: u64,
    rows: u64,
    seconds: f64,
}

impl Totals {
    /// Runs `batch` as stage number `stage` over `rows` rows.
    fn time<R>(&mut self, stage: usize, rows: usize, batch: impl FnOnce() -> R) -> R {
        let start = Instant::now();
        let result = batch();
        let total = &mut self.stages[stage];
        total.calls += 1;
        total.rows += rows as u64;
        total.seconds += start.elapsed().as_secs_f64();
        result
    }

    fn add(&mut self, other: &Totals) {
        self.samples += other.samples;
        self.rays.camera += other.rays.camera;
        self.rays.bounce += other.rays.bounce;
        self.rays.shadow += other.rays.shadow;
        for (a, b) in self.stages.iter_mut().zip(&other.stages) {
            a.calls += b.calls;
            a.rows += b.rows;
            a.seconds += b.seconds;
        }
    }
}

/// Passes over the frame until no pixel wants more samples; `true` if stopped before.
fn passes(shared: &Shared, tiles: &mut [Tile]) -> bool {
    let options = &shared.plan.options;
    let mut first = 0;
    while first < options.samples {
        let step = options.adaptive.map_or(first.clamp(1, PASS), |a| a.batch).min(options.samples - first);
        let active: u64 = tiles.iter().map(|t| t.active.len() as u64).sum();
        if active == 0 {
            return false;
        }
        let done = lock(&shared.totals).samples;
        let total = done + active * u64::from(options.samples - first);
        let work = groups(tiles, group_rows(shared.plan, active * u64::from(step)), step);
        work.into_par_iter().for_each(|group| run_group(shared, group, first, step, total));
        first += step;
        if shared.observer.stop() {
            return first < options.samples;
        }
    }
    false
}

/// Rows a worker takes at a time: a few waves, so that the last, partly filled one weighs little, but enough groups that all
/// workers end at about the same time.
fn group_rows(plan: &Plan, rows: u64) -> u64 {
    let wave = plan.wave as u64;
    (rows / (8 * plan.threads as u64)).clamp(wave, 4 * wave)
}

/// Cuts the tiles into groups with about `rows` rows each, in order.
fn groups(mut tiles: &mut [Tile], rows: u64, samples: u32) -> Vec<&mut [Tile]> {
    let mut groups = Vec::new();
    while !tiles.is_empty() {
        let mut in_group = 0;
        let mut count = 0;
        while count < tiles.len() && in_group < rows {
            in_group += tiles[count].active.len() as u64 * u64::from(samples);
            count += 1;
        }
        let (group, rest) = tiles.split_at_mut(count);
        groups.push(group);
        tiles = rest;
    }
    groups
}

/// Gives every active pixel of `group` the samples `first..first + step`, wave after wave.
fn run_group(shared: &Shared, group: &mut [Tile], first: u32, step: u32, total: u64) {
    let plan = shared.plan;
    let mut wave = lock(&shared.waves)
        .pop()
        .unwrap_or_else(|| Wave::allocate(plan.wave, shared.context.transport.shadow_samples, plan.features));
    let spans = spans_of(group, plan.options.width, first, step);
    let mut rest = spans.as_slice();
    let mut cut = None;
    while !rest.is_empty() || cut.is_some() {
        if shared.observer.stop() {
            break;
        }
        let batch = next_batch(&mut rest, &mut cut, wave.rows as u32);
        let mut totals = Totals::default();
        run_wave(shared, &mut wave, &batch, group, &mut totals);
        let mut all = lock(&shared.totals);
        all.add(&totals);
        let done = all.samples;
        drop(all);
        shared.observer.samples(done, total);
    }
    if let Some(rule) = &plan.options.adaptive {
        group.iter_mut().for_each(|tile| tile.retire(rule));
    }
    lock(&shared.waves).push(wave);
}

fn spans_of(group: &[Tile], width: u32, first: u32, step: u32) -> Vec<Span> {
    let tiles = group.iter().enumerate();
    tiles
        .flat_map(|(t, tile)| tile.active.iter().map(move |&local| (t, tile, local)))
        .map(|(t, tile, local)| {
            let (x, y) = (tile.x[local as usize], tile.y[local as usize]);
            Span { x, y, pixel: y * width + x, first, count: step, tile: t as u32, local }
        })
        .collect()
}

/// Takes spans of `rows` rows in all off the front of `rest`; a span that does not fit is cut, its remainder kept in `cut`.
fn next_batch(rest: &mut &[Span], cut: &mut Option<Span>, mut rows: u32) -> Vec<Span> {
    let mut batch = Vec::new();
    while rows > 0 {
        let Some(span) = cut.take().or_else(|| rest.split_off_first().copied()) else { break };
        let count = span.count.min(rows);
        batch.push(Span { count, ..span });
        rows -= count;
        if count < span.count {
            *cut = Some(Span { first: span.first + count, count: span.count - count, ..span });
        }
    }
    batch
}

/// One wave: the six stages, from spans of pixels to samples in the film.
fn run_wave(shared: &Shared, wave: &mut Wave, spans: &[Span], tiles: &mut [Tile], totals: &mut Totals) {
    const GENERATE: usize = 0;
    const TRAVERSE: usize = 1;
    const SHADE: usize = 2;
    const SHADOW: usize = 3;
    const ROULETTE: usize = 4;
    const RETIRE: usize = 5;
    let (context, observer) = (shared.context, shared.observer);
    let Wave { samples, paths, next, hits, shadows, shadow_hits, scratch, .. } = wave;
    let asked = spans.iter().map(|s| s.count as usize).sum();
    let mut live = totals
        .time(GENERATE, asked, || stages::generate::run(context, spans, stages::generate::Out { samples, paths }));
    let rows = live;
    totals.rays.camera += rows as u64;
    if context.features.has(Features::COST) {
        totals.time(TRAVERSE, rows, || stages::traverse::count(context, rows, paths, samples, scratch));
        live = 0;
    }
    let mut depth = 0;
    // What the shadow stage asks: hemisphere rays want to know what they hit.
    let asks = if context.features.has(Features::HEMISPHERE) { Query::Closest } else { Query::Any };
    while live > 0 {
        observer.queue(Query::Closest, depth, paths.rays(live));
        totals.time(TRAVERSE, live, || stages::traverse::run(context, depth, live, paths, hits));
        scratch.reset();
        let shaded = totals.time(SHADE, live, || {
            let out = stages::shade::Out { samples, shadows, next };
            stages::shade::run(context, depth, live, stages::shade::In { paths, hits }, out, scratch)
        });
        if shaded.shadows > 0 {
            scratch.reset();
            totals.rays.shadow += shaded.shadows as u64;
            observer.queue(asks, depth, shadows.rays(shaded.shadows));
            totals.time(SHADOW, shaded.shadows, || {
                let out = stages::shadow::Out { samples, hits: shadow_hits };
                stages::shadow::run(context, shaded.shadows, shadows, out, scratch);
            });
        }
        live = 0;
        if shaded.next > 0 {
            scratch.reset();
            live = totals.time(ROULETTE, shaded.next, || {
                stages::roulette::run(context, depth, shaded.next, next, paths, scratch)
            });
        }
        totals.rays.bounce += live as u64;
        depth += 1;
    }
    totals.time(RETIRE, rows, || stages::retire::run(spans, samples, tiles));
    scratch.reset();
    totals.samples += rows as u64;
}

/// A lock that a panic elsewhere has not made useless: the panic itself ends the render.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn statistics(tiles: &[Tile], plan: &Plan, totals: Totals, seconds: f64) -> RenderStats {
    let counts = || tiles.iter().flat_map(|t| t.count.iter().copied());
    let pixels = u64::from(plan.cell.width) * u64::from(plan.cell.height);
    let held: u64 = counts().map(u64::from).sum();
    let cost = |(stage, total): (&&Stage, &StageTotals)| StageCost {
        name: stage.name,
        calls: total.calls,
        rows: total.rows,
        seconds: total.seconds,
    };
    RenderStats {
        rays: totals.rays,
        stages: stages::ALL.iter().zip(&totals.stages).filter(|(_, t)| t.calls > 0).map(cost).collect(),
        seconds,
        threads: plan.threads,
        wave: plan.wave,
        simd: plan.simd,
        samples: totals.samples,
        samples_per_pixel: (counts().min().unwrap_or(0), held as f64 / pixels as f64, counts().max().unwrap_or(0)),
        converged_pixels: tiles.iter().map(|t| u64::from(t.converged)).sum(),
        pixels,
        non_finite_samples: tiles.iter().map(|t| t.non_finite).sum(),
        first_non_finite: tiles.iter().find_map(|t| t.first_non_finite),
    }
}
