//! Emission, and the queue of rows that scatter.

use super::In;
use crate::sampling::v3::V3;
use crate::scene::shapes::NO_LIGHT;
use crate::stages::Context;
use crate::transport::{Left, emission};
use crate::wave::features::Features;
use crate::wave::samples::Samples;
use glam::Vec3;

/// Adds emission to the samples and writes the rows that scatter to `queue`; returns how many.
#[inline(always)]
pub fn run(context: &Context, depth: u32, n: usize, input: &In, samples: &mut Samples, queue: &mut [u32]) -> usize {
    let scene = context.scene;
    let looked_at = depth == 0 && context.features.has(Features::LAMPS);
    let counts_emission = context.transport.counts_emission(depth) && !looked_at;
    let mut scattering = 0;
    for row in 0..n {
        let Some(geometry) = scene.shapes.geometries.get(input.hits.geom[row] as usize) else { continue };
        if geometry.light != NO_LIGHT && counts_emission {
            emit(context, depth, row, input, samples);
        }
        queue[scattering] = row as u32;
        let albedo = scene.materials[geometry.material as usize].albedo;
        scattering += usize::from(albedo != Vec3::ZERO);
    }
    scattering
}

/// Few rows of a wave get here: one at a time.
#[inline(always)]
fn emit(context: &Context, depth: u32, row: usize, input: &In, samples: &mut Samples) {
    let paths = input.paths;
    let origin = paths.origin(row);
    let direction = V3::new(paths.dx[row], paths.dy[row], paths.dz[row]);
    let hit = input.hits.hit(row);
    let Some(found) = emission(context.scene, &hit, origin, direction) else { return };
    let features = context.features;
    let normal =
        if features.has(Features::LOOK_BACK) { V3::load([&paths.nx, &paths.ny, &paths.nz], row) } else { direction };
    let pdf = if features.has(Features::MIS) { paths.pdf[row] } else { 0.0 };
    let weight = context.transport.emission_weight(depth, &found, Left { origin, normal, pdf }, hit.t);
    let slot = paths.slot[row] as usize;
    let beta = if paths.beta_r.is_empty() {
        Vec3::ONE
    } else {
        Vec3::new(paths.beta_r[row], paths.beta_g[row], paths.beta_b[row])
    };
    let value = context.transport.clamped(depth, V3::from(beta * found.light.radiance * weight));
    samples.r[slot] += value.x;
    samples.g[slot] += value.y;
    samples.b[slot] += value.z;
}
