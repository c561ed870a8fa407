//! Surfaces and places in double precision: row by row, by the functions of the reference integrator.

use super::In;
use super::block::{Block, get, set};
use crate::sampling::v3::V3;
use crate::scene::origin::Origin;
use crate::stages::Context;
use crate::transport::surface_at;
use crate::wave::features::Features;

/// Fills origin and normals of the block, whose rows are `rows` of the input.
pub fn surfaces(context: &Context, block: &mut Block, rows: &[u32], input: &In) {
    for (i, &row) in rows.iter().enumerate() {
        let row = row as usize;
        let (origin, direction) = (input.paths.origin(row), get(&block.direction, i));
        let point = surface_at(context.scene, &input.hits.hit(row), origin, direction);
        set(&mut block.origin, i, point.origin.high);
        set(&mut block.low, i, point.origin.low.unwrap_or(V3::new(0.0, 0.0, 0.0)));
        set(&mut block.geometric, i, point.geometric);
        set(&mut block.normal, i, point.normal);
    }
}

impl Block {
    /// Where rays leave row `i`.
    #[inline(always)]
    pub fn leaves(&self, context: &Context, i: usize) -> Origin {
        let low = context.features.has(Features::DOUBLE).then(|| get(&self.low, i));
        Origin { high: get(&self.origin, i), low }
    }
}
