//! The leaf block of triangles.

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};

use super::ray::MISS;
use crate::simd::wide::Words;

/// Four triangles, as structure of arrays: three cache lines.
///
/// Corners rather than edges: the watertight test needs both triangles at a shared edge to compute with the very
/// same numbers.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct Tri4 {
    /// First the axis, then the corner, then the triangle. Unused lanes are NaN, which no test lets through.
    pub corners: [[Vec4; 3]; 3],
    /// Primitives; [`MISS`] in unused lanes.
    pub prim: [u32; 4],
    /// Geometries; [`MISS`] in unused lanes.
    pub geom: [u32; 4],
    /// Fills the last cache line.
    unused: [u32; 4],
}

const _: () = assert!(size_of::<Tri4>() == 192);

impl Tri4 {
    /// No triangle.
    pub const EMPTY: Tri4 = Tri4 { corners: [[Vec4::NAN; 3]; 3], prim: [MISS; 4], geom: [MISS; 4], unused: [0; 4] };

    /// Rows of four lanes: three of corners for each axis, then primitives and geometries.
    #[inline(always)]
    pub fn rows(&self) -> &[Words; 12] {
        bytemuck::cast_ref(self)
    }

    /// Fills one lane.
    #[inline]
    pub fn set(&mut self, lane: usize, corners: [Vec3; 3], prim: u32, geom: u32) {
        for (axis, row) in self.corners.iter_mut().enumerate() {
            for (slot, corner) in row.iter_mut().zip(&corners) {
                slot[lane] = corner[axis];
            }
        }
        self.prim[lane] = prim;
        self.geom[lane] = geom;
    }
}
