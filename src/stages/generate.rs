//! # generate: camera rays
//!
//! | | |
//! |---|---|
//! | reads | its spans; `sample.pixel/index`, which it has just written |
//! | writes | `sample.*`, `path.*` (ray, slot, β = 1) |
//! | consumes | spans of pixels |
//! | produces | one row a sample |
//! | cost | 12 words written a row for a diffuse scene |

pub use super::aim::ROWS;
use super::aim::aim;
use super::{Context, Stage};
use crate::sampling::random::Dimensions;
use crate::simd::Kernel;
use crate::wave::features::Features;
use crate::wave::paths::Paths;
use crate::wave::samples::Samples;
use crate::wave::span::Span;

/// Its facts.
pub const STAGE: Stage = Stage {
    name: "generate",
    reads: &[("sample.pixel", Features::ALWAYS), ("sample.index", Features::ALWAYS)],
    writes: &[
        ("sample.pixel", Features::ALWAYS),
        ("sample.index", Features::ALWAYS),
        ("sample.rate", Features::EFFICIENCY),
        ("sample.r", Features::ALWAYS),
        ("sample.g", Features::ALWAYS),
        ("sample.b", Features::ALWAYS),
        ("path.o*", Features::ALWAYS),
        ("path.d*", Features::ALWAYS),
        ("path.l*", Features::DOUBLE),
        ("path.slot", Features::ALWAYS),
        ("path.beta*", Features::SCATTER),
    ],
    requires: Features::ALWAYS,
};

/// What it writes.
pub struct Out<'a> {
    /// One row a sample.
    pub samples: &'a mut Samples,
    /// One row a path.
    pub paths: &'a mut Paths,
}

/// Fills one row for each sample of `spans`; returns how many.
pub fn run(context: &Context, spans: &[Span], out: Out) -> usize {
    context.tier.run(Generate { context, spans, out })
}

struct Generate<'a, 'c> {
    context: &'a Context<'c>,
    spans: &'a [Span],
    out: Out<'a>,
}

impl Kernel for Generate<'_, '_> {
    type Output = usize;

    #[inline(always)]
    fn run(self) -> usize {
        let Out { samples, paths } = self.out;
        let mut n = 0;
        for span in self.spans {
            let rows = n..n + span.count as usize;
            samples.pixel[rows.clone()].fill(span.pixel);
            // The pixel's corner stands in the direction columns until the rays are made below.
            paths.dx[rows.clone()].fill(span.x as f32);
            paths.dy[rows.clone()].fill(span.y as f32);
            if let Some(worth) = &self.context.transport.worth
                && self.context.features.has(Features::EFFICIENCY)
            {
                samples.rate[rows.clone()].fill(worth.rate(span.x, span.y));
            }
            for (k, index) in samples.index[rows].iter_mut().enumerate() {
                *index = span.first + k as u32 * span.stride;
            }
            n += span.count as usize;
        }
        aim(
            self.context,
            Dimensions::CAMERA,
            &samples.pixel[..n],
            &samples.index[..n],
            [&mut paths.dx, &mut paths.dy, &mut paths.dz],
        );
        let lens = self.context.lens;
        paths.ox[..n].fill(lens.origin.x);
        paths.oy[..n].fill(lens.origin.y);
        paths.oz[..n].fill(lens.origin.z);
        for (column, low) in [&mut paths.lx, &mut paths.ly, &mut paths.lz].into_iter().zip(lens.low.to_array()) {
            if !column.is_empty() {
                column[..n].fill(low);
            }
        }
        for (slot, row) in paths.slot[..n].iter_mut().enumerate() {
            *row = slot as u32;
        }
        for column in [&mut samples.r, &mut samples.g, &mut samples.b] {
            column[..n].fill(0.0);
        }
        for column in [&mut paths.beta_r, &mut paths.beta_g, &mut paths.beta_b] {
            if !column.is_empty() {
                column[..n].fill(1.0);
            }
        }
        n
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::v3::V3;
    use crate::stages::tests::Fixture;
    use crate::wave::Wave;

    #[test]
    fn rows_are_the_samples_of_the_spans_in_order() {
        let fixture = Fixture::new();
        for context in fixture.contexts() {
            let span = |x: u32, y: u32, first, count| Span {
                x,
                y,
                pixel: y * 32 + x,
                first,
                stride: 1,
                count,
                tile: 0,
                local: 0,
            };
            let spans = [span(3, 2, 0, 5), span(4, 2, 7, 1), span(31, 23, 100, 3)];
            let mut wave = Wave::allocate(16, 1, context.features);
            let n = run(&context, &spans, Out { samples: &mut wave.samples, paths: &mut wave.paths });
            assert_eq!(n, 9);
            let expected: Vec<(&Span, u32)> =
                spans.iter().flat_map(|s| (s.first..s.first + s.count).map(move |k| (s, k))).collect();
            for (row, (span, index)) in expected.into_iter().enumerate() {
                assert_eq!((wave.samples.pixel[row], wave.samples.index[row]), (span.pixel, index));
                assert_eq!(wave.paths.slot[row] as usize, row);
                // The scalar twin: the same camera ray, to the bit.
                let [u, v, ..] = context.sampler.draw(span.pixel, index, Dimensions::CAMERA);
                let d: V3 = context.lens.direction(span.x as f32 + u, span.y as f32 + v);
                assert_eq!([d.x, d.y, d.z], [wave.paths.dx[row], wave.paths.dy[row], wave.paths.dz[row]]);
                assert_eq!(wave.paths.beta_g[row], 1.0);
            }
        }
    }
}
