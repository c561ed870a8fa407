//! Features and options → stages, columns, bytes a path, wave size; and why each is there.

use crate::bvh::{Accel, Query, Traversal};
use crate::error::{Error, Result};
use crate::film::tile::{self, FilmLayout};
use crate::measure::units;
use crate::options::{Area, Cell, Direct, Integrator, Intersection, Precision, RenderOptions, Roulette, Sampler};
use crate::scene::Scene;
use crate::simd::Tier;
use crate::stages::{self, Stage};
use crate::transport::{Transport, reuse, simulates_light};
use crate::wave::columns::ColumnInfo;
use crate::wave::features::Features;
use crate::wave::{self, Table};
use serde::Serialize;

/// Bytes of columns that a wave may fill by default.
///
/// Chosen from the curve in `profiling/runs/2026-11-22-xeon-2c/wave_size.txt` (second-level cache of 2 MiB): over six scenes,
/// 8192 rows of 1.4 MiB reach 99 % of each scene's best size, 4096 rows 97 %, 256 rows 89 %, 2²⁰ rows 84 %.
const WAVE_BUDGET: usize = 2 << 20;

/// A stage that will run.
#[derive(Clone, Debug, Serialize)]
pub struct PlannedStage {
    /// Its name.
    pub name: &'static str,
    /// Which of its kernels was chosen.
    pub kernel: String,
    /// Why it is there, or runs this kernel.
    pub why: String,
    /// Columns it reads.
    pub reads: Vec<String>,
    /// Columns it writes.
    pub writes: Vec<String>,
    /// Bytes read a row.
    pub bytes_read: usize,
    /// Bytes written a row.
    pub bytes_written: usize,
}

/// A column that will be allocated.
#[derive(Clone, Debug, Serialize)]
pub struct PlannedColumn {
    /// Table and field: `path.ox`.
    pub name: String,
    /// Element type and meaning, with its unit.
    pub what: String,
    /// Bytes a path.
    pub bytes: usize,
    /// The feature that requires it.
    pub why: String,
}

/// What a render will do.
#[derive(Clone, Debug, Serialize)]
pub struct Plan {
    /// The options it was made from.
    pub options: RenderOptions,
    /// What is rendered of the frame.
    pub cell: Cell,
    /// What the scene and the options require.
    #[serde(skip)]
    pub features: Features,
    /// The estimator.
    #[serde(skip)]
    pub transport: Transport,
    /// Stages in order.
    pub stages: Vec<PlannedStage>,
    /// Columns, by table.
    pub columns: Vec<PlannedColumn>,
    /// Bytes of columns a path.
    pub bytes_per_path: usize,
    /// Sums the film keeps.
    #[serde(skip)]
    pub film: FilmLayout,
    /// Rows a wave.
    pub wave: usize,
    /// Why that many.
    pub wave_why: String,
    /// Worker threads.
    pub threads: usize,
    /// Instruction set.
    pub simd: &'static str,
    /// Predicted memory, in bytes.
    pub memory: PlannedMemory,
}

/// Predicted memory, in bytes.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct PlannedMemory {
    /// Columns of all workers.
    pub waves: u64,
    /// Film, and the picture that is made from it.
    pub film: u64,
    /// Scene tables.
    pub scene: u64,
    /// Acceleration structure.
    pub accel: u64,
    /// What chooses among lights.
    pub lights: u64,
}

impl PlannedMemory {
    /// All of it.
    pub fn total(self) -> u64 {
        [self.film, self.scene, self.accel, self.lights].iter().fold(self.waves, |a, &b| a.saturating_add(b))
    }

    /// What a render still has to allocate: scene and acceleration structure are there already.
    pub fn to_come(self) -> u64 {
        self.waves.saturating_add(self.film)
    }
}

