//! How much memory a build takes, before it is taken.

use crate::options::Quality;

/// Bytes that building a tree of so many primitives takes at its peak, beside the scene; the tree itself is part of it.
///
/// Measured on a million triangles of surfaces and of loose triangles (`tests/build_memory.rs`) and on 28.9 million of a surface
/// (`comber info --json --cache off`: 86 bytes each), with a margin of a tenth or more.
pub fn peak_bytes(prims: usize, quality: Quality) -> u64 {
    /// Stacks, bins and queues of all threads.
    const BASE: u64 = 4 << 20;
    /// What the allocator keeps of blocks that it was given back: less of those so large that they were pages of their own.
    const KEPT: (u64, u64) = (70, 64 << 20);
    let each = match quality {
        Quality::Fast => 120,
        Quality::Default => 100,
        Quality::Best => 125,
    };
    let prims = prims as u64;
    BASE + prims * each + (prims * KEPT.0).min(KEPT.1)
}
