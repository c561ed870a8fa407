//! Pixels: moments, convergence, output.

pub mod picture;
pub mod wireframe;
