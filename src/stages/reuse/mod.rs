//! # reuse: neighbours share what their paths find
//!
//! | | |
//! |---|---|
//! | reads | `vertex.*`, `sample.r/g/b/index` |
//! | writes | `sample.r/g/b`, `vertex.direct_r/g/b` |
//! | consumes | the finished paths of a wave, tile by tile |
//! | produces | their samples, each from the paths of a block of pixels |
//! | cost | for blocks of N pixels, up to N − 1 rays a path, any hit |
//!
//! A path's first ray behind what the camera sees leads to light that its neighbours could have found as well. Each of a block's second
//! vertices is linked to all the block's first vertices that see it, and shared among them by the balance heuristic
//! ([`crate::transport::reuse`]): unbiased, and every pixel has the indirect light of N paths for the price of one and N − 1 shadow rays.
//!
//! Not kept: paths of which one of M goes on behind its first vertex, in turns, and counts M times (efficiency, 1 / (relMSE × time), × 0.5 to 0.8 for M of 2
//! and 4 and blocks of 16: no path has so much to share); packets for the links (time × 1.02 to 1.15).
//!
//! What the noise of pixels has in common then changes with the sample, because blocks do (`blocks.rs`).

mod blocks;
mod links;

use super::{Context, Stage};
use crate::bvh::{Accel, Query, TraversalCounts};
use crate::sampling::random::Dimensions;
use crate::wave::features::Features;
use crate::wave::samples::Samples;
use crate::wave::span::Span;
use crate::wave::vertices::Vertices;
use blocks::Blocks;
use bumpalo::Bump;
use links::{Find, Links, ROWS};

/// Its facts.
pub const STAGE: Stage = Stage {
    name: "reuse",
    reads: &[
        ("vertex.*", Features::ALWAYS),
        ("sample.index", Features::ALWAYS),
        ("sample.r", Features::ALWAYS),
        ("sample.g", Features::ALWAYS),
        ("sample.b", Features::ALWAYS),
    ],
    writes: &[
        ("vertex.direct*", Features::ALWAYS),
        ("sample.r", Features::ALWAYS),
        ("sample.g", Features::ALWAYS),
        ("sample.b", Features::ALWAYS),
    ],
    requires: Features::REUSE,
};

/// What it changes.
pub struct Out<'a> {
    /// What the second vertex of each path scatters, or all that a path without one has found; then what the pixel gets.
    pub samples: &'a mut Samples,
    /// What the paths have met; their light from before the second vertex grows into the pixel's.
    pub vertices: &'a mut Vertices,
}

/// Shares the paths of `spans`, which occupy successive slots from 0, and of which those of a tile follow each other and are of the same
/// samples. Returns how many ways were tried, and what that took.
pub fn run(context: &Context, spans: &[Span], out: Out, scratch: &Bump) -> (usize, TraversalCounts) {
    let Out { samples, vertices } = out;
    let mut stage = Work { context, links: Links::new(scratch), tried: 0, counts: TraversalCounts::default() };
    let blocked = scratch.alloc_slice_fill_copy(ROWS, false);
    let mut base = 0;
    for tile in spans.chunk_by(|a, b| a.tile == b.tile) {
        let count = tile[0].count;
        for k in 0..count {
            let blocks = Blocks::sort((0..tile.len() as u32).map(|pixel| base + pixel * count + k), vertices);
            let lot = context.sampler.lot(tile[0].pixel, samples.index[(base + k) as usize], Dimensions::SHARING);
            for block in blocks.cut(context.transport.reuse, lot) {
                if !stage.links.has_room(block.len()) {
                    stage.settle(blocked, samples, vertices);
                }
                context.tier.run(Find { slots: block, samples, vertices, links: &mut stage.links });
            }
        }
        base += tile.len() as u32 * count;
    }
    stage.settle(blocked, samples, vertices);
    for slot in 0..base as usize {
        // Where there was a second vertex, the sample's own columns hold what that scatters: it has been shared.
        let finder = vertices.met[slot] == 2;
        for (to, from) in [
            (&mut samples.r, &vertices.direct_r),
            (&mut samples.g, &vertices.direct_g),
            (&mut samples.b, &vertices.direct_b),
        ] {
            to[slot] = if finder { from[slot] } else { to[slot] + from[slot] };
        }
    }
    (stage.tried, stage.counts)
}

