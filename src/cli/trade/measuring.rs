//! Measuring, with progress, a journal and an end by signal.

use crate::accumulate::Spread;
use crate::cli::args::ReportArgs;
use crate::cli::interrupt::Interrupt;
use crate::error::Result;
use crate::measure::progress::Progress;
use crate::trade::journal::Journal;
use crate::trade::measure::{self, Effort, End, Measured, Subject, Watcher};
use crate::trade::truth::Truth;
use crate::trade::{Configuration, Run};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Parts of a budget of time, or of the smallest render, that progress tells apart.
const STEPS: u64 = 1000;

/// Measures, and shows how far it is.
pub struct Measuring<'a> {
    configurations: &'a [Configuration],
    effort: Effort,
    journal: Option<Mutex<Journal>>,
    interrupt: &'a Interrupt,
    progress: Progress,
    start: Instant,
    /// Work of all renders that are done, as [`Measuring::work`] has it.
    done: AtomicU64,
}

impl<'a> Measuring<'a> {
    /// Nothing is measured yet.
    pub fn new(
        configurations: &'a [Configuration],
        effort: Effort,
        journal: Option<Journal>,
        interrupt: &'a Interrupt,
        report: ReportArgs,
    ) -> Measuring<'a> {
        Measuring {
            configurations,
            effort,
            journal: journal.map(Mutex::new),
            interrupt,
            progress: Progress::new("measuring", STEPS, !report.quiet),
            start: Instant::now(),
            done: AtomicU64::new(0),
        }
    }

    /// Renders what `measured` does not have.
    pub fn run(&self, subject: Subject, truth: &Truth, measured: &mut Measured) -> Result<End> {
        let there = measured.runs.iter().enumerate().map(|(number, runs)| runs.len() as u64 * self.work(number));
        self.done.store(there.sum(), Ordering::Relaxed);
        let end = measure::measure(subject, self.configurations, truth, self.effort, measured, self);
        self.progress.finish();
        end
    }

    /// How much a render of a configuration is, beside others: its samples.
    fn work(&self, number: usize) -> u64 {
        STEPS * u64::from(self.configurations[number].options.samples)
    }

    fn show(&self, done: u64) {
        let all: u64 = (0..self.configurations.len()).map(|number| self.work(number)).sum();
        let all = all.saturating_mul(self.effort.runs.into()).max(1);
        match self.effort.budget {
            None => self.progress.set_of(done, all),
            // Whichever ends first.
            Some(budget) => {
                let time = self.start.elapsed().as_secs_f64() / budget.as_secs_f64();
                let part = time.max(done as f64 / all as f64).min(1.0);
                self.progress.set_of((part * STEPS as f64) as u64, STEPS);
            }
        }
    }
}

impl Watcher for Measuring<'_> {
    fn part(&self, number: usize, done: u64, total: u64) {
        let part = (self.work(number) as f64 * done as f64 / total.max(1) as f64) as u64;
        self.show(self.done.load(Ordering::Relaxed) + part);
    }

    fn finished(&self, run: &Run, spread: &Spread) -> Result<()> {
        let work = self.work(run.configuration as usize);
        self.show(self.done.fetch_add(work, Ordering::Relaxed) + work);
        match &self.journal {
            Some(journal) => journal.lock().unwrap_or_else(PoisonError::into_inner).add(run, spread),
            None => Ok(()),
        }
    }

    fn stop(&self) -> bool {
        self.interrupt.stop_requested()
    }
}
