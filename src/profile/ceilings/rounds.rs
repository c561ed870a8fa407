//! The order of measuring: in rounds, so that what disturbs the machine for a while disturbs all figures alike.

use super::stream::{self, Place};
use super::{Compute, Figure, Level, Memory, compute, walk};
use crate::simd::Tier;
use crate::system::{Buffer, Pages, share_on_huge_pages};

/// How often each figure is taken.
const ROUNDS: usize = 7;

/// Measures working sets, which grow from level to level, with pages of either size, and the processor.
pub fn measure(sets: &[(Level, u64)], threads: usize, tier: Tier) -> (Vec<Memory>, Compute) {
    let (caches, memory): (Vec<_>, Vec<_>) = sets.iter().partition(|(level, _)| *level != Level::Dram);
    let subjects = |sets: &[(Level, u64)], pages| {
        sets.iter().map(|&(level, bytes)| Subject::new(level, pages, bytes, threads)).collect::<Vec<_>>()
    };
    let mut done = Vec::new();
    for pages in Pages::ALL {
        // Written once for all rounds, and copied over after them: this takes longer than measuring.
        for mut subject in subjects(&memory, pages) {
            let Some(mut buffer) = buffer(subject.bytes, pages) else { continue };
            walk::link(&mut buffer, threads);
            subject.huge = share_on_huge_pages(buffer.as_ptr().addr());
            (0..ROUNDS).for_each(|_| subject.read(&buffer, tier));
            (0..ROUNDS).for_each(|_| subject.copy(&mut buffer));
            done.push(subject);
        }
    }
    let most = caches.last().map_or(0, |&(_, bytes)| bytes);
    let mut cached: Vec<_> =
        Pages::ALL.into_iter().filter_map(|pages| Some((buffer(most, pages)?, subjects(&caches, pages)))).collect();
    let (mut vector, mut integer) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        for (buffer, subjects) in &mut cached {
            for subject in subjects {
                let set = &mut buffer[..words(subject.bytes)];
                walk::link(set, 1);
                subject.huge = share_on_huge_pages(set.as_ptr().addr());
                subject.warm(set, tier);
                subject.read(set, tier);
                subject.copy(set);
            }
        }
        vector.push(compute::vector(tier));
        integer.push(compute::integer());
    }
    done.extend(cached.into_iter().flat_map(|(_, subjects)| subjects));
    done.sort_by_key(|subject| (subject.pages == Pages::Huge, subject.level));
    let compute =
        Compute { lanes: compute::lanes(tier), vector: Figure::largest(&vector), integer: Figure::largest(&integer) };
    (done.into_iter().map(Subject::figures).collect(), compute)
}

/// Words of so many bytes.
fn words(bytes: u64) -> usize {
    (bytes / 4) as usize
}

/// Memory for a set; `None` if there is no set, or no memory.
fn buffer(bytes: u64, pages: Pages) -> Option<Buffer<u32>> {
    if bytes == 0 { None } else { Buffer::zeroed_on(words(bytes), pages) }
}

/// A level with pages of one size: what was measured of it, and where the next samples begin.
struct Subject {
    level: Level,
    pages: Pages,
    bytes: u64,
    huge: Option<f64>,
    reader: Place,
    /// One a thread.
    readers: Vec<Place>,
    copier: Place,
    walker: u32,
    gatherer: u32,
    read: Vec<f64>,
    read_all: Vec<f64>,
    copy: Vec<f64>,
    latency: Vec<f64>,
    gather: Vec<f64>,
}

impl Subject {
    fn new(level: Level, pages: Pages, bytes: u64, threads: usize) -> Subject {
        // Levels that no other processor uses are not measured on all of them. A share of less than 4 KiB is no share.
        let readers = if level >= Level::L3 { (threads as u64).min(bytes >> 12) } else { 0 };
        Subject {
            level,
            pages,
            bytes,
            huge: None,
            reader: Place::default(),
            readers: vec![Place::default(); readers as usize],
            copier: Place::default(),
            walker: 0,
            // Half of the walk away from where that begins: not the same lines.
            gatherer: (bytes / 128) as u32,
            read: Vec::new(),
            read_all: Vec::new(),
            copy: Vec::new(),
            latency: Vec::new(),
            gather: Vec::new(),
        }
    }

    /// Brings a set into its cache.
    fn warm(&mut self, set: &[u32], tier: Tier) {
        stream::read(set, &mut self.reader, tier);
    }

    /// A sample of each figure that only reads. Of a set in a cache, what one leaves there is what the next finds.
    fn read(&mut self, set: &[u32], tier: Tier) {
        self.read.push(stream::read(set, &mut self.reader, tier));
        self.latency.push(walk::latency(set, &mut self.walker));
        self.gather.push(walk::gather(set, &mut self.gatherer));
        if !self.readers.is_empty() {
            let together = if self.level == Level::L3 { stream::read_shared } else { stream::read_parts };
            self.read_all.push(together(set, &mut self.readers, tier));
        }
    }

    /// A sample of copying, which overwrites the links.
    fn copy(&mut self, set: &mut [u32]) {
        self.copy.push(stream::copy(set, &mut self.copier));
    }

    fn figures(self) -> Memory {
        Memory {
            level: self.level,
            pages: self.pages,
            huge: self.huge,
            bytes: self.bytes,
            read: Figure::largest(&self.read),
            read_all: (!self.readers.is_empty()).then(|| Figure::largest(&self.read_all)),
            copy: Figure::largest(&self.copy),
            latency: Figure::smallest(&self.latency),
            gather: Figure::smallest(&self.gather),
        }
    }
}
