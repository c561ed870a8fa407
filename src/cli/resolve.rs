//! Arguments as typed → requests as resolved, with every default filled in and every contradiction found.

use super::args::{AccelArgs, ExplainArgs, MAX_SAMPLES, SamplingArgs, SpeedArgs, StorageArgs, TransportArgs};
use super::args::{BvhArgs, CameraArgs, FrameArgs, OutputArgs, RenderArgs, ReportArgs, SceneArgs, StagingArgs};
use super::values;
use crate::cache::Cache;
use crate::cache::folder::DEFAULT_LIMIT;
use crate::error::{Error, Note, Result};
use crate::film::output::Format;
use crate::measure::units;
use crate::options::{
    Accel, AccelOptions, Adaptive, Area, Cell, Direct, Integrator, Intersection, LeafFormat, LightSampling,
    LightSelection, NodeFormat, Precision, RenderOptions, Sampler, Trust,
};
use crate::scene::SceneOptions;
use crate::scene::camera::Camera;
use crate::scene::settings::settings_file;
use crate::scene::stage::{Stage, UpAxis};
use crate::scene::viewpoint::{CameraChoice, Explicit};
use glam::DVec3;
use std::path::{Path, PathBuf};

/// The most pixels that one render may have: 16384 × 16384.
const MAX_PIXELS: u64 = 1 << 28;

/// Bytes of all layers of a picture, a pixel: four colours or vectors, depth, sample count.
const LAYER_BYTES: u64 = 4 * 12 + 4 + 4;

/// Unless a folder is named, only larger trees are kept: smaller ones take a fraction of a second to build.
const CACHED_ABOVE: usize = 1_000_000;

impl StorageRequest {
    /// Stands for the files of the cache, beside which half-written ones may have to be removed.
    pub fn kept(&self) -> Option<PathBuf> {
        self.cache.as_ref().map(|cache| cache.folder.join("tree"))
    }
}

/// Everything that `comber render` and `comber info` need to know.
#[derive(Debug)]
pub struct RenderRequest {
    /// What to load.
    pub scene: SceneRequest,
    /// From where to see it.
    pub view: ViewRequest,
    /// How to render it.
    pub options: RenderOptions,
    /// Where to leave it.
    pub outputs: Outputs,
    /// A pixel and its sample that are told instead.
    pub explain: Option<([u32; 2], u32)>,
    /// What to say about it.
    pub report: ReportArgs,
    /// What the user should know about the options.
    pub notes: Vec<Note>,
}

/// Everything that `comber bvh` needs to know.
#[derive(Debug)]
pub struct BvhRequest {
    /// What to load.
    pub scene: SceneRequest,
    /// From where to see it.
    pub view: ViewRequest,
    /// How to render the background.
    pub options: RenderOptions,
    /// Level of the tree.
    pub depth: u32,
    /// The files.
    pub outputs: Vec<PathBuf>,
    /// What to say about it.
    pub report: ReportArgs,
    /// What the user should know about the options.
    pub notes: Vec<Note>,
}

/// Where a scene comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SceneSource {
    /// Embedded in the program.
    BuiltIn,
    /// Generated from a `proc:` specification.
    Generated(String),
    /// Read from a file.
    File(PathBuf),
}

/// Which scene, and what is made of it.
#[derive(Debug)]
pub struct SceneRequest {
    /// Where it comes from.
    pub source: SceneSource,
    /// The stage that was asked for.
    pub stage: Option<Stage>,
    /// The up axis that was asked for.
    pub up: Option<UpAxis>,
    /// How it is built.
    pub options: SceneOptions,
    /// How exactly its positions are wanted.
    pub precision: Precision,
    /// How much memory it may take, and where its tree is kept.
    pub storage: StorageRequest,
}

/// How much memory may be used, and where trees are kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StorageRequest {
    /// The most bytes of memory; all that is available if `None`.
    pub memory_limit: Option<u64>,
    /// Where trees are kept, if at all.
    pub cache: Option<Cache>,
    /// Only trees of more primitives are kept.
    pub cache_above: usize,
}

