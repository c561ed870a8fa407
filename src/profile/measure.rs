//! The renders that a profile is made of, in turns.

use super::ledger::Ledger;
use super::pixel_cost::{PixelCost, PixelCounter};
use super::recorder::{Keep, Recorder};
use super::timeline::Timeline;
use crate::bench::end_to_end::Subject;
use crate::bench::interleave::{Effort, Summary, Turn, Turns, interleave};
use crate::bench::probe::Probe;
use crate::bench::statistics::Quartiles;
use crate::drive::{self, Outcome};
use crate::error::Result;
use crate::observer::Observer;
use crate::options::RenderOptions;
use crate::plan::Plan;
use crate::stages;
use serde::Serialize;
use std::time::Instant;

/// What a profile should have besides the table.
#[derive(Clone, Copy, Debug)]
pub struct Wants {
    /// Renders of the depth-first reference, in turns with those by waves.
    pub control: bool,
    /// Renders with waves of other sizes.
    pub curve: bool,
    /// Another render, of which every part is kept.
    pub timeline: bool,
    /// What the processor counts; only if it can be asked.
    pub counters: bool,
    /// Maps of what pixels cost: all rays once more, one after another.
    pub pixels: bool,
}

/// A timed render.
#[derive(Clone, Debug)]
pub struct Timed {
    /// What its parts took.
    pub ledger: Ledger,
    /// The same by worker, the last being the calling thread.
    pub workers: Vec<Ledger>,
    /// Wall time in nanoseconds, of [`drive::render`] as its caller sees it.
    pub wall: u64,
}

/// All that was measured.
pub struct Measured {
    /// What the render that counts did: rows, and what they visited.
    pub counted: Ledger,
    /// Its maps, where they were wanted.
    pub pixels: Option<PixelCost>,
    /// What it came to.
    pub outcome: Outcome,
    /// The timed ones, in order.
    pub renders: Vec<Timed>,
    /// Samples of those, and after them of the control, as rays a second.
    pub turns: Turns,
    /// Where the timeline was wanted.
    pub timeline: Option<Timeline>,
    /// Where the curve was wanted.
    pub curve: Vec<CurvePoint>,
}

/// A wave size, and how fast it is.
#[derive(Clone, Debug, Serialize)]
pub struct CurvePoint {
    /// Rows a wave.
    pub rows: u32,
    /// Columns of one worker, in bytes.
    pub bytes: u64,
    /// Rays a second.
    pub rate: Summary,
}

impl Measured {
    /// The timed render of median wall time: the one whose parts the table shows, as parts of different
    /// renders would not add up.
    pub fn median(&self) -> &Timed {
        median(&self.renders)
    }

    /// Rows a second of thread time of each stage at each bounce, as `stage/bounce`, over the timed renders.
    pub fn rates(&self) -> Vec<(String, Summary)> {
        let disturbed: Vec<bool> = self.turns.disturbed(0);
        let mut rates = Vec::new();
        for (stage, depths) in self.median().ledger.stages.iter().enumerate() {
            for depth in (0..depths.len()).filter(|&depth| depths[depth].rows > 0) {
                let of = |timed: &Timed| {
                    let entry = timed.ledger.stages[stage][depth];
                    entry.rows as f64 / (entry.nanos.max(1) as f64 * 1e-9)
                };
                let samples = self.renders.iter().map(of).zip(disturbed.iter().copied());
                rates.push((format!("{}/{depth}", stages::ALL[stage].name), Summary::of(samples)));
            }
        }
        rates
    }

    /// Quartiles over the timed renders.
    pub fn quartiles(&self, value: impl Fn(&Timed) -> f64) -> Quartiles {
        Quartiles::of(self.renders.iter().map(value))
    }
}

