//! The machine's ceilings, measured on the spot: what no stage can exceed.
//!
//! | Figure | Kernel | Unit |
//! |---|---|---|
//! | [`Memory::read`], [`Memory::read_all`] | every line loaded in order, into the widest vectors | bytes/s |
//! | [`Memory::copy`] | one half copied over the other, by the system's `memcpy` | bytes/s, read and written |
//! | [`Memory::latency`] | a walk in random order, each line naming the next | ns a line |
//! | [`Memory::gather`] | lines in random order whose numbers are computed: as many in flight as the processor holds | ns a line |
//! | [`Compute::vector`] | independent chains of a multiplication and an addition, not fused: comber's kernels fuse neither | operations/s |
//! | [`Compute::integer`] | independent chains of four additions and exclusive ors to a multiplication: near what the processor executes at most | operations/s |
//!
//! Each is taken several times. The best is the ceiling; the median beside it tells how calm the machine was. The roofline that they
//! draw is that of Williams, Waterman and Patterson, "Roofline", CACM 52(4), 2009, with latency as a third bound.

mod compute;
mod rounds;
mod sizes;
mod store;
mod stream;
mod walk;

use serde::{Deserialize, Serialize};

use crate::bench::statistics::Quartiles;
use crate::measure::processor;
use crate::options::Simd;
use crate::simd::Tier;
use crate::system::Pages;
pub use sizes::CacheSizes;

/// Goes up when a figure changes its meaning.
const FORMAT: u32 = 1;

/// Where data lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum Level {
    /// The first-level data cache.
    L1,
    /// The second-level cache.
    L2,
    /// The third-level cache.
    L3,
    /// Memory.
    Dram,
}

impl Level {
    /// For reports.
    pub fn name(self) -> &'static str {
        match self {
            Level::L1 => "L1",
            Level::L2 => "L2",
            Level::L3 => "L3",
            Level::Dram => "DRAM",
        }
    }
}

/// A figure taken several times.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// The best: the largest rate, or the smallest time.
    pub best: f64,
    /// The one in the middle. Far from the best, the machine had other things to do.
    pub median: f64,
}

impl Figure {
    /// Of times, or whatever is better the smaller it is.
    fn smallest(samples: &[f64]) -> Figure {
        let best = samples.iter().copied().fold(f64::INFINITY, f64::min);
        Figure { best, median: Quartiles::of(samples.iter().copied()).median }
    }

    /// Of rates, which are better the larger they are.
    fn largest(samples: &[f64]) -> Figure {
        let best = samples.iter().copied().fold(0.0, f64::max);
        Figure { best, ..Figure::smallest(samples) }
    }

    /// Whether both numbers can be what they should.
    fn is_sound(&self) -> bool {
        [self.best, self.median].iter().all(|number| number.is_finite() && *number > 0.0)
    }
}

/// What the figures are of: they hold as long as none of this changes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Key {
    /// What the processor calls itself.
    pub processor: String,
    /// Its caches.
    pub caches: CacheSizes,
    /// Threads of [`Memory::read_all`].
    pub threads: usize,
    /// Instructions that vectors are computed and loaded with.
    pub tier: String,
    /// comber's version.
    pub version: String,
    /// Of the figures.
    format: u32,
}

impl Key {
    /// Of this machine and this comber.
    fn here(threads: usize) -> Key {
        Key {
            processor: processor::name(),
            caches: CacheSizes::detect(),
            threads,
            tier: widest().name().into(),
            version: env!("CARGO_PKG_VERSION").into(),
            format: FORMAT,
        }
    }
}

/// What a level gives, with pages of one size.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// The level.
    pub level: Level,
    /// The pages asked for.
    pub pages: Pages,
    /// How much of the memory was on huge pages, from 0 to 1; `None` if the system does not tell.
    pub huge: Option<f64>,
    /// Size of the working set that the figures are of, in bytes.
    pub bytes: u64,
    /// Reading in order on one thread, in bytes/s.
    pub read: Figure,
    /// The same on all threads together; where they share the level.
    pub read_all: Option<Figure>,
    /// Copying on one thread, in bytes/s: read and written bytes together.
    pub copy: Figure,
    /// Time from asking for a line to having it, in ns.
    pub latency: Figure,
    /// Time a line where lines do not wait for each other, in ns.
    pub gather: Figure,
}

