//! How far a build has come, for those who wait for it.

use crate::options::Quality;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

/// Is told how many of how many units of work are done; from any thread, and not always in order.
pub type Tell<'a> = &'a (dyn Fn(u64, u64) + Sync);

/// The steps of a build, in order.
#[derive(Clone, Copy)]
pub enum Step {
    Fragments,
    Binary,
    Reinsertion,
    Collapse,
    Emit,
}

/// Adds up what the steps report.
pub struct Course<'a> {
    tell: Tell<'a>,
    /// Primitives.
    all: u64,
    /// Units that a primitive takes in each step.
    units: [u64; 5],
    done: AtomicU64,
}

impl<'a> Course<'a> {
    /// Of `all` primitives. What a step takes is its share of the time on the dragon (`phase_seconds` of `comber info --json`), in
    /// per cent.
    pub fn new(tell: Tell<'a>, all: usize, quality: Quality) -> Course<'a> {
        let units = match quality {
            Quality::Fast => [15, 26, 14, 7, 38],
            Quality::Default => [5, 63, 6, 5, 21],
            Quality::Best => [3, 10, 74, 1, 12],
        };
        Course { tell, all: all as u64, units, done: AtomicU64::new(0) }
    }

    /// `step` is done for so many more primitives.
    pub fn add(&self, step: Step, primitives: usize) {
        let more = self.units[step as usize] * primitives as u64;
        let done = self.done.fetch_add(more, Ordering::Relaxed) + more;
        (self.tell)(done, self.all * self.units.iter().sum::<u64>());
    }

    /// As [`Course::add`], of a step that does not work by the primitive: these of so many equal parts are done.
    pub fn add_parts(&self, step: Step, these: Range<u64>, parts: u64) {
        let until = |part: u64| self.all * part / parts;
        self.add(step, (until(these.end) - until(these.start)) as usize);
    }

    /// All of `step` is done.
    pub fn add_all(&self, step: Step) {
        self.add_parts(step, 0..1, 1);
    }
}
