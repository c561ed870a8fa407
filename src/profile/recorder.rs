//! Watches a render and notes what each worker does.

use super::counters::{Counters, Reading};
use super::ledger::Ledger;
use super::timeline::{Mark, Timeline};
use crate::observer::{Observer, Part, Queue, Slice};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Notes what a render does. For one render.
///
/// Every worker has notes of its own, so that the lock around them is never waited for; a note takes some tens of nanoseconds, and
/// there is one for a batch of thousands of rows.
pub struct Recorder<'a> {
    /// Told everything too: shows progress, counts, stops.
    next: &'a dyn Observer,
    /// By worker; the last is the calling thread.
    notes: Vec<Mutex<Notes>>,
    keep: Keep,
    origin: Instant,
}

/// What to note besides sums of times and rows.
#[derive(Clone, Copy, Debug, Default)]
pub struct Keep {
    /// Every part, for a timeline.
    pub marks: bool,
    /// What the processor counts.
    pub counters: bool,
    /// What rays visit, which slows traversal.
    pub visits: bool,
}

#[derive(Default)]
struct Notes {
    ledger: Ledger,
    marks: Vec<Mark>,
    counters: Option<Counters>,
    /// At the beginning of the stage that runs.
    before: Reading,
}

impl<'a> Recorder<'a> {
    /// For a render on `threads` threads.
    pub fn new(threads: usize, keep: Keep, next: &'a dyn Observer) -> Recorder<'a> {
        let notes = (0..=threads).map(|_| Mutex::default()).collect();
        Recorder { next, notes, keep, origin: Instant::now() }
    }

    /// What was noted: by worker, the last being the calling thread; and when.
    pub fn finish(self) -> (Vec<Ledger>, Timeline) {
        let notes = self.notes.into_iter().map(|notes| notes.into_inner().unwrap_or_else(PoisonError::into_inner));
        let (ledgers, tracks) = notes.map(|Notes { ledger, marks, .. }| (ledger, marks)).unzip();
        (ledgers, Timeline { tracks })
    }

    fn notes(&self) -> MutexGuard<'_, Notes> {
        let last = self.notes.len() - 1;
        let worker = rayon::current_thread_index().map_or(last, |worker| worker.min(last));
        self.notes[worker].lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Observer for Recorder<'_> {
    fn samples(&self, done: u64, total: u64) {
        self.next.samples(done, total);
    }

    fn stop(&self) -> bool {
        self.next.stop()
    }

    fn queue(&self, queue: &Queue<'_>) {
        self.next.queue(queue);
    }

    fn began(&self, part: Part) {
        if self.keep.counters {
            let mut notes = self.notes();
            // Each thread opens its own. That this one can was found out before the render.
            let counters = match &mut notes.counters {
                Some(counters) => Some(counters),
                none => Counters::open().ok().map(|counters| none.insert(counters)),
            };
            notes.before = counters.map(|counters| counters.read()).unwrap_or_default();
        }
        self.next.began(part);
    }

    fn ended(&self, slice: &Slice) {
        let mut notes = self.notes();
        let before = notes.before;
        // Groups and passes are not counted: they hold stages.
        let counters = notes.counters.as_mut().filter(|_| matches!(slice.part, Part::Stage { .. }));
        let counted = counters.map(|counters| counters.read() - before);
        notes.ledger.note(slice, counted);
        if self.keep.marks {
            notes.marks.push(Mark::new(slice, self.origin));
        }
        drop(notes);
        self.next.ended(slice);
    }

    fn counts(&self) -> bool {
        self.keep.visits || self.next.counts()
    }
}