impl Plan {
    /// Plans a render of `scene`.
    ///
    /// # Errors
    /// A cell outside the frame, an instruction set that this processor lacks, a wave too large to index.
    pub fn new(scene: &Scene, accel: &Accel, options: &RenderOptions) -> Result<Plan> {
        let cell = options.rendered();
        let ends = (u64::from(cell.x) + u64::from(cell.width), u64::from(cell.y) + u64::from(cell.height));
        if cell.width == 0 || cell.height == 0 || ends.0 > options.width.into() || ends.1 > options.height.into() {
            return Err(Error::Options(format!(
                "the cell of {}×{} pixels at ({}, {}) is not a part of the {}×{} frame",
                cell.width, cell.height, cell.x, cell.y, options.width, options.height
            )));
        }
        if let Some(other) = options.not_in_double() {
            return Err(Error::Options(format!("precision f64 does not go with {other}")));
        }
        if let Some(other) = options.not_in_reuse() {
            return Err(Error::Options(format!("path reuse does not go with {other}")));
        }
        if !(1..=reuse::MOST_PIXELS).contains(&options.reuse) {
            return Err(Error::Options(format!(
                "{} pixels cannot share paths: 1 to {}",
                options.reuse,
                reuse::MOST_PIXELS
            )));
        }
        if options.lamp_rays == 0 {
            return Err(Error::Options("no camera ray would look for lights: 1 or more".into()));
        }
        if accel.precision() != options.accel.precision {
            return Err(Error::Options("the acceleration structure is of another precision than the render".into()));
        }
        let transport = Transport::new(options, &scene.lights);
        let features = features(scene, options, &transport);
        let tables = wave::tables(transport.shadow_samples, features);
        let bytes_per_path: usize = tables.iter().map(|t| t.bytes_per_path()).sum();
        let threads = options.threads.map_or_else(processors, |t| t as usize);
        let (wave, wave_why) = wave_rows(options, bytes_per_path);
        if wave.saturating_mul(transport.shadow_samples.max(1) as usize) >= 1 << 31 {
            return Err(Error::Options(format!("a wave of {wave} rows casts more shadow rays than can be numbered")));
        }
        if features.has(Features::REUSE) && wave < tile::PIXELS {
            return Err(Error::Options(format!(
                "a wave of {wave} rows does not hold a tile, whose {} pixels share their paths",
                tile::PIXELS
            )));
        }
        let film = FilmLayout::new(options);
        let pixels = u64::from(cell.width) * u64::from(cell.height);
        let memory = PlannedMemory {
            waves: (threads as u64).saturating_mul(wave as u64).saturating_mul(bytes_per_path as u64),
            film: pixels * (film.bytes_per_pixel() + film.picture_bytes_per_pixel()) as u64,
            scene: scene.bytes() as u64,
            accel: accel.stats().bytes as u64,
            lights: transport.selection.bytes() as u64,
        };
        Ok(Plan {
            stages: planned_stages(features, &tables, &Subject { scene, accel, options, transport: &transport })?,
            columns: planned_columns(&tables),
            options: options.clone(),
            transport,
            cell,
            features,
            bytes_per_path,
            film,
            wave,
            wave_why,
            threads,
            simd: Tier::detect(options.simd)?.name(),
            memory,
        })
    }
}

/// Processors that this process may use.
fn processors() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// What the scene and the options require.
fn features(scene: &Scene, options: &RenderOptions, transport: &Transport) -> Features {
    let light = simulates_light(options.integrator);
    let shadow = light && transport.shadow_samples > 0 && transport.max_bounce >= 1;
    let continues = light && transport.continues(0);
    let can_end = match options.roulette {
        Roulette::Off => false,
        Roulette::Fixed(_) => transport.continues(1),
        Roulette::Throughput { start } => transport.continues(start),
        Roulette::Efficiency { .. } => transport.reuse == 1 || transport.continues(1),
    };
    let by_efficiency = matches!(options.roulette, Roulette::Efficiency { .. });
    let aovs = FilmLayout::new(options).aovs;
    let shows_normals = options.integrator == Integrator::Normals || aovs;
    Features::TRANSPORT.when(light)
        | Features::SCATTER.when(shadow || continues)
        | Features::TRIANGLES.when(!scene.shapes.triangles.is_empty())
        | Features::SPHERES.when(!scene.shapes.spheres.is_empty())
        | Features::SMOOTH.when(!scene.shapes.normals.is_empty() && (shadow || continues || shows_normals))
        | Features::CONTINUE.when(continues)
        | Features::SHADOW.when(shadow)
        | Features::MIS.when(shadow && continues && transport.mis())
        | Features::LOOK_BACK.when(shadow && continues && transport.looks_back())
        | Features::HEMISPHERE.when(shadow && options.direct == Direct::Hemisphere)
        | Features::ROULETTE.when(continues && can_end)
        | Features::EFFICIENCY.when(by_efficiency && (continues || shadow && options.direct != Direct::Hemisphere))
        | Features::AOVS.when(aovs)
        | Features::DOUBLE.when(options.accel.precision == Precision::F64)
        | Features::REUSE.when(transport.reuse > 1)
        | Features::LAMPS
            .when(options.lamp_rays > 1 && light && transport.counts_emission(0) && !scene.lights.is_empty())
        | Features::COST.when(options.integrator == Integrator::BvhCost)
        | Features::HITS.when(options.integrator != Integrator::BvhCost)
}

