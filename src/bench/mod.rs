//! Measuring: standard sets of rays, fair turns, and figures that say how far they can be believed.
//!
//! | To understand | read |
//! |---|---|
//! | which rays are traced | [`sets`], [`queues`]; [`ray_file`] for rays on disk |
//! | who traces them, and what is timed | [`contest`], [`kernels`], [`crate::peer`] |
//! | how samples are taken and judged | [`interleave`], [`probe`], [`statistics`] |
//! | when two tracers agree | [`agreement`] |
//! | how all of that makes a figure | [`set_report`], [`end_to_end`] |
//! | how figures are kept and compared | [`record`] |

pub mod agreement;
pub mod contest;
pub mod end_to_end;
pub mod interleave;
pub mod kernels;
pub mod probe;
pub mod queues;
pub mod ray_file;
pub mod rays;
pub mod record;
pub mod set_report;
pub mod sets;
pub mod statistics;
