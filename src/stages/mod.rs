//! The six stages, in order. Each file: what it reads and writes, one `run`, its tests. Stages never import each other.
//!
//! | stage | consumes | produces |
//! |---|---|---|
//! | [`generate`] | spans of pixels | samples, paths |
//! | [`traverse`] | paths | hits |
//! | [`shade`] | paths, hits | radiance, shadow rays, next paths |
//! | [`shadow`] | shadow rays | radiance |
//! | [`roulette`] | next paths | paths, dense again |
//! | [`retire`] | samples | film; pixels that are done |

pub mod generate;
pub mod retire;
pub mod roulette;
pub mod shade;
pub mod shadow;
pub mod traverse;

use crate::bvh::Accel;
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

/// The six, in the order in which they run.
pub const ALL: [&Stage; 6] =
    [&generate::STAGE, &traverse::STAGE, &shade::STAGE, &shadow::STAGE, &roulette::STAGE, &retire::STAGE];

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::options::{self, Direct, RenderOptions, Roulette};
    use crate::plan::Plan;
    use crate::scene::camera::Camera;
    use crate::scene::stage::{Stage as Setting, UpAxis, place};
    use crate::scene::{SceneOptions, procedural};

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
