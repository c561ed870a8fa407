//! Memory, predicted before it is taken.

use super::resolve::SceneSource;
use crate::bvh::{double_peak_bytes, may_be_limited, peak_bytes};
use crate::error::{Error, Result};
use crate::measure::{memory, units};
use crate::options::{AccelOptions, LeafFormat, Precision};
use crate::scene::description::SceneDescription;
use crate::scene::procedural;
use crate::scene::shapes::Shapes;
use glam::Vec3;
use serde::Serialize;

/// Bytes of memory that reading takes at its peak, a byte of the file, by its kind.
///
/// Measured by `comber info --json` on the dragon (ASCII PLY), 28.9 million triangles (binary PLY) and lucy100k (OBJ); a COLLADA file is held
/// as a tree of its elements too.
const READ: [(&str, f64); 3] = [("ply", 2.1), ("obj", 3.0), ("dae", 4.0)];
/// Bytes a triangle that a generated mesh may take: three indices and, where nothing is shared, three corners.
const MESH_BYTES: u64 = 48;
/// The memory that may be used.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// The most bytes that this process may have resident; what the system can give if `None`.
    pub limit: Option<u64>,
}

/// What was predicted for a phase, and what it took. Both are totals of the process, so that they compare.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Phase {
    /// Bytes resident at the peak, as predicted.
    pub predicted: u64,
    /// Bytes resident at the peak of all phases until then; `None` where the system does not say.
    pub peak: Option<u64>,
}

impl Budget {
    /// Refuses work that takes more memory than there is; otherwise starts its phase.
    pub fn start(&self, what: &str, needed: u64) -> Result<Phase> {
        match self.refusal(needed) {
            Some(why) => Err(Error::Scene(format!("{what} takes about {}, and {why}", units::bytes(needed)))),
            None => Ok(Phase { predicted: memory::current_resident().unwrap_or(0) + needed, peak: None }),
        }
    }

    /// Why so many more bytes cannot be had, if they cannot.
    pub fn refusal(&self, needed: u64) -> Option<String> {
        let Some(limit) = self.limit else {
            let left = memory::available().filter(|&left| needed > left)?;
            return Some(format!("{} of memory are available", units::bytes(left)));
        };
        let resident = memory::current_resident().unwrap_or(0);
        (needed > limit.saturating_sub(resident))
            .then(|| format!("of the {} of --memory-limit, {} are in use", units::bytes(limit), units::bytes(resident)))
    }
}

impl Phase {
    /// Ends the phase.
    pub fn done(mut self) -> Phase {
        self.peak = memory::peak_resident();
        self
    }
}

/// Bytes that reading or making a scene takes at its peak.
pub fn reading(source: &SceneSource) -> Result<u64> {
    match source {
        // A million triangles and a little.
        SceneSource::BuiltIn => Ok((2 << 20) * MESH_BYTES),
        SceneSource::Generated(specification) => Ok(procedural::Spec::parse(specification)?.triangles * MESH_BYTES),
        SceneSource::File(path) => {
            // What is wrong with a file, reading tells.
            let length = std::fs::metadata(path).map_or(0, |metadata| metadata.len());
            let kind = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
            let factor = READ.iter().find(|(extension, _)| *extension == kind).map_or(1.0, |(_, factor)| *factor);
            Ok((length as f64 * factor) as u64)
        }
    }
}

/// Bytes that laying out the tables takes: one mesh is moved, several are copied into one.
pub fn preparing(description: &SceneDescription) -> u64 {
    let corner = size_of::<Vec3>() as u64;
    let bytes = description.meshes.iter().map(|mesh| {
        let double = size_of_val(&mesh.double[..]) as u64;
        (mesh.positions.len() + mesh.normals.len()) as u64 * corner + double + mesh.triangles.len() as u64 * 12
    });
    // Growing vectors take twice what they hold, while they are copied. The largest mesh may come first and be moved.
    let largest = bytes.clone().max().unwrap_or(0);
    if description.meshes.len() > 1 { 2 * (bytes.sum::<u64>() - largest) } else { 0 }
}

/// The tree to build: the one asked for, if there is memory for it; else one with compact leaves, if that helps and leaves could be chosen.
pub fn tree_that_fits(options: AccelOptions, shapes: &Shapes, budget: &Budget) -> Result<(AccelOptions, Phase)> {
    let primitives = shapes.prim_count();
    let what = format!("building the tree over {} primitives", units::count(primitives as u64));
    let smaller = AccelOptions { leaves: LeafFormat::Limited, ..options };
    let fits = |options: &AccelOptions| budget.refusal(tree(options, primitives)).is_none();
    let options = if may_be_limited(&options, shapes) && !fits(&options) && fits(&smaller) { smaller } else { options };
    Ok((options, budget.start(&what, tree(&options, primitives))?))
}

/// Bytes that building a tree takes at its peak.
pub fn tree(options: &AccelOptions, primitives: usize) -> u64 {
    match options.precision {
        Precision::F32 => peak_bytes(primitives, options.quality, options.leaves == LeafFormat::Limited),
        Precision::F64 => double_peak_bytes(primitives),
    }
}