/// Measures `subject`. `observer` sees every render by waves; `step(done, of)` is called before each render.
///
/// # Errors
/// Those of rendering; pictures or rays of the control that are not the same to the bit.
pub fn measure(
    subject: &Subject,
    wants: Wants,
    effort: Effort,
    observer: &dyn Observer,
    mut step: impl FnMut(usize, usize),
) -> Result<Measured> {
    let plan = Plan::new(subject.scene, subject.accel, subject.options)?;
    let contestants = 1 + usize::from(wants.control);
    let renders = 1 + contestants * effort.rounds + usize::from(wants.timeline);
    let mut done = 0;
    let mut next = || {
        step(done, renders);
        done += 1;
    };
    next();
    let counter = wants.pixels.then(|| PixelCounter::new(subject.accel, &plan, observer));
    let counting: &dyn Observer = counter.as_ref().map_or(observer, |counter| counter);
    let (outcome, counted, _) = record(subject, &plan, Keep { visits: true, ..Keep::default() }, counting)?;

    let keep = Keep { counters: wants.counters, ..Keep::default() };
    let (mut timed, mut failure) = (Vec::new(), None);
    let count = outcome.stats.rays.all();
    let mut probe = Probe::new();
    let turns = interleave(contestants, plan.threads, effort, &mut probe, |way| {
        next();
        let start = Instant::now();
        let result = if way == 0 {
            record(subject, &plan, keep, observer).map(|(_, workers, _)| {
                let wall = start.elapsed().as_nanos() as u64;
                timed.push(Timed { ledger: Ledger::sum(&workers), workers, wall });
            })
        } else {
            subject.check_depth_first(&outcome.picture, outcome.stats.rays)
        };
        failure = failure.take().or(result.err());
        Turn { rate: count as f64 / start.elapsed().as_secs_f64(), waited: 0.0 }
    });
    if let Some(failure) = failure {
        return Err(failure);
    }
    let timeline = match wants.timeline {
        true => {
            next();
            Some(record(subject, &plan, Keep { marks: true, ..Keep::default() }, observer)?.2)
        }
        false => None,
    };
    let pixels = counter.map(|counter| counter.maps(&median(&timed).ledger));
    let curve = match wants.curve {
        true => wave_curve(subject, &plan, median(&timed).wall, &mut probe, observer)?,
        false => Vec::new(),
    };
    let counted = Ledger::sum(&counted);
    Ok(Measured { counted, pixels, outcome, renders: timed, turns, timeline, curve })
}

/// Renders by waves and notes what they do.
fn record(
    subject: &Subject,
    plan: &Plan,
    keep: Keep,
    observer: &dyn Observer,
) -> Result<(Outcome, Vec<Ledger>, Timeline)> {
    let recorder = Recorder::new(plan.threads, keep, observer);
    let outcome = drive::render(subject.scene, subject.accel, subject.camera, plan, &recorder)?;
    let (workers, timeline) = recorder.finish();
    Ok((outcome, workers, timeline))
}

/// Rows of the curve's waves.
const CURVE: [u32; 7] = [256, 1024, 4096, 8192, 16384, 65536, 262_144];
/// Seconds that a render of the curve may take, about.
const CURVE_SECONDS: f64 = 0.4;

fn wave_curve(
    subject: &Subject,
    plan: &Plan,
    wall: u64,
    probe: &mut Probe,
    observer: &dyn Observer,
) -> Result<Vec<CurvePoint>> {
    // Fewer samples a pixel make a shorter render with queues that are as long.
    let share = CURVE_SECONDS / (wall as f64 * 1e-9);
    let samples = ((f64::from(subject.options.samples) * share) as u32).clamp(1, subject.options.samples);
    let options = |rows| RenderOptions { wave: Some(rows), samples, adaptive: None, ..subject.options.clone() };
    let bytes = |rows: u32| u64::from(rows) * plan.bytes_per_path as u64;
    let effort = Effort { rounds: 3, time: std::time::Duration::ZERO, turn: std::time::Duration::ZERO };
    let mut failure = None;
    let turns = interleave(CURVE.len(), plan.threads, effort, probe, |at| {
        let start = Instant::now();
        let rays = Plan::new(subject.scene, subject.accel, &options(CURVE[at]))
            .and_then(|plan| drive::render(subject.scene, subject.accel, subject.camera, &plan, observer))
            .map(|outcome| outcome.stats.rays.all());
        let rate = *rays.as_ref().unwrap_or(&0) as f64 / start.elapsed().as_secs_f64();
        failure = failure.take().or(rays.err());
        Turn { rate, waited: 0.0 }
    });
    match failure {
        Some(failure) => Err(failure),
        None => Ok(CURVE
            .iter()
            .enumerate()
            .map(|(at, &rows)| CurvePoint { rows, bytes: bytes(rows), rate: turns.summary(at) })
            .collect()),
    }
}

fn median(timed: &[Timed]) -> &Timed {
    let mut by_wall: Vec<&Timed> = timed.iter().collect();
    by_wall.sort_by_key(|timed| timed.wall);
    by_wall[(by_wall.len() - 1) / 2]
}
