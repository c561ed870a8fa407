//! The six stages, and two that run where they are asked for, in order. Each file: what it reads and writes, one `run`, its tests. Stages never import each other.
//!
//! | stage | consumes | produces |
//! |---|---|---|
//! | [`generate`] | spans of pixels | samples, paths |
//! | [`lamps`] | samples | emission that the camera sees |
//! | [`traverse`] | paths | hits |
//! | [`shade`] | paths, hits | radiance, shadow rays, next paths |
//! | [`shadow`] | shadow rays | radiance |
//! | [`roulette`] | next paths | paths, dense again |
//! | [`reuse`] | finished paths of a tile | samples that blocks of pixels share |
//! | [`retire`] | samples | film; pixels that are done |

mod aim;
pub mod generate;
pub mod lamps;
pub mod retire;
pub mod reuse;
pub mod roulette;
pub mod shade;
pub mod shadow;
pub mod traverse;

use crate::bvh::Accel;
use crate::light::in_view::InView;
use crate::sampling::sampler::Sampler;
use crate::scene::Scene;
use crate::scene::camera::Lens;
use crate::simd::Tier;
use crate::transport::Transport;
use crate::wave::features::Features;

/// What all batches of a render share. Read only.
pub struct Context<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Answers ray queries.
    pub accel: &'a Accel,
    /// The camera for this frame.
    pub lens: Lens,
    /// Pixels across the frame.
    pub width: u32,
    /// Where lights may be seen, if they are looked at by rays of their own.
    pub in_view: InView,
    /// How many of those a sample has.
    pub lamp_rays: u32,
    /// The estimator.
    pub transport: Transport,
    /// What the plan requires.
    pub features: Features,
    /// Draws random numbers.
    pub sampler: Sampler,
    /// Instruction set.
    pub tier: Tier,
    /// Whether traversal counts what it visits.
    pub counts: bool,
}

/// A stage, as data: what the plan checks and `comber info` prints.
///
/// Columns are named `table.field`; `table.*` and `table.part*` stand for all that begin so and that the plan allocates. `next` is the path
/// table that shade fills and roulette empties.
#[derive(Clone, Copy, Debug)]
pub struct Stage {
    /// Its name, in reports, benches and traces.
    pub name: &'static str,
    /// Columns read, each with the features under which it is.
    pub reads: &'static [(&'static str, Features)],
    /// Columns written, each with the features under which it is.
    pub writes: &'static [(&'static str, Features)],
    /// It runs if the plan has all of these.
    pub requires: Features,
}

/// All of them, in the order in which they run.
pub const ALL: [&Stage; 8] = [
    &generate::STAGE,
    &lamps::STAGE,
    &traverse::STAGE,
    &shade::STAGE,
    &shadow::STAGE,
    &roulette::STAGE,
    &reuse::STAGE,
    &retire::STAGE,
];

/// Their numbers in [`ALL`].
pub mod number {
    /// [`super::generate`]
    pub const GENERATE: usize = 0;
    /// [`super::lamps`]
    pub const LAMPS: usize = 1;
    /// [`super::traverse`]
    pub const TRAVERSE: usize = 2;
    /// [`super::shade`]
    pub const SHADE: usize = 3;
    /// [`super::shadow`]
    pub const SHADOW: usize = 4;
    /// [`super::roulette`]
    pub const ROULETTE: usize = 5;
    /// [`super::reuse`]
    pub const REUSE: usize = 6;
    /// [`super::retire`]
    pub const RETIRE: usize = 7;
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::options::{self, Direct, RenderOptions, Roulette};
    use crate::plan::Plan;
    use crate::scene::camera::Camera;
    use crate::scene::stage::{Stage as Setting, UpAxis, place};
    use crate::scene::{SceneOptions, procedural};

    #[test]
    fn numbers_are_those_of_the_list() {
        use number::*;
        let names = [GENERATE, LAMPS, TRAVERSE, SHADE, SHADOW, ROULETTE, REUSE, RETIRE].map(|number| ALL[number].name);
        assert_eq!(names, ["generate", "lamps", "traverse", "shade", "shadow", "roulette", "reuse", "retire"]);
    }

    /// A small scene for the tests of the stages: cubes in the Cornell box, a frame of 32 × 24 pixels.
    pub struct Fixture {
        scene: Scene,
        accel: Accel,
        camera: Camera,
    }

    impl Fixture {
        pub fn new() -> Fixture {
            let cubes = procedural::generate("proc:cubes,tris=12").expect("cubes");
            let staged = place(cubes, Setting::Cornell, UpAxis::Y).expect("stage");
            let scene = Scene::build(staged.description, SceneOptions::default()).expect("scene");
            let accel = Accel::build(&scene.shapes, &options::AccelOptions::default()).expect("tree");
            Fixture { scene, accel, camera: staged.camera }
        }

        /// For light sampling and for hemisphere sampling, on every tier.
        pub fn contexts(&self) -> Vec<Context<'_>> {
            let of = |direct: Direct, tier: Tier| {
                let roulette = Roulette::Fixed(0.5);
                let options =
                    RenderOptions { width: 32, height: 24, direct, roulette, seed: 9, ..RenderOptions::default() };
                let plan = Plan::new(&self.scene, &self.accel, &options).expect("plan");
                Context {
                    scene: &self.scene,
                    accel: &self.accel,
                    lens: self.camera.lens(32, 24),
                    width: 32,
                    in_view: InView::default(),
                    lamp_rays: 1,
                    transport: Transport::new(&options, &self.scene.lights),
                    features: plan.features,
                    sampler: Sampler::new(&options),
                    tier,
                    counts: false,
                }
            };
            let directs = [Direct::Mis, Direct::Hemisphere].into_iter();
            directs.flat_map(|direct| Tier::available().into_iter().map(move |tier| of(direct, tier))).collect()
        }
    }
}
