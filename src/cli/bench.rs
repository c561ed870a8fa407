//! `comber bench`.

use super::args::{BenchArgs, Peer, Qualities, Robust};
use super::exit::{Done, complain};
use super::load::{self, Loaded, print_notes};
use super::render::use_threads;
use super::report;
use super::resolve::{scene_at, view};
use crate::bench::agreement::{self, Comparison};
use crate::bench::interleave::{Effort, Summary, interleave};
use crate::bench::kernels::Kernel;
use crate::bench::peers::Contestant;
use crate::bench::probe::Probe;
use crate::bench::rays::RaySet;
use crate::bench::sets::{self, Source};
use crate::bvh::Traversal;
use crate::error::{Error, Result};
use crate::measure::units;
use crate::options::{AccelOptions, RenderOptions};
use crate::peer::embree::library::{self, Device};
use crate::peer::embree::modes::Mode;
use crate::peer::embree::scene::{Quality, Tree};
use crate::plan::Plan;
use crate::simd::Tier;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// Measures what `args` ask for.
pub fn run(args: BenchArgs) -> anyhow::Result<Done> {
    let mut notes = Vec::new();
    let (view, _) = view(&args.camera, &mut notes)?;
    print_notes(&notes, args.report);
    let unknown = args.rays.sets.iter().find(|name| !sets::NAMES.contains(&name.as_str()));
    if let Some(name) = unknown {
        return Err(Error::Options(format!("--sets: there is no set '{name}', but {}", sets::NAMES.join(", "))).into());
    }
    let most = args.effort.threads.iter().copied().max();
    use_threads(most)?;
    let devices = devices(&args)?;
    let options = RenderOptions {
        width: args.rays.size[0],
        height: args.rays.size[1],
        accel: AccelOptions::of(args.effort.accel),
        wave: args.rays.wave,
        threads: most,
        simd: args.effort.simd,
        ..RenderOptions::default()
    };
    let scenes: Vec<Option<PathBuf>> =
        if args.scenes.is_empty() { vec![None] } else { args.scenes.iter().cloned().map(Some).collect() };
    for scene in scenes {
        let loaded = load::load(&scene_at(scene, &args.staging), &view, &options, args.report)?;
        bench(&args, &loaded, &options, &devices)?;
    }
    Ok(Done::Finished)
}

/// The peer's libraries.
fn devices(args: &BenchArgs) -> Result<Vec<Arc<Device>>> {
    let Some(Peer::Embree) = args.peer.peer else { return Ok(Vec::new()) };
    let threads = args.effort.threads.iter().copied().max().unwrap_or(1) as usize;
    let libraries = library::find(args.peer.peer_library.as_deref())?;
    libraries.iter().map(|path| Device::open(path, threads, args.peer.peer_isa.as_deref())).collect()
}

