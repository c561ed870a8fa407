//! Arguments of `comber bench` as typed. What they mean together is decided in `request`.

use crate::cli::args::{AccelArgs, CameraArgs, ReportArgs, SIMDS, StagingArgs};
use crate::cli::values::{self, choice, whole};
use crate::options::Simd;
use clap::{ArgAction, Args};
use std::path::PathBuf;

/// `comber bench`.
#[derive(Debug, Args)]
#[command(args_override_self = true, after_help = BENCH_NOTES)]
pub struct BenchArgs {
    /// Scene files or `proc:` meshes, as for `comber render`. Without any, comber's own scene is used.
    #[arg(value_name = "SCENE", help_heading = None::<&str>)]
    pub scenes: Vec<PathBuf>,
    /// What is made of them.
    #[command(flatten)]
    pub staging: StagingArgs,
    /// Which rays.
    #[command(flatten)]
    pub rays: BenchRaysArgs,
    /// How long.
    #[command(flatten)]
    pub effort: EffortArgs,
    /// What answers comber's rays.
    #[command(flatten)]
    pub accel: AccelArgs,
    /// Beside whom.
    #[command(flatten)]
    pub peer: PeerArgs,
    /// From where.
    #[command(flatten)]
    pub camera: CameraArgs,
    /// What to say.
    #[command(flatten)]
    pub report: ReportArgs,
}

/// Which rays are traced.
#[derive(Debug, Args)]
#[command(next_help_heading = "Rays")]
pub struct BenchRaysArgs {
    /// Pixels across and down: a camera ray each, from which the other sets follow.
    #[arg(short = 'r', long, num_args = 2, value_names = ["W", "H"], value_parser = whole(1, 16384),
          default_values = ["1024", "1024"], action = ArgAction::Set, allow_negative_numbers = true)]
    pub size: Vec<u32>,
    /// Sets to trace, separated by commas: P and Pt, camera rays in rows and in tiles; PH, those that hit; S, shadow
    /// rays; D and D2, the first and the second diffuse bounce; Q and QS, the renderer's own queues of rays that ask for the
    /// closest hit and for any [default: all].
    #[arg(long, value_name = "SETS", value_delimiter = ',')]
    pub sets: Vec<String>,
    /// Rays that comber's kernels get at a time [default: the wave that the renderer would choose].
    #[arg(long, value_name = "N", value_parser = whole(1, 1 << 24), allow_negative_numbers = true)]
    pub wave: Option<u32>,
    /// Trace the rays of this file, which --dump-rays wrote, and compare the hits with those in it.
    #[arg(long, value_name = "FILE")]
    pub rays: Option<PathBuf>,
    /// Write the rays and their hits to this file; or to a file NAME.rays for each scene, if this is a folder.
    #[arg(long, value_name = "FILE|DIR")]
    pub dump_rays: Option<PathBuf>,
}

/// How long is measured, and on what.
#[derive(Debug, Args)]
#[command(next_help_heading = "Measuring")]
pub struct EffortArgs {
    /// What to measure, separated by commas [default: kernels and render, and the peer if there is one].
    #[arg(long, value_name = "PARTS", value_delimiter = ',', value_parser = choice(BENCH_PARTS))]
    pub only: Vec<BenchPart>,
    /// Kernels to measure, separated by commas: `suited`, the renderer's choice, or a way through the tree by its name
    /// [default: all].
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub kernel: Vec<String>,
    /// Threads, or several numbers of them separated by commas, each measured by itself.
    #[arg(short, long, value_name = "N", value_delimiter = ',', default_value = "1", value_parser = whole(1, 1024),
          allow_negative_numbers = true)]
    pub threads: Vec<u32>,
    /// Turns that each contestant gets at most.
    #[arg(long, value_name = "N", default_value_t = 11, value_parser = whole(1, 100_000), allow_negative_numbers = true)]
    pub repeats: u32,
    /// Seconds after which no further turn begins on a set, once there were three.
    #[arg(long, value_name = "SECONDS", default_value_t = 20, value_parser = whole(0, 1_000_000),
          allow_negative_numbers = true)]
    pub time: u32,
    /// Milliseconds that a turn lasts at least: sets that take less are traced again and again.
    #[arg(long, value_name = "MS", default_value_t = 100, value_parser = whole(0, 1_000_000),
          allow_negative_numbers = true)]
    pub turn: u32,
    /// Instruction set of comber's kernels.
    #[arg(long, value_name = "SET", default_value = "auto", value_parser = choice(SIMDS))]
    pub simd: Simd,
    /// Trace this set --passes times and measure nothing: for tools that count instructions. With --kernel, the first of
    /// those traces; else with --peer, its first mode that --peer-mode names; else the renderer's choice of kernels.
    #[arg(long, value_name = "SET", conflicts_with_all = ["only", "save", "against"])]
    pub once: Option<String>,
    /// With --once, how often the set is traced.
    #[arg(long, value_name = "N", requires = "once", default_value_t = 1, value_parser = whole(1, 1_000_000),
          allow_negative_numbers = true)]
    pub passes: u32,
    /// Keep the figures under this name in the user's data folder; a name that ends in .json is a path.
    #[arg(long, value_name = "NAME")]
    pub save: Option<String>,
    /// Compare the figures with those kept under this name. Where the median of one lies within the quartiles of the other,
    /// it is a tie.
    #[arg(long, value_name = "NAME")]
    pub against: Option<String>,
}

