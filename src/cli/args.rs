//! Arguments as typed. What they mean together is decided in [`super::resolve`].

use super::bench::args::BenchArgs;
use super::diff::args::DiffArgs;
use super::profile::args::ProfileArgs;
use super::reference::args::ReferenceArgs;
use super::trade::args::TradeArgs;
use super::values::{self, choice, whole};
use crate::options::{
    Accel, Area, Confidence, Direct, Integrator, Intersection, LeafFormat, LightSampling, LightSelection, NodeFormat,
    Normals, Precision, Quality, Roulette, Sampler, Simd, Tests, Trust,
};
use crate::scene::stage::{Stage, UpAxis};
use crate::scene::viewpoint::CameraChoice;
use clap::{ArgAction, Args, Parser, Subcommand};
use glam::DVec3;
use std::path::PathBuf;
use std::time::Duration;

/// The most samples a pixel, and the largest batch: two of them still add up in 32 bits.
pub const MAX_SAMPLES: u32 = i32::MAX as u32;

/// A wavefront path tracer for the CPU.
///
/// comber renders triangle meshes and spheres by path tracing: many paths advance together, one stage at a
/// time. It reads COLLADA (.dae), PLY and OBJ files, makes test scenes of any size, and writes OpenEXR and PNG.
#[derive(Debug, Parser)]
#[command(name = "comber", version, propagate_version = true, after_help = TOP_EXAMPLES, max_term_width = 110)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a picture.
    Render(RenderArgs),
    /// Explain what a render would do, and with what: stages, columns, memory, scene, tree.
    Info(InfoArgs),
    /// Draw the boxes of one level of the bounding volume hierarchy.
    Bvh(BvhArgs),
    /// Measure rays per second, beside Embree if asked, with agreement checked.
    Bench(BenchArgs),
    /// Say where the time of a render goes: by stage and bounce, by pixel, beside the machine's ceilings.
    Profile(ProfileArgs),
    /// Say how far a picture is from another: errors, bias and variance, tests by standard errors.
    Diff(DiffArgs),
    /// Render until a stated relative error is reached, with the standard error of every pixel.
    Reference(ReferenceArgs),
    /// Measure what accuracy costs: error and time of every combination of some options.
    Trade(TradeArgs),
    /// Write a mesh as PLY, as it is or split into smaller triangles.
    Mesh(MeshArgs),
    /// List or remove the trees that are kept on disk.
    Cache(CacheArgs),
}

/// `comber render`.
#[derive(Debug, Args)]
#[command(args_override_self = true, after_help = RENDER_NOTES)]
pub struct RenderArgs {
    /// Which scene.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Which files.
    #[command(flatten)]
    pub output: OutputArgs,
    /// How large.
    #[command(flatten)]
    pub frame: FrameArgs,
    /// How many samples.
    #[command(flatten)]
    pub sampling: SamplingArgs,
    /// Which light.
    #[command(flatten)]
    pub transport: TransportArgs,
    /// From where.
    #[command(flatten)]
    pub camera: CameraArgs,
    /// How fast.
    #[command(flatten)]
    pub speed: SpeedArgs,
    /// One sample instead.
    #[command(flatten)]
    pub explain: ExplainArgs,
    /// What to say.
    #[command(flatten)]
    pub report: ReportArgs,
}

/// Which sample is told vertex by vertex, instead of a render.
#[derive(Debug, Args)]
#[command(next_help_heading = "One sample")]
pub struct ExplainArgs {
    /// Render nothing: tell what one sample of one pixel does, vertex by vertex.
    #[arg(long, requires = "pixel")]
    pub explain: bool,
    /// The pixel, from the left and from the top of the frame.
    #[arg(long, value_name = "X,Y", value_parser = values::pixel, requires = "explain")]
    pub pixel: Option<[u32; 2]>,
    /// Its sample [default: 0, the first].
    #[arg(long, value_name = "N", value_parser = whole(0, u32::MAX), requires = "explain",
          allow_negative_numbers = true)]
    pub sample: Option<u32>,
}

/// `comber info`.
#[derive(Debug, Args)]
#[command(args_override_self = true, after_help = INFO_EXAMPLES)]
pub struct InfoArgs {
    /// The render to explain.
    #[command(flatten)]
    pub render: RenderArgs,
}

