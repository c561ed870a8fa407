//! Fetching what the rows of coming blocks will gather: a row alone would wait for its triangle, and then for three corners.
//!
//! `comber profile` showed shade at 30 % of the built-in scene's time (1.2 million triangles): 88 to 130 ns a row behind the first
//! bounce, where a scene whose tables fit the second-level cache takes 41. Fetching ahead left 57 to 75, and took 8 to 13 % off
//! whole renders of this scene and the dragon (profiling/README.md).

use super::In;
use crate::scene::shapes::Shapes;
use crate::simd::{Address, prefetch_line};

/// Tables of fewer bytes are in the second-level cache anyway, and fetching them would be work for nothing.
const FAR_FROM: usize = 1 << 20;

/// What is fetched ahead, if anything.
pub struct Ahead<'a> {
    shapes: &'a Shapes,
    /// Normals of corners will be gathered too.
    smooth: bool,
    far: bool,
}

impl<'a> Ahead<'a> {
    /// For a scene with these tables.
    pub fn new(shapes: &'a Shapes, smooth: bool) -> Ahead<'a> {
        let bytes = size_of_val(&shapes.positions[..]) + size_of_val(&shapes.triangles[..]);
        Ahead { shapes, smooth, far: bytes >= FAR_FROM }
    }

    /// Asks for the triangles of `rows`, two blocks before they are gathered.
    #[inline(always)]
    pub fn triangles(&self, input: &In, rows: Option<&[u32]>) {
        for &row in rows.filter(|_| self.far).unwrap_or_default() {
            prefetch_line(Address::of(&self.shapes.triangles, input.hits.prim[row as usize] as usize));
        }
    }

    /// Asks for the corners of `rows`, one block before they are gathered: their triangles are here by now.
    #[inline(always)]
    pub fn corners(&self, input: &In, rows: Option<&[u32]>) {
        for &row in rows.filter(|_| self.far).unwrap_or_default() {
            // Spheres have none.
            let Some(triangle) = self.shapes.triangles.get(input.hits.prim[row as usize] as usize) else { continue };
            for vertex in triangle {
                prefetch_line(Address::of(&self.shapes.positions, *vertex as usize));
                if self.smooth {
                    prefetch_line(Address::of(&self.shapes.normals, *vertex as usize));
                }
            }
        }
    }
}
