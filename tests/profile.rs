//! What a profile says is so: counts are exact, times are where they were spent, and sums are whole.

use comber::bench::end_to_end::Subject;
use comber::bench::interleave::Effort;
use comber::bvh::Accel;
use comber::observer::{Observer, Part, Unobserved};
use comber::options::{Direct, RenderOptions};
use comber::plan::Plan;
use comber::profile::ledger::Ledger;
use comber::profile::measure::{Measured, Wants, measure};
use comber::profile::recorder::{Keep, Recorder};
use comber::profile::stage_table::StageTable;
use comber::scene::camera::Camera;
use comber::scene::stage::{Stage, UpAxis, place};
use comber::scene::{Scene, SceneOptions, procedural};
use comber::{drive, reference, stages};
use std::time::{Duration, Instant};

struct Ready {
    scene: Scene,
    accel: Accel,
    camera: Camera,
}

fn ready(spec: &str) -> Ready {
    let staged = place(procedural::generate(spec).unwrap(), Stage::Cornell, UpAxis::Y).unwrap();
    let scene = Scene::build(staged.description, SceneOptions::default()).unwrap();
    let accel = Accel::build(&scene.shapes, &RenderOptions::default().accel).unwrap();
    Ready { scene, accel, camera: staged.camera }
}

fn options(threads: u32) -> RenderOptions {
    RenderOptions { width: 48, height: 40, samples: 8, threads: Some(threads), wave: Some(512), ..Default::default() }
}

const ALL: Wants = Wants { control: true, curve: false, timeline: true, counters: false, pixels: true };

fn profile(ready: &Ready, options: &RenderOptions, observer: &dyn Observer) -> (Plan, Measured) {
    let subject = Subject { scene: &ready.scene, accel: &ready.accel, camera: &ready.camera, options };
    let effort = Effort { rounds: 2, time: Duration::MAX, turn: Duration::ZERO };
    let plan = Plan::new(&ready.scene, &ready.accel, options).unwrap();
    (plan, measure(&subject, ALL, effort, observer, |_, _| ()).unwrap())
}

fn stage(name: &str) -> usize {
    stages::ALL.iter().position(|stage| stage.name == name).unwrap()
}

/// The reference integrator counts its rays by itself.
#[test]
fn rows_are_the_rays_that_the_reference_traces() {
    let ready = ready("proc:torus,tris=2k");
    for direct in [Direct::Mis, Direct::Light, Direct::Hemisphere, Direct::Bsdf] {
        let options = RenderOptions { direct, ..options(2) };
        let (plan, measured) = profile(&ready, &options, &Unobserved);
        let rays = reference::render(&ready.scene, &ready.accel, &ready.camera, &options).unwrap().rays;
        for ledger in [&measured.counted, &measured.median().ledger] {
            let [traverse, shadow, generate] = ["traverse", "shadow", "generate"].map(|name| ledger.stage(stage(name)));
            assert_eq!(generate.rows, rays.camera);
            assert_eq!(ledger.stages[stage("traverse")][0].rows, rays.camera);
            assert_eq!(traverse.rows - rays.camera, rays.bounce);
            assert_eq!(shadow.rows, rays.shadow);
            assert_eq!(traverse.counts.rays + shadow.counts.rays, rays.all());
        }
        // The same rays again, one at a time, pixel by pixel.
        let pixels = measured.pixels.as_ref().unwrap();
        let samples: f32 = pixels.samples.iter().sum();
        assert_eq!(samples as u64, rays.camera);
        let bounces: f64 = pixels.bounces.iter().map(|&b| f64::from(b)).sum::<f64>() * 8.0;
        assert!((bounces - rays.bounce as f64).abs() < 0.5, "{bounces} {}", rays.bounce);

        let table = StageTable::new(&plan, &measured);
        for row in table.stages.iter().chain(&table.bounces) {
            for each in &row.lanes {
                assert!(each.lanes.active <= each.lanes.total, "{row:?}");
                assert!(each.lanes.active > 0 && each.lanes.reached > 0 && each.lanes.total >= each.lanes.reached);
            }
            assert!(row.occupancy > 0.0 && row.occupancy <= 1.0, "{row:?}");
        }
    }
}

/// Counting, recording and drawing timelines leave the picture as it is.
#[test]
fn the_picture_does_not_know_that_it_is_watched() {
    let ready = ready("proc:cubes,tris=200");
    let options = options(2);
    let (_, measured) = profile(&ready, &options, &Unobserved);
    let subject = Subject { scene: &ready.scene, accel: &ready.accel, camera: &ready.camera, options: &options };
    assert!(measured.outcome.picture.same_bits(&subject.by_waves().unwrap().0));
}

