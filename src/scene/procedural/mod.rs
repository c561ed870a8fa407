//! Meshes made from a line of text: `proc:NAME[,tris=N][,seed=S]`.
//!
//! Every vertex and triangle is a pure function of its number, so meshes are the same for any number of threads,
//! and nothing is held in memory but the mesh itself. All are about two units across, around the origin, +y up.
//! Smooth families come with the surface's own normals, worked out rather than averaged.

mod ball;
mod grid;
mod loose;
pub(crate) mod noise;
mod rings;
mod round;
mod spec;
mod terrain;

pub use spec::{DEFAULT_TRIANGLES, Family, MAX_TRIANGLES, MIN_TRIANGLES, Spec};

use crate::error::{At, Note, Result};
use crate::scene::description::{MaterialDescription, MeshDescription, SceneDescription, Surface};
use glam::Vec3;

/// Makes the mesh that `spec` asks for, as a scene of one mesh with one diffuse material and no light.
///
/// The number of triangles is the one asked for where the family allows it, and within about 2 % elsewhere once
/// there are a few hundred; a note tells. Errors name what is wrong with `spec` and what would do.
pub fn generate(spec: &str) -> Result<SceneDescription> {
    Spec::parse(spec).map(|parsed| describe(spec, parsed))
}

fn describe(name: &str, spec: Spec) -> SceneDescription {
    let mut mesh = build(spec);
    mesh.name = name.to_string();
    let made = mesh.triangles.len();
    let grey = MaterialDescription {
        name: "grey".into(),
        at: At::File,
        surface: Surface::Diffuse { albedo: Vec3::splat(0.5) },
        emission: Vec3::ZERO,
    };
    SceneDescription {
        name: name.to_string(),
        meshes: vec![mesh],
        materials: vec![grey],
        notes: vec![Note::info(format!("{name}: {made} triangles, {} asked for", spec.triangles))],
        ..Default::default()
    }
}

/// The mesh of `spec`, with material 0.
fn build(spec: Spec) -> MeshDescription {
    match spec.family {
        Family::Sphere => round::sphere(spec.triangles),
        Family::Blob => round::blob(spec.triangles, spec.seed),
        Family::Coral => round::coral(spec.triangles, spec.seed),
        Family::Torus => rings::torus(spec.triangles),
        Family::Knot => rings::knot(spec.triangles, spec.seed),
        Family::Terrain => terrain::terrain(spec.triangles, spec.seed),
        Family::Soup => loose::soup(spec.triangles, spec.seed),
        Family::Cubes => loose::cubes(spec.triangles, spec.seed),
    }
}
