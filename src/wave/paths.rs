//! Paths: one row a live path, moved together when dead rows are dropped.

use super::columns::columns;
use super::features::Features;
use crate::sampling::v3::V3;
use crate::scene::origin::Origin;

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
        /// what single precision leaves of the ray origin, world x
        lx: f32 => Features::DOUBLE;
        /// the same, y
        ly: f32 => Features::DOUBLE;
        /// the same, z
        lz: f32 => Features::DOUBLE;
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
    /// Where the ray of a row starts.
    #[inline(always)]
    pub fn origin(&self, row: usize) -> Origin {
        let low = (!self.lx.is_empty()).then(|| V3::load([&self.lx, &self.ly, &self.lz], row));
        Origin { high: V3::new(self.ox[row], self.oy[row], self.oz[row]), low }
    }

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
            low: (!self.lx.is_empty()).then(|| [&self.lx[..n], &self.ly[..n], &self.lz[..n]]),
        }
    }
}
