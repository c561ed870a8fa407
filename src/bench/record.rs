//! Figures kept from one run to be compared with those of another.

use super::interleave::Summary;
use super::statistics::Quartiles;
use crate::error::{At, Error, Result};
use crate::film::atomic_file;
use crate::measure::processor;
use serde::{Deserialize, Serialize};
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// What a run found, as JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Of this format: 1.
    pub format: u32,
    /// Version of comber.
    pub comber: String,
    /// The processor.
    pub machine: String,
    /// The figures.
    pub figures: Vec<Figure>,
}

/// One rate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// The scene's name.
    pub scene: String,
    /// Set of rays, or `render`.
    pub what: String,
    /// Threads.
    pub threads: usize,
    /// Kernel, or the peer's library, tree and mode.
    pub who: String,
    /// Rays a second.
    pub rate: Quartiles,
    /// Undisturbed samples behind it.
    pub samples: usize,
    /// Disturbed samples that were left out, unless there are no others.
    pub disturbed: usize,
}

/// How a figure compares with an earlier one.
#[derive(Clone, Debug, Serialize)]
pub struct Change {
    /// Now.
    pub now: Figure,
    /// Then.
    pub then: Quartiles,
    /// Now over then, of medians.
    pub ratio: f64,
    /// Whether that means anything.
    pub verdict: Verdict,
}

/// A comparison in a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The median of one lies within the quartiles of the other.
    Tie,
    /// Now is faster.
    Faster,
    /// Now is slower.
    Slower,
}

const FORMAT: u32 = 1;

impl Verdict {
    /// For reports.
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Tie => "tie",
            Verdict::Faster => "faster",
            Verdict::Slower => "slower",
        }
    }
}

impl Record {
    /// Nothing yet, of this program on this machine.
    pub fn new() -> Record {
        let comber = env!("CARGO_PKG_VERSION").into();
        Record { format: FORMAT, comber, machine: processor::name(), figures: Vec::new() }
    }

    /// Adds a figure.
    pub fn add(&mut self, scene: &str, what: &str, threads: usize, who: &str, summary: &Summary) {
        let (rate, samples, disturbed) = (summary.rate, summary.samples, summary.disturbed);
        self.figures.push(Figure {
            scene: scene.into(),
            what: what.into(),
            threads,
            who: who.into(),
            rate,
            samples,
            disturbed,
        });
    }

    /// Replaces the file at `path`, making its folder if that is the one records are kept in.
    ///
    /// # Errors
    /// The system's.
    pub fn write(&self, path: &Path) -> Result<()> {
        if let Some(folder) =
            path.parent().filter(|folder| folder.parent().is_some_and(|parent| home().as_deref() == Some(parent)))
        {
            std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "make", e))?;
        }
        atomic_file::write(path, |out| {
            let json = serde_json::to_string_pretty(self).map_err(std::io::Error::other);
            json.and_then(|json| writeln!(out, "{json}")).map_err(|e| Error::io(path, "write", e))
        })
    }

    /// Reads the file at `path`.
    ///
    /// # Errors
    /// The system's, and a file that is no record of this format, with the place where that shows.
    pub fn read(path: &Path) -> Result<Record> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, "read", e))?;
        let record: Record = serde_json::from_str(&text).map_err(|e| {
            let at = At::LineColumn(e.line() as u64, e.column() as u64);
            Error::expected(path, at, e.to_string(), "a record that `--save` wrote")
        })?;
        match record.format {
            FORMAT => Ok(record),
            other => Err(Error::expected(path, At::File, format!("format {other}"), format!("format {FORMAT}"))),
        }
    }

    /// Compares each figure with the one of `then` that has the same scene, subject, threads and contestant, if there is one.
    pub fn against(&self, then: &Record) -> Vec<Change> {
        let key = |f: &Figure| (f.scene.clone(), f.what.clone(), f.threads, f.who.clone());
        let change = |now: &Figure| {
            let then = then.figures.iter().find(|then| key(then) == key(now))?;
            let verdict = match now.rate.ties(&then.rate) {
                true => Verdict::Tie,
                false if now.rate.median > then.rate.median => Verdict::Faster,
                false => Verdict::Slower,
            };
            Some(Change { now: now.clone(), then: then.rate, ratio: now.rate.median / then.rate.median, verdict })
        };
        self.figures.iter().filter_map(change).collect()
    }
}

impl Default for Record {
    fn default() -> Self {
        Record::new()
    }
}

/// The file of the record of that name, kept by `command`: in the user's data folder (`~/.local/share/comber/bench` on Linux, if that is
/// the command), unless the name ends in `.json`, which makes it a path.
///
/// # Errors
/// A name that is neither, or no data folder.
pub fn path(command: &str, name: &str) -> Result<PathBuf> {
    if name.ends_with(".json") {
        return Ok(name.into());
    }
    let plain = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
    if name.is_empty() || name.starts_with('.') || !name.chars().all(plain) {
        return Err(Error::Options(format!(
            "'{name}' cannot name a record: use letters, digits, '_', '-' and '.', or a path that ends in .json"
        )));
    }
    let folder = home().map(|home| home.join(command)).ok_or_else(|| {
        Error::Options(format!("there is no data folder to keep '{name}' in: give a path that ends in .json"))
    })?;
    Ok(folder.join(format!("{name}.json")))
}

/// Where records are kept, in a folder a command.
fn home() -> Option<PathBuf> {
    use etcetera::BaseStrategy as _;
    Some(etcetera::base_strategy::choose_native_strategy().ok()?.data_dir().join("comber"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(rates: &[(&str, f64, f64)]) -> Record {
        let mut record = Record::new();
        for &(what, median, half) in rates {
            let rate = Quartiles { low: median - half, median, high: median + half };
            let summary = Summary { rate, samples: 5, disturbed: 1, disturbed_rate: Some(1.0), all_disturbed: false };
            record.add("scene", what, 1, "single", &summary);
        }
        record
    }

    #[test]
    fn figures_are_matched_and_judged_by_quartiles() {
        let then = record(&[("D", 4.0, 0.1), ("S", 3.0, 0.5), ("P", 9.0, 0.1)]);
        let now = record(&[("D", 5.0, 0.1), ("S", 3.2, 0.1), ("P", 8.0, 0.1), ("Q", 1.0, 0.1)]);
        let changes = now.against(&then);
        let verdicts: Vec<_> = changes.iter().map(|change| (change.now.what.as_str(), change.verdict)).collect();
        assert_eq!(verdicts, [("D", Verdict::Faster), ("S", Verdict::Tie), ("P", Verdict::Slower)]);
        assert_eq!(changes[0].ratio, 1.25);
    }

    #[test]
    fn files_come_back_and_others_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        let written = record(&[("D", 4.0, 0.1)]);
        written.write(&path).unwrap();
        assert_eq!(Record::read(&path).unwrap(), written);
        for (text, expected) in [("{", "a.json:1:1"), ("{}", "missing field"), ("[1]", "a.json:1:")] {
            std::fs::write(&path, text).unwrap();
            let message = Record::read(&path).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
        Record { format: 9, ..written }.write(&path).unwrap();
        assert!(Record::read(&path).unwrap_err().to_string().contains("format 9"));
    }

    #[test]
    fn names_stay_in_their_folder() {
        for name in ["", "..", "a/b", ".hidden", "a b", "../x"] {
            assert!(path("bench", name).is_err(), "{name}");
        }
        assert_eq!(path("bench", "some/where.json").unwrap(), Path::new("some/where.json"));
    }
}
