//! One scene, measured.

use super::request::BenchRequest;
use crate::bench::contest::Contestant;
use crate::bench::end_to_end::{RenderReport, Subject};
use crate::bench::probe::Probe;
use crate::bench::ray_file::{self, RayFile};
use crate::bench::rays::RaySet;
use crate::bench::record::Record;
use crate::bench::set_report::{Contest, Disagreed, SetReport};
use crate::bench::sets::{self, Source};
use crate::bench::{agreement, queues};
use crate::cli::exit::complain;
use crate::cli::load::{self, Loaded};
use crate::cli::report;
use crate::cli::resolve::SceneRequest;
use crate::error::{Error, Result};
use crate::measure::progress::Progress;
use crate::options::RenderOptions;
use crate::peer::embree::library::Device;
use crate::peer::embree::scene::Tree;
use crate::plan::Plan;
use crate::simd::Tier;
use serde::Serialize;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What was found of a scene.
#[derive(Serialize)]
pub struct SceneReport {
    /// Name and size, for people.
    #[serde(skip)]
    pub title: String,
    /// What it is made of.
    pub scene: Value,
    /// comber's tree.
    pub bvh: crate::bvh::BvhStats,
    /// Rays a wave.
    pub wave: usize,
    /// Instruction set.
    pub simd: &'static str,
    /// The peer's trees.
    pub peer: Vec<Value>,
    /// The same, for people.
    #[serde(skip)]
    pub peer_lines: Vec<String>,
    /// Rays compared with the oracle that tests every primitive; `None` if the scene is too large for that.
    pub spot_checked: Option<usize>,
    /// Sets of rays.
    pub sets: Vec<SetReport>,
    /// Sets that have no rays.
    pub empty: Vec<String>,
    /// Whole renders.
    pub render: Vec<RenderReport>,
    /// With --once: the set, who traced it, its rays and how often.
    pub once: Option<Value>,
}

/// Loads the scene and measures it; adds its figures to `record`.
pub fn measure(
    request: &BenchRequest,
    scene: &SceneRequest,
    devices: &[Arc<Device>],
    probe: &mut Probe,
    record: &mut Record,
) -> Result<SceneReport> {
    let loaded = load::load(scene, &request.view, &request.options, request.report)?;
    let plan = Plan::new(&loaded.scene, &loaded.accel, &request.options)?;
    let tier = Tier::detect(request.options.simd)?;
    let (low, high) = loaded.scene.bounds();
    let trees = trees(request, &loaded, devices)?;
    let contest = Contest {
        accel: &loaded.accel,
        kernels: request.kernels.clone(),
        tier,
        trees: &trees,
        mode: request.peer.as_ref().map_or("", |peer| &peer.mode),
        all_modes: request.peer.as_ref().is_some_and(|peer| peer.all_modes),
        wave: plan.wave,
        extent: (high - low).max_element(),
        effort: request.effort,
    };
    if !trees.is_empty() && contest.modes().is_empty() {
        return Err(Error::Options(format!("--peer-mode: no mode has '{}' in its name", contest.mode)));
    }
    let mut measured = SceneReport {
        title: report::scene_line(&loaded),
        scene: report::scene_json(&loaded),
        bvh: loaded.accel.stats(),
        wave: plan.wave,
        simd: tier.name(),
        peer: trees.iter().map(tree_json).collect(),
        peer_lines: trees.iter().map(tree_line).collect(),
        spot_checked: None,
        sets: Vec::new(),
        empty: Vec::new(),
        render: Vec::new(),
        once: None,
    };
    if request.trace || request.once.is_some() {
        trace(request, &loaded, &contest, probe, record, &mut measured)?;
    }
    if request.render && request.once.is_none() {
        for &threads in &request.threads {
            let options = RenderOptions { threads: Some(threads as u32), ..small_frame(&request.options) };
            let subject =
                Subject { scene: &loaded.scene, accel: &loaded.accel, camera: &loaded.camera, options: &options };
            let steps = 2 + 2 * request.effort.rounds as u64;
            let progress = Steps::new("measuring renders", steps, request);
            let report = subject.measure(request.effort, probe, || progress.step())?;
            record.add(&loaded.name, "render", threads, "waves", &report.waves);
            measured.render.push(report);
        }
    }
    Ok(measured)
}

