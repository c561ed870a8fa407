//! Counters and timers.

pub mod memory;
pub mod progress;
pub mod units;
