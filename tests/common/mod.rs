//! What several test files share: scenes by path, renders by options.
#![allow(dead_code)] // Each test file uses its own part.

pub mod command;
pub mod make;
pub mod rays;
pub mod statistics;

use comber::bvh::Accel;
use comber::drive::{self, Outcome, Unobserved};
use comber::error::Result;
use comber::film::picture::Picture;
use comber::options::{self, Normals, RenderOptions};
use comber::plan::Plan;
use comber::reference::{self, Reference};
use comber::scene::bounds::geometry_bounds;
use comber::scene::camera::Camera;
use comber::scene::description::SceneDescription;
use comber::scene::{Scene, SceneOptions, viewpoint};
use std::path::{Path, PathBuf};

/// A scene, ready.
pub struct Ready {
    pub name: String,
    pub scene: Scene,
    pub accel: Accel,
    pub camera: Camera,
}

impl Ready {
    pub fn new(description: SceneDescription, camera: Camera, normals: Normals) -> Ready {
        Ready::of(description, camera, normals, options::AccelOptions::default())
    }

    /// With a structure of some kind.
    pub fn of(description: SceneDescription, camera: Camera, normals: Normals, accel: options::AccelOptions) -> Ready {
        let name = description.name.clone();
        let scene = Scene::build(description, SceneOptions { normals, substitute_materials: false }).expect("scene");
        let accel = Accel::build(&scene.shapes, &accel).expect("accel");
        Ready { name, scene, accel, camera }
    }

    /// From a file with the course's profile, seen the course's way.
    pub fn course(path: &Path, normals: Normals) -> Ready {
        Ready::course_in(path, normals, options::AccelOptions::default())
    }

    /// As [`Ready::course`], with a structure of some kind, and positions of its precision.
    pub fn course_in(path: &Path, normals: Normals, accel: options::AccelOptions) -> Ready {
        let description = comber::import::load_in(path, accel.precision).expect("readable scene");
        let (min, max) = geometry_bounds(&description).expect("geometry");
        let camera = viewpoint::course(description.camera.as_ref(), min, max).expect("camera");
        Ready::of(description, camera, normals, accel)
    }

    pub fn try_render(&self, options: &RenderOptions) -> Result<Outcome> {
        let plan = Plan::new(&self.scene, &self.accel, options)?;
        drive::render(&self.scene, &self.accel, &self.camera, &plan, &Unobserved)
    }

    /// The same scene with another structure to answer its rays.
    pub fn with_accel(mut self, kind: options::Accel) -> Ready {
        self.accel = Accel::build(&self.scene.shapes, &options::AccelOptions::of(kind)).expect("accel");
        self
    }

    pub fn render(&self, options: &RenderOptions) -> Outcome {
        self.try_render(options).expect("render")
    }

    pub fn reference(&self, options: &RenderOptions) -> Reference {
        reference::render(&self.scene, &self.accel, &self.camera, options).expect("reference")
    }
}

/// Every layer of two pictures has the same bits.
pub fn assert_same(a: &Picture, b: &Picture, what: &str) {
    let bits3 = |layer: &[[f32; 3]]| layer.iter().flatten().map(|c| c.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits3(&a.beauty), bits3(&b.beauty), "{what}: beauty");
    for (name, x, y) in
        [("albedo", &a.albedo, &b.albedo), ("normal", &a.normal, &b.normal), ("variance", &a.variance, &b.variance)]
    {
        assert_eq!(x.as_deref().map(bits3), y.as_deref().map(bits3), "{what}: {name}");
    }
    let bits = |l: &Vec<f32>| l.iter().map(|c| c.to_bits()).collect::<Vec<_>>();
    assert_eq!(a.depth.as_ref().map(bits), b.depth.as_ref().map(bits), "{what}: depth");
    assert_eq!(a.sample_count, b.sample_count, "{what}: sample count");
}

/// A file of the project's own `scenes/`.
pub fn own(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name)
}

/// All `.dae` files of the project's own `scenes/`.
pub fn own_scenes() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let files = std::fs::read_dir(folder).expect("scenes/").map(|f| f.expect("entry").path());
    let mut scenes: Vec<_> = files.filter(|f| f.extension().is_some_and(|e| e == "dae")).collect();
    scenes.sort();
    assert!(scenes.len() >= 3);
    scenes
}

/// A file of the folder of scenes and references that lies beside the project on some machines, or a word that it does not.
pub fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared").join(name);
    if path.exists() {
        return Some(path);
    }
    println!("skipped: ../shared/{name} is not here");
    None
}