/// Beside whom.
#[derive(Debug, Args)]
#[command(next_help_heading = "Peer")]
pub struct PeerArgs {
    /// Measure this ray tracer too, in turns with comber, on the same rays, and compare the hits.
    #[arg(long, value_name = "NAME", value_parser = choice(PEERS))]
    pub peer: Option<Peer>,
    /// Its library [default: the environment variable COMBER_EMBREE, else all that are installed in the usual places,
    /// Python's packages among them].
    #[arg(long, value_name = "FILE", requires = "peer")]
    pub peer_library: Option<PathBuf>,
    /// Restrict it to an instruction set, as its own configuration spells it: sse2, sse4.2, avx, avx2, avx512.
    #[arg(long, value_name = "SET", requires = "peer", value_parser = values::word)]
    pub peer_isa: Option<String>,
    /// Whether it tests watertight.
    #[arg(long, value_name = "WHEN", requires = "peer", default_value = "auto", value_parser = choice(ROBUST))]
    pub peer_robust: Robust,
    /// How well it builds its trees.
    #[arg(long, value_name = "HOW", requires = "peer", default_value = "auto", value_parser = choice(QUALITIES))]
    pub peer_quality: Qualities,
    /// Measure only modes whose names have this part, as in "4.4.0 medium" or "packets of 8".
    #[arg(long, value_name = "PART", requires = "peer", default_value = "", hide_default_value = true)]
    pub peer_mode: String,
    /// Let all modes take turns. Else a quick look at a part of the set chooses the fastest three.
    #[arg(long, requires = "peer")]
    pub all_modes: bool,
}

/// A part of a bench.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BenchPart {
    /// Each of comber's kernels on each set.
    Kernels,
    /// The peer on each set, beside the renderer's choice of kernels.
    Peer,
    /// Whole renders, beside the depth-first control.
    Render,
}

/// Ray tracers to measure beside comber.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Peer {
    /// Intel's.
    Embree,
}

/// When a peer tests watertight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Robust {
    /// If comber does.
    Auto,
    /// Always.
    On,
    /// Never.
    Off,
}

/// Which trees a peer builds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Qualities {
    /// Those that differ.
    Auto,
    /// Medium alone.
    Medium,
    /// High alone.
    High,
    /// One of each.
    Both,
}

const BENCH_PARTS: &[(&str, &str, BenchPart)] = &[
    ("kernels", "each of comber's kernels on each set of rays", BenchPart::Kernels),
    ("peer", "the peer on each set, beside the renderer's choice of kernels", BenchPart::Peer),
    ("render", "whole renders by waves, beside the depth-first control", BenchPart::Render),
];

const PEERS: &[(&str, &str, Peer)] = &[("embree", "Embree 3 or 4, in whichever of its modes is fastest", Peer::Embree)];

const ROBUST: &[(&str, &str, Robust)] = &[
    ("auto", "if comber's own tests are watertight", Robust::Auto),
    ("on", "with RTC_SCENE_FLAG_ROBUST", Robust::On),
    ("off", "without", Robust::Off),
];

const QUALITIES: &[(&str, &str, Qualities)] = &[
    ("auto", "both where they differ: for watertight tests they are the same", Qualities::Auto),
    ("medium", "its default", Qualities::Medium),
    ("high", "with spatial splits, which takes several times as long", Qualities::High),
    ("both", "one tree of each; the faster one counts", Qualities::Both),
];

const BENCH_NOTES: &str = "\
Every figure is the median of turns: contestants trace the same rays one after another, round by round, and ratios \
are formed within a round. A fixed piece of work before and after each turn tells whether something else kept the \
machine busy; such turns are counted apart. Hits are compared first: more than 1 ray in a million (and at least 2) \
that disagrees with the reference fails the bench; 1 in 10,000, if a peer tests fast and not watertight.

A bare mesh is put on a stage, as for `comber render`; --stage none traces the mesh alone.

Examples:
  comber bench                                         comber's own scene
  comber bench --peer embree --stage none bunny.ply    a mesh alone, beside Embree
  comber bench --peer embree --only peer --sets D,D2,S --threads 1,2 box.dae
  comber bench --save before bunny.ply                 and, after a change:
  comber bench --against before bunny.ply
  comber bench --dump-rays bunny.rays --sets D --only kernels bunny.ply
  comber bench --rays bunny.rays --only kernels --kernel single,in-flight bunny.ply

Embree is loaded if it is installed: Debian's libembree-dev, or PyPI's embreex.

Exit status: 0 done, 1 failed or disagreed, 2 misused.";
