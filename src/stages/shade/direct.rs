//! Direct light: shadow rays and what each is worth.

use super::block::{Block, Outgoing, ROWS, get, set};
use crate::light::shape::LightShape;
use crate::light::{Light, LightSample};
use crate::options::LightSampling;
use crate::sampling::v3::V3;
use crate::stages::Context;
use crate::transport::{Asked, Sampled, hemisphere_sample, light_contribution};
use crate::wave::features::Features;
use crate::wave::shadows::Shadows;
use crate::worth;

/// Appends the shadow rays of the block behind row `n` of `shadows`; returns the new count. `rays` is scratch.
#[inline(always)]
pub fn run(
    context: &Context,
    depth: u32,
    block: &mut Block,
    rays: &mut Outgoing,
    shadows: &mut Shadows,
    mut n: usize,
) -> usize {
    let transport = &context.transport;
    for k in 0..transport.shadow_samples {
        let dimension = transport.dimensions.light(depth, k);
        if context.features.has(Features::HEMISPHERE) {
            block.draw::<2>(&context.sampler, dimension);
            hemisphere(context, block, rays);
        } else if let Some(asked) = single_light(context, k) {
            block.draw::<2>(&context.sampler, dimension);
            one_light(context, block, asked, rays);
        } else {
            block.draw::<4>(&context.sampler, dimension);
            light_by_row(context, block, k, rays);
        }
        if !context.features.has(Features::HEMISPHERE) {
            thin(context, depth, dimension, block, rays);
        }
        n = append(block, rays, shadows, n);
    }
    n
}

/// Bounds what lights may add, and drops the rays that are not worth it.
#[inline(always)]
fn thin(context: &Context, depth: u32, dimension: u32, block: &Block, rays: &mut Outgoing) {
    let transport = &context.transport;
    if transport.clamps(depth + 1) {
        for i in 0..ROWS {
            let value = transport.clamped(depth + 1, get(&rays.value, i));
            set(&mut rays.value, i, value);
        }
    }
    if context.features.has(Features::EFFICIENCY) {
        let lot: [f32; ROWS] = std::array::from_fn(|i| context.sampler.lot(block.pixel[i], block.index[i], dimension));
        for (i, (rate, lot)) in block.rate.into_iter().zip(lot).enumerate() {
            let value = worth::thinned(rate, lot, get(&rays.value, i));
            set(&mut rays.value, i, value);
        }
    }
}

/// The light that sample `k` asks in every row, and how often, if it is the same and of a shape that is sampled in all rows alike.
#[inline(always)]
fn single_light<'a>(context: &'a Context, k: u32) -> Option<(&'a Light, f32)> {
    if context.features.has(Features::DOUBLE) {
        return None;
    }
    let (id, rate) = context.transport.same_light(k)?;
    let light = &context.scene.lights[id];
    (!matches!(light.shape, LightShape::Mesh(_))).then_some((light, rate))
}

#[inline(always)]
fn one_light(context: &Context, block: &Block, asked: (&Light, f32), rays: &mut Outgoing) {
    match (&asked.0.shape, context.transport.light_sampling) {
        (LightShape::Parallelogram(p), LightSampling::Corners) => {
            all_rows(context, block, asked, rays, |from, normal, u, v| p.sample_corners(from, normal, u, v));
        }
        (LightShape::Parallelogram(p), how) => {
            match p.rectangle.as_ref().filter(|_| how == LightSampling::SolidAngle) {
                Some(sides) => {
                    all_rows(context, block, asked, rays, |from, _, u, v| p.sample_rectangle(sides, from, u, v))
                }
                None => all_rows(context, block, asked, rays, |from, _, u, v| p.sample_area(from, u, v)),
            }
        }
        (LightShape::Sphere(s), _) => all_rows(context, block, asked, rays, |from, _, u, v| s.sample(from, u, v)),
        (LightShape::Mesh(_), _) => unreachable!("meshes are sampled row by row"),
    }
}

