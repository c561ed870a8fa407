//! Runs a plan: workers, waves, tiles, progress, cancellation. The only file that knows all stages.

mod statistics;

use crate::bvh::{Accel, Query};
use crate::error::{Error, Result};
use crate::film::develop::develop;
use crate::film::picture::Picture;
use crate::film::{self, tile::Tile};
use crate::light::in_view::InView;
use crate::measure::lanes::Lanes;
pub use crate::observer::{Observer, Unobserved};
use crate::observer::{Part, Queue, Slice, Work};
use crate::pilot;
use crate::plan::Plan;
use crate::sampling::sampler::Sampler;
use crate::scene::Scene;
use crate::scene::camera::Camera;
use crate::simd::Tier;
use crate::stages::number::{GENERATE, LAMPS, RETIRE, REUSE, ROULETTE, SHADE, SHADOW, TRAVERSE};
use crate::stages::{self, Context};
use crate::transport::Transport;
use crate::wave::Wave;
use crate::wave::features::Features;
use crate::wave::span::Span;
use rayon::prelude::*;
use statistics::Totals;
pub use statistics::{RayCounts, RenderStats, StageCost};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

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
    let start = Instant::now();
    let options = &plan.options;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(plan.threads).build();
    let pool = pool.map_err(|e| Error::Options(format!("cannot start {} threads: {e}", plan.threads)))?;
    let worth = pool.install(|| pilot::measure(scene, accel, camera, options));
    let lens = camera.lens(options.width, options.height);
    let in_view = match plan.features.has(Features::LAMPS) {
        true => InView::new(scene, &lens, [options.width, options.height]),
        false => InView::default(),
    };
    let context = Context {
        scene,
        accel,
        lens,
        width: options.width,
        in_view,
        lamp_rays: options.lamp_rays,
        transport: Transport { worth, ..plan.transport.clone() },
        features: plan.features,
        sampler: Sampler::new(options),
        tier: Tier::detect(options.simd)?,
        counts: observer.counts(),
    };
    let mut tiles = film::tile::tiles(plan.cell, plan.film);
    let shared = Shared { context: &context, plan, observer, waves: Mutex::new(Vec::new()), totals: Mutex::default() };
    observer.ended(&Slice::plain(Part::Start, start));
    let start = Instant::now();
    let stopped = pool.install(|| passes(&shared, &mut tiles));
    let seconds = start.elapsed().as_secs_f64();
    let totals = shared.totals.into_inner().unwrap_or_else(PoisonError::into_inner);
    let start = Instant::now();
    drop(pool);
    let picture = develop(&tiles, plan.cell, (options.width, options.height));
    observer.ended(&Slice::plain(Part::Develop, start));
    let cost = plan.features.has(Features::COST).then(|| picture.beauty.iter().map(|p| p[0]).collect());
    Ok(Outcome { picture, cost, stats: totals.statistics(&tiles, plan, seconds), stopped })
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

/// Passes over the frame until no pixel wants more samples; `true` if stopped before.
fn passes(shared: &Shared, tiles: &mut [Tile]) -> bool {
    let options = &shared.plan.options;
    let mut first = 0;
    while first < options.samples {
        let step = options.adaptive.map_or(first.clamp(1, PASS), |a| a.step(first)).min(options.samples - first);
        let active: u64 = tiles.iter().map(|t| t.active.len() as u64).sum();
        if active == 0 {
            return false;
        }
        let done = lock(&shared.totals).samples;
        let total = done + active * u64::from(options.samples - first);
        let start = Instant::now();
        let work = groups(tiles, group_rows(shared.plan, active * u64::from(step)), step);
        work.into_par_iter().for_each(|group| run_group(shared, group, first, step, total));
        shared.observer.ended(&Slice::plain(Part::Pass, start));
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
    let start = Instant::now();
    let plan = shared.plan;
    let mut wave = lock(&shared.waves)
        .pop()
        .unwrap_or_else(|| Wave::allocate(plan.wave, shared.context.transport.shadow_samples, plan.features));
    let mut spans = spans_of(group, plan.options.width, first, step);
    let mut rest = spans.as_mut_slice();
    let whole_tiles = plan.features.has(Features::REUSE);
    while !rest.is_empty() {
        if shared.observer.stop() {
            break;
        }
        let batch = next_batch(&mut rest, wave.rows as u32, whole_tiles);
        let mut run = Run { observer: shared.observer, totals: Totals::default() };
        run_wave(shared.context, &mut wave, &batch, group, &mut run);
        let mut all = lock(&shared.totals);
        all.add(&run.totals);
        let done = all.samples;
        drop(all);
        shared.observer.samples(done, total);
    }
    if let Some(rule) = &plan.options.adaptive {
        group.iter_mut().for_each(|tile| tile.retire(rule));
    }
    lock(&shared.waves).push(wave);
    shared.observer.ended(&Slice::plain(Part::Group, start));
}

fn spans_of(group: &[Tile], width: u32, first: u32, step: u32) -> Vec<Span> {
    let tiles = group.iter().enumerate();
    tiles
        .flat_map(|(t, tile)| tile.active.iter().map(move |&local| (t, tile, local)))
        .map(|(t, tile, local)| {
            let (x, y) = (tile.x[local as usize], tile.y[local as usize]);
            let (first, stride, count) = tile.wanted(local as usize, first, step);
            Span { x, y, pixel: y * width + x, first, stride, count, tile: t as u32, local }
        })
        .collect()
}

/// Takes spans of up to `rows` rows in all off the front of `rest`; what does not fit is cut. With `whole_tiles`, the spans of a tile,
/// which are all of the same samples, stay together: they are cut between samples.
fn next_batch(rest: &mut &mut [Span], mut rows: u32, whole_tiles: bool) -> Vec<Span> {
    let mut batch = Vec::new();
    while let Some(&Span { tile, count: wanted, .. }) = rest.first() {
        let together = if whole_tiles { rest.iter().take_while(|span| span.tile == tile).count() } else { 1 };
        let count = wanted.min(rows / together as u32);
        if count == 0 {
            break;
        }
        rows -= count * together as u32;
        let cut = rest[..together].iter_mut();
        batch.extend(cut.map(|span| span.split_off_front(count)));
        if count == wanted {
            *rest = &mut std::mem::take(rest)[together..];
        }
    }
    batch
}

/// A wave's way through the stages: who watches, and what it has cost.
struct Run<'a> {
    observer: &'a dyn Observer,
    totals: Totals,
}

