//! # retire: samples to the film, pixels off the list
//!
//! | | |
//! |---|---|
//! | reads | `sample.*` but the pixel numbers |
//! | writes | film |
//! | consumes | spans of pixels and their finished samples |
//! | produces | tiles with fewer active pixels |
//! | cost | 16 bytes read a sample, 44 with first hits; 24 to 144 bytes of film read and written |
//!
//! Policy (when is a pixel done?) lives in `film/convergence.rs`; this stage carries it out.

use super::Stage;
use crate::film::tile::{Sample, Tile};
use crate::wave::features::Features;
use crate::wave::samples::Samples;
use crate::wave::span::Span;

/// Its facts.
pub const STAGE: Stage = Stage {
    name: "retire",
    reads: &[
        ("sample.index", Features::ALWAYS),
        ("sample.r", Features::ALWAYS),
        ("sample.g", Features::ALWAYS),
        ("sample.b", Features::ALWAYS),
        ("sample.albedo*", Features::AOVS),
        ("sample.normal*", Features::AOVS),
        ("sample.depth", Features::AOVS),
    ],
    writes: &[],
    requires: Features::ALWAYS,
};

/// Adds the samples of `spans`, which occupy successive slots from 0, to the pixels of `tiles`.
pub fn run(spans: &[Span], samples: &Samples, tiles: &mut [Tile]) {
    let aovs = !samples.depth.is_empty();
    let mut slot = 0;
    for span in spans {
        let tile = &mut tiles[span.tile as usize];
        for _ in 0..span.count {
            let mut sample =
                Sample { radiance: [samples.r[slot], samples.g[slot], samples.b[slot]], ..Sample::default() };
            if aovs {
                sample.albedo = [samples.albedo_r[slot], samples.albedo_g[slot], samples.albedo_b[slot]];
                sample.normal = [samples.normal_x[slot], samples.normal_y[slot], samples.normal_z[slot]];
                sample.depth = samples.depth[slot];
            }
            tile.add(span.local as usize, samples.index[slot], &sample);
            slot += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::tile::{FilmLayout, tiles};
    use crate::options::Cell;

    /// However the samples of a pixel are cut into spans, the film holds the same bits.
    #[test]
    fn cuts_between_waves_leave_no_trace() {
        let cell = Cell { x: 0, y: 0, width: 3, height: 1 };
        let layout = FilmLayout { variance: true, luminance: true, ..FilmLayout::default() };
        let value = |pixel: u32, index: u32| (pixel as f32 + 1.3) / (index as f32 + 0.7);
        let film = |cut: u32| {
            let mut film = tiles(cell, layout);
            let mut samples = Samples::allocate(300, Features::TRANSPORT);
            for first in (0..100).step_by(cut as usize) {
                let count = cut.min(100 - first);
                let spans: Vec<Span> =
                    (0..3).map(|p| Span { x: p, y: 0, pixel: p, first, stride: 1, count, tile: 0, local: p }).collect();
                let rows = spans.iter().flat_map(|s| (s.first..s.first + s.count).map(|k| value(s.pixel, k)));
                for (slot, value) in rows.enumerate() {
                    (samples.r[slot], samples.g[slot], samples.b[slot]) = (value, value * 0.5, 0.1);
                }
                run(&spans, &samples, &mut film);
            }
            let tile = film.remove(0);
            (tile.mean, tile.m2, tile.count, tile.luminance.iter().map(|m| m.mean.to_bits()).collect::<Vec<_>>())
        };
        assert_eq!(film(100), film(1));
        assert_eq!(film(100), film(7));
    }
}
