//! Numbers, warps and densities: pure functions.

pub mod angle;
pub mod lanes;
pub mod random;
pub mod warp;