/// The stage at work.
struct Work<'a, 'c> {
    context: &'a Context<'c>,
    links: Links<'a>,
    tried: usize,
    counts: TraversalCounts,
}

impl Work<'_, '_> {
    /// Asks which ways are free, and shares along those.
    fn settle(&mut self, blocked: &mut [bool], samples: &Samples, vertices: &mut Vertices) {
        let Context { accel, tier, counts, .. } = self.context;
        let trace = if *counts { Accel::any_hits_counted } else { Accel::any_hits };
        let blocked = &mut blocked[..self.links.len];
        self.counts += trace(accel, accel.suited(Query::Any, false), *tier, self.links.rays(), blocked);
        self.tried += self.links.len;
        self.links.settle(blocked, samples, vertices);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::ray::Ray;
    use crate::sampling::random::mix;
    use crate::sampling::random::to_unit;
    use crate::stages::tests::Fixture;
    use glam::{DVec3, Vec3};

    const WIDTH: u32 = 16;
    const HEIGHT: u32 = 12;
    const COUNT: u32 = 2;

    /// Numbers that have nothing to do with each other.
    fn number(slot: usize, what: u32) -> f32 {
        to_unit(mix(slot as u32 ^ mix(what)))
    }

    /// A point of the box's floor, ceiling or back wall, and its normal: all of them see each other but for the cubes.
    fn point(slot: usize, what: u32) -> (Vec3, Vec3) {
        let (a, b) = (number(slot, what) * 1.8 - 0.9, number(slot, what + 1) * 1.4 + 0.05);
        match (number(slot, what + 2) * 3.0) as u32 {
            0 => (Vec3::new(a, 1e-4, b - 0.75), Vec3::Y),
            1 => (Vec3::new(a, 1.4999, b - 0.75), Vec3::NEG_Y),
            _ => (Vec3::new(a, b, -0.9999), Vec3::Z),
        }
    }

    /// First and second vertices anywhere; some paths have none, or only one, or find nothing.
    fn fill(samples: &mut Samples, v: &mut Vertices) {
        for slot in 0..(WIDTH * HEIGHT * COUNT) as usize {
            let ((first, n), (second, g)) = (point(slot, 10), point(slot, 20));
            (v.first_ox[slot], v.first_oy[slot], v.first_oz[slot]) = first.into();
            (v.first_gx[slot], v.first_gy[slot], v.first_gz[slot]) = n.into();
            let shading = (n + Vec3::new(0.2, 0.1, -0.1) * number(slot, 3)).normalize();
            (v.first_nx[slot], v.first_ny[slot], v.first_nz[slot]) = shading.into();
            (v.albedo_r[slot], v.albedo_g[slot], v.albedo_b[slot]) = (0.2, number(slot, 4), 0.9);
            (v.second_ox[slot], v.second_oy[slot], v.second_oz[slot]) = second.into();
            (v.second_gx[slot], v.second_gy[slot], v.second_gz[slot]) = g.into();
            v.met[slot] = (number(slot, 5) * 8.0).min(2.0) as u32;
            let own = if v.met[slot] == 2 { 0.25 } else { 0.0 };
            (v.direct_r[slot], v.direct_g[slot], v.direct_b[slot]) = (own, own, own);
            let found = if number(slot, 6) < 0.2 { 0.0 } else { number(slot, 7) };
            (samples.r[slot], samples.g[slot], samples.b[slot]) = (found, 0.5 * found, 2.0);
            samples.index[slot] = slot as u32 % COUNT;
        }
    }

    /// The scalar twin, in double precision: every path of a block with every other, by the formula of the paper.
    fn twin(context: &Context, samples: &Samples, v: &Vertices, block: &[u32], add: &mut [DVec3]) {
        let vec = |x: &[f32], y: &[f32], z: &[f32], i: u32| {
            DVec3::new(x[i as usize].into(), y[i as usize].into(), z[i as usize].into())
        };
        let density = |i: u32, j: u32| {
            let way = vec(&v.second_ox, &v.second_oy, &v.second_oz, j) - vec(&v.first_ox, &v.first_oy, &v.first_oz, i);
            let d = way.normalize();
            let cos = d.dot(vec(&v.first_nx, &v.first_ny, &v.first_nz, i)).max(0.0);
            let above = d.dot(vec(&v.first_gx, &v.first_gy, &v.first_gz, i)) > 0.0;
            let arrives = (-d.dot(vec(&v.second_gx, &v.second_gy, &v.second_gz, j))).max(0.0);
            let start = vec(&v.second_ox, &v.second_oy, &v.second_oz, j).as_vec3();
            let ray = Ray { t_max: 1.0, ..Ray::new(start, (-way).as_vec3()) };
            let free = i == j || !context.accel.single().any_hit(&ray);
            if above && free { cos * arrives / way.length_squared() } else { 0.0 }
        };
        for &j in block.iter().filter(|&&j| v.met[j as usize] == 2) {
            let all: f64 = block.iter().map(|&k| density(k, j)).sum();
            let found = vec(&samples.r, &samples.g, &samples.b, j);
            for &i in block {
                let share = if all > 0.0 { density(i, j) / all } else { f64::from(u8::from(i == j)) };
                add[i as usize] += vec(&v.albedo_r, &v.albedo_g, &v.albedo_b, i) * found * share;
            }
        }
    }

    #[test]
    fn pixels_get_what_the_formula_says() {
        let fixture = Fixture::new();
        for mut context in fixture.contexts() {
            for pixels in [2, 16, 64] {
                context.transport.reuse = pixels;
                let rows = (WIDTH * HEIGHT * COUNT) as usize;
                let mut samples = Samples::allocate(rows, Features::ALWAYS);
                let mut vertices = Vertices::allocate(rows, Features::REUSE);
                fill(&mut samples, &mut vertices);
                let span = |i: u32| Span {
                    x: i % WIDTH,
                    y: i / WIDTH,
                    pixel: i,
                    first: 0,
                    stride: 1,
                    count: COUNT,
                    tile: 0,
                    local: i,
                };
                let spans: Vec<Span> = (0..WIDTH * HEIGHT).map(span).collect();
                let mut expected: Vec<DVec3> = (0..rows)
                    .map(|slot| match vertices.met[slot] {
                        2 => DVec3::splat(0.25),
                        _ => DVec3::new(samples.r[slot].into(), samples.g[slot].into(), samples.b[slot].into()),
                    })
                    .collect();
                for k in 0..COUNT {
                    let blocks = Blocks::sort((0..WIDTH * HEIGHT).map(|pixel| pixel * COUNT + k), &vertices);
                    let lot = context.sampler.lot(0, k, Dimensions::SHARING);
                    blocks.cut(pixels, lot).for_each(|block| twin(&context, &samples, &vertices, block, &mut expected));
                }
                let out = Out { samples: &mut samples, vertices: &mut vertices };
                let (tried, _) = run(&context, &spans, out, &Bump::new());
                assert!(tried > rows / 4 && tried < rows * pixels as usize, "{tried} ways");
                for (slot, expected) in expected.into_iter().enumerate() {
                    let found = DVec3::new(samples.r[slot].into(), samples.g[slot].into(), samples.b[slot].into());
                    let off = (found - expected).abs().max_element();
                    assert!(off <= 2e-5 * expected.max_element().max(0.1), "slot {slot}: {found} for {expected}");
                }
            }
        }
    }
}
