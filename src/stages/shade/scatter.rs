//! The continuing ray.

use super::block::{Block, Outgoing, ROWS, get, set};
use crate::material::diffuse;
use crate::sampling::v3::V3;
use crate::stages::Context;
use crate::wave::features::Features;
use crate::wave::paths::Paths;

/// Appends the block's next paths behind row `n` of `next`; returns the new count. Dead ones have β = 0.
/// `rays` is scratch.
#[inline(always)]
pub fn run(context: &Context, depth: u32, block: &mut Block, rays: &mut Outgoing, next: &mut Paths, n: usize) -> usize {
    let dimension = context.transport.dimensions.bounce(depth);
    if context.features.has(Features::ROULETTE) {
        block.draw::<3>(&context.sampler, dimension);
    } else {
        block.draw::<2>(&context.sampler, dimension);
    }
    let end = n + block.len;
    let Outgoing { direction, value: beta, number: pdf } = rays;
    for (i, pdf) in pdf.iter_mut().enumerate() {
        let (u, v) = (block.random[0][i], block.random[1][i]);
        let sample = diffuse::sample(get(&block.albedo, i), get(&block.normal, i), get(&block.geometric, i), u, v);
        set(direction, i, sample.direction);
        set(beta, i, get(&block.beta, i).times(sample.weight));
        *pdf = sample.pdf;
    }
    if let Some(lights) = context.transport.looks_for_lights(depth) {
        for i in 0..ROWS {
            let in_vain = lights.misses(get(&block.origin, i), get(direction, i));
            set(beta, i, V3::select(in_vain, V3::new(0.0, 0.0, 0.0), get(beta, i)));
        }
    }
    let len = block.len;
    for (to, from) in [
        (&mut next.ox, &block.origin[0]),
        (&mut next.oy, &block.origin[1]),
        (&mut next.oz, &block.origin[2]),
        (&mut next.dx, &direction[0]),
        (&mut next.dy, &direction[1]),
        (&mut next.dz, &direction[2]),
        (&mut next.beta_r, &beta[0]),
        (&mut next.beta_g, &beta[1]),
        (&mut next.beta_b, &beta[2]),
    ] {
        to[n..end].copy_from_slice(&from[..len]);
    }
    if context.features.has(Features::DOUBLE) {
        for (to, from) in [&mut next.lx, &mut next.ly, &mut next.lz].into_iter().zip(&block.low) {
            to[n..end].copy_from_slice(&from[..len]);
        }
    }
    next.slot[n..end].copy_from_slice(&block.slot[..len]);
    if context.features.has(Features::MIS) {
        next.pdf[n..end].copy_from_slice(&pdf[..len]);
    }
    if context.features.has(Features::LOOK_BACK) {
        let [x, y, z] = &block.normal;
        for (to, from) in [(&mut next.nx, x), (&mut next.ny, y), (&mut next.nz, z)] {
            to[n..end].copy_from_slice(&from[..len]);
        }
    }
    if context.features.has(Features::ROULETTE) {
        next.roulette[n..end].copy_from_slice(&block.random[2][..len]);
    }
    end
}
