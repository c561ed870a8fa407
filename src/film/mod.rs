//! Pixels: moments, convergence, output.

pub mod atomic_file;
pub mod convergence;
pub mod exr_output;
pub mod output;
pub mod picture;
pub mod png_output;