impl Run<'_> {
    /// Runs `batch` as stage number `stage` at vertex `depth`.
    fn stage(&mut self, stage: usize, depth: u32, batch: impl FnOnce() -> Work) -> Work {
        let part = Part::Stage { stage, depth };
        let start = Instant::now();
        self.observer.began(part);
        let work = batch();
        let end = Instant::now();
        self.totals.stages[stage].add(work.rows, end - start);
        self.observer.ended(&Slice { part, start, end, work });
        work
    }
}

/// One wave: the stages, from spans of pixels to samples in the film.
fn run_wave(context: &Context, wave: &mut Wave, spans: &[Span], tiles: &mut [Tile], run: &mut Run) {
    let Wave { samples, paths, next, hits, shadows, shadow_hits, vertices, scratch, .. } = wave;
    let observer = run.observer;
    let generated = run.stage(GENERATE, 0, || {
        let rows = stages::generate::run(context, spans, stages::generate::Out { samples, paths });
        Work { rows, produced: rows, lanes: Lanes::over(rows, stages::generate::ROWS), ..Work::default() }
    });
    let rows = generated.produced;
    let mut live = rows;
    run.totals.rays.camera += rows as u64;
    if context.features.has(Features::LAMPS) {
        scratch.reset();
        let work = run.stage(LAMPS, 0, || {
            let (produced, counts) = stages::lamps::run(context, rows, samples, scratch);
            Work { rows, produced, counts, ..Work::default() }
        });
        run.totals.rays.camera += work.produced as u64;
    }
    if context.features.has(Features::COST) {
        run.stage(TRAVERSE, 0, || {
            stages::traverse::count(context, rows, paths, samples, scratch);
            Work { rows, ..Work::default() }
        });
        live = 0;
    }
    let mut depth = 0;
    // What the shadow stage asks: hemisphere rays want to know what they hit.
    let asks = if context.features.has(Features::HEMISPHERE) { Query::Closest } else { Query::Any };
    while live > 0 {
        let (rays, slots) = (paths.rays(live), &paths.slot[..live]);
        observer.queue(&Queue { query: Query::Closest, shadow: false, depth, rays, slots, pixels: &samples.pixel });
        run.stage(TRAVERSE, depth, || {
            let counts = stages::traverse::run(context, depth, live, paths, hits);
            Work { rows: live, produced: live, counts, ..Work::default() }
        });
        scratch.reset();
        let mut shaded = stages::shade::Counts::default();
        run.stage(SHADE, depth, || {
            let out = stages::shade::Out { samples, shadows, next, vertices };
            shaded = stages::shade::run(context, depth, live, stages::shade::In { paths, hits }, out, scratch);
            let lanes = Lanes::over(shaded.scattering, stages::shade::ROWS);
            Work { rows: live, produced: shaded.next, lanes, ..Work::default() }
        });
        if shaded.shadows > 0 {
            scratch.reset();
            run.totals.rays.shadow += shaded.shadows as u64;
            let (rays, slots) = (shadows.rays(shaded.shadows), &shadows.slot[..shaded.shadows]);
            observer.queue(&Queue { query: asks, shadow: true, depth, rays, slots, pixels: &samples.pixel });
            run.stage(SHADOW, depth, || {
                let out = stages::shadow::Out { samples, hits: shadow_hits };
                let counts = stages::shadow::run(context, depth, shaded.shadows, shadows, out, scratch);
                Work { rows: shaded.shadows, counts, ..Work::default() }
            });
        }
        live = 0;
        if shaded.next > 0 {
            scratch.reset();
            let work = run.stage(ROULETTE, depth, || {
                let input = stages::roulette::In { next, samples };
                let produced = stages::roulette::run(context, depth, shaded.next, input, paths, scratch);
                Work { rows: shaded.next, produced, ..Work::default() }
            });
            live = work.produced;
        }
        run.totals.rays.bounce += live as u64;
        depth += 1;
    }
    if context.features.has(Features::REUSE) {
        scratch.reset();
        let work = run.stage(REUSE, 0, || {
            let out = stages::reuse::Out { samples, vertices };
            let (produced, counts) = stages::reuse::run(context, spans, out, scratch);
            Work { rows, produced, counts, ..Work::default() }
        });
        run.totals.rays.shadow += work.produced as u64;
    }
    run.stage(RETIRE, 0, || {
        stages::retire::run(spans, samples, tiles);
        Work { rows, ..Work::default() }
    });
    scratch.reset();
    run.totals.samples += rows as u64;
}

/// A lock that a panic elsewhere has not made useless: the panic itself ends the render.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