fn bench(args: &BenchArgs, loaded: &Loaded, options: &RenderOptions, devices: &[Arc<Device>]) -> Result<()> {
    let plan = Plan::new(&loaded.scene, &loaded.accel, options)?;
    let tier = Tier::detect(options.simd)?;
    let size = [options.width, options.height];
    let source =
        Source { scene: &loaded.scene, accel: &loaded.accel, camera: &loaded.camera, size, wave: plan.wave, tier };
    let wanted = &args.rays.sets;
    let sets = sets::make(&source, |name| wanted.is_empty() || wanted.iter().any(|wanted| wanted == name));
    let stats = loaded.accel.stats();
    println!(
        "{}; tree {} in {}, {:.1} bytes a primitive, SAH {:.1}",
        report::scene_line(loaded),
        units::bytes(stats.bytes as u64),
        report::seconds(stats.build_seconds),
        stats.bytes_per_primitive,
        stats.sah_cost
    );
    let qualities: &[Quality] = match args.peer.peer_quality {
        Qualities::Medium => &[Quality::Medium],
        Qualities::High => &[Quality::High],
        Qualities::Both => &[Quality::Medium, Quality::High],
    };
    let robust = args.peer.peer_robust != Robust::Off;
    let mut trees = Vec::new();
    for device in devices {
        for &quality in qualities {
            let tree = Tree::build(device, &loaded.scene.shapes, quality, robust)?;
            println!("{}: built in {}, {}", tree.name(), report::seconds(tree.build_seconds), units::bytes(tree.bytes));
            trees.push(tree);
        }
    }
    let mut probe = Probe::new();
    let effort =
        Effort { rounds: args.effort.repeats as usize, time: Duration::from_secs(u64::from(args.effort.time)) };
    let (low, high) = loaded.scene.bounds();
    let extent = (high - low).max_element();
    let mut rows = Vec::new();
    for set in &sets {
        for &threads in &args.effort.threads {
            let threads = threads as usize;
            let comber = |kernel| Contestant::Comber { accel: &loaded.accel, kernel, tier };
            let mut contestants: Vec<Contestant> = Kernel::all().into_iter().map(comber).collect();
            let own = contestants.len();
            contestants.extend(best_modes(set, threads, &trees, plan.wave, 3));
            let reference = comber(Kernel::Way(Traversal::Single)).answers(set);
            for contestant in &contestants {
                let comparison = agreement::compare(set, extent, &reference, &contestant.answers(set));
                check(set, contestant, &comparison)?;
            }
            let turns = interleave(contestants.len(), effort, &mut probe, |c| contestants[c].rate(set, threads));
            let rate = |c: usize| turns.summary(c).rate.median;
            let best = (own..contestants.len()).max_by(|&a, &b| rate(a).total_cmp(&rate(b)));
            for (c, contestant) in contestants.iter().enumerate() {
                let ratio = best.map(|best| turns.ratio(c, best));
                rows.push(row(set, threads, contestant, &turns.summary(c), ratio));
            }
        }
    }
    println!(
        "{}",
        report::table(
            ["set", "rays", "threads", "who", "Mray/s", "quartiles", "ratio", "quartiles", "turns"],
            4,
            rows.into_iter()
        )
    );
    Ok(())
}

fn row(set: &RaySet, threads: usize, who: &Contestant, rate: &Summary, ratio: Option<Summary>) -> [String; 9] {
    let spread = |s: &Summary, scale: f64| format!("{:.2}–{:.2}", s.rate.low * scale, s.rate.high * scale);
    [
        set.name.clone(),
        units::count(set.rays.len() as u64),
        threads.to_string(),
        who.name(),
        format!("{:.2}", rate.rate.median * 1e-6),
        spread(rate, 1e-6),
        ratio.map_or("–".into(), |ratio| format!("{:.2}", ratio.rate.median)),
        ratio.map_or("–".into(), |ratio| spread(&ratio, 1.0)),
        format!("{} ({} disturbed)", rate.samples, rate.disturbed),
    ]
}

fn check(set: &RaySet, contestant: &Contestant, comparison: &Comparison) -> Result<()> {
    for difference in &comparison.first {
        let [ours, theirs] = &difference.answers;
        complain(&format!(
            "{} ray {} ({:?}): {ours}; {}: {theirs}",
            set.name,
            difference.row,
            difference.ray,
            contestant.name()
        ));
    }
    if comparison.fails() {
        return Err(Error::Scene(format!(
            "{}: {} of {} rays of {} disagree with the reference hits",
            contestant.name(),
            comparison.different,
            comparison.rays,
            set.name
        )));
    }
    Ok(())
}

/// The `count` fastest of all modes on all trees, by a quick look at a part of the set.
fn best_modes<'a>(set: &RaySet, threads: usize, trees: &'a [Tree], wave: usize, count: usize) -> Vec<Contestant<'a>> {
    let part = set.thinned(8);
    let mut all: Vec<(f64, Contestant)> = Vec::new();
    for tree in trees {
        for mode in Mode::all(tree.device(), wave) {
            let contestant = Contestant::Embree { tree, mode };
            let rate = (0..2).map(|_| contestant.rate(&part, threads)).fold(0.0, f64::max);
            all.push((rate, contestant));
        }
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all.into_iter().take(count).map(|(_, contestant)| contestant).collect()
}