/// `comber bvh`.
#[derive(Debug, Args)]
#[command(args_override_self = true, after_help = BVH_EXAMPLES)]
pub struct BvhArgs {
    /// Which scene.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Level of the tree whose boxes are drawn: 0 is the whole scene.
    #[arg(long, value_name = "D", default_value_t = 4, value_parser = whole(0, 1024), allow_negative_numbers = true)]
    pub depth: u32,
    /// Write the picture here; .png or .exr. May be given several times [default: comber_bvh.png].
    #[arg(short, long, visible_short_alias = 'f', visible_alias = "outfile", value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// Frame size in pixels [default: that of -c, else 960 720].
    #[arg(short = 'r', long, num_args = 2, value_names = ["W", "H"], value_parser = whole(1, 65536),
          action = ArgAction::Set, allow_negative_numbers = true)]
    pub size: Option<Vec<u32>>,
    /// From where.
    #[command(flatten)]
    pub camera: CameraArgs,
    /// Worker threads [default: one a processor].
    #[arg(short, long, visible_alias = "nthreads", value_name = "N", value_parser = whole(1, 1024),
          allow_negative_numbers = true, help_heading = "Speed (the picture stays the same)")]
    pub threads: Option<u32>,
    /// What to say.
    #[command(flatten)]
    pub report: ReportArgs,
}

/// `comber mesh`.
#[derive(Debug, Args)]
#[command(args_override_self = true, after_help = MESH_EXAMPLES)]
pub struct MeshArgs {
    /// A scene file (.dae, .ply, .obj), or a generated mesh (proc:NAME,tris=N,seed=S).
    #[arg(value_name = "INPUT")]
    pub scene: PathBuf,
    /// Write the mesh here.
    #[arg(short, long, value_name = "FILE.ply")]
    pub output: PathBuf,
    /// Split every triangle into N times N, by N steps along its edges.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole(1, 1024), allow_negative_numbers = true)]
    pub split: u32,
    /// Move every vertex by smooth noise of up to X times the mean edge of INPUT.
    #[arg(long, value_name = "X", default_value_t = 0.0, value_parser = values::share, allow_negative_numbers = true)]
    pub noise: f32,
    /// Write numbers as text [default: binary, big-endian].
    #[arg(long, conflicts_with = "little_endian")]
    pub ascii: bool,
    /// Write binary numbers with their lowest byte first.
    #[arg(long)]
    pub little_endian: bool,
    /// Worker threads [default: one a processor].
    #[arg(short, long, visible_alias = "nthreads", value_name = "N", value_parser = whole(1, 1024),
          allow_negative_numbers = true)]
    pub threads: Option<u32>,
    /// What to say.
    #[command(flatten)]
    pub report: ReportArgs,
}

/// `comber cache`.
#[derive(Debug, Args)]
#[command(after_help = CACHE_EXAMPLES)]
pub struct CacheArgs {
    /// What to do.
    #[command(subcommand)]
    pub action: CacheAction,
}

/// What `comber cache` does.
#[derive(Debug, Subcommand)]
pub enum CacheAction {
    /// List the trees, those used last first.
    Ls(CacheFolderArgs),
    /// Remove trees: all, those that were not used for a while, or one.
    Clear(CacheClearArgs),
    /// Print the folder.
    Path(CacheFolderArgs),
}

/// Which cache, and what to say of it.
#[derive(Debug, Args)]
pub struct CacheFolderArgs {
    /// Another folder than the user's.
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    /// Print JSON on standard output.
    #[arg(long)]
    pub json: bool,
}

/// Which trees to remove.
#[derive(Debug, Args)]
pub struct CacheClearArgs {
    /// Only this tree, by its key or the first digits of it.
    #[arg(value_name = "KEY", value_parser = values::key_digits)]
    pub key: Option<String>,
    /// Only trees that were last used longer ago than this: 90m, 12h, 30d, 4w.
    #[arg(long, value_name = "AGE", value_parser = values::age, conflicts_with = "key", allow_negative_numbers = true)]
    pub older_than: Option<Duration>,
    /// Which cache.
    #[command(flatten)]
    pub folder: CacheFolderArgs,
}