/// What one thread computes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Compute {
    /// 32-bit lanes of a vector.
    pub lanes: usize,
    /// Single-precision multiplications and additions a second, each lane's counted, half of either.
    pub vector: Figure,
    /// 64-bit integer operations a second.
    pub integer: Figure,
}

/// All of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ceilings {
    /// What they are of.
    pub key: Key,
    /// Each level with each size of pages.
    pub memory: Vec<Memory>,
    /// The processor.
    pub compute: Compute,
}

impl Ceilings {
    /// Measures them, for a render on `threads` threads. Takes a second or two, and up to 512 MiB of memory for that long.
    pub fn measure(threads: usize) -> Ceilings {
        let threads = threads.max(1);
        let key = Key::here(threads);
        let sets = key.caches.working_sets(crate::measure::memory::available());
        let (memory, compute) = rounds::measure(&sets, threads, widest());
        Ceilings { key, memory, compute }
    }

    /// The figures of a level; `None` if the machine has no such level, or had no memory for it.
    pub fn at(&self, level: Level, pages: Pages) -> Option<&Memory> {
        self.memory.iter().find(|memory| (memory.level, memory.pages) == (level, pages))
    }

    /// Whether all numbers can be what they should.
    fn is_sound(&self) -> bool {
        let figures = |memory: &Memory| [memory.read, memory.copy, memory.latency, memory.gather];
        self.memory.iter().all(|m| figures(m).iter().chain(&m.read_all).all(Figure::is_sound))
            && self.compute.vector.is_sound()
            && self.compute.integer.is_sound()
    }
}

/// The widest vectors there are: every processor has some.
fn widest() -> Tier {
    Tier::detect(Simd::Auto).unwrap_or(Tier::Baseline)
}

#[cfg(test)]
pub(in crate::profile::ceilings) mod tests {
    use super::*;

    /// Ceilings that no machine has.
    pub fn made_up(key: Key) -> Ceilings {
        let figure = Figure { best: 2.0, median: 1.5 };
        let memory = Memory {
            level: Level::L3,
            pages: Pages::Huge,
            huge: None,
            bytes: 1 << 20,
            read: figure,
            read_all: Some(figure),
            copy: figure,
            latency: figure,
            gather: figure,
        };
        Ceilings { key, memory: vec![memory], compute: Compute { lanes: 4, vector: figure, integer: figure } }
    }

    #[test]
    fn every_level_has_figures_that_can_be() {
        let sets = [(Level::L1, 16 << 10), (Level::L3, 1 << 20), (Level::Dram, 8 << 20)];
        let (memory, compute) = rounds::measure(&sets, 3, widest());
        let ceilings = Ceilings { key: Key::here(3), memory, compute };
        assert!(ceilings.is_sound(), "{ceilings:?}");
        assert_eq!(ceilings.memory.len(), 2 * sets.len());
        for pages in Pages::ALL {
            for (level, bytes) in sets {
                let memory = ceilings.at(level, pages).unwrap();
                assert_eq!((memory.bytes, memory.read_all.is_some()), (bytes, level >= Level::L3));
            }
            assert!(ceilings.at(Level::L2, pages).is_none());
        }
        assert!(rounds::measure(&[], 1, widest()).0.is_empty(), "no memory to be had");
    }

    #[test]
    fn the_best_is_the_largest_rate_or_the_smallest_time() {
        let samples = [3.0, 1.0, 7.0, 4.0, 5.0];
        assert_eq!(Figure::largest(&samples), Figure { best: 7.0, median: 4.0 });
        assert_eq!(Figure::smallest(&samples), Figure { best: 1.0, median: 4.0 });
    }

    #[test]
    fn numbers_that_cannot_be_are_told() {
        for number in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let mut ceilings = made_up(Key::here(1));
            assert!(ceilings.is_sound());
            ceilings.memory[0].read_all = Some(Figure { best: 1.0, median: number });
            assert!(!ceilings.is_sound(), "{number}");
        }
    }
}