/// From where a scene is seen.
#[derive(Debug, PartialEq)]
pub struct ViewRequest {
    /// Where the camera stands.
    pub framing: Framing,
    /// What the command line says differently.
    pub explicit: Explicit,
}

/// Where a camera comes from.
#[derive(Debug, PartialEq)]
pub enum Framing {
    /// The scene's own or its stage's, whichever it has.
    Scene,
    /// The scene's, placed in this way.
    Choice(CameraChoice),
    /// A settings file.
    Settings {
        /// The camera, around the origin of coordinates.
        camera: Camera,
        /// Its position as the file states it.
        position: DVec3,
    },
}

/// The files that a render leaves.
#[derive(Debug, PartialEq)]
pub struct Outputs {
    /// Pictures, as PNG or EXR.
    pub pictures: Vec<PathBuf>,
    /// Heat map of samples a pixel.
    pub rate: Option<PathBuf>,
    /// Stops of exposure of PNG pictures.
    pub exposure: f32,
}

impl Outputs {
    /// All files.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        self.pictures.iter().chain(&self.rate).map(PathBuf::as_path)
    }
}

impl RenderRequest {
    /// Makes sense of `args`, or says why not.
    pub fn new(args: RenderArgs) -> Result<Self> {
        let mut notes = Vec::new();
        let (view, size) = view(&args.camera, &mut notes)?;
        let default = RenderOptions::default();
        let (width, height, cell) = frame(&args.frame, size.unwrap_or([default.width, default.height]))?;
        let outputs = outputs(&args.output, args.sampling.adaptive.is_some(), &mut notes)?;
        let direct = match (args.transport.hemisphere, args.transport.direct) {
            (true, Some(other)) if other != Direct::Hemisphere => {
                return misuse("-H asks for hemisphere sampling, but --direct asks for something else");
            }
            (true, _) => Direct::Hemisphere,
            (false, direct) => direct.unwrap_or_default(),
        };
        if direct == Direct::Bsdf && args.transport.light_samples > 1 {
            notes.push(Note::warning("--light-samples changes nothing: --direct bsdf sends no rays to lights"));
        }
        if matches!(direct, Direct::Bsdf | Direct::Hemisphere) {
            let way = "--direct bsdf and hemisphere choose no light and no point on one";
            if args.transport.light_selection != LightSelection::Auto {
                notes.push(Note::warning(format!("--light-selection changes nothing: {way}")));
            }
            if args.transport.light_sampling != LightSampling::default() {
                notes.push(Note::warning(format!("--light-sampling changes nothing: {way}")));
            }
        }
        let options = RenderOptions {
            width,
            height,
            cell,
            samples: args.sampling.samples,
            light_samples: args.transport.light_samples,
            max_depth: args.transport.depth,
            integrator: args.transport.integrator,
            direct,
            light_sampling: args.transport.light_sampling,
            light_selection: args.transport.light_selection,
            roulette: args.transport.roulette,
            clamp_indirect: args.transport.clamp_indirect,
            adaptive: adaptive(&args.sampling, outputs.exposure, &mut notes)?,
            sampler: args.sampling.sampler,
            replicates: replicates(&args.sampling)?,
            reuse: args.sampling.reuse,
            lamp_rays: args.sampling.lamp_rays,
            seed: args.sampling.seed,
            accel: accel(&args.speed.accel)?,
            aovs: outputs.pictures.iter().any(|path| is(path, Format::Exr)),
            wave: args.speed.wave,
            threads: args.speed.threads,
            simd: args.speed.simd,
        };
        let (first, last) = options.integrator.bounces(options.max_depth).unwrap_or((1, 0));
        if options.reuse > 1 && last < 2 {
            notes.push(Note::warning("--reuse changes nothing: no light bounces twice"));
        }
        if options.lamp_rays > 1 && first > 0 {
            notes.push(Note::warning("--lamp-rays changes nothing: lights are not shown themselves"));
        }
        if options.clamp_indirect.is_some() && last < 2 {
            notes.push(Note::warning("--clamp-indirect changes nothing: no light bounces twice"));
        }
        if let Some(other) = options.not_in_double() {
            return misuse(format!("--precision f64 does not go with --{other}"));
        }
        if let Some(other) = options.not_in_reuse() {
            return misuse(format!("--reuse does not go with --{other}"));
        }
        let explain = args.explain.pixel.map(|pixel| (pixel, args.explain.sample.unwrap_or(0)));
        if explain.is_some() && options.shares() {
            let part = if options.reuse > 1 { "--reuse" } else { "--lamp-rays" };
            return misuse(format!("--explain follows a path by itself, which {part} adds others to: leave it out"));
        }
        if let Some(([x, y], _)) = explain.filter(|([x, y], _)| *x >= width || *y >= height) {
            return misuse(format!("--pixel {x},{y} is not in the frame of {width} × {height} pixels"));
        }
        let scene = SceneRequest { precision: options.accel.precision, ..scene(args.scene) };
        let named = scene.storage.cache.is_some() && scene.storage.cache_above == 0;
        if named && scene.precision == Precision::F64 {
            notes.push(Note::warning("--cache changes nothing: trees in double precision are built anew each time"));
        }
        Ok(RenderRequest { scene, view, options, outputs, explain, report: args.report, notes })
    }