#[inline(always)]
fn all_rows(
    context: &Context,
    block: &Block,
    (light, rate): (&Light, f32),
    rays: &mut Outgoing,
    sample: impl Fn(V3, V3, f32, f32) -> LightSample,
) {
    let transport = &context.transport;
    let light = Sampled { radiance: V3::from(light.radiance), rate };
    let mis = transport.mis();
    let Outgoing { direction, value, number } = rays;
    for (i, number) in number.iter_mut().enumerate() {
        let vertex = block.vertex(i);
        let found = sample(get(&block.origin, i), vertex.normal, block.random[0][i], block.random[1][i]);
        set(direction, i, found.direction);
        *number = found.distance;
        set(value, i, light_contribution(vertex, light, found, mis));
    }
}

/// Rows ask different lights, or a mesh: one at a time.
#[inline(always)]
fn light_by_row(context: &Context, block: &Block, k: u32, rays: &mut Outgoing) {
    let (transport, lights) = (&context.transport, &context.scene.lights);
    for i in 0..block.len {
        let random = [0, 1, 2, 3].map(|d: usize| block.random[d][i]);
        let (from, vertex) = (block.leaves(context, i), block.vertex(i));
        let Some(Asked { light, found, .. }) = transport.ask(lights, k, random, from, vertex.normal) else {
            set(&mut rays.value, i, V3::new(0.0, 0.0, 0.0));
            continue;
        };
        let value = light_contribution(vertex, light, found, transport.mis());
        set(&mut rays.direction, i, found.direction);
        rays.number[i] = found.distance;
        set(&mut rays.value, i, value);
    }
}

#[inline(always)]
fn hemisphere(context: &Context, block: &Block, rays: &mut Outgoing) {
    let count = context.transport.shadow_samples;
    for i in 0..ROWS {
        let uv = [block.random[0][i], block.random[1][i]];
        let (direction, value) = hemisphere_sample(block.vertex(i), uv, count);
        set(&mut rays.direction, i, direction);
        set(&mut rays.value, i, value);
    }
    rays.number.fill(f32::INFINITY);
}

/// Streams the rays that are worth tracing to the table.
#[inline(always)]
fn append(block: &Block, rays: &Outgoing, shadows: &mut Shadows, n: usize) -> usize {
    let mut worth = [0u8; ROWS];
    let mut count = 0;
    for i in 0..block.len {
        worth[count] = i as u8;
        let [r, g, b] = [0, 1, 2].map(|c: usize| rays.value[c][i]);
        // Not `> 0`: a value that is not a number must reach the film, which counts it.
        count += usize::from(r != 0.0 || g != 0.0 || b != 0.0);
    }
    let worth = &worth[..count];
    for (to, from) in [
        (&mut shadows.ox, &block.origin[0]),
        (&mut shadows.oy, &block.origin[1]),
        (&mut shadows.oz, &block.origin[2]),
        (&mut shadows.dx, &rays.direction[0]),
        (&mut shadows.dy, &rays.direction[1]),
        (&mut shadows.dz, &rays.direction[2]),
        (&mut shadows.t_max, &rays.number),
        (&mut shadows.direct_r, &rays.value[0]),
        (&mut shadows.direct_g, &rays.value[1]),
        (&mut shadows.direct_b, &rays.value[2]),
    ] {
        for (to, &i) in to[n..n + count].iter_mut().zip(worth) {
            *to = from[i as usize % ROWS];
        }
    }
    let low = [&mut shadows.lx, &mut shadows.ly, &mut shadows.lz].into_iter().zip(&block.low);
    for (to, from) in low.filter(|(to, _)| !to.is_empty()) {
        to[n..n + count].iter_mut().zip(worth).for_each(|(to, &i)| *to = from[i as usize % ROWS]);
    }
    for (to, &i) in shadows.slot[n..n + count].iter_mut().zip(worth) {
        *to = block.slot[i as usize % ROWS];
    }
    n + count
}
