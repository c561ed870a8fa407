//! The scene argument → scene, acceleration structure and camera, in phases that the user sees.

use super::args::ReportArgs;
use super::budget::{self, Budget, Phase};
use super::camera;
use super::exit::complain;
use super::resolve::{SceneRequest, SceneSource, ViewRequest};
use super::tree::{Origin, Wanted};
use crate::bvh::Accel;
use crate::error::{Error, Note, Result};
use crate::import;
use crate::measure::memory;
use crate::measure::progress::Progress;
use crate::options::{Precision, RenderOptions};
use crate::scene::Scene;
use crate::scene::camera::Camera;
use crate::scene::default;
use crate::scene::description::SceneDescription;
use crate::scene::procedural;
use crate::scene::stage::{self, Stage};
use glam::Vec3;
use serde::Serialize;
use std::time::Instant;

/// A scene that can be rendered.
pub struct Loaded {
    /// What to call it.
    pub name: String,
    /// The stage it was put on.
    pub stage: &'static str,
    /// Its tables.
    pub scene: Scene,
    /// What answers rays.
    pub accel: Accel,
    /// From where it is seen.
    pub camera: Camera,
    /// Where that came from.
    pub tree: Origin,
    /// How long reading and preparing took.
    pub seconds: LoadSeconds,
    /// Memory of reading.
    pub read_memory: Phase,
    /// Bytes resident when all is loaded; `None` where the system does not say.
    pub resident: Option<u64>,
}

/// Wall times of the phases of loading.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct LoadSeconds {
    /// Reading or making the description, and putting it on its stage.
    pub read: f64,
    /// Laying out the tables.
    pub prepare: f64,
}

/// Reads, stages, lays out, and gets the tree; prints what the user should know about the scene.
pub fn load(request: &SceneRequest, view: &ViewRequest, options: &RenderOptions, report: ReportArgs) -> Result<Loaded> {
    let show = !report.quiet;
    let budget = Budget { limit: request.storage.memory_limit };
    // A position in double precision takes 24 bytes beside the 12 that it takes anyway; of a file, positions are a half at most.
    let more = if request.precision == Precision::F64 { 2 } else { 1 };
    let read_memory = budget.start("reading the scene", more * budget::reading(&request.source)?)?;
    let (staged, read) = phase("reading", show, || {
        let (description, camera) = describe(&request.source, request.precision)?;
        let staged = put_on_stage(description, camera, request)?;
        let mut camera = camera::resolve(view, &staged, options)?;
        if request.precision == Precision::F32 {
            camera.low = Vec3::ZERO;
        }
        Ok((staged.description, staged.stage, camera))
    })?;
    let read_memory = read_memory.done();
    let (description, stage, camera) = staged;
    let name = description.name.clone();
    budget.start("laying out the scene", budget::preparing(&description))?;
    let (scene, prepare) = phase("preparing", show, || Scene::build(description, request.options))?;
    print_notes(&scene.notes, report);
    let wanted =
        Wanted { name: &name, shapes: &scene.shapes, options: options.accel, storage: &request.storage, report };
    let (accel, tree) = wanted.get()?;
    let seconds = LoadSeconds { read, prepare };
    Ok(Loaded { name, stage, scene, accel, camera, tree, seconds, read_memory, resident: memory::current_resident() })
}

/// A description on its stage.
pub struct Staged {
    /// Everything that will be rendered.
    pub description: SceneDescription,
    /// Name of the stage.
    pub stage: &'static str,
    /// The camera that came with the stage or the built-in scene.
    pub camera: Option<Camera>,
}

/// Runs one phase of which no progress is known, with its name on the terminal; gives its wall time too.
pub fn phase<T>(label: &str, show: bool, work: impl FnOnce() -> Result<T>) -> Result<(T, f64)> {
    timed(Progress::busy(label, show), |_| work())
}

/// Runs one phase that may tell its progress; gives its wall time too.
pub fn timed<T>(progress: Progress, work: impl FnOnce(&Progress) -> Result<T>) -> Result<(T, f64)> {
    let start = Instant::now();
    let result = work(&progress)?;
    progress.finish();
    Ok((result, start.elapsed().as_secs_f64()))
}

/// A scene, and the camera that comes with it if that is not a node of its file. What is generated is exact in single precision.
pub fn describe(source: &SceneSource, precision: Precision) -> Result<(SceneDescription, Option<Camera>)> {
    match source {
        SceneSource::BuiltIn => default::description().map(|staged| (staged.description, Some(staged.camera))),
        SceneSource::Generated(specification) => Ok((procedural::generate(specification)?, None)),
        SceneSource::File(path) => Ok((import::load_in(path, precision)?, None)),
    }
}

/// Puts a description on the stage that was asked for, or that suits it.
///
/// `none` leaves a scene with a camera alone; others are framed by it.
fn put_on_stage(description: SceneDescription, camera: Option<Camera>, request: &SceneRequest) -> Result<Staged> {
    let complete = camera.is_some() || description.camera.is_some();
    let stage = match request.stage {
        Some(stage) => stage,
        None if complete || has_lights(&description) => Stage::None,
        None => Stage::Cornell,
    };
    let name = match stage {
        Stage::None => "none",
        Stage::Cornell => "cornell",
        Stage::Studio => "studio",
    };
    if complete && stage == Stage::None {
        return match request.up {
            None => Ok(Staged { description, stage: name, camera }),
            Some(_) => Err(Error::Options(format!(
                "--up turns scenes that are put on a stage or framed, but {} has a camera of its own",
                description.name
            ))),
        };
    }
    let staged = stage::place(description, stage, request.up.unwrap_or_default())?;
    Ok(Staged { description: staged.description, stage: name, camera: Some(staged.camera) })
}

/// Whether anything in the description emits light.
fn has_lights(description: &SceneDescription) -> bool {
    let emits = |material: u32| {
        description.materials.get(material as usize).is_some_and(|material| material.emission.max_element() > 0.0)
    };
    !description.area_lights.is_empty()
        || description.meshes.iter().any(|mesh| emits(mesh.material))
        || description.spheres.iter().any(|sphere| emits(sphere.material))
}

/// Warnings go to standard error always, information unless it is to be quiet.
pub fn print_notes(notes: &[Note], report: ReportArgs) {
    for note in notes {
        match (note.warning, report.quiet) {
            (true, _) => complain(&format!("warning: {}", note.text)),
            (false, false) => complain(&format!("note: {}", note.text)),
            (false, true) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::At;
    use crate::scene::description::{MaterialDescription, MeshDescription, Surface};

    #[test]
    fn a_scene_is_lit_by_what_it_uses() {
        let material = |emission| MaterialDescription {
            name: String::new(),
            at: At::File,
            surface: Surface::Diffuse { albedo: Vec3::ONE },
            emission,
        };
        let with_mesh_of = |material: u32, materials: Vec<MaterialDescription>| SceneDescription {
            meshes: vec![MeshDescription { material, ..Default::default() }],
            materials,
            ..Default::default()
        };
        let materials = vec![material(Vec3::ZERO), material(Vec3::X)];
        assert!(has_lights(&with_mesh_of(1, materials.clone())));
        assert!(!has_lights(&with_mesh_of(0, materials)), "the material that emits is not used");
        assert!(!has_lights(&with_mesh_of(0, Vec::new())));
    }
}
