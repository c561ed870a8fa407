//! What the number of triangles costs: building the tree, memory, and rays a second.
//!
//! `cargo bench --bench scaling [-- --most 30M --models FILE… --picture FILE]` measures corals of 1k, 3k, 10k, …
//! triangles, then the models, prints a table and writes a picture. A coral has ridges over as many octaves as its
//! triangles can show, so that large ones are as rough as scans, not smoother than small ones.
//!
//! Trees are built with default options on all threads. Rays are the sets PH, S, D and D2 of `comber::bench::sets`, traced by
//! the kernel that the renderer would choose, on one thread. Figures are medians.

mod common;

use clap::Parser;
use comber::bench::interleave::Effort;
use comber::bench::kernels::Kernel;
use comber::bench::probe::Probe;
use comber::bench::set_report::Contest;
use comber::bench::sets::{self, Source};
use comber::bench::statistics::Quartiles;
use comber::bvh::{Accel, BvhStats};
use comber::error::{Error, Result};
use comber::film::atomic_file;
use comber::measure::plot::{COLORS, Marks, Panel, Picture, Series, Theme};
use comber::measure::{processor, units};
use comber::options::{AccelOptions, RenderOptions, Simd};
use comber::plan::Plan;
use comber::scene::description::SceneDescription;
use comber::scene::procedural::{self, Spec};
use comber::scene::stage::{Stage, UpAxis, place};
use comber::scene::{Scene, SceneOptions};
use comber::simd::Tier;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// The sets that are measured.
const SETS: [&str; 4] = ["PH", "S", "D", "D2"];
/// Pixels across and down.
const SIDE: u32 = 256;

