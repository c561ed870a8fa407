//! Position and normals of the block's rows.

use super::block::{Block, ROWS, get, set};
use crate::scene::surface::{on_broad_triangle, on_narrow_triangle, on_sphere, shading_normal};
use crate::stages::Context;
use crate::wave::features::Features;

/// Fills origin and normals of the first `len` rows.
#[inline(always)]
pub fn run(context: &Context, block: &mut Block, len: usize) {
    let smooth = context.features.has(Features::SMOOTH);
    let mut broad = [true; ROWS];
    for (i, broad) in broad.iter_mut().enumerate() {
        let [a, b, c] = &block.corners;
        let corners = [get(a, i), get(b, i), get(c, i)];
        let (point, is_broad) = on_broad_triangle(corners, block.u[i], block.v[i], get(&block.direction, i));
        *broad = is_broad;
        set(&mut block.origin, i, point.origin);
        set(&mut block.geometric, i, point.geometric);
        set(&mut block.normal, i, point.normal);
    }
    for i in (0..len).filter(|&i| !broad[i]) {
        let corners = block.corners.each_ref().map(|corner| get(corner, i));
        let point = on_narrow_triangle(corners, block.u[i], block.v[i], get(&block.direction, i));
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
        set(&mut block.origin, i, point.origin);
        set(&mut block.geometric, i, point.geometric);
        set(&mut block.normal, i, point.normal);
    }
}

/// Corner normals take the place of the corners, which are no longer needed.
#[inline(always)]
fn interpolate_normals(context: &Context, block: &mut Block, len: usize) {
    let shapes = &context.scene.shapes;
    for i in 0..len {
        if let Some(triangle) = shapes.triangles.get(block.prim[i] as usize) {
            for (corner, vertex) in block.corners.iter_mut().zip(triangle) {
                set(corner, i, shapes.normals[*vertex as usize].into());
            }
        }
    }
    for i in 0..ROWS {
        let [a, b, c] = &block.corners;
        let normals = [get(a, i), get(b, i), get(c, i)];
        set(&mut block.normal, i, shading_normal(normals, block.u[i], block.v[i], get(&block.geometric, i)));
    }
}
