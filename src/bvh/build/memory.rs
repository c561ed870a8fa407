//! How much memory a build takes, before it is taken.

use crate::bvh::shared_tri4::SharedTri4;
use crate::error::{Error, Result};
use crate::measure::units;
use crate::options::Quality;

/// Bytes that building a tree of so many primitives takes at its peak, beside the scene; the tree itself is part of it. `limited`: of leaves
/// that are compact for the sake of memory (`check_compact_blocks`).
///
/// Measured on a million triangles of surfaces and of loose triangles (`tests/build_memory.rs`) and on 28.9 million of a surface
/// (`comber info --json --cache off`: 86 bytes each), with a margin of a tenth or more.
pub fn peak_bytes(prims: usize, quality: Quality, limited: bool) -> u64 {
    /// Stacks, bins and queues of all threads.
    const BASE: u64 = 4 << 20;
    /// What the allocator keeps of blocks that it was given back: less of those so large that they were pages of their own.
    const KEPT: (u64, u64) = (70, 64 << 20);
    let each = match quality {
        Quality::Fast => 120,
        Quality::Default if limited => 82,
        Quality::Default => 100,
        Quality::Best => 125,
    };
    let prims = prims as u64;
    BASE + prims * each + (prims * KEPT.0).min(KEPT.1)
}

/// Bytes of compact blocks a triangle that predictions allow for: five triangles in two blocks. With nodes and the order of the leaves, that is what
/// the steps before take, in which no leaf is made yet.
const COMPACT_BLOCKS: u64 = 52;

/// An error if compact blocks take more than was predicted of leaves that are compact for the sake of memory. How many there are is
/// known once the tree is planned, before they are made.
pub fn check_compact_blocks(blocks: usize, triangles: usize) -> Result<()> {
    let needed = (blocks * size_of::<SharedTri4>()) as u64;
    let allowed = triangles as u64 * COMPACT_BLOCKS + 4096;
    if needed <= allowed {
        return Ok(());
    }
    Err(Error::Scene(format!(
        "compact leaves, which --memory-limit asks for, take {} instead of the {} predicted: the triangles share too few corners; \
         the tree needs a higher limit",
        units::bytes(needed),
        units::bytes(allowed)
    )))
}
