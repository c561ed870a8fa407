//! Meshes out: split into smaller triangles, and written as PLY.

pub mod ply;
pub mod split;
