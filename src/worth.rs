//! What a ray must be worth: Russian roulette by efficiency.
//!
//! The efficiency of an estimator is 1 / (variance × work). A ray that is expected to add `c` to a sample, and is traced with
//! probability `q` and counts 1/q then, saves 1 − q of its work for `c²(1/q − 1)` of variance; the efficiency is best where q = min(1, c / δ)
//! with δ = √(variance of a sample / rays of a sample) (Veach, *Robust Monte Carlo Methods for Light Transport Simulation*, 1997,
//! §10.4.1). Both are measured by a few samples of each part of the frame before the render ([`crate::pilot`]).

use crate::options::RenderOptions;
use crate::sampling::v3::V3;

/// No ray counts more than this many times for others that were not traced: what it was expected to add may be wrong.
const MOST: f32 = 4.0;

/// Paths that carry less than this end by and by, whatever their worth: a scene without noise would have them go on to the depth limit.
const LITTLE: f32 = 1.0 / 1024.0;

/// Parts of the frame along its longer side.
const PARTS: u32 = 16;

/// How a frame is cut into square parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parts {
    /// Pixels along the side of a part: 2 to this power.
    shift: u32,
    /// Parts side by side.
    pub across: u32,
    /// Parts one above another.
    pub down: u32,
}

impl Parts {
    /// The parts of the frame that `options` ask for: 9 to 16 along its longer side, unless that has fewer pixels.
    pub fn of(options: &RenderOptions) -> Parts {
        let (width, height) = (options.width, options.height);
        let shift = width.max(height).div_ceil(PARTS).next_power_of_two().ilog2();
        let along = |pixels: u32| pixels.div_ceil(1 << shift);
        Parts { shift, across: along(width), down: along(height) }
    }

    /// The part of a pixel of the frame.
    pub fn part(self, x: u32, y: u32) -> usize {
        ((y >> self.shift) * self.across + (x >> self.shift)) as usize
    }

    /// Pixels of a part, from its left upper corner, as far as they are in the frame.
    pub fn corner(self, part: u32) -> [u32; 2] {
        [(part % self.across) << self.shift, (part / self.across) << self.shift]
    }

    /// Pixels along the side of a part.
    pub fn side(self) -> u32 {
        1 << self.shift
    }
}

/// What rays must be worth in each part of the frame.
#[derive(Clone, Debug)]
pub struct Worth {
    /// How the frame is cut.
    pub parts: Parts,
    /// 1 / δ of each part, per radiance.
    pub rates: Vec<f32>,
    /// Radiance that a path which goes on is expected to find, per unit of throughput.
    pub incoming: f32,
}

impl Worth {
    /// 1 / δ where a pixel of the frame is.
    pub fn rate(&self, x: u32, y: u32) -> f32 {
        self.rates[self.parts.part(x, y)]
    }

    /// Probability with which a path of throughput β (brightest channel) goes on where 1 / δ is `rate`.
    #[inline(always)]
    pub fn of_path(&self, rate: f32, beta: f32) -> f32 {
        let survival = survival(rate, beta * self.incoming);
        if beta < LITTLE { survival.min(beta / LITTLE).max(1.0 / MOST) } else { survival }
    }
}

/// Probability with which a ray is traced that is expected to add `value` (brightest channel) where 1 / δ is `rate`. A value that is not
/// a number is traced: the film counts it.
#[inline(always)]
pub fn survival(rate: f32, value: f32) -> f32 {
    let share = value * rate;
    if share < 1.0 { share.max(1.0 / MOST) } else { 1.0 }
}

/// What a ray towards a light, which would add `value`, adds if it is traced: zero if it is not worth its work; else `value`, or more for those
/// that are not traced. The `lot` is drawn by itself: nothing is gained by spreading lots evenly.
#[inline(always)]
pub fn thinned(rate: f32, lot: f32, value: V3) -> V3 {
    let survival = survival(rate, value.max_component());
    value * if lot < survival { 1.0 / survival } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_has_a_part() {
        for (width, height) in [(1, 1), (16, 9), (17, 3), (480, 360), (1920, 1080), (7, 5000)] {
            let parts = Parts::of(&RenderOptions { width, height, ..RenderOptions::default() });
            assert!(parts.across.max(parts.down) <= PARTS, "{parts:?}");
            let mut met = vec![false; (parts.across * parts.down) as usize];
            for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
                let part = parts.part(x, y);
                let [left, top] = parts.corner(part as u32);
                assert!((left..left + parts.side()).contains(&x) && (top..top + parts.side()).contains(&y));
                met[part] = true;
            }
            assert!(met.iter().all(|&met| met));
        }
    }

    #[test]
    fn what_is_worth_its_ray_is_traced() {
        let parts = Parts::of(&RenderOptions { width: 32, height: 2, ..RenderOptions::default() });
        let worth = Worth { parts, rates: Vec::new(), incoming: 0.5 };
        const NO_NOISE: f32 = f32::INFINITY;
        let nan = f32::NAN;
        assert_eq!(
            (worth.of_path(0.25, 16.0), worth.of_path(0.25, 2.0), worth.of_path(0.25, 0.0)),
            (1.0, 0.25, 1.0 / MOST)
        );
        assert_eq!(worth.of_path(0.25, 3.0), 0.375);
        // No noise to be saved: everything is traced. Values that are not numbers are, too.
        assert_eq!(
            (worth.of_path(NO_NOISE, 2e-3), worth.of_path(NO_NOISE, nan), worth.of_path(0.25, nan)),
            (1.0, 1.0, 1.0)
        );
        // But no path goes on for ever.
        assert_eq!((worth.of_path(NO_NOISE, 0.5 / 1024.0), worth.of_path(NO_NOISE, 0.0)), (0.5, 1.0 / MOST));
    }
}