/// Which scene, and what is made of it.
#[derive(Debug, Args)]
#[command(next_help_heading = "Scene")]
pub struct SceneArgs {
    /// A scene file (.dae, .ply, .obj); or `proc:NAME[,tris=N][,seed=S]`, a generated mesh: sphere, torus, knot,
    /// terrain, blob, coral, soup or cubes, as in proc:knot,tris=1M. Without it, comber's own scene is used.
    #[arg(value_name = "SCENE", help_heading = None::<&str>)]
    pub path: Option<PathBuf>,
    /// The same as SCENE.
    #[arg(long, value_name = "SCENE", conflicts_with = "path")]
    pub scene: Option<PathBuf>,
    /// What is made of it.
    #[command(flatten)]
    pub staging: StagingArgs,
}

/// What is made of a scene.
#[derive(Debug, Args)]
#[command(next_help_heading = "Scene")]
pub struct StagingArgs {
    /// Put the scene on a stage with light and camera, in place of its own [default: cornell for scenes with neither
    /// light nor camera, none for others].
    #[arg(long, value_name = "STAGE", value_parser = choice(STAGES))]
    pub stage: Option<Stage>,
    /// The axis that points up in a scene that is put on a stage or framed [default: y].
    #[arg(long, value_name = "AXIS", value_parser = choice(UP_AXES))]
    pub up: Option<UpAxis>,
    /// Normals used for shading.
    #[arg(long, value_name = "KIND", default_value = "smooth", value_parser = choice(NORMALS))]
    pub normals: Normals,
    /// Render materials that are not modelled as diffuse ones, with a warning, instead of failing.
    #[arg(long)]
    pub substitute_materials: bool,
    /// How much of memory and disk.
    #[command(flatten)]
    pub storage: StorageArgs,
}

/// How much memory may be used, and where trees are kept.
#[derive(Debug, Args)]
#[command(next_help_heading = "Memory and cache (the picture stays the same)")]
pub struct StorageArgs {
    /// Fail, before it is taken, rather than use more memory than SIZE, as in 8GiB [default: what is available].
    #[arg(long, value_name = "SIZE", value_parser = values::size, allow_negative_numbers = true)]
    pub memory_limit: Option<u64>,
    /// Keep the tree of every scene in the folder DIR, and take it from there the next time; `off`: neither
    /// [default: trees of more than a million primitives, in the folder that `comber cache path` prints].
    #[arg(long, value_name = "DIR|off")]
    pub cache: Option<PathBuf>,
    /// Of the kept trees, remove those used longest ago beyond SIZE [default: 8GiB].
    #[arg(long, value_name = "SIZE", value_parser = values::size, allow_negative_numbers = true)]
    pub cache_limit: Option<u64>,
}

/// Which files, and how they look.
#[derive(Debug, Args)]
#[command(next_help_heading = "Output")]
pub struct OutputArgs {
    /// Write the picture here; may be given several times. FILE.png is for looking at, FILE.exr has linear floats
    /// and the layers albedo, normal, depth, variance and sample count [default: comber.png and comber.exr].
    #[arg(short, long, visible_short_alias = 'f', visible_alias = "outfile", value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// Write a heat map of the samples that each pixel got, with a legend [default: with -a and a PNG output
    /// NAME.png, NAME_rate.png].
    #[arg(long, value_name = "FILE.png")]
    pub rate: Option<PathBuf>,
    /// Multiply PNG outputs by 2 to this power. EXR outputs keep the measured radiance.
    #[arg(long, value_name = "STOPS", value_parser = values::exposure, allow_negative_numbers = true)]
    pub exposure: Option<f32>,
}

/// How large, and which part.
///
/// Lists of a fixed length are set, not appended to: of two, the last counts, as for single values.
#[derive(Debug, Args)]
#[command(next_help_heading = "Output")]
pub struct FrameArgs {
    /// Frame size in pixels [default: that of -c, else 480 360].
    #[arg(short = 'r', long, num_args = 2, value_names = ["W", "H"], value_parser = whole(1, 65536),
          action = ArgAction::Set, allow_negative_numbers = true)]
    pub size: Option<Vec<u32>>,
    /// Render only the cell of DX by DY pixels whose top left corner is the pixel X, Y of the frame.
    #[arg(short = 'p', long, num_args = 4, value_names = ["X", "Y", "DX", "DY"], value_parser = whole(0, 65536),
          action = ArgAction::Set, allow_negative_numbers = true)]
    pub cell: Option<Vec<u32>>,
}