    /// Of renders that leave no pictures of their own.
    pub fn without_outputs(
        scene: SceneArgs,
        frame: FrameArgs,
        sampling: SamplingArgs,
        transport: TransportArgs,
        camera: CameraArgs,
        speed: SpeedArgs,
        report: ReportArgs,
    ) -> Result<Self> {
        // Of a PNG: an EXR would ask for layers.
        let output = OutputArgs { output: vec!["none.png".into()], rate: None, exposure: None };
        let explain = ExplainArgs { explain: false, pixel: None, sample: None };
        let args = RenderArgs { scene, output, frame, sampling, transport, camera, speed, explain, report };
        let mut request = RenderRequest::new(args)?;
        request.outputs = Outputs { pictures: Vec::new(), rate: None, exposure: 0.0 };
        Ok(request)
    }

    /// Refuses what only `comber render` does.
    pub fn is_a_render(self) -> Result<Self> {
        match self.explain {
            Some(_) => misuse("--explain goes with `comber render` only"),
            None => Ok(self),
        }
    }
}

impl BvhRequest {
    /// Makes sense of `args`, or says why not.
    pub fn new(args: BvhArgs) -> Result<Self> {
        let mut notes = Vec::new();
        let (view, size) = view(&args.camera, &mut notes)?;
        let (width, height, _) = frame(&FrameArgs { size: args.size, cell: None }, size.unwrap_or([960, 720]))?;
        let outputs = if args.output.is_empty() { vec!["comber_bvh.png".into()] } else { args.output };
        check_names(&outputs)?;
        Ok(BvhRequest {
            scene: scene(args.scene),
            view,
            options: RenderOptions {
                width,
                height,
                // Normals are cheap, and four samples a pixel smooth the edges.
                integrator: Integrator::Normals,
                samples: 4,
                threads: args.threads,
                ..RenderOptions::default()
            },
            depth: args.depth,
            outputs,
            report: args.report,
            notes,
        })
    }
}

