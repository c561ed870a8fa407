//! What the benches share: scenes, options and arguments. Measuring in turns is `comber::bench`'s.
#![allow(dead_code)] // Each bench uses its own part.

pub mod pipeline;

use comber::bvh::Accel;
use comber::error::Result;
use comber::options::{self, RenderOptions};
use comber::scene::bounds::geometry_bounds;
use comber::scene::camera::Camera;
use comber::scene::description::SceneDescription;
use comber::scene::stage::{Stage, UpAxis, place};
use comber::scene::{Scene, SceneOptions, default, viewpoint};
use std::path::Path;

/// A scene, ready to be rendered.
pub struct Ready {
    pub name: &'static str,
    pub scene: Scene,
    pub accel: Accel,
    pub camera: Camera,
}

/// The names of all bench scenes. The last two need models that `scenes/fetch.sh` fetches.
pub const SCENES: [&str; 6] = ["cornell_empty", "cornell_spheres", "cornell_mesh", "default", "lucy100k", "dragon"];

/// The scene of that name as described; a word and `None` if it needs a file that is not here.
pub fn describe(name: &str) -> Option<(SceneDescription, Camera)> {
    match name {
        "default" => Some(staged(default::description())),
        "dragon" => on_stage(&["scenes/models/dragon_vrip.ply", "../shared/models/dragon_vrip.ply"]),
        "lucy100k" => on_stage(&["scenes/models/lucy100k.obj", "../shared/models/lucy100k.obj"]),
        _ => {
            let folders = ["scenes", "../shared/scenes/cs184"];
            let mut files = folders.iter().map(|folder| project().join(folder).join(name).with_extension("dae"));
            let found = files.find(|file| file.exists());
            if found.is_none() {
                eprintln!("skipped: {name}.dae is not here");
            }
            found.map(|file| course(&file))
        }
    }
}

/// The scene of that name; a word and `None` if it needs a model that is not here.
pub fn load(name: &'static str) -> Option<Ready> {
    let (description, camera) = describe(name)?;
    let scene = Scene::build(description, SceneOptions::default()).expect("a scene of the project is sound");
    let accel =
        Accel::build(&scene.shapes, &options::AccelOptions::default()).expect("a scene of the project can be indexed");
    Some(Ready { name, scene, accel, camera })
}

fn project() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn staged(staged: Result<comber::scene::stage::Staged>) -> (SceneDescription, Camera) {
    let staged = staged.expect("the scene stands on its stage");
    (staged.description, staged.camera)
}

/// The first of these files that is here, on the Cornell stage.
fn on_stage(files: &[&str]) -> Option<(SceneDescription, Camera)> {
    let Some(file) = files.iter().map(|file| project().join(file)).find(|file| file.exists()) else {
        eprintln!("skipped: {} is not here", files[0]);
        return None;
    };
    Some(staged(comber::import::load(&file).and_then(|mesh| place(mesh, Stage::Cornell, UpAxis::Y))))
}

fn course(file: &Path) -> (SceneDescription, Camera) {
    let description = comber::import::load(file).expect("a readable scene");
    let (min, max) = geometry_bounds(&description).expect("a scene with geometry");
    let camera = viewpoint::course(description.camera.as_ref(), min, max).expect("a scene with a camera");
    (description, camera)
}

/// What all benches render: the defaults, on a frame small enough to be rendered often.
pub fn render_options() -> RenderOptions {
    RenderOptions { width: 256, height: 192, samples: 16, ..RenderOptions::default() }
}

/// The arguments of a bench that has no harness: words that choose scenes, and whether to measure at all.
pub struct Args {
    words: Vec<String>,
    /// `cargo bench` says `--bench`; `cargo test` does not, and wants to see the bench run once, quickly.
    pub measure: bool,
}

impl Args {
    pub fn parse() -> Args {
        let (flags, words): (Vec<_>, Vec<_>) = std::env::args().skip(1).partition(|arg| arg.starts_with("--"));
        Args { words, measure: flags.iter().any(|flag| flag == "--bench") }
    }

    /// The bench scenes that the words name; all of them without words.
    pub fn scenes(&self) -> Vec<&'static str> {
        let all = if self.measure { &SCENES[..] } else { &SCENES[..1] };
        all.iter().copied().filter(|name| self.chosen(name)).collect()
    }

    /// Whether the words, if there are any, name this scene.
    pub fn chosen(&self, name: &str) -> bool {
        self.words.is_empty() || self.words.iter().any(|word| name.contains(word.as_str()))
    }
}
