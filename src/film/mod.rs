//! Pixels: moments, convergence, output.

pub mod convergence;
pub mod develop;
pub mod picture;
pub mod tile;
