//! What the benches share: scenes, options, and measuring on a machine that is never quite still.
#![allow(dead_code)] // Each bench uses its own part.

pub mod pipeline;

use comber::bvh::Accel;
use comber::error::Result;
use comber::options::{self, RenderOptions};
use comber::scene::bounds::geometry_bounds;
use comber::scene::camera::Camera;
use comber::scene::description::SceneDescription;
use comber::scene::stage::{Stage, UpAxis, place};
use comber::scene::{Scene, SceneOptions, default, viewpoint};
use std::path::Path;
use std::time::Instant;

/// A scene, ready to be rendered.
pub struct Ready {
    pub name: &'static str,
    pub scene: Scene,
    pub accel: Accel,
    pub camera: Camera,
}

/// The names of all bench scenes. The last two need models that `scenes/fetch.sh` fetches.
pub const SCENES: [&str; 6] = ["cornell_empty", "cornell_spheres", "cornell_mesh", "default", "lucy100k", "dragon"];

/// The scene of that name; a word and `None` if it needs a model that is not here.
pub fn load(name: &'static str) -> Option<Ready> {
    let (description, camera) = match name {
        "default" => staged(default::description()),
        "dragon" => on_stage(&["scenes/models/dragon_vrip.ply", "../shared/models/dragon_vrip.ply"])?,
        "lucy100k" => on_stage(&["scenes/models/lucy100k.obj", "../shared/models/lucy100k.obj"])?,
        _ => course(&project().join("scenes").join(name).with_extension("dae")),
    };
    let scene = Scene::build(description, SceneOptions::default()).expect("a scene of the project is sound");
    let accel =
        Accel::build(&scene.shapes, &options::AccelOptions::default()).expect("a scene of the project can be indexed");
    Some(Ready { name, scene, accel, camera })
}

fn project() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn staged(staged: Result<comber::scene::stage::Staged>) -> (SceneDescription, Camera) {
    let staged = staged.expect("the scene stands on its stage");
    (staged.description, staged.camera)
}

/// The first of these files that is here, on the Cornell stage.
fn on_stage(files: &[&str]) -> Option<(SceneDescription, Camera)> {
    let Some(file) = files.iter().map(|file| project().join(file)).find(|file| file.exists()) else {
        eprintln!("skipped: {} is not here", files[0]);
        return None;
    };
    Some(staged(comber::import::load(&file).and_then(|mesh| place(mesh, Stage::Cornell, UpAxis::Y))))
}

fn course(file: &Path) -> (SceneDescription, Camera) {
    let description = comber::import::load(file).expect("a readable scene");
    let (min, max) = geometry_bounds(&description).expect("a scene with geometry");
    let camera = viewpoint::course(description.camera.as_ref(), min, max).expect("a scene with a camera");
    (description, camera)
}

/// What all benches render: the defaults, on a frame small enough to be rendered often.
pub fn render_options() -> RenderOptions {
    RenderOptions { width: 256, height: 192, samples: 16, ..RenderOptions::default() }
}

/// The arguments of a bench that has no harness: words that choose scenes, and whether to measure at all.
pub struct Args {
    words: Vec<String>,
    /// `cargo bench` says `--bench`; `cargo test` does not, and wants to see the bench run once, quickly.
    pub measure: bool,
}

impl Args {
    pub fn parse() -> Args {
        let (flags, words): (Vec<_>, Vec<_>) = std::env::args().skip(1).partition(|arg| arg.starts_with("--"));
        Args { words, measure: flags.iter().any(|flag| flag == "--bench") }
    }

    /// The bench scenes that the words name; all of them without words.
    pub fn scenes(&self) -> Vec<&'static str> {
        let chosen = |name: &&str| self.words.is_empty() || self.words.iter().any(|word| name.contains(word.as_str()));
        let all = if self.measure { &SCENES[..] } else { &SCENES[..1] };
        all.iter().copied().filter(chosen).collect()
    }
}

/// What one run of something took.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Wall time in seconds.
    pub wall: f64,
    /// Processor time of all threads in seconds: hardly changed by what else the machine does.
    pub cpu: f64,
    /// Seconds that a fixed piece of work took right before and right after, the longer of the two.
    pub probe: f64,
}

/// Runs `work` between two probes on `threads` threads.
pub fn sample<R>(threads: usize, work: impl FnOnce() -> R) -> (R, Sample) {
    let before = probe(threads);
    let (cpu, start) = (cpu_seconds(), Instant::now());
    let result = work();
    let (wall, cpu) = (start.elapsed().as_secs_f64(), cpu_seconds() - cpu);
    (result, Sample { wall, cpu, probe: before.max(probe(threads)) })
}

/// A sample is disturbed if its probe took this much longer than the median probe.
const DISTURBED: f64 = 1.1;

/// For each sample, whether something else was running.
pub fn disturbed(samples: &[Sample]) -> Vec<bool> {
    let usual = Quartiles::of(samples.iter().map(|s| s.probe)).median;
    samples.iter().map(|s| s.probe > DISTURBED * usual).collect()
}

/// The time that a fixed loop of integer work takes on each of `threads` threads at once, the longest of them.
fn probe(threads: usize) -> f64 {
    let work = || {
        let start = Instant::now();
        let mut state = 1u32;
        for _ in 0..1_000_000 {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        }
        std::hint::black_box(state);
        start.elapsed().as_secs_f64()
    };
    std::thread::scope(|scope| {
        let others: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
        let own = work();
        others.into_iter().fold(own, |longest, other| longest.max(other.join().expect("a loop does not panic")))
    })
}

/// Processor time that this process has used, on all its threads; not a number where the system has no `/proc`.
fn cpu_seconds() -> f64 {
    /// Linux counts for users in hundredths, whatever the kernel does.
    const TICKS: f64 = 100.0;
    let Ok(stat) = std::fs::read_to_string("/proc/self/stat") else { return f64::NAN };
    // The second field is the program's name in parentheses, and may hold spaces. Fields 14 and 15 are wanted.
    let Some((_, fields)) = stat.rsplit_once(')') else { return f64::NAN };
    let fields: Vec<f64> = fields.split_whitespace().skip(11).take(2).filter_map(|field| field.parse().ok()).collect();
    if let [user, system] = fields[..] { (user + system) / TICKS } else { f64::NAN }
}

/// Median and quartiles.
#[derive(Clone, Copy, Debug)]
pub struct Quartiles {
    pub low: f64,
    pub median: f64,
    pub high: f64,
}

impl Quartiles {
    /// Of `values`, between neighbours by weight; not a number if there are none.
    pub fn of(values: impl Iterator<Item = f64>) -> Quartiles {
        let mut values: Vec<f64> = values.collect();
        values.sort_by(f64::total_cmp);
        let at = |fraction: f64| {
            let Some(last) = values.len().checked_sub(1) else { return f64::NAN };
            let place = fraction * last as f64;
            let (below, part) = (place.floor() as usize, place.fract());
            values[below] * (1.0 - part) + values[(below + 1).min(last)] * part
        };
        Quartiles { low: at(0.25), median: at(0.5), high: at(0.75) }
    }
}