/// The sets of rays, measured, or only traced.
fn trace(
    request: &BenchRequest,
    loaded: &Loaded,
    contest: &Contest,
    probe: &mut Probe,
    record: &mut Record,
    measured: &mut SceneReport,
) -> Result<()> {
    let (sets, answers) = sets(request, loaded, contest)?;
    if let Some((name, passes)) = &request.once {
        let set = sets.iter().find(|set| set.name == *name);
        let set = set.ok_or_else(|| Error::Options(format!("there is no set '{name}' in the file of rays")))?;
        let comber = Contestant::Comber { accel: contest.accel, kernel: request.kernels[0], tier: contest.tier };
        let who = contest.modes().first().copied().unwrap_or(comber);
        (0..*passes).for_each(|_| who.once(set));
        measured.once = Some(json!({ "set": name, "who": who.name(), "rays": set.rays.len(), "passes": passes }));
        return Ok(());
    }
    for (set, answers) in sets.iter().zip(&answers) {
        if let Some(answers) = answers {
            let found = contest.reference().answers(set);
            let comparison = agreement::compare(set, contest.extent, answers, &found);
            if comparison.fails(agreement::WATERTIGHT) {
                return Err(disagreement(set, &Disagreed { name: "the file".into(), comparison }));
            }
        }
        let checked = contest.spot_check(set, &loaded.scene.shapes).map_err(|d| disagreement(set, &d))?;
        measured.spot_checked = checked.map(|rays| rays + measured.spot_checked.unwrap_or(0)).or(measured.spot_checked);
    }
    if let Some(dump) = &request.dump {
        write_rays(dump, loaded, contest, &sets)?;
    }
    for set in &sets {
        if set.rays.is_empty() {
            measured.empty.push(set.name.clone());
            continue;
        }
        for &threads in &request.threads {
            let turns = request.effort.rounds * (contest.kernels.len() + if contest.trees.is_empty() { 0 } else { 3 });
            let progress = Steps::new(&format!("tracing {}", set.name), 2 + turns as u64, request);
            let report = contest.measure(set, threads, probe, |_| progress.step());
            let report = report.map_err(|d| disagreement(set, &d))?;
            for contestant in &report.contestants {
                record.add(&loaded.name, &set.name, threads, &contestant.name, &contestant.rate);
            }
            measured.sets.push(report);
        }
    }
    Ok(())
}

/// The sets that were asked for, from the file or from the scene, with the answers that the file has.
fn sets(
    request: &BenchRequest,
    loaded: &Loaded,
    contest: &Contest,
) -> Result<(Vec<RaySet>, Vec<Option<agreement::Answers>>)> {
    if let Some(path) = &request.rays {
        let file = ray_file::read(path)?;
        let shapes = &loaded.scene.shapes;
        if file.primitives != [shapes.triangles.len() as u64, shapes.spheres.len() as u64] {
            let [triangles, spheres] = file.primitives;
            complain(&format!(
                "warning: {}: made for another scene, {} of {triangles} triangles and {spheres} spheres",
                path.display(),
                file.scene
            ));
        }
        return Ok(file.sets.into_iter().filter(|(set, _)| request.wants(&set.name)).unzip());
    }
    let progress = Progress::busy("making rays", !request.report.quiet);
    let (scene, accel, camera) = (&loaded.scene, &loaded.accel, &loaded.camera);
    let size = [request.options.width, request.options.height];
    let source = Source { scene, accel, camera, size, wave: contest.wave, tier: contest.tier };
    let mut sets = if sets::NAMES.iter().any(|name| request.wants(name)) {
        sets::make(&source, |name| request.wants(name))
    } else {
        Vec::new()
    };
    if queues::NAMES.iter().any(|name| request.wants(name)) {
        let most = u64::from(size[0]) * u64::from(size[1]) / 4;
        let queues = queues::record(scene, accel, camera, &small_frame(&request.options), most)?;
        sets.extend(queues.into_iter().filter(|set| request.wants(&set.name)));
    }
    progress.finish();
    let answers = vec![None; sets.len()];
    Ok((sets, answers))
}

