//! Counters and timers.
