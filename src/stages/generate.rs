//! # generate: camera rays
//!
//! | | |
//! |---|---|
//! | reads | its spans; `sample.pixel/index`, which it has just written |
//! | writes | `sample.*`, `path.*` (ray, slot, β = 1) |
//! | consumes | spans of pixels |
//! | produces | one row a sample |
//! | cost | 12 words written a row for a diffuse scene |

use super::{Context, Stage};
use crate::sampling::lanes::{Lanes, V3};
use crate::sampling::random::{Dimensions, uniform4};
use crate::simd::Kernel;
use crate::wave::features::Features;
use crate::wave::paths::Paths;
use crate::wave::samples::Samples;
use crate::wave::span::Span;
use glam::Vec4;

/// Its facts.
pub const STAGE: Stage = Stage {
    name: "generate",
    reads: &[("sample.pixel", Features::ALWAYS), ("sample.index", Features::ALWAYS)],
    writes: &[
        ("sample.pixel", Features::ALWAYS),
        ("sample.index", Features::ALWAYS),
        ("sample.r", Features::ALWAYS),
        ("sample.g", Features::ALWAYS),
        ("sample.b", Features::ALWAYS),
        ("path.ox", Features::ALWAYS),
        ("path.oy", Features::ALWAYS),
        ("path.oz", Features::ALWAYS),
        ("path.dx", Features::ALWAYS),
        ("path.dy", Features::ALWAYS),
        ("path.dz", Features::ALWAYS),
        ("path.slot", Features::ALWAYS),
        ("path.beta_r", Features::SCATTER),
        ("path.beta_g", Features::SCATTER),
        ("path.beta_b", Features::SCATTER),
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
            for (k, index) in samples.index[rows].iter_mut().enumerate() {
                *index = span.first + k as u32;
            }
            n += span.count as usize;
        }
        jitter(&samples.pixel[..n], &samples.index[..n], self.context.seed, [&mut paths.dx[..n], &mut paths.dy[..n]]);
        let lens = self.context.lens;
        for i in (0..n).step_by(Vec4::WIDTH) {
            let (x, y) = (Vec4::load(&paths.dx[i..]), Vec4::load(&paths.dy[i..]));
            let d = lens.direction(x, y);
            d.store([&mut paths.dx, &mut paths.dy, &mut paths.dz], i);
        }
        paths.ox[..n].fill(lens.origin.x);
        paths.oy[..n].fill(lens.origin.y);
        paths.oz[..n].fill(lens.origin.z);
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

/// Adds the sub-pixel position to each row's pixel corner.
#[inline(always)]
fn jitter(pixel: &[u32], index: &[u32], seed: u32, [x, y]: [&mut [f32]; 2]) {
    for (((pixel, index), x), y) in pixel.iter().zip(index).zip(x).zip(y) {
        let [u, v, ..] = uniform4(*pixel, *index, Dimensions::CAMERA, seed);
        *x += u;
        *y += v;
    }
}

/// The camera ray of one sample: the scalar twin of this stage.
pub fn camera_direction(context: &Context, x: u32, y: u32, pixel: u32, sample: u32) -> V3<f32> {
    let [u, v, ..] = uniform4(pixel, sample, Dimensions::CAMERA, context.seed);
    context.lens.direction(x as f32 + u, y as f32 + v)
}
