//! The order of primitives along a Morton curve, and where its cells end.

use glam::Vec3;
use rayon::prelude::*;
use std::ops::Range;

use super::fragment::{self, Fragment};
use crate::bvh::aabb::Aabb;
use crate::scene::shapes::Shapes;

/// Most bits an axis: trees that are cut by them alone stay well below the depth that traversal allows.
const MOST_AXIS_BITS: u32 = 15;

/// All primitives, sorted by the Morton code of the centre of their box within `bounds`; equal codes by number.
///
/// Code and number share 64 bits, so that sorting moves nothing else: a million primitives get 14 bits an axis.
#[derive(Debug)]
pub struct Curve {
    /// Codes above numbers, ascending.
    keys: Vec<u64>,
    prim_bits: u32,
}

impl Curve {
    /// Sorts some primitives.
    pub fn new(shapes: &Shapes, prims: &[Range<u32>], bounds: &Aabb) -> Curve {
        let prim_bits = usize::BITS - shapes.prim_count().saturating_sub(1).leading_zeros();
        let quantizer = Quantizer::new(bounds, ((64 - prim_bits) / 3).min(MOST_AXIS_BITS));
        let mut keys = Vec::new();
        for prims in prims {
            keys.par_extend(prims.clone().into_par_iter().map(|prim| {
                let tight = fragment::tight(shapes, prim);
                quantizer.code(tight.min * 0.5 + tight.max * 0.5) << prim_bits | u64::from(prim)
            }));
        }
        keys.par_sort_unstable();
        Curve { keys, prim_bits }
    }

    /// A fragment for each primitive, in the order of the curve.
    pub fn fragments(&self, shapes: &Shapes) -> Vec<Fragment> {
        let mask = (1u64 << self.prim_bits) - 1;
        let prims = self.keys.par_iter().map(|key| (key & mask) as u32);
        prims.map(|prim| Fragment::new(prim, &fragment::tight(shapes, prim))).collect()
    }

    /// All of it.
    pub fn whole(&self) -> Stretch<'_> {
        Stretch { keys: &self.keys, prim_bits: self.prim_bits }
    }
}

/// A part of the curve.
#[derive(Clone, Copy, Debug)]
pub struct Stretch<'a> {
    keys: &'a [u64],
    prim_bits: u32,
}

impl<'a> Stretch<'a> {
    /// How many lie before the border of the largest cells that the stretch reaches over; `None` if all lie in the
    /// same of the smallest cells.
    #[inline(always)]
    pub fn border(&self) -> Option<usize> {
        let (first, last) = (self.keys[0] >> self.prim_bits, self.keys[self.keys.len() - 1] >> self.prim_bits);
        let bit = (first ^ last).checked_ilog2()? + self.prim_bits;
        Some(self.keys.partition_point(|key| key >> bit & 1 == 0))
    }

    /// A part of it.
    #[inline(always)]
    pub fn part(&self, rows: std::ops::Range<usize>) -> Stretch<'a> {
        Stretch { keys: &self.keys[rows], ..*self }
    }
}

/// Maps points to Morton codes.
struct Quantizer {
    origin: Vec3,
    scale: Vec3,
    last: u32,
}

impl Quantizer {
    /// The same grid on all axes: cells are cubes, or else flat scenes would be cut across all the time.
    fn new(bounds: &Aabb, axis_bits: u32) -> Quantizer {
        let last = (1u32 << axis_bits) - 1;
        let size = (bounds.max.as_dvec3() - bounds.min.as_dvec3()).max_element();
        let scale = if size > 0.0 { f64::from(last) / size } else { 0.0 };
        // Tiny scenes: a scale that a float cannot hold would make everything land in the first cell, or the last.
        Quantizer { origin: bounds.min, scale: Vec3::splat(scale.min(f64::from(f32::MAX)) as f32), last }
    }

    #[inline(always)]
    fn code(&self, point: Vec3) -> u64 {
        // Casts saturate: whatever the rounding, cells stay within the grid.
        let cell = |value: f32| u64::from((value as u32).min(self.last));
        let at = (point - self.origin) * self.scale;
        spread(cell(at.x)) | spread(cell(at.y)) << 1 | spread(cell(at.z)) << 2
    }
}

/// Puts two zeros between the lowest 21 bits.
#[inline(always)]
fn spread(bits: u64) -> u64 {
    let mut x = bits & 0x1f_ffff;
    x = (x | x << 32) & 0x001f_0000_0000_ffff;
    x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_spread() {
        for bit in 0..21 {
            assert_eq!(spread(1 << bit), 1 << (3 * bit));
        }
        assert_eq!(spread(0x1f_ffff), 0x1249_2492_4924_9249);
    }

    #[test]
    fn stretches_end_where_cells_do() {
        let curve =
            Curve { keys: [0b000, 0b001, 0b010, 0b100, 0b111, 0b111].map(|code| code << 3).to_vec(), prim_bits: 3 };
        let whole = curve.whole();
        assert_eq!(whole.border(), Some(3));
        assert_eq!(whole.part(0..3).border(), Some(2));
        assert_eq!(whole.part(3..6).border(), Some(1));
        assert_eq!(whole.part(4..6).border(), None);
    }

    #[test]
    fn codes_stay_on_the_grid() {
        for size in [0.0, 1e-40, 1e-30, 1.0, 1e30] {
            let bounds = Aabb { min: Vec3::splat(-size), max: Vec3::new(size, 0.0, size) };
            let quantizer = Quantizer::new(&bounds, 14);
            for point in [bounds.min, bounds.max, Vec3::ZERO] {
                assert!(quantizer.code(point) < 1 << 42);
            }
            assert_eq!(quantizer.code(bounds.min), 0);
        }
    }
}
