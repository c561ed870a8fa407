//! A finished picture: layers of floats, ready to be written.

use serde_json::Value;

/// Layers in scanline order, top row first. Each present layer has `width * height` entries.
#[derive(Clone, Debug, Default)]
pub struct Picture {
    /// Pixels across the data window.
    pub width: usize,
    /// Pixels down the data window.
    pub height: usize,
    /// Left edge of the data window within the full frame.
    pub x: usize,
    /// Top edge of the data window within the full frame.
    pub y: usize,
    /// Full frame size (the display window): equals `(width, height)` unless a cell was rendered.
    pub full: (usize, usize),
    /// Linear Rec. 709 radiance: channels `R G B`.
    pub beauty: Vec<[f32; 3]>,
    /// `Albedo.R/G/B`: mean albedo of the first hit.
    pub albedo: Option<Vec<[f32; 3]>>,
    /// `Ns.X/Y/Z`: mean shading normal of the first hit, world space.
    pub normal: Option<Vec<[f32; 3]>>,
    /// `Z`: mean distance to the first hit, infinite where nothing was hit.
    pub depth: Option<Vec<f32>>,
    /// `Variance.R/G/B`: variance of the mean (standard error squared) of each channel of `beauty`; an upper bound of it where
    /// samples avoid each other and are of one sequence.
    pub variance: Option<Vec<[f32; 3]>>,
    /// `Debug Sample Count.X`: samples a pixel.
    pub sample_count: Option<Vec<u32>>,
    /// Provenance: scene, options, seed, version, time; written as one JSON string attribute named `comber`.
    pub provenance: Value,
}

impl Picture {
    /// Whether the beauty layers are the same to the bit.
    pub fn same_bits(&self, other: &Picture) -> bool {
        let bits = |picture: &Picture| picture.beauty.iter().flatten().map(|c| c.to_bits()).collect::<Vec<_>>();
        (self.width, self.height) == (other.width, other.height) && bits(self) == bits(other)
    }
}
