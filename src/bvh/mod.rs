//! The acceleration structure: built as a binary tree, collapsed to four-wide nodes, traversed.

pub mod ray;

/// Placeholder until the structure lands.
pub enum Accel {}