/// How many samples, and where.
#[derive(Debug, Args)]
#[command(next_help_heading = "Sampling")]
pub struct SamplingArgs {
    /// Samples a pixel; with -a, the most that a pixel gets.
    #[arg(short, long, visible_alias = "spp", value_name = "N", default_value_t = 64,
          value_parser = whole(1, MAX_SAMPLES), allow_negative_numbers = true)]
    pub samples: u32,
    /// Adaptive sampling: after every BATCH samples, stop sampling tiles of 16 by 16 pixels (with --adaptive-area pixel,
    /// pixels) whose 95 % confidence interval has a half-width of at most TOLERANCE times the mean. As good as as many samples
    /// spread evenly, or better (README). Light that no sample of a tile has met is not waited for: where one sample in 10,000
    /// is bright, 44 % of the tiles miss it with a BATCH of 32, 19 % with 64, 4 % with 128; black tiles wait for 4 times BATCH.
    #[arg(short, long, num_args = 2, value_names = ["BATCH", "TOLERANCE"], action = ArgAction::Set,
          allow_negative_numbers = true)]
    pub adaptive: Option<Vec<String>>,
    /// With -a, the quantile of the confidence interval [default: t].
    #[arg(long, value_name = "KIND", requires = "adaptive", value_parser = choice(CONFIDENCES))]
    pub confidence: Option<Confidence>,
    /// With -a, when tests are made [default: batches].
    #[arg(long, value_name = "WHEN", requires = "adaptive", value_parser = choice(TESTS))]
    pub adaptive_tests: Option<Tests>,
    /// With -a, which test is believed [default: once].
    #[arg(long, value_name = "WHICH", requires = "adaptive", value_parser = choice(TRUSTS))]
    pub adaptive_trust: Option<Trust>,
    /// With -a, what stops together: pixels by themselves stop where luck has it; they are too dark by 7 % where one sample
    /// in 50 is lit, and miss nearly all light that is met once in 10,000 times [default: tile].
    #[arg(long, value_name = "WHAT", requires = "adaptive", value_parser = choice(AREAS))]
    pub adaptive_area: Option<Area>,
    /// With -a, a mean M counts as the root of M² + L²: what is darker need not be as good. By more than the default, tiles
    /// stop sooner; by less, dark parts take samples that others need more, for up to 1.4 times the error [default: 0.1; as
    /// shown, with --exposure].
    #[arg(long, value_name = "L", requires = "adaptive", value_parser = values::positive, allow_negative_numbers = true)]
    pub adaptive_floor: Option<f32>,
    /// With -a, no pixel stops with fewer samples [default: BATCH, at least 2].
    #[arg(long, value_name = "N", requires = "adaptive", value_parser = whole(2, MAX_SAMPLES),
          allow_negative_numbers = true)]
    pub min_samples: Option<u32>,
    /// Where random numbers come from.
    #[arg(long, value_name = "HOW", default_value = "sobol", value_parser = choice(SAMPLERS))]
    pub sampler: Sampler,
    /// Deal the samples of a pixel to N sequences that know nothing of each other, N a power of two: standard errors are right
    /// then, where they are an upper bound with 1; with less accuracy for the same samples [default: 1; 16 where
    /// --adaptive-area pixel or --adaptive-trust halves needs them, that is with a sampler other than independent].
    #[arg(long, value_name = "N", value_parser = values::power_of_two, allow_negative_numbers = true)]
    pub replicates: Option<u32>,
    /// Blocks of N pixels share the indirect light that their paths find: the same mean, and noise that neighbours have in common, but
    /// far less of it: 16 take 1.9 times the time for a sixth of the relMSE. N is a power of two of at most 64; not with -a.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = values::block, allow_negative_numbers = true)]
    pub reuse: u32,
    /// Camera rays a sample that look for lights alone, in pixels where one may be seen: edges of lamps are the noisiest part of
    /// most pictures, and 16 rays make them smooth for 4 % of the time.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole(1, 256), allow_negative_numbers = true)]
    pub lamp_rays: u32,
    /// Seed of all random numbers.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = whole(0, u32::MAX),
          allow_negative_numbers = true)]
    pub seed: u32,
}

impl Default for SamplingArgs {
    /// What the command line means that says nothing of it.
    fn default() -> SamplingArgs {
        #[derive(Parser)]
        struct Alone {
            #[command(flatten)]
            sampling: SamplingArgs,
        }
        Alone::parse_from([""]).sampling
    }
}

