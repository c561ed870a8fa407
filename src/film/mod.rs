//! Pixels: moments, convergence, output.

pub mod atomic_file;
pub mod convergence;
pub mod picture;
