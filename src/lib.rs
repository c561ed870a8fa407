//! # comber: a wavefront path tracer for the CPU
//!
//! Paths advance together, one stage at a time; every stage is a batch kernel over structure-of-arrays columns.
//!
//! ```text
//! generate → traverse → shade → shadow → roulette → retire ─┐
//!     ↑          ↑                          │               │  finished samples: film
//!     │          └── survivors: next bounce ┘               │
//!     └──────────── pixels that want more samples ──────────┘
//! ```
//!
//! Goals, in this order:
//!
//! 1. **Right.** Every fast path has a simple twin that a test compares it to, to the bit where that is possible
//!    ([`mod@reference`] is the twin of the whole); pictures are tested against closed forms and independent renderers.
//! 2. **Deterministic.** The bytes of a picture do not depend on threads, wave size, tile order or instruction set.
//! 3. **Fast.** A wave that does not beat the depth-first reference is a failure.
//! 4. **Small.** A plan allocates and schedules only what the scene and the options require ([`plan`]).
//! 5. **Plain.** The data flow shows in the names of the files.
//!
//! | To understand | read |
//! |---|---|
//! | the stages, in order | [`stages`] |
//! | the columns they read and write | [`wave`] |
//! | which of them a render needs, and why | [`plan`] |
//! | how waves are cut, run and stopped | [`drive`] |
//! | what each vertex of a path adds | [`transport`] |
//! | what a ray can hit, and how it is found | [`scene`], [`bvh`] |
//! | when a pixel is done | [`film::convergence`] |
//! | how far a picture is from another | [`compare`] |
//! | what accuracy costs, and references to tell | [`trade`], [`accumulate`] |
//! | what the machine could do at most | [`profile::ceilings`] |
//! | how fast all of that is, and beside whom | [`mod@bench`], [`peer`] |
//! | what one sample did, vertex by vertex | [`explain`] |
//! | where the time goes | [`observer`], [`profile`] |
//!
//! `unsafe` has three homes: [`simd`], [`system`], and [`peer::embree`], which calls a C library where the user asks for that.
//!
//! ```
//! use comber::{bvh::Accel, drive, options::RenderOptions, plan::Plan, scene};
//!
//! let staged = scene::stage::place(
//!     scene::procedural::generate("proc:torus,tris=2k")?,
//!     scene::stage::Stage::Cornell,
//!     scene::stage::UpAxis::Y,
//! )?;
//! let scene = scene::Scene::build(staged.description, Default::default())?;
//! let options = RenderOptions { width: 32, height: 24, samples: 4, ..RenderOptions::default() };
//! let accel = Accel::build(&scene.shapes, &options.accel)?;
//! let plan = Plan::new(&scene, &accel, &options)?;
//! let outcome = drive::render(&scene, &accel, &staged.camera, &plan, &drive::Unobserved)?;
//! assert_eq!(outcome.picture.beauty.len(), 32 * 24);
//! # Ok::<(), comber::error::Error>(())
//! ```

pub mod accumulate;
pub mod bench;
pub mod bvh;
pub mod cache;
pub mod cli;
pub mod compare;
pub mod drive;
pub mod error;
pub mod explain;
pub mod export;
pub mod film;
pub mod import;
pub mod light;
pub mod material;
pub mod measure;
pub mod observer;
pub mod options;
pub mod peer;
pub mod pilot;
pub mod plan;
pub mod profile;
pub mod reference;
pub mod sampling;
pub mod scene;
pub mod simd;
pub mod stages;
pub mod system;
pub mod trade;
pub mod transport;
pub mod wave;
pub mod worth;
