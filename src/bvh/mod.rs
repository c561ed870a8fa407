//! The acceleration structure: built as a binary tree, collapsed to four-wide nodes, traversed in batches.
//!
//! [`Accel`] is the door. Behind it stand the tree ([`Bvh4`]) and the oracle ([`Brute`]), which agree to the last
//! bit: the tests of `triangle` and `sphere` decide what is hit and where, the tree only what is tested.

mod aabb;
mod accel;
mod brute;
mod build;
mod bvh4;
mod child;
mod closest;
mod columns;
mod node4;
pub mod ray;
mod sphere;
mod sphere4;
mod stats;
pub(crate) mod stored;
mod traverse;
mod tri4;
mod triangle;

pub use aabb::Aabb;
pub use accel::{Accel, SingleRay};
pub use brute::Brute;
pub use bvh4::Bvh4;
pub use columns::{HitColumnsMut, RayColumns, TraversalCounts};
pub use stats::BvhStats;
pub use traverse::Traversal;
