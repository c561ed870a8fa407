//! Shapes of many separate pieces: a soup of triangles, cubes on a lattice.

use super::noise::{hash, unit};
use crate::scene::description::MeshDescription;
use glam::{Quat, Vec3};
use rayon::prelude::*;
use std::f32::consts::TAU;

/// `triangles` triangles of all directions, scattered evenly in the unit ball; flat.
pub fn soup(triangles: u64, seed: u32) -> MeshDescription {
    let count = triangles as u32;
    // Sized so that their area together stays the same: rays get equally deep into any number of them.
    let reach = (4.0 / (count as f32).sqrt()).min(0.5);
    let random = |triangle: u32, dimension: u32| unit(hash(triangle, dimension, 0, seed));
    let mut positions = Vec::new();
    (0..3 * count)
        .into_par_iter()
        .map(|index| {
            let triangle = index / 3;
            let center = direction(random(triangle, 0), random(triangle, 1)) * random(triangle, 2).cbrt();
            let first = 3 + 3 * (index % 3);
            let corner = direction(random(triangle, first), random(triangle, first + 1));
            center + corner * (reach * (0.5 + 0.5 * random(triangle, first + 2)))
        })
        .collect_into_vec(&mut positions);
    let mut indices = Vec::new();
    (0..count).into_par_iter().map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect_into_vec(&mut indices);
    MeshDescription { positions, triangles: indices, ..Default::default() }
}

/// A unit direction from two numbers in [0, 1), evenly over the sphere.
fn direction(a: f32, b: f32) -> Vec3 {
    let y = 1.0 - 2.0 * a;
    let (sin, cos) = (TAU * b).sin_cos();
    let across = (1.0 - y * y).max(0.0).sqrt();
    Vec3::new(across * cos, y, across * sin)
}

/// Cubes of random sizes and turns on a cubic lattice, as many as come nearest; a single one stands straight.
pub fn cubes(triangles: u64, seed: u32) -> MeshDescription {
    let count = ((triangles + 6) / 12) as u32;
    let side = (1..).find(|side: &u32| side.pow(3) >= count).expect("some lattice is large enough");
    let pitch = 2.0 / side as f32;
    let corner = |index: u32| {
        let (cube, corner) = (index / 8, index % 8);
        let sign = |bit: u32| if corner & bit == 0 { -0.5 } else { 0.5 };
        let local = Vec3::new(sign(1), sign(2), sign(4));
        if count == 1 {
            return local * 2.0;
        }
        // Layers fill from below, so what an incomplete top layer lacks is at the top.
        let cell = Vec3::new((cube % side) as f32, (cube / side / side) as f32, (cube / side % side) as f32);
        let random = |dimension: u32| unit(hash(cube, dimension, 1, seed));
        let turn = Quat::from_axis_angle(direction(random(0), random(1)), TAU * random(2));
        // A cube of any turn fits into its cell below a side of 1/√3.
        let size = 0.3 + 0.27 * random(3);
        (cell + 0.5 + turn * local * size) * pitch - 1.0
    };
    let mut positions = Vec::new();
    (0..8 * count).into_par_iter().map(corner).collect_into_vec(&mut positions);
    // Corner numbers have bit 0 for +x, bit 1 for +y, bit 2 for +z.
    const FACES: [[u32; 3]; 12] = [
        [0, 4, 6],
        [0, 6, 2], // −x
        [1, 3, 7],
        [1, 7, 5], // +x
        [0, 1, 5],
        [0, 5, 4], // −y
        [2, 6, 7],
        [2, 7, 3], // +y
        [0, 2, 3],
        [0, 3, 1], // −z
        [4, 5, 7],
        [4, 7, 6], // +z
    ];
    let mut indices = Vec::new();
    (0..12 * count)
        .into_par_iter()
        .map(|index| FACES[(index % 12) as usize].map(|corner| index / 12 * 8 + corner))
        .collect_into_vec(&mut indices);
    MeshDescription { positions, triangles: indices, ..Default::default() }
}
