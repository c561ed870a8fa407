//! Profiling: which stage of a render is hot, why, and how far it is from what the machine can do.
//!
//! | To understand | read |
//! |---|---|
//! | what is noted while a render runs, and by whom | [`recorder`], [`ledger`] |
//! | which renders are made, and in which order | [`measure`] |
//! | how notes become the table of stages | [`stage_table`] |
//! | what bounds a stage | [`ceilings`], [`bound`]; [`counters`] where the processor has some |
//! | which batch ran when | [`timeline`] |
//! | what each pixel cost | [`pixel_cost`] |
//!
//! Times and counts come from different renders of the same samples: counting slows traversal, so the renders that are timed
//! do not count, and the one that counts is not timed.

pub mod bound;
pub mod ceilings;
pub mod counters;
pub mod ledger;
pub mod measure;
pub mod pixel_cost;
pub mod recorder;
pub mod stage_table;
pub mod timeline;
