//! Paths: one row a live path, moved together when dead rows are dropped.

use super::columns::columns;
use super::features::Features;

columns! {
    /// Where a path is, and what it still carries.
    pub struct Paths = "path" {
        /// ray origin, world x
        ox: f32 => Features::ALWAYS;
        /// ray origin, world y
        oy: f32 => Features::ALWAYS;
        /// ray origin, world z
        oz: f32 => Features::ALWAYS;
        /// ray direction, unit, world x
        dx: f32 => Features::ALWAYS;
        /// ray direction, unit, world y
        dy: f32 => Features::ALWAYS;
        /// ray direction, unit, world z
        dz: f32 => Features::ALWAYS;
        /// row of the sample table
        slot: u32 => Features::ALWAYS;
        /// throughput β, red
        beta_r: f32 => Features::SCATTER;
        /// throughput β, green
        beta_g: f32 => Features::SCATTER;
        /// throughput β, blue
        beta_b: f32 => Features::SCATTER;
        /// solid-angle density with which the ray's direction was drawn (sr⁻¹)
        pdf: f32 => Features::MIS;
        /// unit shading normal of the surface that the ray left, world x
        nx: f32 => Features::LOOK_BACK;
        /// the same, y
        ny: f32 => Features::LOOK_BACK;
        /// the same, z
        nz: f32 => Features::LOOK_BACK;
        /// random number that decides whether the path goes on
        roulette: f32 => Features::ROULETTE;
    }
}

impl Paths {
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
            t_max: None,
        }
    }
}
