//! Numbers, warps and densities: pure functions.

pub mod angle;
pub mod order;
pub mod random;
pub mod sampler;
pub mod sobol;
pub mod v3;
pub mod warp;
