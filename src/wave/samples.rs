//! Samples: one row a camera path of the wave, for as long as the wave lasts. Its row number is the path's *slot*.

use super::columns::columns;
use super::features::Features;

columns! {
    /// What a path adds up to.
    pub struct Samples = "sample" {
        /// pixel of the frame, row by row from the top left; seeds the random numbers
        pixel: u32 => Features::ALWAYS;
        /// index of the sample within the pixel; seeds the random numbers
        index: u32 => Features::ALWAYS;
        /// 1 / δ where the pixel is: what rays must be worth, per radiance
        rate: f32 => Features::EFFICIENCY;
        /// radiance gathered so far, red (W·sr⁻¹·m⁻²)
        r: f32 => Features::ALWAYS;
        /// radiance gathered so far, green
        g: f32 => Features::ALWAYS;
        /// radiance gathered so far, blue
        b: f32 => Features::ALWAYS;
        /// albedo of the first hit, red
        albedo_r: f32 => Features::AOVS;
        /// albedo of the first hit, green
        albedo_g: f32 => Features::AOVS;
        /// albedo of the first hit, blue
        albedo_b: f32 => Features::AOVS;
        /// shading normal of the first hit, world x; zero for a miss
        normal_x: f32 => Features::AOVS;
        /// shading normal of the first hit, world y
        normal_y: f32 => Features::AOVS;
        /// shading normal of the first hit, world z
        normal_z: f32 => Features::AOVS;
        /// distance to the first hit, world units; infinite for a miss
        depth: f32 => Features::AOVS;
    }
}
