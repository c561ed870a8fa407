//! What the kernels need of a leaf block of triangles, whatever its format.

use bytemuck::Pod;

use crate::simd::wide::Wide;

/// Up to four triangles.
///
/// Rows are those of [`super::intersect::Intersect::first_row`]: 0, 3 and 6 for the axes x, y and z. They stand for places in memory, so that no
/// kernel has to multiply.
pub trait TriangleBlock: Pod + Send + Sync {
    /// Primitives; [`super::ray::MISS`] in unused lanes, which no test lets through.
    fn prims(&self) -> &[u32; 4];

    /// The geometry of the triangle in a lane.
    fn geom(&self, lane: usize) -> u32;

    /// One coordinate of a corner of the triangle in a lane.
    fn coordinate(&self, row: usize, corner: usize, lane: usize) -> f32;

    /// The corners of a block for each ray, by corner, then by the ray's axis.
    fn corners<'a, W: Wide>(
        wide: W,
        block: impl Fn(usize) -> &'a Self + Copy,
        row: impl Fn(usize, u32) -> usize + Copy,
    ) -> [[W::Lanes; 3]; 3];

    /// The same of one block for all rays, which have their axes in common.
    fn corners_for_all<W: Wide>(&self, wide: W, rows: [usize; 3]) -> [[W::Lanes; 3]; 3];
}
