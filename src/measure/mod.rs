//! Counters and timers.

pub mod lanes;
pub mod memory;
pub mod plot;
pub mod processor;
pub mod progress;
pub mod units;
