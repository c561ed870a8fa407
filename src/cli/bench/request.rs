//! What `comber bench` was asked to do, with every default filled in and every contradiction found.

use super::args::{BenchArgs, BenchPart, Peer, Qualities, Robust};
use crate::bench::interleave::Effort;
use crate::bench::kernels::Kernel;
use crate::bench::{queues, record, sets};
use crate::cli::args::ReportArgs;
use crate::cli::resolve::{self, SceneRequest, ViewRequest};
use crate::error::{Error, Note, Result};
use crate::options::{AccelOptions, Intersection, Precision, RenderOptions};
use crate::peer::embree::scene::Quality;
use std::path::PathBuf;
use std::time::Duration;

/// Everything that a bench needs to know.
pub struct BenchRequest {
    /// What to load, one after another.
    pub scenes: Vec<SceneRequest>,
    /// From where to see each.
    pub view: ViewRequest,
    /// Frame of the camera rays, wave, instruction set and tree.
    pub options: RenderOptions,
    /// Names of sets; of all if empty.
    pub sets: Vec<String>,
    /// A file of rays to trace in place of sets.
    pub rays: Option<PathBuf>,
    /// Where to leave the rays.
    pub dump: Option<PathBuf>,
    /// Measure sets of rays.
    pub trace: bool,
    /// Measure whole renders.
    pub render: bool,
    /// comber's kernels.
    pub kernels: Vec<Kernel>,
    /// Numbers of threads.
    pub threads: Vec<usize>,
    /// How often.
    pub effort: Effort,
    /// Only trace a set so many times.
    pub once: Option<(String, u32)>,
    /// The peer.
    pub peer: Option<PeerRequest>,
    /// Where to keep the figures.
    pub save: Option<PathBuf>,
    /// Figures to compare with.
    pub against: Option<PathBuf>,
    /// What to say.
    pub report: ReportArgs,
    /// What the user should know about the options.
    pub notes: Vec<Note>,
}

/// How the peer is measured.
pub struct PeerRequest {
    /// Its library; any that is found if `None`.
    pub library: Option<PathBuf>,
    /// Instruction set, as it spells it.
    pub isa: Option<String>,
    /// Watertight.
    pub robust: bool,
    /// Trees to build.
    pub qualities: &'static [Quality],
    /// Part of the names of modes.
    pub mode: String,
    /// All modes take turns.
    pub all_modes: bool,
}

/// Whether comber's own tests are watertight, which is what `--peer-robust auto` follows.
fn is_watertight(options: &AccelOptions) -> bool {
    options.intersection == Intersection::Watertight
}

impl BenchRequest {
    /// Makes sense of `args`, or says why not.
    pub fn new(args: BenchArgs) -> Result<BenchRequest> {
        let mut notes = Vec::new();
        let (view, _) = resolve::view(&args.camera, &mut notes)?;
        args.rays
            .sets
            .iter()
            .chain(&args.effort.once)
            .try_for_each(|name| known_set(name, args.rays.rays.is_some()))?;
        let parts = &args.effort.only;
        let has = |part| parts.is_empty() || parts.contains(&part);
        if parts.contains(&BenchPart::Peer) && args.peer.peer.is_none() {
            return misuse("--only peer needs to know which: add --peer embree");
        }
        if args.rays.rays.is_some() && args.scenes.len() > 1 {
            return misuse("--rays has the rays of one scene, but several scenes are given");
        }
        let threads: Vec<usize> = args.effort.threads.iter().map(|&threads| threads as usize).collect();
        let accel = resolve::accel(&args.accel)?;
        if accel.precision == Precision::F64 {
            return misuse(
                "comber bench traces rays of single precision; what f64 costs, comber trade --vary precision=f32,f64 tells",
            );
        }
        let traces = match args.effort.once {
            Some(_) => args.effort.kernel.is_empty(),
            None => has(BenchPart::Peer),
        };
        let peer = args.peer.peer.filter(|_| traces).map(|Peer::Embree| {
            let robust = match args.peer.peer_robust {
                Robust::Auto => is_watertight(&accel),
                Robust::On => true,
                Robust::Off => false,
            };
            PeerRequest {
                library: args.peer.peer_library.clone(),
                isa: args.peer.peer_isa.clone(),
                robust,
                qualities: qualities(args.peer.peer_quality, robust),
                mode: args.peer.peer_mode.clone(),
                all_modes: args.peer.all_modes,
            }
        });
        let mut kernels = kernels(&args.effort.kernel)?;
        if !has(BenchPart::Kernels) && args.effort.kernel.is_empty() {
            kernels = vec![Kernel::Suited];
        }
        let paths: Vec<Option<PathBuf>> = match args.scenes.is_empty() {
            true => vec![None],
            false => args.scenes.into_iter().map(Some).collect(),
        };
        Ok(BenchRequest {
            scenes: paths.into_iter().map(|path| resolve::scene_at(path, &args.staging)).collect(),
            view,
            options: RenderOptions {
                width: args.rays.size[0],
                height: args.rays.size[1],
                accel,
                wave: args.rays.wave,
                threads: args.effort.threads.iter().copied().max(),
                simd: args.effort.simd,
                ..RenderOptions::default()
            },
            sets: args.rays.sets,
            rays: args.rays.rays,
            dump: args.rays.dump_rays,
            trace: has(BenchPart::Kernels) || has(BenchPart::Peer),
            render: has(BenchPart::Render),
            kernels,
            threads,
            effort: Effort {
                rounds: args.effort.repeats as usize,
                time: Duration::from_secs(u64::from(args.effort.time)),
                turn: Duration::from_millis(u64::from(args.effort.turn)),
            },
            once: args.effort.once.map(|set| (set, args.effort.passes)),
            peer,
            save: args.effort.save.as_deref().map(|name| record::path("bench", name)).transpose()?,
            against: args.effort.against.as_deref().map(|name| record::path("bench", name)).transpose()?,
            report: args.report,
            notes,
        })
    }

    /// Whether the set of that name was asked for.
    pub fn wants(&self, name: &str) -> bool {
        match &self.once {
            Some((once, _)) => once == name,
            None => self.sets.is_empty() || self.sets.iter().any(|wanted| wanted == name),
        }
    }
}

fn misuse<T>(what: impl Into<String>) -> Result<T> {
    Err(Error::Options(what.into()))
}

/// Files may have sets of any name.
fn known_set(name: &String, from_file: bool) -> Result<()> {
    let known: Vec<&str> = sets::NAMES.into_iter().chain(queues::NAMES).collect();
    if from_file || known.contains(&name.as_str()) {
        return Ok(());
    }
    misuse(format!("there is no set of rays '{name}'; there are {}", known.join(", ")))
}

fn kernels(names: &[String]) -> Result<Vec<Kernel>> {
    let all = Kernel::all();
    if names.is_empty() {
        return Ok(Kernel::usual());
    }
    let find = |name: &String| {
        all.iter().copied().find(|kernel| kernel.name() == name).ok_or_else(|| {
            let known: Vec<&str> = all.iter().map(|kernel| kernel.name()).collect();
            Error::Options(format!("there is no kernel '{name}'; there are {}", known.join(", ")))
        })
    };
    names.iter().map(find).collect()
}

fn qualities(asked: Qualities, robust: bool) -> &'static [Quality] {
    match asked {
        Qualities::Medium => &[Quality::Medium],
        Qualities::High => &[Quality::High],
        Qualities::Auto if robust => &[Quality::Medium],
        Qualities::Both | Qualities::Auto => &[Quality::Medium, Quality::High],
    }
}
