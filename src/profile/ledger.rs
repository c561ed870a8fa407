//! Sums by stage and bounce.

use super::counters::Reading;
use crate::bvh::TraversalCounts;
use crate::measure::lanes::Lanes;
use crate::observer::{Part, Slice};
use crate::stages;

/// What the batches of one stage did at one depth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Entry {
    /// Batches.
    pub calls: u64,
    /// Rows consumed.
    pub rows: u64,
    /// Rows produced.
    pub produced: u64,
    /// Of generate and shade, loops over rows.
    pub lanes: Lanes,
    /// Thread time in nanoseconds.
    pub nanos: u64,
    /// Of traversal, what was counted.
    pub counts: TraversalCounts,
    /// What the processor counted, if it does.
    pub counters: Option<Reading>,
}

impl Entry {
    /// Adds what another entry has.
    pub fn add(&mut self, other: &Entry) {
        self.calls += other.calls;
        self.rows += other.rows;
        self.produced += other.produced;
        self.lanes += other.lanes;
        self.nanos += other.nanos;
        self.counts += other.counts;
        match (&mut self.counters, other.counters) {
            (Some(sum), Some(more)) => *sum += more,
            (sum, more) => *sum = sum.or(more),
        }
    }
}

/// What a render did, part by part.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Ledger {
    /// By stage, as in [`stages::ALL`], and bounce.
    pub stages: [Vec<Entry>; stages::ALL.len()],
    /// Groups of tiles: all that workers did, stages among it.
    pub groups: Entry,
    /// Passes over the frame, in which all workers took part.
    pub passes: Entry,
    /// Starting threads, laying out the film.
    pub start: Entry,
    /// Making a picture of the film.
    pub develop: Entry,
}

impl Ledger {
    /// Notes a part that has ended, and what the processor counted meanwhile.
    pub fn note(&mut self, slice: &Slice, counters: Option<Reading>) {
        let entry = match slice.part {
            Part::Start => &mut self.start,
            Part::Pass => &mut self.passes,
            Part::Group => &mut self.groups,
            Part::Develop => &mut self.develop,
            Part::Stage { stage, depth } => {
                let depths = &mut self.stages[stage];
                if depths.len() <= depth as usize {
                    depths.resize(depth as usize + 1, Entry::default());
                }
                &mut depths[depth as usize]
            }
        };
        let work = &slice.work;
        entry.add(&Entry {
            calls: 1,
            rows: work.rows as u64,
            produced: work.produced as u64,
            lanes: work.lanes,
            nanos: (slice.end - slice.start).as_nanos() as u64,
            counts: work.counts,
            counters,
        });
    }

    /// What all workers noted.
    pub fn sum(workers: &[Ledger]) -> Ledger {
        let mut sum = Ledger::default();
        workers.iter().for_each(|ledger| sum.merge(ledger));
        sum
    }

    /// Adds what another worker noted.
    pub fn merge(&mut self, other: &Ledger) {
        for (depths, others) in self.stages.iter_mut().zip(&other.stages) {
            if depths.len() < others.len() {
                depths.resize(others.len(), Entry::default());
            }
            depths.iter_mut().zip(others).for_each(|(entry, other)| entry.add(other));
        }
        self.groups.add(&other.groups);
        self.passes.add(&other.passes);
        self.start.add(&other.start);
        self.develop.add(&other.develop);
    }

    /// One stage at all depths.
    pub fn stage(&self, stage: usize) -> Entry {
        self.stages[stage].iter().fold(Entry::default(), |mut sum, entry| {
            sum.add(entry);
            sum
        })
    }

    /// Thread time within stages, in nanoseconds.
    pub fn stage_nanos(&self) -> u64 {
        self.stages.iter().flatten().map(|entry| entry.nanos).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observer::Work;
    use std::time::{Duration, Instant};

    fn slice(part: Part, nanos: u64, rows: usize) -> Slice {
        let start = Instant::now();
        let work = Work { rows, produced: rows / 2, ..Work::default() };
        Slice { part, start, end: start + Duration::from_nanos(nanos), work }
    }

    #[test]
    fn workers_add_up_whatever_depths_they_reached() {
        let (mut a, mut b) = (Ledger::default(), Ledger::default());
        a.note(&slice(Part::Stage { stage: 1, depth: 0 }, 100, 10), None);
        b.note(&slice(Part::Stage { stage: 1, depth: 3 }, 50, 4), None);
        b.note(&slice(Part::Stage { stage: 1, depth: 0 }, 1, 2), None);
        b.note(&slice(Part::Group, 70, 0), None);
        let mut sum = a.clone();
        sum.merge(&b);
        b.merge(&a);
        assert_eq!(sum, b);
        assert_eq!(sum.stages[1].iter().map(|entry| entry.nanos).collect::<Vec<_>>(), [101, 0, 0, 50]);
        assert_eq!((sum.stage(1).rows, sum.stage(1).produced, sum.stage(1).calls), (16, 8, 3));
        assert_eq!((sum.stage_nanos(), sum.groups.nanos), (151, 70));
    }
}
