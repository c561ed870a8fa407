//! Pixels: moments, convergence, output.

pub mod picture;
