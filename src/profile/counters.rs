//! The processor's own counters, of one thread.
//!
//! ```no_run
//! use comber::profile::counters::Counters;
//!
//! let mut counters = Counters::open()?;
//! let before = counters.read();
//! let spent = counters.read() - before;
//! println!("{:?} instructions", spent.instructions());
//! # Ok::<(), String>(())
//! ```

#[cfg(target_os = "linux")]
mod linux;

use std::ops::{AddAssign, Sub};

use serde::{Deserialize, Serialize};

/// How many counters there are.
const COUNT: usize = 4;

/// Counters of the thread that opened them: cycles, instructions, mispredicted branches and misses of the last cache, in user
/// code alone. Each thread opens its own.
pub struct Counters {
    #[cfg(target_os = "linux")]
    group: linux::Group<COUNT>,
    #[cfg(not(target_os = "linux"))]
    never: std::convert::Infallible,
}

impl Counters {
    /// Opens them for the calling thread, and starts them.
    ///
    /// # Errors
    /// Why this machine or its system gives none, in a sentence. Counters of which it has only some are no error: those it lacks
    /// are `None` in each reading.
    #[cfg(target_os = "linux")]
    pub fn open() -> Result<Counters, String> {
        use perf_event::events::Hardware;
        let events = [Hardware::CPU_CYCLES, Hardware::INSTRUCTIONS, Hardware::BRANCH_MISSES, Hardware::CACHE_MISSES];
        Ok(Counters { group: linux::Group::open(events)? })
    }

    /// Opens them for the calling thread.
    ///
    /// # Errors
    /// Always: only Linux is known to give them.
    #[cfg(not(target_os = "linux"))]
    pub fn open() -> Result<Counters, String> {
        Err("hardware counters are read on Linux alone".into())
    }

    /// What they have counted so far. One call of the system: about 1.3 µs, on a machine where any call takes 0.4. Empty if that
    /// fails, which it does not for open counters.
    #[cfg(target_os = "linux")]
    pub fn read(&mut self) -> Reading {
        self.group.read()
    }

    /// Never called: there are none.
    #[cfg(not(target_os = "linux"))]
    pub fn read(&mut self) -> Reading {
        match self.never {}
    }
}

/// What counters have counted, up to a moment or, as the difference of two such, between them.
///
/// A processor with fewer counters than are wanted by all programs takes turns. The raw counts are kept, and with them for how long
/// the counters were wanted and for how long they ran: what the accessors give is scaled by that.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reading {
    /// Nanoseconds that the thread ran with its counters open.
    enabled: u64,
    /// Nanoseconds of these that they counted.
    running: u64,
    /// Cycles, instructions, mispredicted branches, misses of the last cache.
    counts: [Option<u64>; COUNT],
}

impl Reading {
    /// Cycles that the processor ran, at whatever frequency it had.
    pub fn cycles(&self) -> Option<u64> {
        self.scaled(0)
    }

    /// Instructions retired.
    pub fn instructions(&self) -> Option<u64> {
        self.scaled(1)
    }

    /// Branches that went another way than predicted.
    pub fn branch_misses(&self) -> Option<u64> {
        self.scaled(2)
    }

    /// Accesses that the last cache did not hold: as the processor defines it.
    pub fn cache_misses(&self) -> Option<u64> {
        self.scaled(3)
    }

    /// How much of the time the counters ran, from 0 to 1: below 1 all counts are estimates. `None` if no time has passed.
    pub fn coverage(&self) -> Option<f64> {
        (self.enabled > 0).then(|| self.running as f64 / self.enabled as f64)
    }

    /// One of the counts, as it would be had its counter run all the time; `None` if it never did.
    fn scaled(&self, which: usize) -> Option<u64> {
        let count = self.counts[which]?;
        match (self.enabled, self.running) {
            (enabled, running) if enabled == running => Some(count),
            (_, 0) => None,
            (enabled, running) => u64::try_from(u128::from(count) * u128::from(enabled) / u128::from(running)).ok(),
        }
    }

    /// Whether nothing was ever counted.
    fn is_empty(&self) -> bool {
        *self == Reading::default()
    }
}

impl Sub for Reading {
    type Output = Reading;

    /// What was counted since `earlier`.
    fn sub(self, earlier: Reading) -> Reading {
        let since = |now: Option<u64>, before: Option<u64>| Some(now?.saturating_sub(before?));
        Reading {
            enabled: self.enabled.saturating_sub(earlier.enabled),
            running: self.running.saturating_sub(earlier.running),
            counts: std::array::from_fn(|i| since(self.counts[i], earlier.counts[i])),
        }
    }
}

impl AddAssign for Reading {
    /// Of two intervals, or two threads, together; what one of them lacks the sum lacks. The default is the empty sum.
    fn add_assign(&mut self, other: Reading) {
        if self.is_empty() {
            *self = other;
        } else if !other.is_empty() {
            let both = |a: Option<u64>, b: Option<u64>| Some(a?.saturating_add(b?));
            self.enabled = self.enabled.saturating_add(other.enabled);
            self.running = self.running.saturating_add(other.running);
            self.counts = std::array::from_fn(|i| both(self.counts[i], other.counts[i]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(enabled: u64, running: u64, counts: [Option<u64>; COUNT]) -> Reading {
        Reading { enabled, running, counts }
    }

    #[test]
    fn differences_and_sums_are_taken_count_by_count() {
        let before = reading(10, 10, [Some(5), Some(7), None, Some(1)]);
        let after = reading(30, 30, [Some(105), Some(207), None, Some(1)]);
        let between = after - before;
        assert_eq!(between, reading(20, 20, [Some(100), Some(200), None, Some(0)]));
        assert_eq!(
            [between.cycles(), between.instructions(), between.branch_misses(), between.cache_misses()],
            [Some(100), Some(200), None, Some(0)]
        );
        let mut sum = Reading::default();
        sum += between;
        sum += Reading::default();
        assert_eq!(sum, between);
        sum += reading(5, 5, [Some(1), None, Some(1), Some(2)]);
        assert_eq!(sum, reading(25, 25, [Some(101), None, None, Some(2)]));
        assert_eq!((before - after).cycles(), Some(0), "readings the wrong way round");
    }

    #[test]
    fn counters_that_took_turns_are_scaled() {
        let third = reading(300, 100, [Some(50), Some(u64::MAX / 2), Some(0), None]);
        assert_eq!(third.cycles(), Some(150));
        assert_eq!(third.instructions(), None, "more than fits");
        assert_eq!(third.branch_misses(), Some(0));
        assert_eq!(third.coverage(), Some(1.0 / 3.0));
        let never = reading(300, 0, [Some(0); COUNT]);
        assert_eq!((never.cycles(), never.coverage()), (None, Some(0.0)));
        assert_eq!(Reading::default().coverage(), None);
    }

    #[test]
    fn readings_are_kept_as_text() {
        let kept = reading(3, 2, [Some(1), None, Some(u64::MAX), Some(0)]);
        assert_eq!(serde_json::from_str::<Reading>(&serde_json::to_string(&kept).unwrap()).unwrap(), kept);
    }

    #[test]
    fn there_are_counters_or_a_reason() {
        match Counters::open() {
            Ok(mut counters) => {
                let before = counters.read();
                std::hint::black_box((0..100_000u64).fold(0, |sum, i| std::hint::black_box(sum ^ i)));
                let spent = counters.read() - before;
                assert!(spent.instructions().is_none_or(|count| count > 100_000), "{spent:?}");
            }
            Err(why) => assert!(why.len() > 20 && !why.contains('\n'), "{why}"),
        }
    }
}
