//! The acceleration structure: built as a binary tree, collapsed to four-wide nodes, traversed in batches.
//!
//! [`Accel`] is the door. Behind it stand the tree ([`Bvh4`]) and the oracle ([`Brute`]), which agree to the last
//! bit: the tests of `watertight` and `sphere` decide what is hit and where, the tree only what is tested. A scene that is a mesh in a room is [`Parted`]. Beside them stands `double`, for
//! `--precision f64`.

mod aabb;
mod accel;
mod block;
mod brute;
mod build;
mod bvh4;
mod child;
mod closest;
mod columns;
pub(crate) mod double;
mod grid_node4;
mod grid_node8;
mod intersect;
mod moller_trumbore;
mod node;
mod node4;
mod parted;
mod parts;
pub mod ray;
mod rays4;
mod shared_tri4;
mod single_ray;
mod some_rays;
mod sphere;
mod sphere4;
mod stats;
pub(crate) mod stored;
mod traverse;
mod tri4;
mod watertight;

pub use aabb::Aabb;
pub use accel::Accel;
pub use brute::Brute;
pub use build::format::may_be_limited;
pub use build::{Tell, peak_bytes, tight_bounds};
pub use bvh4::Bvh4;
pub use columns::{HitColumnsMut, Query, RayColumns, TraversalCounts};
pub use double::peak_bytes as double_peak_bytes;
pub(crate) use grid_node4::Grid;
pub use parted::Parted;
pub use single_ray::SingleRay;
pub(crate) use sphere::{first as first_root, roots as sphere_roots};
pub use stats::{BvhStats, PhaseSeconds};
pub use traverse::Traversal;
