//! How the primitives of a leaf come in blocks.

use crate::bvh::shared_tri4::{GEOMETRIES, SharedTri4};
use crate::scene::shapes::Shapes;

/// The rule.
#[derive(Clone, Copy, Debug)]
pub enum Packing<'a> {
    /// Four to a block.
    Fours,
    /// Of triangles, as many as a compact block has room for; four spheres.
    Shared(&'a Shapes),
}

impl Packing<'_> {
    /// How many of the first of these primitives, all of one kind, come in one block.
    #[inline]
    pub fn first_block(&self, prims: &[u32]) -> usize {
        match self {
            Packing::Shared(shapes) if (prims[0] as usize) < shapes.triangles.len() => {
                // So few geometries that it does not matter need not be searched.
                let matters = shapes.geometries.len() > GEOMETRIES as usize;
                let geometry = |prim| if matters { shapes.geometry_of(prim) } else { 0 };
                SharedTri4::fitting(prims.iter().map(|&prim| (shapes.corners(prim), geometry(prim))))
            }
            _ => prims.len().min(4),
        }
    }

    /// How many blocks these primitives, all of one kind, take.
    #[inline]
    pub fn blocks(&self, prims: &[u32]) -> u32 {
        match self {
            Packing::Fours => prims.len().div_ceil(4) as u32,
            Packing::Shared(_) => {
                let (mut rest, mut blocks) = (prims, 0);
                while !rest.is_empty() {
                    rest = &rest[self.first_block(rest)..];
                    blocks += 1;
                }
                blocks
            }
        }
    }
}
