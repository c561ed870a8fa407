//! What is seen of two pictures: brightened, clamped to 0..1, as a display shows them.

use super::luminance;
use super::pair::Pair;
use crate::film::png_output::srgb_encoded;

/// Linear colours from 0 to 1. Pixels that do not count are black in both.
pub struct Seen {
    pub a: Vec<[f64; 3]>,
    pub b: Vec<[f64; 3]>,
}

impl Seen {
    /// Both pictures, brightened by `exposure` stops.
    pub fn new(pair: &Pair, exposure: f32) -> Seen {
        let factor = f64::from(exposure).exp2();
        let see = |layer: &[[f32; 3]]| {
            let see = |(pixel, usable): (&[f32; 3], &bool)| match usable {
                true => pixel.map(|c| (f64::from(c) * factor).clamp(0.0, 1.0)),
                false => [0.0; 3],
            };
            layer.iter().zip(&pair.usable).map(see).collect()
        };
        Seen { a: see(&pair.a), b: see(&pair.b) }
    }
}

/// Luminance, sRGB-encoded, from 0 to 1.
pub fn grey(colour: [f64; 3]) -> f64 {
    srgb_encoded(luminance(colour))
}