/// Each part is noted once: stages within groups within passes, and all of a pixel's time within stages.
#[test]
fn parts_sum_to_the_whole() {
    let ready = ready("proc:torus,tris=2k");
    for threads in [1, 2] {
        let (plan, measured) = profile(&ready, &options(threads), &Unobserved);
        let ledger = &measured.median().ledger;
        assert!(ledger.stage_nanos() <= ledger.groups.nanos);
        assert!(ledger.groups.nanos <= ledger.passes.nanos * u64::from(threads));
        let whole = ledger.start.nanos + ledger.passes.nanos + ledger.develop.nanos;
        assert!(whole <= measured.median().wall);

        let table = StageTable::new(&plan, &measured);
        let shares: f64 = table.stages.iter().map(|row| row.share).sum::<f64>()
            + table.outside.iter().map(|outside| outside.share).sum::<f64>();
        assert!((shares + table.unaccounted - 1.0).abs() < 1e-9);
        let bounces: f64 = table.bounces.iter().map(|row| row.seconds).sum();
        assert!((bounces - table.stages.iter().map(|row| row.seconds).sum::<f64>()).abs() < 1e-9);

        assert_eq!(table.workers.len(), threads as usize);
        let by_worker: f64 = table.workers.iter().flat_map(|worker| &worker.stages).map(|stage| stage.seconds).sum();
        assert!((by_worker - bounces).abs() < 1e-9);

        let pixels: f64 = measured.pixels.as_ref().unwrap().time.iter().map(|&micros| f64::from(micros)).sum();
        let stages = ledger.stage_nanos() as f64 * 1e-3;
        assert!((pixels / stages - 1.0).abs() < 1e-3, "{pixels} {stages}");

        let timeline = measured.timeline.as_ref().unwrap();
        assert_eq!(timeline.tracks.len(), threads as usize + 1);
        for track in &timeline.tracks {
            // On one thread, a part lies within another or beside it.
            for (i, a) in track.iter().enumerate().filter(|(_, a)| matches!(a.part, Part::Stage { .. })) {
                for b in track[i + 1..].iter().take(50) {
                    let (a_end, b_end) = (a.start + a.nanos, b.start + b.nanos);
                    assert!(a_end <= b.start || (b.start <= a.start && a_end <= b_end), "{a:?} {b:?}");
                }
            }
        }
    }
}

/// Slows one stage at one depth: the hook runs within the stage's time.
struct Slow {
    part: Part,
    by: Duration,
}

impl Observer for Slow {
    fn began(&self, part: Part) {
        let start = Instant::now();
        while part == self.part && start.elapsed() < self.by {
            std::hint::spin_loop();
        }
    }
}

#[test]
fn a_slow_stage_shows_in_its_own_row_and_nowhere_else() {
    let ready = ready("proc:cubes,tris=200");
    let options = options(1);
    let plan = Plan::new(&ready.scene, &ready.accel, &options).unwrap();
    let ledger = |observer: &dyn Observer| {
        let recorder = Recorder::new(plan.threads, Keep::default(), observer);
        drive::render(&ready.scene, &ready.accel, &ready.camera, &plan, &recorder).unwrap();
        Ledger::sum(&recorder.finish().0)
    };
    for (name, depth) in [("shade", 1), ("traverse", 2), ("retire", 0), ("roulette", 1)] {
        let part = Part::Stage { stage: stage(name), depth };
        let by = Duration::from_millis(20);
        // What the machine does besides can only add: the least of three is closest to the truth.
        let nanos = |observer: &dyn Observer| {
            let ledgers = [ledger(observer), ledger(observer), ledger(observer)];
            let calls = ledgers[0].stages[stage(name)][depth as usize].calls;
            let least = |stage: usize, depth: usize| {
                ledgers.iter().map(|l| l.stages[stage].get(depth).map_or(0, |entry| entry.nanos)).min().unwrap()
            };
            let own = least(stage(name), depth as usize);
            let others: u64 =
                (0..stages::ALL.len()).flat_map(|s| (0..6).map(move |d| (s, d))).map(|(s, d)| least(s, d)).sum();
            (calls, own, others - own)
        };
        let (calls, before, others_before) = nanos(&Unobserved);
        let (_, after, others_after) = nanos(&Slow { part, by });
        let added = calls * by.as_nanos() as u64;
        // The hook spins for no less; how much longer the machine decides, which is not tested. Of the delay, which is far
        // longer than all the render, nothing may be in other rows.
        assert!(after >= added, "{name}: {after} after {before}, {added} added");
        assert!(others_after < others_before + added / 2, "{name}: others {others_before} → {others_after}");
    }
}