/// The acceleration structure that was asked for.
pub fn accel(args: &AccelArgs) -> Result<AccelOptions> {
    let AccelArgs { accel: kind, bvh, nodes, leaves, intersection, precision } = *args;
    if kind == Accel::Brute {
        if bvh.is_some() {
            return misuse("--bvh says how good a tree to build, but --accel brute builds none");
        }
        if nodes.is_some() {
            return misuse("--nodes says how the nodes of a tree are stored, but --accel brute builds none");
        }
        if leaves.is_some() {
            return misuse("--leaves says how the leaves of a tree are stored, but --accel brute builds none");
        }
    }
    if (intersection, nodes) == (Intersection::Fast, Some(NodeFormat::Compact)) {
        return misuse("--nodes compact goes with --intersection watertight only");
    }
    if leaves == Some(LeafFormat::Compact) {
        if intersection == Intersection::Fast {
            return misuse("--leaves compact goes with --intersection watertight only");
        }
        if nodes == Some(NodeFormat::Full) {
            return misuse("--leaves compact does not go with --nodes full, but with compact nodes");
        }
    }
    if precision == Precision::F64 {
        let chosen = [
            ("--bvh", "quality", bvh.is_some()),
            ("--nodes", "kind of nodes", nodes.is_some()),
            ("--leaves", "kind of leaves", leaves.is_some()),
        ];
        if let Some((option, what, _)) = chosen.into_iter().find(|(_, _, is_given)| *is_given) {
            return misuse(format!("{option} does not go with --precision f64, whose tree comes in one {what}"));
        }
    }
    let (quality, nodes, leaves) = (bvh.unwrap_or_default(), nodes.unwrap_or_default(), leaves.unwrap_or_default());
    Ok(AccelOptions { kind, quality, nodes, leaves, intersection, precision })
}

fn misuse<T>(what: impl Into<String>) -> Result<T> {
    Err(Error::Options(what.into()))
}

/// Frame size and cell; `size` is used if none is asked for.
fn frame(args: &FrameArgs, size: [u32; 2]) -> Result<(u32, u32, Option<Cell>)> {
    let [width, height] = match args.size.as_deref() {
        Some(&[width, height]) => [width, height],
        _ => size,
    };
    let cell = match args.cell.as_deref() {
        Some(&[x, y, width, height]) => Some(Cell { x, y, width, height }),
        _ => None,
    };
    if let Some(cell) = cell {
        if cell.width == 0 || cell.height == 0 {
            return misuse("the cell (-p) is empty: DX and DY must be at least 1");
        }
        // Numbers of a cell are at most 65536, so the sums fit.
        if cell.x + cell.width > width || cell.y + cell.height > height {
            return misuse(format!(
                "the cell (-p) reaches to pixel {}, {}, but the frame (-r) has {width} × {height} pixels",
                cell.x + cell.width - 1,
                cell.y + cell.height - 1,
            ));
        }
    }
    let (across, down) = cell.map_or((width, height), |cell| (cell.width, cell.height));
    let pixels = u64::from(across) * u64::from(down);
    if pixels > MAX_PIXELS {
        return misuse(format!(
            "{across} × {down} are {} pixels, for which the layers of an EXR output alone would take {}; at most {} \
             (16384 × 16384) are allowed: render it in cells (-p)",
            units::count(pixels),
            units::bytes(pixels * LAYER_BYTES),
            units::count(MAX_PIXELS),
        ));
    }
    Ok((width, height, cell))
}

/// Output files, with the defaults.
fn outputs(args: &OutputArgs, adaptive: bool, notes: &mut Vec<Note>) -> Result<Outputs> {
    let pictures =
        if args.output.is_empty() { vec!["comber.png".into(), "comber.exr".into()] } else { args.output.clone() };
    check_names(&pictures)?;
    let png = pictures.iter().find(|path| is(path, Format::Png));
    if let Some(rate) = args.rate.as_deref().filter(|path| !is(path, Format::Png)) {
        return misuse(format!("{}: a heat map (--rate) must end in .png", rate.display()));
    }
    let rate = args.rate.clone().or_else(|| png.filter(|_| adaptive).map(|path| beside(path, "_rate.png")));
    if let Some(rate) = rate.as_ref().filter(|rate| pictures.contains(rate)) {
        return misuse(format!("{}: the picture and the heat map cannot be the same file", rate.display()));
    }
    if args.exposure.is_some() && png.is_none() {
        notes.push(Note::warning("--exposure changes nothing: no PNG is written, and EXR keeps radiance as it is"));
    }
    Ok(Outputs { pictures, rate, exposure: args.exposure.unwrap_or(0.0) })
}

