//! How much memory a build takes, before it is taken.

use crate::options::Quality;

/// Bytes that building a tree of so many primitives takes at its peak, beside the scene; the tree itself is part of it.
///
/// Measured on surfaces and on loose triangles (`tests/build_memory.rs`), with a margin of a tenth or more.
pub fn peak_bytes(prims: usize, quality: Quality) -> u64 {
    /// Stacks, bins and queues of all threads.
    const BASE: u64 = 4 << 20;
    let each = match quality {
        Quality::Fast => 170,
        Quality::Default => 150,
        Quality::Best => 180,
    };
    BASE + prims as u64 * each
}