/// Which light is simulated, and how.
#[derive(Debug, Args)]
#[command(next_help_heading = "Light transport")]
pub struct TransportArgs {
    /// What the picture shows.
    #[arg(long, value_name = "WHAT", default_value = "path", value_parser = choice(INTEGRATORS))]
    pub integrator: Integrator,
    /// The most bounces of a path: 0 shows emission only, 1 direct light too, 2 the first indirect light, ….
    #[arg(short = 'm', long, value_name = "N", default_value_t = 5, value_parser = whole(0, 65536),
          allow_negative_numbers = true)]
    pub depth: u32,
    /// Rays towards each area light at each point of a path; with -H, rays over the hemisphere per light. Where lights are
    /// drawn, so many for each of at most 16.
    #[arg(short, long, value_name = "N", default_value_t = 1, value_parser = whole(1, 4096),
          allow_negative_numbers = true)]
    pub light_samples: u32,
    /// How direct light is estimated [default: mis].
    #[arg(long, value_name = "HOW", value_parser = choice(DIRECTS))]
    pub direct: Option<Direct>,
    /// The same as --direct hemisphere.
    #[arg(short = 'H', long)]
    pub hemisphere: bool,
    /// How points on lights are drawn.
    #[arg(long, value_name = "HOW", default_value = "corners", value_parser = choice(LIGHT_SAMPLINGS))]
    pub light_sampling: LightSampling,
    /// Which lights are asked at each point of a path.
    #[arg(long, value_name = "WHICH", default_value = "auto", value_parser = choice(LIGHT_SELECTIONS))]
    pub light_selection: LightSelection,
    /// When paths end early: `off`; `fixed:P` goes on with probability P, above 0 and at most 1; `throughput[:START]`
    /// goes on with the probability of the path's throughput, at most 0.95, once START bounces are done;
    /// `efficiency[:FACTOR]` traces every ray, of paths and towards lights, with the probability at which it is worth its
    /// work, learnt from a few samples beforehand; a larger FACTOR traces less.
    #[arg(long, value_name = "WHEN", default_value = "efficiency", value_parser = values::roulette)]
    pub roulette: Roulette,
    /// The most radiance (brightest channel) that a light may add to a sample at once after two bounces or more: fewer
    /// fireflies, for a picture that is too dark where they would be. Direct light and lamps stay as they are.
    #[arg(long, value_name = "RADIANCE", value_parser = values::positive, allow_negative_numbers = true)]
    pub clamp_indirect: Option<f32>,
}

/// From where.
#[derive(Debug, Args)]
#[command(next_help_heading = "Camera")]
pub struct CameraArgs {
    /// How the camera of the scene is placed [default: course if the scene file has the course's profile, file if
    /// it has another camera; scenes without camera are framed, or seen as their stage has it].
    #[arg(long, value_name = "HOW", value_parser = choice(CAMERAS))]
    pub camera: Option<CameraChoice>,
    /// Take camera and frame size from a settings file, as the course's renderer saves it.
    #[arg(short, long, value_name = "FILE", conflicts_with = "camera")]
    pub camera_settings: Option<PathBuf>,
    /// Put the camera here [default: with --vi, as far from there as the camera was from the centre of the scene].
    /// Vectors may also be three separate numbers: --vp 1 2 3.
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub vp: Option<DVec3>,
    /// Look at this point [default: with --vp, the centre of the scene].
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub vi: Option<DVec3>,
    /// This direction is up in the picture [default: 0,1,0].
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub vu: Option<DVec3>,
    /// Horizontal field of view. Frames of another shape than --xfov and --yfov prescribe show more, never less.
    #[arg(long, value_name = "DEGREES", value_parser = values::angle, allow_negative_numbers = true)]
    pub xfov: Option<f64>,
    /// Vertical field of view.
    #[arg(long, value_name = "DEGREES", value_parser = values::angle, allow_negative_numbers = true)]
    pub yfov: Option<f64>,
}

/// What changes the time but not the picture.
#[derive(Debug, Args)]
#[command(next_help_heading = "Speed (the picture stays the same)")]
pub struct SpeedArgs {
    /// Worker threads [default: one a processor].
    #[arg(short, long, visible_alias = "nthreads", value_name = "N", value_parser = whole(1, 1024),
          allow_negative_numbers = true)]
    pub threads: Option<u32>,
    /// Paths that advance together [default: as many as suit the cache].
    #[arg(long, value_name = "N", value_parser = whole(1, 1 << 24), allow_negative_numbers = true)]
    pub wave: Option<u32>,
    /// Instruction set.
    #[arg(long, value_name = "SET", default_value = "auto", value_parser = choice(SIMDS))]
    pub simd: Simd,
    /// What answers ray queries.
    #[command(flatten)]
    pub accel: AccelArgs,
}

