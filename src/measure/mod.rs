//! Counters and timers.

pub mod memory;
pub mod processor;
pub mod progress;
pub mod units;
