//! A fractal heightfield over the square [−1, 1]², y up.

use super::grid::Grid;
use super::noise::{fractal, ridges};
use crate::scene::description::MeshDescription;
use glam::Vec3;

/// Mountains on rolling ground. The four edges are open.
pub fn terrain(triangles: u64, seed: u32) -> MeshDescription {
    let grid = Grid::new(triangles, 1.0, false);
    // Ridges narrower than a few cells would only be jagged.
    let finest = grid.rows as f32 / 2.0 / 6.0;
    let octaves = ((finest / 2.0).log2() as u32).clamp(2, 8);
    let (positions, normals) = grid.vertices(|column, row| {
        let x = 2.0 * column as f32 / grid.columns as f32 - 1.0;
        // Rows run towards −z, so that columns and rows turn counter-clockwise seen from above.
        let z = 1.0 - 2.0 * row as f32 / grid.rows as f32;
        let place = Vec3::new(x, 0.0, z);
        let ground = fractal(place * 1.5, seed ^ 0x6a0d, 3, 0.45);
        let mountains = ridges(place * 2.0, seed, octaves, 0.45);
        // Ridges grow with the height of the ground beneath them.
        let growth = 0.16 + 0.14 * ground.value;
        let height = 0.22 * ground.value + growth * (mountains.value - 1.0);
        let slope =
            ground.gradient * (1.5 * (0.22 + 0.14 * (mountains.value - 1.0))) + mountains.gradient * (2.0 * growth);
        (Vec3::new(x, height, z), Vec3::new(-slope.x, 1.0, -slope.z).normalize())
    });
    MeshDescription { positions, normals, triangles: grid.triangles(), ..Default::default() }
}
