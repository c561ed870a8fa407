//! Vertices: the first two surfaces of each path of the wave, kept so that other paths can be led by way of them. Rows are slots.

use super::columns::columns;
use super::features::Features;

columns! {
    /// Where a path met its first two surfaces, and what it has found before the second.
    pub struct Vertices = "vertex" {
        /// how many of the two it has met, if both scatter
        met: u32 => Features::REUSE;
        /// where rays leave the first surface, world x
        first_ox: f32 => Features::REUSE;
        /// the same, y
        first_oy: f32 => Features::REUSE;
        /// the same, z
        first_oz: f32 => Features::REUSE;
        /// unit geometric normal of the first surface, on the side of the arriving ray, world x
        first_gx: f32 => Features::REUSE;
        /// the same, y
        first_gy: f32 => Features::REUSE;
        /// the same, z
        first_gz: f32 => Features::REUSE;
        /// its unit shading normal, world x
        first_nx: f32 => Features::REUSE;
        /// the same, y
        first_ny: f32 => Features::REUSE;
        /// the same, z
        first_nz: f32 => Features::REUSE;
        /// its albedo, red
        albedo_r: f32 => Features::REUSE;
        /// its albedo, green
        albedo_g: f32 => Features::REUSE;
        /// its albedo, blue
        albedo_b: f32 => Features::REUSE;
        /// where rays leave the second surface, world x
        second_ox: f32 => Features::REUSE;
        /// the same, y
        second_oy: f32 => Features::REUSE;
        /// the same, z
        second_oz: f32 => Features::REUSE;
        /// unit geometric normal of the second surface, on the side of the arriving ray, world x
        second_gx: f32 => Features::REUSE;
        /// the same, y
        second_gy: f32 => Features::REUSE;
        /// the same, z
        second_gz: f32 => Features::REUSE;
        /// radiance that the path has gathered before the second surface scatters any, red (W·sr⁻¹·m⁻²)
        direct_r: f32 => Features::REUSE;
        /// the same, green
        direct_g: f32 => Features::REUSE;
        /// the same, blue
        direct_b: f32 => Features::REUSE;
    }
}