/// What answers ray queries.
#[derive(Debug, Args)]
#[command(next_help_heading = "Acceleration structure")]
pub struct AccelArgs {
    /// What answers ray queries.
    #[arg(long, value_name = "KIND", default_value = "bvh", value_parser = choice(ACCELS))]
    pub accel: Accel,
    /// How much time the BVH is worth [default: default].
    #[arg(long, value_name = "QUALITY", value_parser = choice(QUALITIES))]
    pub bvh: Option<Quality>,
    /// How the nodes of the BVH are stored [default: auto].
    #[arg(long, value_name = "FORMAT", value_parser = choice(NODE_FORMATS))]
    pub nodes: Option<NodeFormat>,
    /// How the leaves of the BVH are stored [default: auto].
    #[arg(long, value_name = "FORMAT", value_parser = choice(LEAF_FORMATS))]
    pub leaves: Option<LeafFormat>,
    /// How rays are tested against triangles; the picture may change where triangles meet.
    #[arg(long, value_name = "TEST", default_value = "watertight", value_parser = choice(INTERSECTIONS))]
    pub intersection: Intersection,
    /// How exactly positions are known: f64 is for scenes both huge and fine, in which things are finer than a 10⁷th of their distance from
    /// the scene's centre.
    #[arg(long, value_name = "PRECISION", default_value = "f32", value_parser = choice(PRECISIONS))]
    pub precision: Precision,
}

/// What is said about it.
#[derive(Clone, Copy, Debug, Args)]
#[command(next_help_heading = "Report")]
pub struct ReportArgs {
    /// Print the report as JSON on standard output, and nothing else there.
    #[arg(long)]
    pub json: bool,
    /// No progress, notes or summary. Warnings and errors remain.
    #[arg(short, long)]
    pub quiet: bool,
}

const STAGES: &[(&str, &str, Stage)] = &[
    ("cornell", "the course's box, with its light and its camera", Stage::Cornell),
    ("studio", "a backdrop with three lights, seen from the side", Stage::Studio),
    ("none", "left where it is; if it has no camera it is framed, and lit if it is dark", Stage::None),
];

const UP_AXES: &[(&str, &str, UpAxis)] =
    &[("x", "+x is up", UpAxis::X), ("y", "+y is up", UpAxis::Y), ("z", "+z is up", UpAxis::Z)];

const NORMALS: &[(&str, &str, Normals)] = &[
    ("smooth", "interpolated vertex normals, where the scene has them", Normals::Smooth),
    ("flat", "the triangle's own", Normals::Flat),
];

pub(super) const CONFIDENCES: &[(&str, &str, Confidence)] = &[
    ("z", "normal: 1.96, as in the course", Confidence::Z),
    ("t", "Student's t, wider for few samples", Confidence::T),
];

pub(super) const TESTS: &[(&str, &str, Tests)] = &[
    ("batches", "after every BATCH samples, as in the course", Tests::Batches),
    ("doubling", "after BATCH samples, twice, four times, eight times as many", Tests::Doubling),
];

pub(super) const TRUSTS: &[(&str, &str, Trust)] = &[
    ("once", "one test that is passed, as in the course", Trust::Once),
    ("twice", "two in succession", Trust::Twice),
    ("halves", "each half of the samples stops by what the other half says", Trust::Halves),
];

pub(super) const AREAS: &[(&str, &str, Area)] = &[
    ("pixel", "every pixel by itself, as in the course", Area::Pixel),
    ("tile", "16 by 16 pixels, by the root mean square of their intervals", Area::Tile),
];

pub(super) const SAMPLERS: &[(&str, &str, Sampler)] = &[
    ("independent", "every number on its own", Sampler::Independent),
    ("sobol", "Owen-scrambled Sobol points: spread evenly, less noise", Sampler::Sobol),
    (
        "blue-noise",
        "Sobol points that pixels share: what noise is left looks finer, for few samples",
        Sampler::BlueNoise,
    ),
];