/// Checks that pictures have formats that can be written, and different names.
fn check_names(paths: &[PathBuf]) -> Result<()> {
    for (index, path) in paths.iter().enumerate() {
        Format::of(path)?;
        if paths[..index].contains(path) {
            return misuse(format!("{}: given twice as an output", path.display()));
        }
    }
    Ok(())
}

/// Whether a picture of this name is written in this format.
pub fn is(path: &Path, format: Format) -> bool {
    Format::of(path).is_ok_and(|found| found == format)
}

/// `dir/name.png` → `dir/name<suffix>`; the name need not be text.
fn beside(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(suffix);
    path.with_file_name(name)
}

/// Sequences a pixel: several where a rule has to know how far they are apart.
fn replicates(args: &SamplingArgs) -> Result<u32> {
    let halves = args.adaptive_trust == Some(Trust::Halves);
    let each = halves || args.adaptive_area == Some(Area::Pixel);
    let correlated = args.sampler != Sampler::Independent;
    match args.replicates {
        Some(few) if few < 4 && correlated && halves => misuse(format!(
            "--adaptive-trust halves compares sequences within each half: {few} are too few (--replicates)"
        )),
        Some(replicates) if replicates > args.samples => {
            misuse(format!("--replicates {replicates}: pixels get {} samples (-s)", args.samples))
        }
        Some(replicates) => Ok(replicates),
        None if args.adaptive.is_some() && correlated && each => {
            Ok(ADAPTIVE_REPLICATES.min(args.samples.max(2).next_power_of_two() / 2))
        }
        None => Ok(1),
    }
}

/// Sequences a pixel where it is judged by itself, or a half by the other, and nothing is said. A tile needs no more than one ([`crate::film::doubling`]).
pub(super) const ADAPTIVE_REPLICATES: u32 = 16;

/// `-a BATCH TOLERANCE` and what goes with it.
fn adaptive(args: &SamplingArgs, exposure: f32, notes: &mut Vec<Note>) -> Result<Option<Adaptive>> {
    let Some([batch, tolerance]) = args.adaptive.as_deref() else {
        return Ok(None);
    };
    let batch =
        values::whole_in(batch, 1..=MAX_SAMPLES).or_else(|why| misuse(format!("'{batch}', the BATCH of -a, {why}")))?;
    let tolerance =
        values::positive(tolerance).or_else(|why| misuse(format!("'{tolerance}', the TOLERANCE of -a, {why}")))?;
    if let Some(least) = args.min_samples.filter(|&least| least > args.samples) {
        return misuse(format!("--min-samples {least} is more than the {} samples that pixels get (-s)", args.samples));
    }
    if batch >= args.samples {
        notes.push(Note::warning(format!(
            "-a changes nothing: the first test is after {batch} samples, and pixels get {} (-s)",
            args.samples
        )));
    }
    Ok(Some(Adaptive {
        batch,
        tests: args.adaptive_tests.unwrap_or_default(),
        trust: args.adaptive_trust.unwrap_or_default(),
        area: args.adaptive_area.unwrap_or_default(),
        tolerance,
        // As shown: of a picture exposed up, darker parts matter.
        floor: args.adaptive_floor.unwrap_or(Adaptive::FLOOR * (-exposure).exp2()),
        confidence: args.confidence.unwrap_or_default(),
        // One sample has no variance.
        min_samples: args.min_samples.unwrap_or(batch.max(2)),
    }))
}

fn scene(args: SceneArgs) -> SceneRequest {
    scene_at(args.path.or(args.scene), &args.staging)
}

/// The scene of that name; the built-in one without a name.
pub fn scene_at(path: Option<PathBuf>, staging: &StagingArgs) -> SceneRequest {
    let source = path.map_or(SceneSource::BuiltIn, scene_source);
    let options = SceneOptions { normals: staging.normals, substitute_materials: staging.substitute_materials };
    SceneRequest {
        source,
        stage: staging.stage,
        up: staging.up,
        options,
        precision: Precision::F32,
        storage: storage(&staging.storage),
    }
}