/// A frame of a quarter of the width and height with 16 samples a pixel: as many paths as the frame has pixels.
fn small_frame(options: &RenderOptions) -> RenderOptions {
    let quarter = |side: u32| side.div_ceil(4);
    RenderOptions { width: quarter(options.width), height: quarter(options.height), samples: 16, ..options.clone() }
}

fn trees(request: &BenchRequest, loaded: &Loaded, devices: &[Arc<Device>]) -> Result<Vec<Tree>> {
    let mut trees = Vec::new();
    for device in devices {
        for &quality in request.peer.as_ref().map_or(&[][..], |peer| peer.qualities) {
            let robust = request.peer.as_ref().is_some_and(|peer| peer.robust);
            let progress = Progress::busy(&format!("building Embree {}", device.version), !request.report.quiet);
            trees.push(Tree::build(device, &loaded.scene.shapes, quality, robust)?);
            progress.finish();
        }
    }
    Ok(trees)
}

fn tree_json(tree: &Tree) -> Value {
    json!({
        "name": tree.name(),
        "library": report::path_json(&tree.device().path),
        "version": tree.device().version,
        "quality": tree.quality,
        "robust": tree.robust,
        "build_seconds": tree.build_seconds,
        "bytes": tree.bytes,
    })
}

fn tree_line(tree: &Tree) -> String {
    format!(
        "{}, {}: built in {}, {} with its copy of the scene ({})",
        tree.name(),
        if tree.robust { "robust" } else { "fast" },
        report::seconds(tree.build_seconds),
        crate::measure::units::bytes(tree.bytes),
        tree.device().path.display()
    )
}

fn write_rays(target: &Path, loaded: &Loaded, contest: &Contest, sets: &[RaySet]) -> Result<()> {
    let path = if target.is_dir() {
        let name = PathBuf::from(&loaded.name);
        // `proc:` names have characters that some file systems refuse.
        let name = name.file_name().unwrap_or_default().to_string_lossy().replace([':', '=', ','], "_");
        target.join(format!("{name}.rays"))
    } else {
        target.to_path_buf()
    };
    let shapes = &loaded.scene.shapes;
    let primitives = [shapes.triangles.len() as u64, shapes.spheres.len() as u64];
    let sets = sets.iter().map(|set| (set.clone(), Some(contest.reference().answers(set)))).collect();
    ray_file::write(&path, &RayFile { scene: loaded.name.clone(), primitives, sets })
}

/// Shows the first rays that differ, and makes the rest an error.
fn disagreement(set: &RaySet, disagreed: &Disagreed) -> Error {
    let comparison = &disagreed.comparison;
    for difference in &comparison.first {
        let [expected, found] = &difference.answers;
        complain(&format!("{} ray {}: {expected} or {found}? {:?}", set.name, difference.row, difference.ray));
    }
    Error::Scene(format!(
        "{} disagrees with the reference about {} of {} rays of {}",
        disagreed.name, comparison.different, comparison.rays, set.name
    ))
}

/// Progress in steps.
struct Steps {
    progress: Progress,
    done: std::cell::Cell<u64>,
}

impl Steps {
    fn new(label: &str, steps: u64, request: &BenchRequest) -> Steps {
        Steps { progress: Progress::new(label, steps, !request.report.quiet), done: 0.into() }
    }

    fn step(&self) {
        self.done.set(self.done.get() + 1);
        self.progress.set(self.done.get());
    }
}
