//! The full leaf block of triangles.

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};

use super::block::TriangleBlock;
use super::ray::MISS;
use crate::simd::wide::{Wide, Words};

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

impl TriangleBlock for Tri4 {
    #[inline(always)]
    fn prims(&self) -> &[u32; 4] {
        &self.prim
    }

    #[inline(always)]
    fn geom(&self, lane: usize) -> u32 {
        self.geom[lane]
    }

    #[inline(always)]
    fn coordinate(&self, row: usize, corner: usize, lane: usize) -> f32 {
        // The masks spare bounds checks.
        f32::from_bits(self.rows()[(row & 7) + corner][lane & 3])
    }

    #[inline(always)]
    fn corners<'a, W: Wide>(
        wide: W,
        block: impl Fn(usize) -> &'a Self + Copy,
        row: impl Fn(usize, u32) -> usize + Copy,
    ) -> [[W::Lanes; 3]; 3] {
        [corner::<W, 0>(wide, block, row), corner::<W, 1>(wide, block, row), corner::<W, 2>(wide, block, row)]
    }

    #[inline(always)]
    fn corners_for_all<W: Wide>(&self, wide: W, [x, y, z]: [usize; 3]) -> [[W::Lanes; 3]; 3] {
        let rows = self.rows();
        [
            [wide.repeat(&rows[x]), wide.repeat(&rows[y]), wide.repeat(&rows[z])],
            [wide.repeat(&rows[x + 1]), wide.repeat(&rows[y + 1]), wide.repeat(&rows[z + 1])],
            [wide.repeat(&rows[x + 2]), wide.repeat(&rows[y + 2]), wide.repeat(&rows[z + 2])],
        ]
    }
}

/// One corner of four triangles a ray. (No closure: those with vectors in them must be inlined.)
#[inline(always)]
fn corner<'a, W: Wide, const CORNER: usize>(
    wide: W,
    block: impl Fn(usize) -> &'a Tri4,
    row: impl Fn(usize, u32) -> usize,
) -> [W::Lanes; 3] {
    [
        wide.gather(|ray| &block(ray).rows()[row(ray, 0) + CORNER]),
        wide.gather(|ray| &block(ray).rows()[row(ray, 1) + CORNER]),
        wide.gather(|ray| &block(ray).rows()[row(ray, 2) + CORNER]),
    ]
}
