//! What a render tells while it runs, and to whom.

use crate::bvh::{Query, RayColumns, TraversalCounts};
use crate::measure::lanes::Lanes;
use std::time::Instant;

/// Who watches a render, and may stop it. Called from worker threads.
pub trait Observer: Sync {
    /// `done` of at most `total` samples are in the film (adaptive renders may end with fewer). Called between waves.
    fn samples(&self, _done: u64, _total: u64) {}

    /// `true`: finish the waves under way and return what there is. Asked between waves.
    fn stop(&self) -> bool {
        false
    }

    /// Rays are about to be traced.
    fn queue(&self, _queue: &Queue<'_>) {}

    /// `part` begins on this thread. Its clock runs already: time spent here is its own.
    fn began(&self, _part: Part) {}

    /// A part has ended on this thread. Its clock has stopped: time spent here is of what is around it.
    fn ended(&self, _slice: &Slice) {}

    /// Whether traversal shall count what it visits, which slows it.
    fn counts(&self) -> bool {
        false
    }
}

/// Watches nothing, never stops.
pub struct Unobserved;

impl Observer for Unobserved {}

/// Rays on their way to traversal, and whose they are.
#[derive(Clone, Copy)]
pub struct Queue<'a> {
    /// What is asked.
    pub query: Query,
    /// Whether they ask for direct light, and not where a path goes.
    pub shadow: bool,
    /// The vertex they leave (0: the camera, or for shadow rays the first surface).
    pub depth: u32,
    /// The rays.
    pub rays: RayColumns<'a>,
    /// Row of the sample table to which each ray belongs.
    pub slots: &'a [u32],
    /// Pixel of each row of the sample table: y · width + x in the frame.
    pub pixels: &'a [u32],
}

/// What a worker does. Parts nest in the order of this list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Part {
    /// Starting threads and laying out the film; on the calling thread.
    Start,
    /// One pass over the frame; on one of the workers, while all work.
    Pass,
    /// Some neighbouring tiles, wave after wave.
    Group,
    /// One batch of a stage, by its place in [`crate::stages::ALL`].
    Stage {
        /// Which.
        stage: usize,
        /// Bounces before.
        depth: u32,
    },
    /// Ending threads and making a picture of the film; on the calling thread.
    Develop,
}

/// A part that is over.
#[derive(Clone, Copy, Debug)]
pub struct Slice {
    /// Which.
    pub part: Part,
    /// When it began.
    pub start: Instant,
    /// When it ended.
    pub end: Instant,
    /// Of stages: what it did.
    pub work: Work,
}

impl Slice {
    /// A part other than a stage, which ends now.
    pub fn plain(part: Part, start: Instant) -> Slice {
        Slice { part, start, end: Instant::now(), work: Work::default() }
    }
}

/// What a batch of a stage did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Rows consumed.
    pub rows: usize,
    /// Rows produced: paths, hits, next paths. Shadow and retire add to rows that are there already.
    pub produced: usize,
    /// Of generate and shade, the rows of whole blocks that loops of vectors go through.
    pub lanes: Lanes,
    /// Of traversal, as far as it was asked to count.
    pub counts: TraversalCounts,
}
