//! Numbers, warps and densities: pure functions.

pub mod angle;
pub mod lanes;
pub mod random;
pub mod sampler;
pub mod sobol;
pub mod warp;
