//! # comber: a wavefront path tracer for the CPU

pub mod bvh;
pub mod cli;
pub mod drive;
pub mod error;
pub mod film;
pub mod import;
pub mod measure;
pub mod options;
pub mod plan;
pub mod scene;
