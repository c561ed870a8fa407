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
use crate::bvh::columns::TraversalCounts;
use crate::wave::features::Features;
use crate::wave::hits::Hits;
use crate::wave::paths::Paths;

/// Its facts.
pub const STAGE: Stage = Stage {
    name: "traverse",
    reads: &[
        ("path.ox", Features::ALWAYS),
        ("path.oy", Features::ALWAYS),
        ("path.oz", Features::ALWAYS),
        ("path.dx", Features::ALWAYS),
        ("path.dy", Features::ALWAYS),
        ("path.dz", Features::ALWAYS),
    ],
    writes: &[("hit.*", Features::ALWAYS)],
    requires: Features::ALWAYS,
};

/// Traces the first `n` paths.
pub fn run(context: &Context, n: usize, paths: &Paths, hits: &mut Hits) -> TraversalCounts {
    context.accel.closest_hits(context.tier, paths.rays(n), hits.columns_mut(n))
}