/// Measures building and tracing over the number of triangles.
#[derive(Parser)]
struct Args {
    /// Triangles of the largest generated mesh, up to 30M.
    #[arg(long, default_value = "1M", value_parser = triangles)]
    most: u64,
    /// Models to measure too.
    #[arg(long, num_args = 1.., value_name = "FILE")]
    models: Vec<PathBuf>,
    /// The picture to write [default: scaling.svg in cargo's target folder].
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Said by `cargo bench`.
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> ExitCode {
    // `cargo test` does not say `--bench`, may say what its own harness would understand, and wants to see the bench run
    // once, quickly.
    let outcome = match std::env::args_os().any(|arg| arg == "--bench") {
        true => run(&Args::parse()),
        false => try_out(),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(args: &Args) -> Result<()> {
    let file = args.picture.clone().unwrap_or_else(|| {
        let scratch = Path::new(env!("CARGO_TARGET_TMPDIR"));
        scratch.parent().unwrap_or(scratch).join("scaling.svg")
    });
    atomic_file::check_writable(&file)?;
    // Now, rather than after an hour of corals.
    for path in &args.models {
        std::fs::File::open(path).map_err(|e| Error::io(path, "read", e))?;
    }
    let mut probe = Probe::new();
    print_head();
    let mut corals = Vec::new();
    for triangles in counts(args.most) {
        let mesh = procedural::generate(&coral(triangles))?;
        corals.push(Row::measure(units::count(triangles), mesh, FULL, &mut probe)?.print());
    }
    let mut models = Vec::new();
    for path in &args.models {
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        models.push(Row::measure(name, comber::import::load(path)?, FULL, &mut probe)?.print());
    }
    if corals.iter().chain(&models).any(|row| row.rates.iter().flatten().any(|rate| rate.disturbed)) {
        println!("* something else used the machine during every turn");
    }
    let svg = picture(&corals, &models)?;
    atomic_file::write(&file, |out| out.write_all(svg.as_bytes()).map_err(|e| Error::io(&file, "write", e)))?;
    println!("picture: {}", file.display());
    Ok(())
}

/// The smallest mesh, and a picture that is not written.
fn try_out() -> Result<()> {
    let row = Row::measure("1,000".into(), procedural::generate(&coral(1000))?, QUICK, &mut Probe::new())?;
    print_head();
    picture(&[row.print()], &[]).map(drop)
}

/// How often to measure.
#[derive(Clone, Copy)]
struct Care {
    /// Builds, unless they take longer than `build_time` together.
    builds: usize,
    build_time: Duration,
    rays: Effort,
}

const FULL: Care = Care {
    builds: 7,
    build_time: Duration::from_secs(3),
    rays: Effort { rounds: 7, time: Duration::from_secs(3), turn: Duration::from_millis(50) },
};
const QUICK: Care = Care {
    builds: 1,
    build_time: Duration::ZERO,
    rays: Effort { rounds: 1, time: Duration::ZERO, turn: Duration::ZERO },
};

/// The figures of one mesh.
struct Row {
    name: String,
    triangles: usize,
    build_seconds: f64,
    tree: BvhStats,
    /// In the order of [`SETS`]; `None` if the set has no rays.
    rates: [Option<Rate>; 4],
}

struct Rate {
    mray: f64,
    /// In every turn.
    disturbed: bool,
}

impl Row {
    fn measure(name: String, mesh: SceneDescription, care: Care, probe: &mut Probe) -> Result<Row> {
        let staged = place(mesh, Stage::None, UpAxis::Y)?;
        let scene = Scene::build(staged.description, SceneOptions::default())?;
        let (accel, build_seconds) = build(&scene, care)?;
        let options = RenderOptions { width: SIDE, height: SIDE, threads: Some(1), ..RenderOptions::default() };
        let wave = Plan::new(&scene, &accel, &options)?.wave;
        let tier = Tier::detect(Simd::Auto)?;
        let (low, high) = scene.bounds();
        let contest = Contest {
            accel: &accel,
            kernels: vec![Kernel::Suited],
            tier,
            trees: &[],
            mode: "",
            all_modes: false,
            wave,
            extent: (high - low).max_element(),
            effort: care.rays,
        };
        let source = Source { scene: &scene, accel: &accel, camera: &staged.camera, size: [SIDE, SIDE], wave, tier };
        let mut rates = [const { None }; 4];
        for set in sets::make(&source, |name| SETS.contains(&name)) {
            if set.rays.is_empty() {
                continue;
            }
            let report = contest.measure(&set, 1, probe, |_| ()).map_err(|disagreed| {
                let comparison = disagreed.comparison;
                let (different, rays) = (comparison.different, comparison.rays);
                Error::Scene(format!(
                    "{name}: {different} of {rays} rays of {} have other hits than the reference",
                    set.name
                ))
            })?;
            let place = SETS.iter().position(|name| *name == set.name).expect("only these were asked for");
            let mray = report.contestants[0].rate.rate.median * 1e-6;
            rates[place] = Some(Rate { mray, disturbed: report.all_disturbed });
        }
        Ok(Row { name, triangles: scene.shapes.triangles.len(), build_seconds, tree: accel.stats(), rates })
    }

    /// Prints the line of the table, and gives itself back.
    fn print(self) -> Row {
        let nanoseconds = self.build_seconds * 1e9 / self.triangles.max(1) as f64;
        print!(
            "{:<20} {:>11} {:>10.2} {:>10.1} {:>10.1} {:>9.2}",
            self.name,
            units::count(self.triangles as u64),
            self.build_seconds * 1e3,
            nanoseconds,
            self.tree.bytes_per_primitive,
            self.tree.sah_cost,
        );
        for rate in &self.rates {
            match rate {
                Some(Rate { mray, disturbed }) => print!(" {mray:>7.2}{}", if *disturbed { '*' } else { ' ' }),
                None => print!(" {:>7} ", "–"),
            }
        }
        println!();
        self
    }
}

fn print_head() {
    let [ph, s, d, d2] = SETS.map(|name| format!("{name:>7} "));
    println!("{:>74}  Mray/s, one thread", "");
    println!(
        "{:<20} {:>11} {:>10} {:>10} {:>10} {:>9} {ph} {s} {d} {d2}",
        "mesh", "triangles", "build ms", "ns/tri.", "B/tri.", "SAH cost"
    );
}

/// A tree, and the median of the seconds that it took to build.
fn build(scene: &Scene, care: Care) -> Result<(Accel, f64)> {
    let build = || Accel::build(&scene.shapes, &AccelOptions::default());
    let start = Instant::now();
    let mut accel = build()?;
    let mut seconds = vec![accel.stats().build_seconds];
    while seconds.len() < care.builds && start.elapsed() < care.build_time {
        // Two trees at once would be a lot of memory, and the first is not needed.
        drop(accel);
        accel = build()?;
        seconds.push(accel.stats().build_seconds);
    }
    Ok((accel, Quartiles::of(seconds).median))
}

/// 1000, 3000, 10 000, … and `most` itself.
fn counts(most: u64) -> Vec<u64> {
    let decades = std::iter::successors(Some(1000u64), |n| n.checked_mul(10));
    decades.flat_map(|n| [n, 3 * n]).take_while(|n| *n < most).chain([most]).collect()
}

fn coral(triangles: u64) -> String {
    format!("proc:coral,tris={triangles}")
}

/// Reads `30M` as specifications of meshes do.
fn triangles(text: &str) -> std::result::Result<u64, String> {
    Spec::parse(&format!("proc:coral,tris={text}")).map(|spec| spec.triangles).map_err(|e| e.to_string())
}

/// Build time and memory on the left, rays a second on the right.
fn picture(corals: &[Row], models: &[Row]) -> Result<String> {
    let series = |name: &str, color, value: &dyn Fn(&Row) -> f64| {
        let points = |rows: &[Row]| rows.iter().map(|row| [row.triangles as f64, value(row)]).collect();
        [
            Series { name: name.into(), color, points: points(corals), marks: Marks::Joined },
            Series { name: String::new(), color, points: points(models), marks: Marks::Single },
        ]
    };
    let [blue, ..] = COLORS;
    let rates = SETS.iter().enumerate().flat_map(|(set, name)| {
        series(name, COLORS[set], &|row| row.rates[set].as_ref().map_or(f64::NAN, |rate| rate.mray))
    });
    let panel = |frame, x: &str, y: &str, series| Panel { frame, x: x.into(), y: y.into(), series };
    let threads = rayon::current_num_threads();
    let mut subtitle = processor::name();
    if !models.is_empty() {
        let names: Vec<&str> = models.iter().map(|row| row.name.as_str()).collect();
        subtitle = format!("{subtitle}; lines: proc:coral, rings: {}", names.join(", "));
    }
    let build = series(&format!("build, {threads} threads"), blue, &|row| row.build_seconds);
    let memory = series("memory of the tree", blue, &|row| row.tree.bytes_per_primitive);
    let svg = Picture {
        size: [980.0, 600.0],
        title: "Scaling with the number of triangles".into(),
        subtitle,
        theme: Theme::LIGHT,
        panels: vec![
            panel([80.0, 100.0, 380.0, 230.0], "", "build time (s)", build.into()),
            panel([80.0, 400.0, 380.0, 140.0], "triangles", "bytes a triangle", memory.into()),
            panel([570.0, 100.0, 380.0, 440.0], "triangles", "Mray/s, one thread", rates.collect()),
        ],
    }
    .svg();
    // Names of models are in it: a picture that no viewer could read must not replace one that is there.
    match roxmltree::Document::parse(&svg) {
        Ok(_) => Ok(svg),
        Err(error) => Err(Error::Scene(format!("the picture is no XML: {error}"))),
    }
}
