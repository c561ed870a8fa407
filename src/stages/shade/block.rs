//! Rows being shaded: gathered once, small enough for the first-level cache.
//!
//! Loops go through all rows of a block, and not only those at hand, and have no branches, nor loops over three within: so the compiler makes vectors of them, as
//! wide as the instruction set has. Four rows at a time, spelt out, took 1.03 to 1.1 times as long to render.

use super::In;
use crate::sampling::sampler::Sampler;
use crate::sampling::v3::V3;
use crate::stages::Context;
use crate::transport::Vertex;
use crate::wave::features::Features;
use crate::wave::samples::Samples;
use glam::Vec3;

/// Rows a block. Measured on the Cornell box with spheres: 32 to 256 are equal within noise.
pub const ROWS: usize = 64;

/// One number of each row.
pub type Column = [f32; ROWS];
/// One vector of each row.
pub type Column3 = [Column; 3];

/// The components of the rows at hand. Rows past `len` hold what an earlier block left there: they are
/// computed along and never written out.
pub struct Block {
    /// Rows in use.
    pub len: usize,
    /// Sample-table row.
    pub slot: [u32; ROWS],
    /// Pixel, for random numbers.
    pub pixel: [u32; ROWS],
    /// Sample index, for random numbers.
    pub index: [u32; ROWS],
    /// What rays must be worth: 1 / δ.
    pub rate: Column,
    /// Primitive.
    pub prim: [u32; ROWS],
    /// Throughput β.
    pub beta: Column3,
    /// Albedo.
    pub albedo: Column3,
    /// Direction of the arriving ray.
    pub direction: Column3,
    /// Barycentric weights.
    pub u: Column,
    /// Barycentric weights.
    pub v: Column,
    /// Triangle corners.
    pub corners: [Column3; 3],
    /// Where rays leave.
    pub origin: Column3,
    /// What single precision leaves of that; means nothing without `Features::DOUBLE`.
    pub low: Column3,
    /// Geometric normal, on the arriving ray's side.
    pub geometric: Column3,
    /// Shading normal, on the arriving ray's side.
    pub normal: Column3,
    /// Four random numbers.
    pub random: [Column; 4],
    /// Rows of the block that hit a sphere, and the point they hit.
    pub spheres: [(u32, V3); ROWS],
    /// How many of those.
    pub sphere_count: usize,
}

/// Rays that leave the rows at hand, towards a light or onwards.
pub struct Outgoing {
    /// Unit direction.
    pub direction: Column3,
    /// What the ray is worth: direct light that may arrive, or the throughput of the path that goes on.
    pub value: Column3,
    /// Distance that must be free, or density with which the direction was drawn.
    pub number: Column,
}

impl Default for Outgoing {
    fn default() -> Self {
        Outgoing { direction: [[0.0; ROWS]; 3], value: [[0.0; ROWS]; 3], number: [0.0; ROWS] }
    }
}

impl Default for Block {
    fn default() -> Self {
        let zero = [0.0; ROWS];
        Block {
            len: 0,
            slot: [0; ROWS],
            pixel: [0; ROWS],
            index: [0; ROWS],
            rate: zero,
            prim: [0; ROWS],
            beta: [zero; 3],
            albedo: [zero; 3],
            direction: [zero; 3],
            u: zero,
            v: zero,
            corners: [[zero; 3]; 3],
            origin: [zero; 3],
            low: [zero; 3],
            geometric: [zero; 3],
            normal: [zero; 3],
            random: [zero; 4],
            spheres: [(0, V3 { x: 0.0, y: 0.0, z: 0.0 }); ROWS],
            sphere_count: 0,
        }
    }
}

impl Block {
    /// Gathers `rows` of the input, and of the scene what belongs to them.
    #[inline(always)]
    pub fn gather(&mut self, context: &Context, rows: &[u32], input: &In, samples: &Samples) {
        let (paths, hits) = (input.paths, input.hits);
        let scene = context.scene;
        let shapes = &scene.shapes;
        let efficiency = context.features.has(Features::EFFICIENCY);
        self.len = rows.len();
        self.sphere_count = 0;
        for (i, &row) in rows.iter().enumerate() {
            let row = row as usize;
            let slot = paths.slot[row];
            self.slot[i] = slot;
            self.pixel[i] = samples.pixel[slot as usize];
            self.index[i] = samples.index[slot as usize];
            if efficiency {
                self.rate[i] = samples.rate[slot as usize];
            }
            set(&mut self.beta, i, V3::new(paths.beta_r[row], paths.beta_g[row], paths.beta_b[row]));
            let direction = V3::new(paths.dx[row], paths.dy[row], paths.dz[row]);
            set(&mut self.direction, i, direction);
            let material = shapes.geometries[hits.geom[row] as usize].material;
            set(&mut self.albedo, i, scene.materials[material as usize].albedo.into());
            let prim = hits.prim[row];
            self.prim[i] = prim;
            if (prim as usize) < shapes.triangles.len() {
                self.u[i] = hits.u[row];
                self.v[i] = hits.v[row];
                for (corner, position) in self.corners.iter_mut().zip(shapes.corners(prim)) {
                    set(corner, i, position.into());
                }
            } else {
                let origin = V3::new(paths.ox[row], paths.oy[row], paths.oz[row]);
                self.spheres[self.sphere_count] = (i as u32, origin + direction * hits.t[row]);
                self.sphere_count += 1;
                // The triangle code computes along: a triangle that gives it no trouble.
                for (corner, position) in self.corners.iter_mut().zip([Vec3::ZERO, Vec3::X, Vec3::Y]) {
                    set(corner, i, position.into());
                }
            }
        }
    }

    /// One row, as the estimator sees it.
    #[inline(always)]
    pub fn vertex(&self, i: usize) -> Vertex {
        Vertex {
            beta: get(&self.beta, i),
            albedo: get(&self.albedo, i),
            normal: get(&self.normal, i),
            geometric: get(&self.geometric, i),
        }
    }

    /// Draws the first `N` of the four numbers of block `dimension` for every row.
    #[inline(always)]
    pub fn draw<const N: usize>(&mut self, sampler: &Sampler, dimension: u32) {
        if let Some(columns) = self.random.first_chunk_mut::<N>() {
            sampler.draw_rows(&self.pixel, &self.index, dimension, columns);
        }
    }
}

/// Reads one row of a vector column.
#[inline(always)]
pub fn get([x, y, z]: &Column3, i: usize) -> V3 {
    V3::new(x[i], y[i], z[i])
}

/// Writes one row of a vector column.
#[inline(always)]
pub fn set([x, y, z]: &mut Column3, i: usize, value: V3) {
    (x[i], y[i], z[i]) = (value.x, value.y, value.z);
}