const INTEGRATORS: &[(&str, &str, Integrator)] = &[
    ("path", "all light up to the depth limit", Integrator::Path),
    ("direct", "emission and direct light", Integrator::Direct),
    ("zero-bounce", "emission alone", Integrator::ZeroBounce),
    ("one-bounce", "direct light alone", Integrator::OneBounce),
    ("indirect-only", "indirect light alone", Integrator::IndirectOnly),
    ("normals", "shading normals as colours", Integrator::Normals),
    ("bvh-cost", "nodes of the tree that camera rays visit, as a heat map", Integrator::BvhCost),
];

pub(super) const DIRECTS: &[(&str, &str, Direct)] = &[
    ("hemisphere", "uniform directions over the hemisphere, as in the course", Direct::Hemisphere),
    ("light", "points on the lights", Direct::Light),
    ("bsdf", "the ray that continues the path, and nothing else", Direct::Bsdf),
    ("mis", "lights and continuing ray, weighted by the power heuristic", Direct::Mis),
];

pub(super) const LIGHT_SAMPLINGS: &[(&str, &str, LightSampling)] = &[
    (
        "corners",
        "parallelograms by what would arrive from their corners; triangles uniform by area",
        LightSampling::Corners,
    ),
    ("area", "uniform by area", LightSampling::Area),
    (
        "solid-angle",
        "rectangles and triangles uniform by the angle that they fill, unless that is tiny",
        LightSampling::SolidAngle,
    ),
];

pub(super) const LIGHT_SELECTIONS: &[(&str, &str, LightSelection)] = &[
    ("auto", "each of up to 16; of more, and of meshes that emit, by the tree", LightSelection::Auto),
    ("each", "each light, a mesh being one", LightSelection::Each),
    ("power", "at most 16 lights, drawn by their power", LightSelection::Power),
    (
        "tree",
        "at most as many, of which one may be a triangle of a mesh, drawn by a bound of what arrives",
        LightSelection::Tree,
    ),
];

const CAMERAS: &[(&str, &str, CameraChoice)] = &[
    (
        "course",
        "as the course's renderer places it, seeing at any size what that shows at 480 × 360",
        CameraChoice::Course,
    ),
    ("course-pixels", "as the course's renderer places it and shows at this very size", CameraChoice::CoursePixels),
    ("file", "where the scene file says", CameraChoice::File),
];

pub(super) const SIMDS: &[(&str, &str, Simd)] = &[
    ("auto", "the best that this processor has", Simd::Auto),
    ("baseline", "what every processor of this kind has", Simd::Baseline),
    ("avx2", "AVX2 and FMA", Simd::Avx2),
    ("avx512", "AVX-512 to trace rays, AVX2 for the rest", Simd::Avx512),
];

const ACCELS: &[(&str, &str, Accel)] = &[
    ("bvh", "bounding volume hierarchy of four-wide nodes", Accel::Bvh),
    ("brute", "every ray against every primitive", Accel::Brute),
];

pub(super) const QUALITIES: &[(&str, &str, Quality)] = &[
    ("fast", "for previews: built in 0.6 of the time, up to 15 % more nodes a ray on scans", Quality::Fast),
    ("default", "binned surface area heuristic, large nodes reinserted", Quality::Default),
    (
        "best",
        "for long renders: all nodes reinserted; 2 to 4 times the time, about 1 % fewer nodes a ray on scans",
        Quality::Best,
    ),
];

pub(super) const NODE_FORMATS: &[(&str, &str, NodeFormat)] = &[
    ("auto", "compact where that makes boxes hardly larger, else full", NodeFormat::Auto),
    ("full", "128 bytes, planes in single precision", NodeFormat::Full),
    ("compact", "64 bytes, planes on a 16-bit grid around the scene", NodeFormat::Compact),
];

pub(super) const LEAF_FORMATS: &[(&str, &str, LeafFormat)] = &[
    ("auto", "full; compact where only those fit in --memory-limit", LeafFormat::Auto),
    ("full", "192 bytes a block: the corners of four triangles", LeafFormat::Full),
    (
        "compact",
        "128 bytes: eight vertices that four triangles share; 0.7 of the tree's memory on scans",
        LeafFormat::Compact,
    ),
];

pub(super) const INTERSECTIONS: &[(&str, &str, Intersection)] = &[
    ("watertight", "no ray slips between triangles that share an edge (Woop et al. 2013)", Intersection::Watertight),
    ("fast", "fewer operations, and a ray in a million slips through (Möller and Trumbore 1997)", Intersection::Fast),
];

