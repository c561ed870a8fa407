//! What a tree looks like, in numbers.

use serde::Serialize;

/// Figures of a built acceleration structure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct BvhStats {
    /// Triangles and spheres.
    pub primitives: usize,
    /// Inner nodes.
    pub nodes: usize,
    /// Leaf blocks of up to four primitives.
    pub leaf_blocks: usize,
    /// Levels of inner nodes.
    pub depth: u32,
    /// Expected nodes visited plus blocks tested, of a ray that meets the box of the scene.
    pub sah_cost: f64,
    /// Memory of nodes and blocks.
    pub bytes: usize,
    /// Memory a primitive.
    pub bytes_per_primitive: f64,
    /// Wall time of the build.
    pub build_seconds: f64,
}
