//! Scene files in, [`SceneDescription`]s out, or a located error.

pub mod bytes;
pub mod dae;
mod lines;
pub mod number;
pub mod obj;
pub mod ply;
pub mod polygon;
mod recentre;

use crate::error::{At, Error, Result};
use crate::options::Precision;
use crate::scene::description::{MaterialDescription, SceneDescription, Surface};
use glam::{DVec3, Vec3};
use std::path::Path;

/// Reads a scene file; its extension, in any case, says how. What lies far from the origin for its size is read
/// around its own centre: see [`SceneDescription::origin`].
pub fn load(path: &Path) -> Result<SceneDescription> {
    load_in(path, Precision::F32)
}

/// As [`load`], in some precision: in double precision, descriptions also have what single precision leaves of positions.
pub fn load_in(path: &Path, precision: Precision) -> Result<SceneDescription> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let parse = match extension.as_str() {
        "dae" => dae::parse_around,
        "obj" => obj::parse_around,
        "ply" => ply::parse_around,
        _ => {
            let path = path.display();
            return Err(Error::Options(format!("{path}: unknown kind of scene file; expected .dae, .obj or .ply")));
        }
    };
    let bytes = bytes::read(path)?;
    let around = |origin| Around { origin, precision };
    let mut scene = parse(path, &bytes, around(DVec3::ZERO))?;
    // Twice where the first centre was rounded by more than the size of the scene.
    for _ in 0..2 {
        let Some(centre) = recentre::centre(&scene) else { break };
        let origin = scene.origin + centre;
        drop(scene);
        scene = parse(path, &bytes, around(origin))?;
    }
    if scene.origin != DVec3::ZERO {
        scene.notes.push(recentre::note(&scene));
    }
    Ok(scene)
}

/// How positions are taken from a file.
#[derive(Clone, Copy, Debug, Default)]
pub struct Around {
    /// What is subtracted from every one, in `f64`, before it is rounded.
    pub origin: DVec3,
    /// Whether what rounding leaves is kept, too.
    pub precision: Precision,
}

impl Around {
    /// Whether positions are wanted in double precision.
    pub fn in_double(&self) -> bool {
        self.precision == Precision::F64
    }
}

/// What to call a scene: the file's name, without its folders.
fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// The material of a mesh that states none.
fn default_material() -> MaterialDescription {
    let surface = Surface::Diffuse { albedo: Vec3::splat(0.5) };
    MaterialDescription { name: "default".into(), at: At::File, surface, emission: Vec3::ZERO }
}

/// A normal of unit length, or zero if it has no direction: shade flat there.
///
/// In `f64`, where the square of no `f32` vanishes or overflows.
fn unit_or_zero(normal: Vec3) -> Vec3 {
    normal.as_dvec3().normalize_or_zero().as_vec3()
}
