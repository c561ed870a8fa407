//! Which batch ran when: for Perfetto, chrome://tracing and flame graphs.

use crate::error::{Error, Result};
use crate::film::atomic_file;
use crate::observer::{Part, Slice};
use crate::stages;
use crate::stages::number::{ROULETTE, SHADOW, TRAVERSE};
use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::Path;
use std::time::Instant;

/// A part with its time. 40 bytes: a long render has millions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mark {
    /// Which.
    pub part: Part,
    /// Nanoseconds since the recorder was made.
    pub start: u64,
    /// Nanoseconds that it took.
    pub nanos: u64,
    /// Rows consumed.
    pub rows: u32,
    /// Rows produced.
    pub produced: u32,
}

impl Mark {
    /// Of a part that has ended, on a clock that began at `origin`.
    pub fn new(slice: &Slice, origin: Instant) -> Mark {
        Mark {
            part: slice.part,
            start: slice.start.saturating_duration_since(origin).as_nanos() as u64,
            nanos: (slice.end - slice.start).as_nanos() as u64,
            rows: slice.work.rows as u32,
            produced: slice.work.produced as u32,
        }
    }
}

/// All parts of a render, in the order in which they ended.
#[derive(Clone, Debug, Default)]
pub struct Timeline {
    /// By worker; the last track is of the calling thread.
    pub tracks: Vec<Vec<Mark>>,
}

/// Stages whose queue is drawn as a counter, with its name.
const QUEUES: [(usize, &str); 3] = [(TRAVERSE, "paths"), (SHADOW, "shadow rays"), (ROULETTE, "next paths")];

impl Timeline {
    /// Parts on all tracks.
    pub fn len(&self) -> usize {
        self.tracks.iter().map(Vec::len).sum()
    }

    /// Whether nothing was recorded.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Writes the timeline as the JSON array of Chrome's Trace Event Format, which Perfetto reads too: a track a
    /// worker, a slice a part, and for each worker the rows of its queues as counters. Times are in microseconds.
    ///
    /// # Errors
    /// The system's.
    pub fn write_trace(&self, path: &Path) -> Result<()> {
        atomic_file::write(path, |out| self.trace(out).map_err(|e| Error::io(path, "write", e)))
    }

    fn trace(&self, out: &mut impl Write) -> io::Result<()> {
        write!(out, "[\n{{\"ph\":\"M\",\"pid\":1,\"name\":\"process_name\",\"args\":{{\"name\":\"comber\"}}}}")?;
        for (track, marks) in self.tracks.iter().enumerate() {
            let name = self.track_name(track);
            write!(
                out,
                ",\n{{\"ph\":\"M\",\"pid\":1,\"tid\":{track},\"name\":\"thread_name\",\"args\":{{\"name\":\"{name}\"}}}}"
            )?;
            for mark in marks {
                write!(
                    out,
                    ",\n{{\"ph\":\"X\",\"pid\":1,\"tid\":{track},\"ts\":{},\"dur\":{},\"cat\":\"{}\",\"name\":\"{}\"",
                    Micros(mark.start),
                    Micros(mark.nanos),
                    category(mark.part),
                    name_of(mark.part),
                )?;
                if let Part::Stage { stage, depth } = mark.part {
                    let Mark { rows, produced, .. } = mark;
                    write!(out, ",\"args\":{{\"bounce\":{depth},\"rows\":{rows},\"produced\":{produced}}}}}")?;
                    if let Some((_, queue)) = QUEUES.iter().find(|(of, _)| *of == stage) {
                        for (at, rows) in [(mark.start, rows), (mark.start + mark.nanos, &0)] {
                            write!(
                                out,
                                ",\n{{\"ph\":\"C\",\"pid\":1,\"ts\":{},\"name\":\"{queue}, {name}\",\"args\":{{\"rows\":{rows}}}}}",
                                Micros(at),
                            )?;
                        }
                    }
                } else {
                    write!(out, "}}")?;
                }
            }
        }
        writeln!(out, "\n]")
    }

    /// Writes folded stacks, one a line with its own time in microseconds, for `flamegraph.pl`, inferno or speedscope.
    ///
    /// # Errors
    /// The system's.
    pub fn write_folded(&self, path: &Path) -> Result<()> {
        atomic_file::write(path, |out| self.folded(out).map_err(|e| Error::io(path, "write", e)))
    }

