//! What a tree looks like, in numbers.

use serde::Serialize;

use crate::options::Quality;

/// Figures of a built acceleration structure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct BvhStats {
    /// How good it was to be; `None` for the oracle.
    pub quality: Option<Quality>,
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
    /// What it was spent on.
    pub phase_seconds: PhaseSeconds,
}

/// Wall times of the phases of a build, in seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PhaseSeconds {
    /// Boxes of all primitives.
    pub fragments: f64,
    /// The binary tree.
    pub binary: f64,
    /// Moving its subtrees to better places.
    pub reinsertion: f64,
    /// Planning the four-wide tree.
    pub collapse: f64,
    /// Writing its nodes and leaf blocks.
    pub emit: f64,
}
