//! Materials: evaluate, sample, density – pure functions of values.

pub mod diffuse;

use glam::Vec3;

/// What the stages need to know of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Fraction of light reflected, linear Rec. 709; zero for a black emitter.
    pub albedo: Vec3,
    /// Radiance emitted from the front side.
    pub emission: Vec3,
}