/// The size of a wave, and why.
fn wave_rows(options: &RenderOptions, bytes_per_path: usize) -> (usize, String) {
    if let Some(rows) = options.wave {
        return (rows as usize, "as asked".into());
    }
    let fitting = (WAVE_BUDGET / bytes_per_path).max(1).ilog2();
    let rows = 1usize << fitting.clamp(8, 13);
    let why = format!("the largest power of two, of 256 to 8192, whose columns fit {} KiB", WAVE_BUDGET >> 10);
    (rows, why)
}

fn planned_columns(tables: &[Table]) -> Vec<PlannedColumn> {
    let column = |table: &Table, (name, info): (String, &'static ColumnInfo)| PlannedColumn {
        name,
        what: format!("{}: {}", info.ty, info.meaning),
        bytes: ColumnInfo::BYTES * table.rows_per_path,
        why: (info.requires | table.requires).why(),
    };
    tables.iter().flat_map(|table| table.allocated().map(move |c| column(table, c))).collect()
}

/// Names of allocated columns that a stage's list stands for.
fn resolve(list: &[(&'static str, Features)], features: Features, columns: &[String]) -> Result<Vec<String>> {
    let mut names = Vec::new();
    for (pattern, _) in list.iter().filter(|(_, requires)| features.has(*requires)) {
        let before = names.len();
        match pattern.strip_suffix('*') {
            Some(table) => names.extend(columns.iter().filter(|c| c.starts_with(table)).cloned()),
            None => names.extend(columns.iter().filter(|c| c == pattern).cloned()),
        }
        // Two entries of a list may stand for the same column: once with, once without a feature.
        let found = names.split_off(before);
        if found.is_empty() {
            return Err(Error::Options(format!("the plan has no column {pattern}: a stage's list is wrong")));
        }
        names.extend(found.into_iter().filter(|name| !names.contains(name)).collect::<Vec<_>>());
    }
    Ok(names)
}

/// What a plan is about.
struct Subject<'a> {
    scene: &'a Scene,
    accel: &'a Accel,
    options: &'a RenderOptions,
    transport: &'a Transport,
}

/// The stages that run, after a check that what they read is written and what they write is read.
fn planned_stages(features: Features, tables: &[Table], subject: &Subject) -> Result<Vec<PlannedStage>> {
    let columns: Vec<String> = tables.iter().flat_map(|t| t.allocated().map(|(name, _)| name)).collect();
    let mut planned = Vec::new();
    for stage in stages::ALL.iter().filter(|s| features.has(s.requires)) {
        let reads = resolve(stage.reads, features, &columns)?;
        let writes = resolve(stage.writes, features, &columns)?;
        let (kernel, why) = describe(stage, features, subject);
        let (bytes_read, bytes_written) = (reads.len() * ColumnInfo::BYTES, writes.len() * ColumnInfo::BYTES);
        planned.push(PlannedStage { name: stage.name, kernel, why, reads, writes, bytes_read, bytes_written });
    }
    check(&planned, &columns)?;
    Ok(planned)
}

/// Every column is written by some stage and read by some stage. (The order within a bounce is the drive's, and fixed.)
fn check(planned: &[PlannedStage], columns: &[String]) -> Result<()> {
    for column in columns {
        let read = planned.iter().any(|s| s.reads.contains(column));
        let written = planned.iter().any(|s| s.writes.contains(column));
        if !(read && written) {
            let problem = if read { "read but never written" } else { "allocated but never read" };
            return Err(Error::Options(format!("the plan is inconsistent: {column} is {problem}")));
        }
    }
    Ok(())
}

/// The kernel a stage runs, and why.
fn describe(stage: &Stage, features: Features, subject: &Subject) -> (String, String) {
    let Subject { scene, accel, options, transport } = subject;
    let rays = [(Query::Closest, true), (Query::Closest, false), (Query::Any, false)];
    let [camera, behind, shadow] = rays.map(|(query, coherent)| match accel.suited(query, coherent) {
        Traversal::Single => "one ray after another",
        Traversal::InFlight => "many rays in flight",
        Traversal::Packet => "packets of rays",
        Traversal::List => "every primitive, a ray a lane",
    });
    let tree = units::bytes(accel.stats().bytes as u64);
    let shapes = match (features.has(Features::TRIANGLES), features.has(Features::SPHERES)) {
        (true, true) => "triangles and spheres",
        (true, false) => "triangles",
        _ => "spheres",
    };
    let count = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    match stage.name {
        "generate" => {
            let numbers = match options.sampler {
                Sampler::Independent => "independent random numbers",
                Sampler::Sobol => "Sobol points a pixel",
                Sampler::BlueNoise => "Sobol points that pixels share",
            };
            let dealt = match options.replicates {
                1 => String::new(),
                replicates => format!(" in {replicates} replicates"),
            };
            (format!("pinhole camera, jittered; {numbers}{dealt}"), "every path starts at the camera".into())
        }
        "traverse" => {
            let structure = match options.accel.kind {
                crate::options::Accel::Bvh if features.has(Features::DOUBLE) => "binary BVH in double precision",
                crate::options::Accel::Bvh => "4-wide BVH",
                crate::options::Accel::Brute => "every primitive",
            };
            let test = match options.accel.intersection {
                Intersection::Watertight => "watertight",
                Intersection::Fast => "Möller–Trumbore",
            };
            let mut kernel = format!("{structure}, closest hit, {test}, {shapes}");
            let mut why = format!("the scene holds {shapes}");
            if let Some((nodes, reason)) = accel.node_format() {
                kernel += &format!(", {nodes} nodes");
                why += &format!("; {reason}");
            }
            if let Some((leaves, reason)) = accel.leaf_format() {
                kernel += &format!(", {leaves} leaves");
                why += &format!("; {reason}");
            }
            if accel.beside() > 0 {
                kernel += &format!(", {} beside the tree", count(accel.beside(), "primitive"));
                why += "; those of small meshes are as wide as the scene: every ray is tested against them, and few come to the tree";
            }
            if features.has(Features::COST) {
                kernel += ", counting nodes";
            } else if options.accel.kind == crate::options::Accel::Bvh {
                let same = camera == behind;
                kernel += &format!("; {camera}{}", if same { "" } else { " from the camera" });
                if features.has(Features::CONTINUE) && !same {
                    kernel += &format!(", {behind} behind the first surface");
                }
                why += &format!("; the tree takes {tree}");
            }
            (kernel, why)
        }
        "shade" => {
            let mut parts = Vec::new();
            if features.has(Features::TRANSPORT) {
                parts.push("emission");
            }
            if features.has(Features::SCATTER) {
                parts.push("diffuse");
                parts.push(if features.has(Features::SMOOTH) { "corner normals" } else { "flat normals" });
            }
            if features.has(Features::SCATTER) && features.has(Features::SPHERES) {
                parts.push("sphere normals");
            }
            if features.has(Features::AOVS) {
                parts.push("first-hit layers");
            }
            if !features.has(Features::TRANSPORT) && !features.has(Features::COST) {
                parts.push("normals as colours");
            }
            let mut why = format!("{} of {}", count(scene.materials.len(), "material"), "diffuse kind");
            if features.has(Features::SHADOW) {
                let rays = count(transport.shadow_samples as usize, "shadow ray");
                why += &format!("; {rays} a vertex towards {}", count(scene.lights.len(), "light"));
                if !features.has(Features::HEMISPHERE) {
                    parts.push(transport.selection.kernel());
                    why += &format!(": {}", transport.selection.why(options.light_selection, &scene.lights));
                }
            }
            (if parts.is_empty() { "nothing to shade".into() } else { parts.join(", ") }, why)
        }
        "shadow" if features.has(Features::HEMISPHERE) => {
            ("closest hit, then its emission".into(), Features::HEMISPHERE.why())
        }
        "shadow" => (format!("any hit, {shadow}"), Features::SHADOW.why()),
        "roulette" => match options.roulette {
            Roulette::Fixed(p) if features.has(Features::ROULETTE) => {
                (format!("continue with probability {p}, then compact"), Features::ROULETTE.why())
            }
            Roulette::Throughput { start } if features.has(Features::ROULETTE) => (
                format!(
                    "continue with probability min(max β, 0.95) after {}, then compact",
                    count(start as usize, "bounce")
                ),
                Features::ROULETTE.why(),
            ),
            Roulette::Efficiency { factor } if features.has(Features::ROULETTE) => {
                let rule = "continue, and ask lights, with probability min(value expected / δ, 1)";
                (
                    format!("{rule}, δ = {factor} √(variance / rays) of each part of the frame; then compact"),
                    Features::EFFICIENCY.why(),
                )
            }
            _ => ("compact".into(), "rows whose path has ended make room".into()),
        },
        "lamps" => {
            let rays = count(options.lamp_rays as usize, "camera ray");
            (format!("{rays} for each sample of pixels where lights may be seen, {camera}"), Features::LAMPS.why())
        }
        "reuse" => {
            let blocks = format!("blocks of {} pixels, balance heuristic; any hit, {shadow}", transport.reuse);
            (blocks, Features::REUSE.why())
        }
        _ => match options.adaptive {
            Some(rule) => {
                let what = if rule.area == Area::Tile { "tile" } else { "pixel" };
                (
                    format!("add to the film; test every {} samples", rule.batch),
                    format!("a {what} is done when its 95 % interval is within {} of its mean", rule.tolerance),
                )
            }
            None => ("add to the film".into(), "every pixel gets all its samples".into()),
        },
    }
}