pub(super) const PRECISIONS: &[(&str, &str, Precision)] = &[
    ("f32", "24 bits: enough for most, as scenes are read around their own centre", Precision::F32),
    (
        "f64",
        "48 bits for geometry, lights, camera and where rays start, for 3 to 4 times the time; directions keep 24",
        Precision::F64,
    ),
];

const TOP_EXAMPLES: &str = "\
Examples:
  comber render                                  comber's own scene, to comber.png and comber.exr
  comber render -s 256 -m 6 -f box.png box.dae   a COLLADA scene
  comber render bunny.ply --stage studio         a bare mesh
  comber info box.dae                            what a render of it would do
  comber bvh box.dae --depth 6 -o tree.png       level 6 of its tree
  comber bench box.dae --peer embree             rays per second, beside Embree
  comber diff box.exr reference.exr              how far a picture is from another
  comber reference box.dae --rel-error 0.005     a picture that is known to half a percent
  comber trade box.dae --vary samples=4,16,64    what accuracy costs
  comber mesh bunny.ply --split 8 -o large.ply   the mesh in 64 times as many triangles
  comber cache ls                                trees of large meshes, kept on disk

Exit status: 0 done, 1 failed, 2 misused, 130 interrupted.";

const RENDER_NOTES: &str = "\
Examples:
  comber render -t 8 -s 64 -l 32 -m 6 -r 480 360 -f box.png box.dae
  comber render -s 2048 -a 64 0.05 -o box.exr -o box.png box.dae
  comber render proc:cubes,tris=1M --stage cornell -r 960 720
  comber render bunny.ply --up z --vp -0.5,1,3 --vi 0,0.5,0 --yfov 30
  comber render scan.ply --memory-limit 16GiB --cache /fast/disk
  comber render box.dae --explain --pixel 240,180 --sample 7

Interrupting (INT or TERM) ends a render early: the files are written with the samples that are done. A second \
signal ends comber at once, and earlier files stay as they were.

The same scene, options and seed give the same pictures, byte for byte, whatever the threads, wave size and \
instruction set. EXR files also state when they were made; set SOURCE_DATE_EPOCH (seconds since 1970) to fix \
that too.

Exit status: 0 done, 1 failed, 2 misused, 130 interrupted.";

const INFO_EXAMPLES: &str = "\
Takes every option of `comber render`, so that a command can be explained by changing one word. Reads the scene \
and builds the tree, but renders and writes nothing.

Examples:
  comber info box.dae
  comber info -s 2048 -a 64 0.05 -o box.exr box.dae
  comber info --json proc:cubes,tris=1M

Exit status: 0 done, 1 failed, 2 misused, 130 interrupted.";

const BVH_EXAMPLES: &str = "\
The boxes are drawn over shading normals, dimmed; nearer boxes over farther ones, neighbours in different \
colours. Level 0 is the box of the whole scene, level 1 has those of the root's children, and so on; branches \
that end above the level are not drawn.

Examples:
  comber bvh --depth 0 -o root.png box.dae
  comber bvh --depth 8 -r 1920 1080 proc:cubes,tris=1M

Exit status: 0 done, 1 failed, 2 misused, 130 interrupted.";

const MESH_EXAMPLES: &str = "\
Triangles that share an edge share the vertices on it, and noise depends on nothing but the position, so a closed \
mesh stays closed. The file is streamed: only INPUT has to fit in memory. All meshes of INPUT become one; materials, \
spheres, lights and camera are left out, and normals too if the mesh is split or moved.

Examples:
  comber mesh lucy.obj --split 17 --noise 0.1 -o lucy28m.ply   289 triangles for each
  comber mesh proc:knot,tris=1M -o knot.ply                    a generated mesh
  comber mesh scan.ply --ascii -o readable.ply                 another encoding

Exit status: 0 done, 1 failed, 2 misused, 130 interrupted.";

const CACHE_EXAMPLES: &str = "\
Trees of meshes of more than a million primitives are kept, as building them takes a while; --cache and --cache-limit \
of the other commands change where, which and how many. A tree is known by all that it was built from, so it is never \
out of date, and a file that is damaged is built anew. Removing trees does no harm to a render that is using them.

Examples:
  comber cache ls
  comber cache clear --older-than 30d
  comber cache clear 5f0c2a
  comber render scan.ply --cache /fast/disk --cache-limit 50GiB

Exit status: 0 done, 1 failed, 2 misused, 130 interrupted.";
