//! Turns: contestants are measured one after another, round by round, so that whatever else the machine does meets all
//! of them, and ratios come from neighbours in time.

use super::probe::{Probe, Reading};
use super::statistics::Quartiles;
use crate::measure::processor;
use serde::Serialize;
use std::time::{Duration, Instant};

/// How often to measure.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Rounds, unless time runs out.
    pub rounds: usize,
    /// No round begins after this long, but for the first three.
    pub time: Duration,
    /// A turn lasts at least this long, if what is measured is shorter.
    pub turn: Duration,
}

/// What a contestant did in a turn.
#[derive(Clone, Copy, Debug)]
pub struct Turn {
    /// Rays a second.
    pub rate: f64,
    /// Share of its time in which a thread was ready to run while something else had its processor.
    pub waited: f64,
}

/// One measurement.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Sample {
    /// What was measured, as a rate: larger is better.
    pub rate: f64,
    /// Processor time of all threads in seconds: hardly changed by what else the machine does.
    pub cpu: f64,
    /// Share of the time in which a thread waited for a processor that something else had.
    pub waited: f64,
    /// The slower of the readings right before and after.
    pub probe: Reading,
}

impl Sample {
    /// Something else used the machine, during the sample or right before or after.
    fn is_disturbed(&self, best: Reading) -> bool {
        self.waited > WAITED || self.probe.is_disturbed(best)
    }
}

/// A thread that waited for more of its time than this was disturbed.
const WAITED: f64 = 0.02;

/// Measurements in turns: `samples[contestant][round]`.
#[derive(Clone, Debug, Serialize)]
pub struct Turns {
    /// The samples.
    pub samples: Vec<Vec<Sample>>,
    /// The best reading seen up to the end.
    pub best: Reading,
}

/// Fewer undisturbed samples than this have no spread, and without that everything would be a change.
const FEWEST: usize = 2;

/// What a contestant's samples say.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Summary {
    /// Of the undisturbed samples; of all if hardly any was undisturbed.
    pub rate: Quartiles,
    /// Samples behind `rate`.
    pub samples: usize,
    /// How many samples were disturbed.
    pub disturbed: usize,
    /// The median of those.
    pub disturbed_rate: Option<f64>,
    /// So few samples were undisturbed that all count.
    pub all_disturbed: bool,
}

impl Summary {
    /// Of `values`, each with whether it was disturbed.
    pub fn of(values: impl Iterator<Item = (f64, bool)>) -> Summary {
        let (bad, good): (Vec<_>, Vec<_>) = values.partition(|(_, disturbed)| *disturbed);
        let of = |values: &[(f64, bool)]| Quartiles::of(values.iter().map(|(value, _)| *value));
        let all_disturbed = good.len() < FEWEST && !bad.is_empty();
        let everything = [&good[..], &bad].concat();
        let counted = if all_disturbed { &everything } else { &good };
        Summary {
            rate: of(counted),
            samples: counted.len(),
            disturbed: bad.len(),
            disturbed_rate: (!bad.is_empty()).then(|| of(&bad).median),
            all_disturbed,
        }
    }
}

/// Measures `contestants` contestants, which use `threads` threads: `measure(c)` gives number `c` its turn.
pub fn interleave(
    contestants: usize,
    threads: usize,
    effort: Effort,
    probe: &mut Probe,
    mut measure: impl FnMut(usize) -> Turn,
) -> Turns {
    let start = Instant::now();
    let mut samples = vec![Vec::new(); contestants];
    for round in 0..effort.rounds {
        if round >= 3 && start.elapsed() > effort.time {
            break;
        }
        for (contestant, samples) in samples.iter_mut().enumerate() {
            let (before, cpu) = (probe.read(threads), processor::seconds());
            let Turn { rate, waited } = measure(contestant);
            let cpu = processor::seconds() - cpu;
            samples.push(Sample { rate, cpu, waited, probe: before.max(probe.read(threads)) });
        }
    }
    Turns { samples, best: probe.best() }
}

impl Turns {
    /// What the samples of one contestant say.
    pub fn summary(&self, contestant: usize) -> Summary {
        Summary::of(self.samples[contestant].iter().map(|s| (s.rate, s.is_disturbed(self.best))))
    }

    /// Whether each sample of one contestant was disturbed.
    pub fn disturbed(&self, contestant: usize) -> Vec<bool> {
        self.samples[contestant].iter().map(|s| s.is_disturbed(self.best)).collect()
    }

    /// The rate of `a` over that of `b`, round by round. A round is disturbed if either sample was.
    pub fn ratio(&self, a: usize, b: usize) -> Summary {
        let pairs = self.samples[a].iter().zip(&self.samples[b]);
        Summary::of(pairs.map(|(a, b)| (a.rate / b.rate, a.is_disturbed(self.best) || b.is_disturbed(self.best))))
    }

    /// The processor time of `a` over that of `b`, round by round, disturbed or not.
    pub fn cpu_ratio(&self, a: usize, b: usize) -> Quartiles {
        Quartiles::of(self.samples[a].iter().zip(&self.samples[b]).map(|(a, b)| a.cpu / b.cpu))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STILL: Reading = Reading { compute: 1.0, memory: 1.0 };
    const BUSY: Reading = Reading { compute: 2.0, memory: 1.0 };

    fn turns(a: &[(f64, Reading)], b: &[(f64, Reading)]) -> Turns {
        let samples = |list: &[(f64, Reading)]| {
            list.iter().map(|&(rate, probe)| Sample { rate, cpu: rate, waited: 0.0, probe }).collect()
        };
        Turns { samples: vec![samples(a), samples(b)], best: STILL }
    }

    #[test]
    fn ratios_leave_out_rounds_that_were_disturbed_on_either_side() {
        let turns = turns(&[(4.0, STILL), (1.0, BUSY), (6.0, STILL)], &[(2.0, STILL), (2.0, STILL), (2.0, STILL)]);
        let ratio = turns.ratio(0, 1);
        assert_eq!((ratio.rate.median, ratio.samples, ratio.disturbed), (2.5, 2, 1));
        assert_eq!(ratio.disturbed_rate, Some(0.5));
        assert_eq!(turns.summary(1).disturbed, 0);
    }

    #[test]
    fn if_all_are_disturbed_they_count_and_it_is_said() {
        let turns = turns(&[(4.0, BUSY)], &[(2.0, STILL)]);
        assert!(turns.ratio(0, 1).all_disturbed);
        assert_eq!(turns.ratio(0, 1).rate.median, 2.0);
    }

    #[test]
    fn one_undisturbed_sample_alone_does_not_count() {
        let summary = Summary::of([(4.0, false), (1.0, true), (2.0, true)].into_iter());
        assert_eq!((summary.samples, summary.disturbed, summary.rate.median), (3, 2, 2.0));
        assert!(summary.rate.low < summary.rate.high);
    }

    #[test]
    fn contestants_take_turns() {
        let mut order = Vec::new();
        let effort = Effort { rounds: 5, time: Duration::ZERO, turn: Duration::ZERO };
        let turns = interleave(2, 1, effort, &mut Probe::new(), |contestant| {
            order.push(contestant);
            Turn { rate: contestant as f64, waited: 0.0 }
        });
        assert_eq!(order, [0, 1, 0, 1, 0, 1], "three rounds are made even without time");
        assert_eq!(turns.samples[1].len(), 3);
    }
}
