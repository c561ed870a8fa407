//! A fixed piece of work, timed around every sample: what else the machine does shows in its time.

use serde::{Deserialize, Serialize};
use std::hint::black_box;
use std::time::Instant;

/// Seconds that the two parts of the probe took.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// A chain of integer operations: slower if the core is shared or slowed down.
    pub compute: f64,
    /// A walk through memory that the second-level cache does not hold: slower if others use the memory.
    pub memory: f64,
}

impl Reading {
    /// The slower of two, part by part.
    pub fn max(self, other: Reading) -> Reading {
        Reading { compute: self.compute.max(other.compute), memory: self.memory.max(other.memory) }
    }

    /// The faster of two, part by part.
    pub fn min(self, other: Reading) -> Reading {
        Reading { compute: self.compute.min(other.compute), memory: self.memory.min(other.memory) }
    }

    /// A reading this much slower than the best one seen is disturbed: computing repeats to a few percent on a still machine,
    /// walks through memory to a tenth or two.
    pub fn is_disturbed(self, best: Reading) -> bool {
        self.compute > 1.15 * best.compute || self.memory > 1.5 * best.memory
    }
}

/// The probe, and the best it has seen.
pub struct Probe {
    /// Cache lines, each with the number of the next: one cycle through all of them.
    lines: Vec<[u32; 16]>,
    at: u32,
    best: Reading,
}

/// Cache lines of the walk: 16 MiB.
const LINES: u32 = 1 << 18;
/// Steps of a reading.
const STEPS: u32 = 8_000;
/// Steps of a reading's computation: two operations that each wait for the one before.
const OPERATIONS: u32 = 200_000;

impl Default for Probe {
    fn default() -> Self {
        Probe::new()
    }
}

impl Probe {
    /// Lays out the walk, and takes a first reading.
    pub fn new() -> Probe {
        // A full-period congruential generator modulo a power of two visits every line once, in no order that a
        // prefetcher could guess.
        let next = |line: u32| line.wrapping_mul(747_796_405).wrapping_add(2_891_336_453) % LINES;
        let lines = (0..LINES).map(|line| [next(line); 16]).collect();
        let mut probe = Probe { lines, at: 0, best: Reading { compute: f64::INFINITY, memory: f64::INFINITY } };
        probe.read(1);
        probe
    }

    /// Takes a reading, about a millisecond: computing on `threads` threads at once, the slowest of which counts, and then
    /// walking on one.
    pub fn read(&mut self, threads: usize) -> Reading {
        let seed = self.at;
        let work = move || {
            let start = Instant::now();
            let mut state = seed;
            for _ in 0..OPERATIONS {
                // A multiplication alone would be several at once for a compiler that knows algebra.
                state = (state ^ state >> 15).wrapping_mul(747_796_405);
            }
            black_box(state);
            start.elapsed().as_secs_f64()
        };
        let compute = std::thread::scope(|scope| {
            let others: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
            let own = work();
            others.into_iter().fold(own, |longest, other| longest.max(other.join().expect("a loop does not panic")))
        });
        let start = Instant::now();
        for _ in 0..STEPS {
            self.at = self.lines[self.at as usize][0];
        }
        black_box(self.at);
        let reading = Reading { compute, memory: start.elapsed().as_secs_f64() };
        self.best = self.best.min(reading);
        reading
    }

    /// The fastest of each part that was ever read.
    pub fn best(&self) -> Reading {
        self.best
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_walk_visits_every_line() {
        let probe = Probe::new();
        let mut seen = vec![false; LINES as usize];
        let mut at = 0u32;
        for _ in 0..LINES {
            assert!(!std::mem::replace(&mut seen[at as usize], true));
            at = probe.lines[at as usize][0];
        }
        assert_eq!(at, 0);
    }

    #[test]
    fn slow_readings_are_disturbed() {
        let best = Reading { compute: 1.0, memory: 1.0 };
        assert!(!Reading { compute: 1.1, memory: 1.4 }.is_disturbed(best));
        assert!(Reading { compute: 1.2, memory: 1.0 }.is_disturbed(best));
        assert!(Reading { compute: 1.0, memory: 1.6 }.is_disturbed(best));
    }
}