    fn folded(&self, out: &mut impl Write) -> io::Result<()> {
        for (stack, nanos) in self.own_times() {
            writeln!(out, "{stack} {}", (nanos + 500) / 1000)?;
        }
        Ok(())
    }

    /// Nanoseconds that each stack was on top. Passes are not on a stack: all workers take part in them.
    fn own_times(&self) -> BTreeMap<String, u64> {
        let mut own = BTreeMap::new();
        for (track, marks) in self.tracks.iter().enumerate() {
            let name = self.track_name(track);
            let (mut groups, mut stages) = (0, 0);
            for mark in marks {
                let stack = match mark.part {
                    Part::Pass => continue,
                    Part::Group => {
                        groups += mark.nanos;
                        continue;
                    }
                    Part::Stage { depth, .. } => {
                        stages += mark.nanos;
                        format!("comber;{name};tiles;bounce {depth};{}", name_of(mark.part))
                    }
                    Part::Start | Part::Develop => format!("comber;{name};{}", name_of(mark.part)),
                };
                *own.entry(stack).or_default() += mark.nanos;
            }
            if groups > 0 {
                own.insert(format!("comber;{name};tiles"), groups.saturating_sub(stages));
            }
        }
        own
    }

    fn track_name(&self, track: usize) -> String {
        if track + 1 == self.tracks.len() { "main thread".into() } else { format!("worker {track}") }
    }
}

/// Nanoseconds, printed as microseconds.
struct Micros(u64);

impl std::fmt::Display for Micros {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{:03}", self.0 / 1000, self.0 % 1000)
    }
}

fn name_of(part: Part) -> &'static str {
    match part {
        Part::Start => "start threads",
        Part::Pass => "pass",
        Part::Group => "tiles",
        Part::Stage { stage, .. } => stages::ALL[stage].name,
        Part::Develop => "develop picture",
    }
}

fn category(part: Part) -> &'static str {
    if matches!(part, Part::Stage { .. }) { "stage" } else { "drive" }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::number::GENERATE;
    use serde_json::Value;

    fn timeline() -> Timeline {
        let stage = |stage, depth, start, nanos, rows| Mark {
            part: Part::Stage { stage, depth },
            start,
            nanos,
            rows,
            produced: rows / 2,
        };
        let part = |part, start, nanos| Mark { part, start, nanos, rows: 0, produced: 0 };
        let worker = vec![
            stage(GENERATE, 0, 2_000, 1_000, 64),
            stage(TRAVERSE, 0, 3_000, 5_500, 64),
            stage(TRAVERSE, 2, 9_000, 4_000, 8),
            part(Part::Group, 1_500, 20_000),
            part(Part::Pass, 1_000, 21_000),
        ];
        Timeline { tracks: vec![worker, vec![part(Part::Start, 0, 1_000)]] }
    }

    #[test]
    fn traces_are_json_of_nested_slices_and_counters() {
        let mut text = Vec::new();
        timeline().trace(&mut text).unwrap();
        let events: Vec<Value> = serde_json::from_slice(&text).unwrap();
        let of = |kind: &str| events.iter().filter(|e| e["ph"] == kind).collect::<Vec<_>>();
        assert_eq!(of("M").len(), 3);
        assert_eq!(of("X").len(), 6);
        // Two queues of rays, up and down.
        assert_eq!(of("C").iter().map(|e| e["args"]["rows"].as_u64().unwrap()).collect::<Vec<_>>(), [64, 0, 8, 0]);
        let traverse = of("X").into_iter().find(|e| e["name"] == "traverse").unwrap();
        assert_eq!((traverse["ts"].as_f64(), traverse["dur"].as_f64()), (Some(3.0), Some(5.5)));
        assert_eq!(traverse["args"]["produced"], 32);
    }

    #[test]
    fn folded_stacks_hold_each_nanosecond_once() {
        let own = timeline().own_times();
        assert_eq!(own["comber;worker 0;tiles;bounce 0;traverse"], 5_500);
        assert_eq!(own["comber;worker 0;tiles"], 20_000 - 10_500);
        assert_eq!(own.values().sum::<u64>(), 20_000 + 1_000);
        let mut text = Vec::new();
        timeline().folded(&mut text).unwrap();
        assert!(String::from_utf8(text).unwrap().contains("comber;worker 0;tiles;bounce 2;traverse 4\n"));
    }
}
