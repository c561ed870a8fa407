//! Where the time of a render goes, and how far that is from what the machine can do.

pub mod ceilings;
pub mod counters;
