//! Numbers, warps and densities: pure functions.

pub mod lanes;
pub mod random;
pub mod warp;
