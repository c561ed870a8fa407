//! # comber: a wavefront path tracer for the CPU

pub mod bvh;
pub mod cli;
pub mod drive;
pub mod error;
pub mod film;
pub mod import;
pub mod light;
pub mod material;
pub mod measure;
pub mod options;
pub mod plan;
pub mod reference;
pub mod sampling;
pub mod scene;
pub mod simd;
pub mod stages;
pub mod transport;
pub mod wave;
