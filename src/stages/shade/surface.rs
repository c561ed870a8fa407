//! Position and normals of the block's rows.

use super::block::{Block, get, put, set};
use crate::sampling::lanes::{Lanes, V3};
use crate::scene::surface::{on_sphere, on_triangle, shading_normal};
use crate::stages::Context;
use crate::wave::features::Features;
use glam::Vec4;

/// Fills origin and normals of the first `len` rows.
#[inline(always)]
pub fn run(context: &Context, block: &mut Block, len: usize) {
    let smooth = context.features.has(Features::SMOOTH);
    for i in (0..len).step_by(Vec4::WIDTH) {
        let [a, b, c] = &block.corners;
        let corners = [get::<Vec4>(a, i), get(b, i), get(c, i)];
        let (u, v) = (Vec4::load(&block.u[i..]), Vec4::load(&block.v[i..]));
        let point = on_triangle(corners, u, v, get(&block.direction, i));
        set(&mut block.origin, i, point.origin);
        set(&mut block.geometric, i, point.geometric);
        set(&mut block.normal, i, point.normal);
    }
    if smooth {
        interpolate_normals(context, block, len);
    }
    // The triangle code has computed along for rows that hit a sphere; they are put right here.
    let shapes = &context.scene.shapes;
    for k in 0..block.sphere_count {
        let (i, hit) = block.spheres[k];
        let i = i as usize;
        let sphere = &shapes.spheres[block.prim[i] as usize - shapes.triangles.len()];
        let point = on_sphere(sphere.center.into(), sphere.radius, hit, get(&block.direction, i));
        put(&mut block.origin, i, [point.origin.x, point.origin.y, point.origin.z]);
        put(&mut block.geometric, i, [point.geometric.x, point.geometric.y, point.geometric.z]);
        put(&mut block.normal, i, [point.normal.x, point.normal.y, point.normal.z]);
    }
}

/// Corner normals take the place of the corners, which are no longer needed.
#[inline(always)]
fn interpolate_normals(context: &Context, block: &mut Block, len: usize) {
    let shapes = &context.scene.shapes;
    for i in 0..len {
        if let Some(triangle) = shapes.triangles.get(block.prim[i] as usize) {
            for (corner, vertex) in block.corners.iter_mut().zip(triangle) {
                put(corner, i, shapes.normals[*vertex as usize].to_array());
            }
        }
    }
    for i in (0..len).step_by(Vec4::WIDTH) {
        let [a, b, c] = &block.corners;
        let normals: [V3<Vec4>; 3] = [get(a, i), get(b, i), get(c, i)];
        let (u, v) = (Vec4::load(&block.u[i..]), Vec4::load(&block.v[i..]));
        set(&mut block.normal, i, shading_normal(normals, u, v, get(&block.geometric, i)));
    }
}
