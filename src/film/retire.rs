//! Which pixels of a tile stop: the rules of adaptive sampling carried out on the film's sums.

use super::convergence::converged;
use super::interval::Interval;
use super::tile::Tile;
use crate::options::{Adaptive, Area, Trust};

impl Tile {
    /// Takes pixels that meet the rule off the list of active ones.
    pub fn retire(&mut self, rule: &Adaptive) {
        let mut active = std::mem::take(&mut self.active);
        let before = active.len();
        match rule.area {
            Area::Pixel => active.iter().for_each(|&local| self.test(rule, &[local as usize])),
            Area::Tile if active.is_empty() => {}
            Area::Tile => self.test(rule, &(0..self.x.len()).collect::<Vec<_>>()),
        }
        active.retain(|&local| self.open[local as usize] != 0);
        self.converged += (before - active.len()) as u32;
        self.active = active;
    }

    /// Tests `pixels` as one, and closes what needs no more samples.
    fn test(&mut self, rule: &Adaptive, pixels: &[usize]) {
        let (lead, floor) = (pixels[0], f64::from(rule.floor));
        let open = match rule.trust {
            Trust::Halves => {
                // Each half by the spread of the other, as if that had all samples of the pixel: the mean of both is
                // what has to be good enough. A half that has stopped says what it said then.
                let samples = |half: u32| self.interval(&pixels[..1], Some(half), floor).samples;
                let all = samples(0).saturating_add(samples(1));
                let stops = |half: u32| converged(&self.interval(pixels, Some(1 - half), floor).at(all), rule);
                let closed = u8::from(stops(0)) | u8::from(stops(1)) << 1;
                self.open[lead] & !closed
            }
            Trust::Once | Trust::Twice => {
                let passes = converged(&self.interval(pixels, None, floor), rule);
                let done = passes && (rule.trust == Trust::Once || self.passed[lead]);
                self.passed[lead] = passes;
                if done { 0 } else { 0b11 }
            }
        };
        pixels.iter().for_each(|&local| self.open[local] = open);
    }

    /// The interval of luminance of a pixel or of a tile, or of one half of their samples.
    fn interval(&self, pixels: &[usize], half: Option<u32>, floor: f64) -> Interval {
        let of = |local: usize| {
            let moments = &self.luminance[local];
            if let Some(doubling) = self.doublings.get(local) {
                doubling.interval(moments.n, moments.mean)
            } else if self.sequences.is_empty() || (half.is_none() && self.sequences.independent()) {
                Interval::of_samples(moments)
            } else {
                self.sequences.luminance(local, half)
            }
        };
        match pixels {
            [one] => of(*one),
            many => Interval::of_tile(many.iter().map(|&local| of(local)), floor),
        }
    }
}
