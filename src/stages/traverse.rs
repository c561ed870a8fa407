//! # traverse: closest hits
//!
//! | | |
//! |---|---|
//! | reads | `path.o*`, `path.d*` |
//! | writes | `hit.*` |
//! | consumes | one row a live path |
//! | produces | one row a live path |
//! | cost | 24 bytes read, 20 written a row; nodes and leaves besides |

use super::{Context, Stage};
use crate::bvh::{Accel, Query, TraversalCounts};
use crate::wave::features::Features;
use crate::wave::hits::Hits;
use crate::wave::paths::Paths;
use crate::wave::samples::Samples;
use bumpalo::Bump;

/// Its facts.
pub const STAGE: Stage = Stage {
    name: "traverse",
    reads: &[
        ("path.o*", Features::ALWAYS),
        ("path.d*", Features::ALWAYS),
        ("path.l*", Features::DOUBLE),
        ("path.slot", Features::COST),
    ],
    writes: &[
        ("hit.*", Features::HITS),
        ("sample.r", Features::COST),
        ("sample.g", Features::COST),
        ("sample.b", Features::COST),
    ],
    requires: Features::ALWAYS,
};

/// Traces the first `n` paths, all at vertex `depth`. Rows keep the order of their pixels, so camera rays are coherent.
pub fn run(context: &Context, depth: u32, n: usize, paths: &Paths, hits: &mut Hits) -> TraversalCounts {
    let way = context.accel.suited(Query::Closest, depth == 0);
    let trace = if context.counts { Accel::closest_hits_counted } else { Accel::closest_hits };
    trace(context.accel, way, context.tier, paths.rays(n), hits.columns_mut(n))
}

/// Counts the nodes that the first `n` camera rays visit, and makes the counts their samples' radiance.
pub fn count(context: &Context, n: usize, paths: &Paths, samples: &mut Samples, scratch: &Bump) {
    let visits = scratch.alloc_slice_fill_copy(n, 0u32);
    context.accel.cost_columns(paths.rays(n), visits);
    for (row, &visits) in visits.iter().enumerate() {
        let slot = paths.slot[row] as usize;
        (samples.r[slot], samples.g[slot], samples.b[slot]) = (visits as f32, visits as f32, visits as f32);
    }
}
