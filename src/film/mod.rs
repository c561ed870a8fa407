//! Pixels: moments, convergence, output.

pub mod atomic_file;
pub mod convergence;
pub mod develop;
pub mod doubling;
pub mod exr_output;
mod font;
pub mod heatmap;
pub mod interval;
pub mod layers;
pub mod output;
pub mod picture;
pub mod png_output;
pub mod read;
mod retire;
pub mod sequences;
pub mod tile;
pub mod wireframe;
