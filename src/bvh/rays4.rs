//! Four rays, a lane each: setting rays up is done for four at a time.

use glam::{BVec4A, Mat4, Vec4};

use super::columns::RayColumns;
use crate::simd::wide::Words;

/// Smallest direction component that counts, relative to the largest: it keeps every product of a box test a number.
pub const STEEPEST: f32 = 1.0 / (1u64 << 60) as f32;

/// Four rays, by component.
#[derive(Clone, Copy, Debug)]
pub struct Rays4 {
    /// Origins.
    pub origin: [Vec4; 3],
    /// Directions.
    pub direction: [Vec4; 3],
    /// The ends of the rays; −1 for those that hit nothing, whatever the tree.
    pub t_max: Vec4,
    /// Their starts, at least 0.
    pub t_min: Vec4,
}

impl Rays4 {
    /// The rows from `first` on; past the end the last one again.
    #[inline(always)]
    pub fn load(rays: &RayColumns<'_>, first: usize) -> Rays4 {
        if first + 4 <= rays.len() {
            // Asked once, and not a column: the two ways would be merged, and all lanes be loaded one by one.
            return Rays4::new(rays, |column| Vec4::from_slice(&column[first..]));
        }
        let last = rays.len() - 1;
        Rays4::at(rays, std::array::from_fn(|i| (first + i).min(last)))
    }

    /// The directions alone.
    #[inline(always)]
    pub fn directions(rays: &RayColumns<'_>, first: usize) -> [Vec4; 3] {
        if first + 4 <= rays.len() {
            return [rays.dx, rays.dy, rays.dz].map(|column| Vec4::from_slice(&column[first..]));
        }
        let last = rays.len() - 1;
        let rows: [usize; 4] = std::array::from_fn(|i| (first + i).min(last));
        [rays.dx, rays.dy, rays.dz].map(|column| Vec4::from_array(rows.map(|row| column[row])))
    }

    /// Which of them can hit anything, one bit each.
    #[inline(always)]
    pub fn traceable(&self) -> u32 {
        !self.t_max.is_negative_bitmask() & 15
    }

    /// Any four rows.
    #[inline(always)]
    pub fn at(rays: &RayColumns<'_>, rows: [usize; 4]) -> Rays4 {
        Rays4::new(rays, |column: &[f32]| Vec4::from_array(rows.map(|row| column[row])))
    }

    #[inline(always)]
    fn new(rays: &RayColumns<'_>, load: impl Fn(&[f32]) -> Vec4 + Copy) -> Rays4 {
        let origin = [load(rays.ox), load(rays.oy), load(rays.oz)];
        let direction = [load(rays.dx), load(rays.dy), load(rays.dz)];
        let t_max = rays.t_max.map_or(Vec4::INFINITY, load);
        let t_min = rays.t_min.map_or(Vec4::ZERO, load);
        let traceable = traceable(origin, direction, t_min, t_max);
        // Hits at infinity do not count, so the limit is finite.
        let t_max = Vec4::select(traceable, t_max.min(Vec4::splat(f32::MAX)), Vec4::NEG_ONE);
        let t_min = Vec4::select(traceable, t_min.max(Vec4::ZERO), Vec4::ZERO);
        Rays4 { origin, direction, t_max, t_min }
    }

    /// Reciprocals of the directions, finite: components count as at least [`STEEPEST`] of the largest.
    #[inline(always)]
    pub fn scale(&self) -> [Vec4; 3] {
        let [x, y, z] = self.direction.map(Vec4::abs);
        let least = x.max(y).max(z) * STEEPEST;
        let scale = |magnitude: Vec4, direction: Vec4| magnitude.max(least).recip().copysign(direction);
        [scale(x, self.direction[0]), scale(y, self.direction[1]), scale(z, self.direction[2])]
    }
}

/// [`super::ray::Ray::is_traceable`].
#[inline(always)]
fn traceable(origin: [Vec4; 3], direction: [Vec4; 3], t_min: Vec4, t_max: Vec4) -> BVec4A {
    // Comparisons with NaN are false. Sums of finite numbers may overflow, so each is asked.
    let finite = |v: Vec4| v.abs().cmple(Vec4::splat(f32::MAX));
    let [x, y, z] = direction.map(Vec4::abs);
    let long = x.max(y).max(z).cmpge(Vec4::splat(super::ray::SHORTEST));
    finite(origin[0])
        & finite(origin[1])
        & finite(origin[2])
        & finite(direction[0])
        & finite(direction[1])
        & finite(direction[2])
        & long
        & t_max.cmpgt(t_min.max(Vec4::ZERO))
        & t_min.cmplt(Vec4::INFINITY)
}

/// From a vector a word to a quad a ray.
#[inline(always)]
pub fn transposed([a, b, c, d]: [Vec4; 4]) -> [Words; 4] {
    let rays = Mat4::from_cols(a, b, c, d).transpose();
    [rays.x_axis, rays.y_axis, rays.z_axis, rays.w_axis].map(|quad| quad.to_array().map(f32::to_bits))
}
