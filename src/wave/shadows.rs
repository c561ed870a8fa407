//! Shadows: one row a ray that asks whether tentative direct light arrives.

use super::columns::columns;
use super::features::Features;
use crate::sampling::v3::V3;
use crate::scene::origin::Origin;

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
        /// what single precision leaves of the ray origin, world x
        lx: f32 => Features::DOUBLE;
        /// the same, y
        ly: f32 => Features::DOUBLE;
        /// the same, z
        lz: f32 => Features::DOUBLE;
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
            t_max: Some(&self.t_max[..n]),
            low: (!self.lx.is_empty()).then(|| [&self.lx[..n], &self.ly[..n], &self.lz[..n]]),
        }
    }
}
