//! Measuring: standard sets of rays, fair turns, and figures that say how far they can be believed.

pub mod agreement;
pub mod interleave;
pub mod kernels;
pub mod peers;
pub mod probe;
pub mod rays;
pub mod sets;
pub mod statistics;
