//! What the camera sees first: albedo, normal, depth; and the picture of the integrator that shows normals.

use super::In;
use super::block::Block;
use crate::sampling::v3::V3;
use crate::stages::Context;
use crate::transport::{normal_color, surface_at};
use crate::wave::features::Features;
use crate::wave::samples::Samples;
use glam::Vec3;

/// Records the first hits of the wave, if the plan asks for them. Of rows that go through `blocks` afterwards, because they scatter, the
/// normal is left to [`normals`].
#[inline(always)]
pub fn run(context: &Context, n: usize, input: &In, samples: &mut Samples, blocks: bool) {
    let aovs = context.features.has(Features::AOVS);
    let normals = !context.features.has(Features::TRANSPORT) && !context.features.has(Features::COST);
    if !(aovs || normals) {
        return;
    }
    let paths = input.paths;
    for row in 0..n {
        let slot = paths.slot[row] as usize;
        let hit = input.hits.hit(row);
        let direction = V3::new(paths.dx[row], paths.dy[row], paths.dz[row]);
        let scene = context.scene;
        let geometry = scene.shapes.geometries.get(hit.geom as usize);
        let albedo = geometry.map_or(Vec3::ZERO, |g| scene.materials[g.material as usize].albedo);
        let here = hit.is_some() && !(blocks && albedo != Vec3::ZERO);
        let normal = here.then(|| surface_at(scene, &hit, paths.origin(row), direction).normal);
        if let (true, Some(normal)) = (normals, normal) {
            let color = normal_color(normal);
            (samples.r[slot], samples.g[slot], samples.b[slot]) = (color.x, color.y, color.z);
        }
        if aovs {
            let normal = normal.map_or(Vec3::ZERO, Vec3::from);
            (samples.albedo_r[slot], samples.albedo_g[slot], samples.albedo_b[slot]) = (albedo.x, albedo.y, albedo.z);
            (samples.normal_x[slot], samples.normal_y[slot], samples.normal_z[slot]) = (normal.x, normal.y, normal.z);
            samples.depth[slot] = hit.t;
        }
    }
}

/// Records the normals of a block's rows, which were computed as blocks are.
#[inline(always)]
pub fn normals(block: &Block, samples: &mut Samples) {
    let [x, y, z] = &block.normal;
    for (i, &slot) in block.slot[..block.len].iter().enumerate() {
        let slot = slot as usize;
        (samples.normal_x[slot], samples.normal_y[slot], samples.normal_z[slot]) = (x[i], y[i], z[i]);
    }
}