/// Memory and cache, with the defaults.
fn storage(args: &StorageArgs) -> StorageRequest {
    let limit = args.cache_limit.unwrap_or(DEFAULT_LIMIT);
    let folder = match args.cache.as_deref() {
        Some(word) if word == Path::new("off") => None,
        Some(folder) => Some(folder.to_path_buf()),
        None => Cache::users_folder(),
    };
    StorageRequest {
        memory_limit: args.memory_limit,
        cache: folder.map(|folder| Cache { folder, limit }),
        cache_above: if args.cache.is_some() { 0 } else { CACHED_ABOVE },
    }
}

/// A file, or a mesh to generate.
pub fn scene_source(path: PathBuf) -> SceneSource {
    match path.to_str().filter(|text| text.starts_with("proc:")) {
        Some(specification) => SceneSource::Generated(specification.to_owned()),
        None => SceneSource::File(path),
    }
}

/// From where, and the frame size that goes with it if a settings file has one.
pub fn view(args: &CameraArgs, notes: &mut Vec<Note>) -> Result<(ViewRequest, Option<[u32; 2]>)> {
    let settings = args.camera_settings.as_deref().map(settings_file).transpose()?;
    let mut size = None;
    let framing = match (settings, args.camera) {
        (Some(settings), _) => {
            notes.extend(settings.notes);
            size = Some([settings.width, settings.height]);
            Framing::Settings { camera: settings.camera, position: settings.position }
        }
        (None, Some(choice)) => Framing::Choice(choice),
        (None, None) => Framing::Scene,
    };
    let explicit = Explicit { position: args.vp, target: args.vi, up: args.vu, xfov: args.xfov, yfov: args.yfov };
    Ok((ViewRequest { framing, explicit }, size))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::args::{Cli, Command};
    use crate::options::Area;
    use crate::options::Roulette;
    use clap::Parser as _;
    use glam::DVec3;

    fn resolve(line: &str) -> Result<RenderRequest> {
        let words = ["comber", "render"].into_iter().chain(line.split_whitespace()).map(Into::into);
        match Cli::try_parse_from(values::join_vectors(words)).expect("clap accepts it").command {
            Command::Render(args) => RenderRequest::new(args),
            other => panic!("{other:?}"),
        }
    }

    fn refused(line: &str) -> String {
        match resolve(line) {
            Err(Error::Options(why)) => why,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn clap_finds_no_mistake_in_the_definition() {
        <Cli as clap::CommandFactory>::command().debug_assert();
    }

    #[test]
    fn what_pixels_share_is_resolved_and_contradictions_are_refused() {
        let options = resolve("--reuse 16 --lamp-rays 12").unwrap().options;
        assert_eq!((options.reuse, options.lamp_rays), (16, 12));
        assert!(refused("--reuse 16 -a 8 0.1").contains("--adaptive"));
        assert!(refused("--reuse 4 --clamp-indirect 2").contains("--clamp-indirect"));
        assert!(refused("--reuse 4 --precision f64").contains("--reuse"));
        assert!(refused("--lamp-rays 4 --precision f64").contains("--lamp-rays"));
        let noted = |line: &str| resolve(line).unwrap().notes.into_iter().map(|note| note.text).collect::<Vec<_>>();
        assert_eq!(noted("--reuse 4 -m 1"), ["--reuse changes nothing: no light bounces twice"]);
        assert_eq!(noted("--lamp-rays 4 --integrator normals").len(), 1);
        assert!(noted("--reuse 4 --lamp-rays 4 -m 2").is_empty());
        for part in ["--reuse", "--lamp-rays"] {
            assert!(refused(&format!("{part} 2 --explain --pixel 1,1")).contains(part));
        }
    }

    #[test]
    fn without_arguments_the_defaults_hold() {
        let request = resolve("").unwrap();
        assert_eq!(request.scene.source, SceneSource::BuiltIn);
        assert_eq!(request.view, ViewRequest { framing: Framing::Scene, explicit: Explicit::default() });
        assert_eq!(request.outputs.pictures, ["comber.png", "comber.exr"].map(PathBuf::from));
        assert_eq!(request.outputs.rate, None);
        assert!(request.notes.is_empty());
        let expected = RenderOptions { aovs: true, ..RenderOptions::default() };
        assert_eq!(format!("{:?}", request.options), format!("{expected:?}"));
    }

    #[test]
    fn a_command_line_of_the_course() {
        let request =
            resolve("-t 8 -s 64 -l 32 -m 6 -r 640 360 -a 16 0.05 -p 1 2 3 4 -H -f out.png scene.dae").unwrap();
        let options = &request.options;
        assert_eq!(request.scene.source, SceneSource::File("scene.dae".into()));
        assert_eq!((options.width, options.height), (640, 360));
        assert_eq!(options.cell, Some(Cell { x: 1, y: 2, width: 3, height: 4 }));
        assert_eq!((options.samples, options.light_samples, options.max_depth), (64, 32, 6));
        assert_eq!((options.threads, options.direct), (Some(8), Direct::Hemisphere));
        let adaptive = Adaptive {
            batch: 16,
            tolerance: 0.05,
            confidence: Default::default(),
            min_samples: 16,
            area: Area::Tile,
            floor: 0.1,
            ..Adaptive::COURSE
        };
        assert_eq!(options.adaptive, Some(adaptive));
        assert!(!options.aovs, "a PNG has no layers");
        assert_eq!(request.outputs.pictures, [PathBuf::from("out.png")]);
        assert_eq!(request.outputs.rate, Some("out_rate.png".into()));
    }

    #[test]
    fn the_last_of_two_wins_but_outputs_add_up() {
        let request = resolve("-s 1 -s 2 -r 1 2 -r 3 4 -a 1 0.1 -a 2 0.2 -o a.png --outfile b.EXR").unwrap();
        assert_eq!((request.options.samples, request.options.width, request.options.height), (2, 3, 4));
        assert_eq!(request.options.adaptive.map(|adaptive| adaptive.batch), Some(2));
        assert_eq!(request.outputs.pictures, ["a.png", "b.EXR"].map(PathBuf::from));
        assert!(request.options.aovs);
    }

    #[test]
    fn adaptive_sampling() {
        let adaptive = |line: &str| resolve(line).unwrap().options.adaptive.unwrap();
        assert_eq!(adaptive("-a 1 0.1").min_samples, 2, "one sample has no variance");
        let course = Adaptive { batch: 8, tolerance: 0.1, min_samples: 4, floor: 0.1, ..Adaptive::COURSE };
        assert_eq!(adaptive("-a 8 0.1 --confidence z --min-samples 4 --adaptive-area pixel"), course);
        assert_eq!(adaptive("-a 8 0.1 --adaptive-floor 0.02").floor, 0.02);
        assert_eq!(adaptive("-a 8 0.1 --exposure 3").floor, 0.1 / 8.0, "as shown");
        let replicates = |line: &str| resolve(line).unwrap().options.replicates;
        assert_eq!(replicates("-a 8 0.1"), 1, "a tile needs no others");
        assert_eq!(replicates("-a 8 0.1 --adaptive-area pixel"), 16);
        assert_eq!(replicates("-a 8 0.1 --adaptive-trust halves"), 16);
        assert_eq!(replicates("-a 8 0.1 --adaptive-trust halves --sampler independent"), 1);
        assert_eq!(resolve("-s 8 -a 8 0.1").unwrap().notes.len(), 1, "it has no effect");
        assert_eq!(resolve("-s 9 -a 8 0.1").unwrap().notes.len(), 0);
        assert!(refused("-s 8 -a 4 0.1 --min-samples 9").contains("9"));
        assert!(refused("-a 1.5 0.1").contains("BATCH"));
        assert!(refused("-a 4 inf").contains("TOLERANCE"));
    }

    #[test]
    fn scenes_come_from_three_places() {
        let source = |line: &str| resolve(line).unwrap().scene.source;
        assert_eq!(source("proc:cubes,tris=1M"), SceneSource::Generated("proc:cubes,tris=1M".into()));
        assert_eq!(source("--scene proc:cubes"), SceneSource::Generated("proc:cubes".into()));
        assert_eq!(source("--scene a.ply"), SceneSource::File("a.ply".into()));
        assert_eq!(source(""), SceneSource::BuiltIn);
    }

    #[test]
    fn trees_are_kept_where_the_command_line_says() {
        let storage = |line: &str| resolve(line).unwrap().scene.storage;
        assert_eq!((storage("").memory_limit, storage("").cache_above), (None, 1_000_000));
        assert_eq!(storage("--cache off").cache, None);
        let named = storage("--cache trees --cache-limit 1G --memory-limit 2GiB");
        assert_eq!(named.cache, Some(Cache { folder: "trees".into(), limit: 1 << 30 }));
        assert_eq!((named.cache_above, named.memory_limit), (0, Some(2 << 30)));
    }

    #[test]
    fn views() {
        let view = |line: &str| resolve(line).unwrap().view;
        let explicit = Explicit {
            position: Some(DVec3::new(-1.0, 2.0, -0.003)),
            target: Some(DVec3::ZERO),
            up: Some(DVec3::NEG_Z),
            xfov: None,
            yfov: Some(30.0),
        };
        let both = ["--vp -1 2 -3e-3 --vi 0 0 0 --vu 0 0 -1", "--vp -1,2,-3e-3 --vi=0,0,0 --vu 0,0,-1"];
        for line in both {
            let expected = ViewRequest { framing: Framing::Scene, explicit };
            assert_eq!(view(&format!("{line} --yfov 30 a.dae")), expected);
        }
        assert_eq!(view("--camera file").framing, Framing::Choice(CameraChoice::File));
    }

    #[test]
    fn cells_stay_within_the_frame() {
        assert!(resolve("-r 10 8 -p 9 7 1 1").is_ok());
        assert!(refused("-r 10 8 -p 9 7 2 1").contains("pixel 10, 7"));
        assert!(refused("-r 10 8 -p 9 7 1 2").contains("pixel 9, 8"));
        assert!(refused("-p 65536 65536 65536 65536").contains("480 × 360"));
        assert!(refused("-p 0 0 1 0").contains("empty"));
    }

    #[test]
    fn a_part_of_a_frame_that_is_too_large_may_be_rendered() {
        assert!(resolve("-r 16384 16384").is_ok());
        assert!(resolve("-r 65536 65536 -p 65000 65000 100 100").is_ok());
    }

    #[test]
    fn what_has_no_effect_is_noted() {
        for line in [
            "--direct bsdf -l 4",
            "--exposure 1 -o a.exr",
            "--precision f64 --cache trees",
            "--clamp-indirect 2 -m 1",
            "--clamp-indirect 2 --integrator direct",
        ] {
            let notes = resolve(line).unwrap().notes;
            assert!(notes.len() == 1 && notes[0].warning, "{line}: {notes:?}");
        }
        assert_eq!(resolve("--roulette fixed:0.5").unwrap().options.roulette, Roulette::Fixed(0.5));
    }

    #[test]
    fn heat_maps_stand_beside_the_picture() {
        let rate = |line: &str| resolve(line).unwrap().outputs.rate;
        assert_eq!(rate("-a 8 0.1 -o b.exr -o dir/a.b.PNG"), Some("dir/a.b_rate.png".into()));
        assert_eq!(rate("-a 8 0.1 -o b.exr"), None);
        assert_eq!(rate("--rate r.png -o b.exr"), Some("r.png".into()));
        assert!(refused("--rate r.exr").contains(".png"));
        assert!(refused("-a 8 0.1 -o a.png -o a_rate.png").contains("same file"));
    }
}
