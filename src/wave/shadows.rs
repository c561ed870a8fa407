//! Shadows: one row a ray that asks whether tentative direct light arrives.

use super::columns::columns;
use super::features::Features;

columns! {
    /// A question to the scene, and what it is worth.
    pub struct Shadows = "shadow" {
        /// ray origin, world x
        ox: f32 => Features::SHADOW;
        /// ray origin, world y
        oy: f32 => Features::SHADOW;
        /// ray origin, world z
        oz: f32 => Features::SHADOW;
        /// ray direction, unit, world x
        dx: f32 => Features::SHADOW;
        /// ray direction, unit, world y
        dy: f32 => Features::SHADOW;
        /// ray direction, unit, world z
        dz: f32 => Features::SHADOW;
        /// distance that must be free, world units; infinite for hemisphere sampling
        t_max: f32 => Features::SHADOW;
        /// row of the sample table
        slot: u32 => Features::SHADOW;
        /// what arrives if nothing is in the way, red; for hemisphere sampling, what multiplies the emission found
        direct_r: f32 => Features::SHADOW;
        /// the same, green
        direct_g: f32 => Features::SHADOW;
        /// the same, blue
        direct_b: f32 => Features::SHADOW;
    }
}

impl Shadows {
    /// The first `n` rays.
    pub fn rays(&self, n: usize) -> crate::bvh::RayColumns<'_> {
        crate::bvh::RayColumns {
            ox: &self.ox[..n],
            oy: &self.oy[..n],
            oz: &self.oz[..n],
            dx: &self.dx[..n],
            dy: &self.dy[..n],
            dz: &self.dz[..n],
            t_min: None,
            t_max: Some(&self.t_max[..n]),
        }
    }
}
