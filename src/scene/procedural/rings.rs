//! Tubes that close to a ring: torus and knot.

use super::grid::Grid;
use super::noise::{Field, noise};
use crate::scene::description::MeshDescription;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// A ring torus about the y axis: radius 1, tube 0.4.
pub fn torus(triangles: u64) -> MeshDescription {
    const TUBE: f64 = 0.4;
    let grid = Grid::new(triangles, 1.0 / TUBE, true);
    let (positions, normals) = grid.vertices(|column, row| {
        let (sin_around, cos_around) = turn(column, grid.columns);
        let (sin_tube, cos_tube) = turn(row, grid.rows);
        let normal = DVec3::new(cos_tube * sin_around, sin_tube, cos_tube * cos_around);
        let center = DVec3::new(sin_around, 0.0, cos_around);
        ((center + normal * TUBE).as_vec3(), normal.as_vec3())
    });
    MeshDescription { positions, normals, triangles: grid.triangles(), ..Default::default() }
}

/// A tube along a trefoil, of three twisted strands with a fine grain; stands upright, about 2.6 across.
pub fn knot(triangles: u64, seed: u32) -> MeshDescription {
    const LENGTH_BY_GIRTH: f64 = 10.0;
    // With fewer pieces along the curve it would not go around itself.
    const LEAST: u64 = 72;
    let grid = Grid::new(triangles.max(LEAST), LENGTH_BY_GIRTH, true);
    // What depends only on the place along the curve is worked out once a column, in f64.
    let frames: Vec<Frame> = (0..grid.columns)
        .into_par_iter()
        .map(|column| Frame::at(TAU * f64::from(column) / f64::from(grid.columns)))
        .collect();
    let (positions, normals) = grid.vertices(|column, row| {
        let (sin_tube, cos_tube) = turn(row, grid.rows);
        frames[column as usize].surface(sin_tube as f32, cos_tube as f32, row as f32 / grid.rows as f32, seed)
    });
    MeshDescription { positions, normals, triangles: grid.triangles(), ..Default::default() }
}

/// Sine and cosine of `index / count` of a full turn.
fn turn(index: u32, count: u32) -> (f64, f64) {
    (TAU * f64::from(index) / f64::from(count)).sin_cos()
}

/// Mean radius of the knot's tube.
const KNOT_TUBE: f32 = 0.3;
/// Strands, and the turns that each makes about the tube on its way along the whole curve.
const STRANDS: f32 = 3.0;
const TWIST: f32 = 7.0;

/// The moving frame of the knot's curve and its derivatives by the curve's parameter.
struct Frame {
    parameter: f32,
    center: Vec3,
    across: Vec3,
    along_axis: Vec3,
    d_center: Vec3,
    d_across: Vec3,
    d_along_axis: Vec3,
}

impl Frame {
    fn at(t: f64) -> Frame {
        // Central differences in f64: exact to far below the f32 that the mesh is rounded to.
        let step = 1e-5;
        let (center, across, along_axis) = frame(t);
        let (before, after) = (frame(t - step), frame(t + step));
        let slope = |a: DVec3, b: DVec3| ((b - a) / (2.0 * step)).as_vec3();
        Frame {
            parameter: t as f32,
            center: center.as_vec3(),
            across: across.as_vec3(),
            along_axis: along_axis.as_vec3(),
            d_center: slope(before.0, after.0),
            d_across: slope(before.1, after.1),
            d_along_axis: slope(before.2, after.2),
        }
    }

    /// Position and unit normal at an angle about the tube, given by sine, cosine and as a fraction of the turn.
    fn surface(&self, sin: f32, cos: f32, fraction: f32, seed: u32) -> (Vec3, Vec3) {
        let angle = fraction * std::f32::consts::TAU;
        let out = self.across * cos + self.along_axis * sin;
        let out_by_angle = self.along_axis * cos - self.across * sin;
        let out_by_t = self.d_across * cos + self.d_along_axis * sin;

        // Strands with soft valleys between them, then a fine oblique rib, then a grain that has no direction.
        let strand = STRANDS * angle + TWIST * self.parameter;
        let rib = 24.0 * angle - 60.0 * self.parameter;
        let smooth = self.center + out * KNOT_TUBE;
        let grain = {
            let field = noise(smooth * 9.0, seed);
            Field { value: 0.03 * field.value, gradient: field.gradient * (0.03 * 9.0) }
        };
        let relief = 0.2 * strand.cos() + 0.012 * rib.cos() + grain.value;
        let strand_slope = -0.2 * strand.sin();
        let rib_slope = -0.012 * rib.sin();
        let smooth_by_angle = out_by_angle * KNOT_TUBE;
        let smooth_by_t = self.d_center + out_by_t * KNOT_TUBE;
        let relief_by_angle = STRANDS * strand_slope + 24.0 * rib_slope + grain.gradient.dot(smooth_by_angle);
        let relief_by_t = TWIST * strand_slope - 60.0 * rib_slope + grain.gradient.dot(smooth_by_t);

        let radius = KNOT_TUBE * (1.0 + relief);
        let by_angle = out * (KNOT_TUBE * relief_by_angle) + out_by_angle * radius;
        let by_t = self.d_center + out * (KNOT_TUBE * relief_by_t) + out_by_t * radius;
        (self.center + out * radius, by_t.cross(by_angle).normalize())
    }
}

/// A point of a trefoil and two unit vectors perpendicular to the curve there, periodic in `t` by 2π.
fn frame(t: f64) -> (DVec3, DVec3, DVec3) {
    let point = |t: f64| {
        DVec3::new(t.sin() + 2.0 * (2.0 * t).sin(), t.cos() - 2.0 * (2.0 * t).cos(), -1.25 * (3.0 * t).sin()) * 0.45
    };
    let tangent = DVec3::new(t.cos() + 4.0 * (2.0 * t).cos(), 4.0 * (2.0 * t).sin() - t.sin(), -3.75 * (3.0 * t).cos())
        .normalize();
    // The z axis is nowhere parallel to the curve, so its part across the curve makes a frame that closes.
    let across = tangent.cross(DVec3::Z).normalize();
    (point(t), across, across.cross(tangent))
}
