//! Finished renders on disk, so that a measurement that was stopped or killed can go on, and loses one render at most.
//!
//! A folder: `journal.jsonl` has a line of what is measured, and then one a render; `sums-N.bin` has the pictures of configuration N added
//! up ([`sums_file`]). A render is first written to the journal and then to the sums, so a process that is killed between the two leaves one
//! line too many, which is dropped. A journal of another scene, of other options or by another version is refused.

use super::Run;
use super::measure::Measured;
use crate::accumulate::{Spread, about, sums_file};
use crate::error::{At, Error, Note, Result};
use crate::film::atomic_file;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fs::{self, File, OpenOptions};
use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};

/// Where renders are kept.
#[derive(Debug)]
pub struct Journal {
    folder: PathBuf,
    about: Value,
    file: File,
}

/// The first line.
#[derive(Serialize, Deserialize)]
struct Head {
    about: Value,
}

/// All other lines.
#[derive(Serialize, Deserialize)]
struct Line {
    run: Run,
    /// CRC-32 of the JSON of `run`.
    crc: u32,
}

const EXPECTED: &str = "a journal that `comber trade` wrote";

impl Journal {
    /// Starts anew in `folder`, which is made if it is missing: what a journal there held is forgotten.
    ///
    /// # Errors
    /// The system's.
    pub fn start(folder: &Path, about: Value) -> Result<Journal> {
        fs::create_dir_all(folder).map_err(|e| Error::io(folder, "make", e))?;
        Journal::with(folder, about, &[])
    }

    /// Goes on in `folder` with `configurations` configurations of `pixels` pixels: what is there, and what had to be left out of it.
    /// Starts anew if there is no journal.
    ///
    /// # Errors
    /// The system's; a journal of something else, or one that is damaged other than at its end.
    pub fn resume(
        folder: &Path,
        about: Value,
        configurations: usize,
        pixels: usize,
    ) -> Result<(Journal, Measured, Vec<Note>)> {
        let path = folder.join(NAME);
        let text = match fs::read(&path) {
            Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
            Err(e) if e.kind() == ErrorKind::NotFound => String::new(),
            Err(e) => return Err(Error::io(&path, "read", e)),
        };
        let mut measured = Measured::new(configurations, pixels);
        if text.is_empty() {
            let note = Note::info(format!("{}: nothing to go on from; starting anew", path.display()));
            return Ok((Journal::start(folder, about)?, measured, vec![note]));
        }
        let (runs, mut notes) = read(&path, &text, &about)?;
        for run in runs {
            let line = |what: String| Error::expected(&path, At::File, what, EXPECTED);
            let Some(kept) = measured.runs.get_mut(run.configuration as usize) else {
                return Err(line(format!("it has a configuration {}", run.configuration)));
            };
            if run.run as usize != kept.len() {
                return Err(line(format!("run {} of configuration {} is missing", kept.len(), run.configuration)));
            }
            kept.push(run);
        }
        for (number, (runs, spread)) in measured.runs.iter_mut().zip(&mut measured.spreads).enumerate() {
            let sums = sums_path(folder, number);
            match sums_file::read(&sums, &of_configuration(&about, number), pixels) {
                Ok(Some(found)) if found.rounds as usize == runs.len() => *spread = found,
                Ok(Some(found)) if found.rounds as usize + 1 == runs.len() => {
                    runs.pop();
                    *spread = found;
                }
                _ if runs.len() <= 1 => runs.clear(),
                problem => {
                    let why = match problem {
                        Err(error) => error.to_string(),
                        Ok(None) => format!("{} is missing", sums.display()),
                        Ok(Some(found)) => format!("{} has {} renders", sums.display(), found.rounds),
                    };
                    let lost = runs.len();
                    notes.push(Note::warning(format!("{why}: the {lost} renders of its configuration are repeated")));
                    runs.clear();
                }
            }
        }
        let kept: Vec<Run> = measured.runs.iter().flatten().copied().collect();
        Ok((Journal::with(folder, about, &kept)?, measured, notes))
    }

    /// Writes a journal of these runs, and opens it to add more.
    fn with(folder: &Path, about: Value, runs: &[Run]) -> Result<Journal> {
        let path = folder.join(NAME);
        let head = json(&Head { about: about.clone() });
        let lines: String = runs.iter().map(line).collect();
        atomic_file::write(&path, |out| {
            out.write_all(format!("{head}\n{lines}").as_bytes()).map_err(|e| Error::io(&path, "write", e))
        })?;
        let file = OpenOptions::new().append(true).open(&path).map_err(|e| Error::io(&path, "write", e))?;
        Ok(Journal { folder: folder.to_path_buf(), about, file })
    }

    /// Keeps a render; `spread` has it already.
    ///
    /// # Errors
    /// The system's.
    pub fn add(&mut self, run: &Run, spread: &Spread) -> Result<()> {
        let path = self.folder.join(NAME);
        self.file.write_all(line(run).as_bytes()).map_err(|e| Error::io(&path, "write", e))?;
        let number = run.configuration as usize;
        sums_file::write(&sums_path(&self.folder, number), &of_configuration(&self.about, number), spread)
    }
}

const NAME: &str = "journal.jsonl";

fn sums_path(folder: &Path, configuration: usize) -> PathBuf {
    folder.join(format!("sums-{configuration}.bin"))
}

fn of_configuration(about: &Value, number: usize) -> Value {
    serde_json::json!({ "trade": about, "configuration": number })
}

fn json(value: &impl Serialize) -> String {
    serde_json::to_string(value).expect("plain data")
}

fn line(run: &Run) -> String {
    let crc = crc32fast::hash(json(run).as_bytes());
    format!("{}\n", json(&Line { run: *run, crc }))
}

/// The runs in a journal; a last line that is not whole is left out.
fn read(path: &Path, text: &str, about: &Value) -> Result<(Vec<Run>, Vec<Note>)> {
    let mut lines = text.split_inclusive('\n');
    let wrong = |line: usize, what: String| Error::expected(path, At::Line(line as u64), what, EXPECTED);
    let head: Head = serde_json::from_str(lines.next().unwrap_or_default()).map_err(|e| wrong(1, e.to_string()))?;
    if head.about != *about {
        let what = format!("it is of something else: {}", about::difference(&head.about, about));
        return Err(Error::expected(
            path,
            At::Line(1),
            what,
            "a journal of the same measurement, or none (leave out --resume)",
        ));
    }
    let (mut runs, mut notes) = (Vec::new(), Vec::new());
    let lines: Vec<&str> = lines.collect();
    for (index, text) in lines.iter().enumerate() {
        let parsed = serde_json::from_str::<Line>(text).map_err(|e| e.to_string()).and_then(|line| {
            let right = line.crc == crc32fast::hash(json(&line.run).as_bytes()) && text.ends_with('\n');
            if right { Ok(line.run) } else { Err("its checksum is wrong".into()) }
        });
        match parsed {
            Ok(run) => runs.push(run),
            Err(_) if index + 1 == lines.len() => {
                notes.push(Note::info(format!("{}: its last line was not whole and is left out", path.display())));
            }
            Err(what) => return Err(wrong(index + 2, what)),
        }
    }
    Ok((runs, notes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::probe::Reading;
    use serde_json::json;

    fn run(configuration: u32, run: u32) -> Run {
        let number = 0.1 + f64::from(run) / 3.0;
        let probe = Reading { compute: number * 1e-3, memory: 2e-4 };
        Run {
            configuration,
            run,
            seed: 77 + run,
            seconds: number,
            rays: 10,
            samples: 4,
            non_finite: 0,
            mse: number * 1e-7,
            relmse: number,
            probe,
        }
    }

    /// A journal of two configurations with three runs each.
    fn filled(folder: &Path) -> Measured {
        let mut journal = Journal::start(folder, json!({"scene": "a"})).unwrap();
        let mut measured = Measured::new(2, 1);
        for r in 0..3 {
            for c in 0..2 {
                measured.spreads[c].add(&[[r as f32 / 7.0; 3]], 1.0).unwrap();
                measured.runs[c].push(run(c as u32, r));
                journal.add(&run(c as u32, r), &measured.spreads[c]).unwrap();
            }
        }
        measured
    }

    fn resume(folder: &Path) -> Result<(Journal, Measured, Vec<Note>)> {
        Journal::resume(folder, json!({"scene": "a"}), 2, 1)
    }

    #[test]
    fn what_was_kept_is_read_to_the_bit() {
        let dir = tempfile::tempdir().unwrap();
        let measured = filled(dir.path());
        for _ in 0..2 {
            let (_, found, notes) = resume(dir.path()).unwrap();
            assert_eq!((&found, notes.len()), (&measured, 0));
        }
        let (_, nothing, notes) = resume(&dir.path().join("other")).unwrap();
        assert_eq!((nothing, notes.len()), (Measured::new(2, 1), 1));
    }

    /// Cut off anywhere after the first line, at most the render that was being written is lost of either configuration, or its
    /// sums are found to be too new and it is measured again; and what goes on from there is whole.
    #[test]
    fn a_journal_that_is_cut_off_goes_on() {
        let dir = tempfile::tempdir().unwrap();
        filled(dir.path());
        let path = dir.path().join(NAME);
        let whole = fs::read(&path).unwrap();
        let first = whole.iter().position(|&b| b == b'\n').unwrap() + 1;
        // At the ends of lines and within them; every length would take minutes of forcing files to the disk.
        let around = |end: &usize| (end - 1..=end + 1).any(|at| whole.get(at.wrapping_sub(1)) == Some(&b'\n'));
        for end in (first..=whole.len()).filter(|end| around(end) || end % 101 == 0) {
            fs::write(&path, &whole[..end]).unwrap();
            let (mut journal, found, _) = resume(dir.path()).unwrap();
            for (runs, spread) in found.runs.iter().zip(&found.spreads) {
                assert!(runs.len() == spread.rounds as usize, "cut off at {end}");
            }
            let mut spread = found.spreads[0].clone();
            spread.add(&[[0.5; 3]], 1.0).unwrap();
            journal.add(&run(0, found.runs[0].len() as u32), &spread).unwrap();
            assert_eq!(resume(dir.path()).unwrap().1.runs[0].len(), found.runs[0].len() + 1, "cut off at {end}");
            filled(dir.path());
        }
        for end in [0, 1, first / 2, first - 2, first - 1] {
            fs::write(&path, &whole[..end]).unwrap();
            assert_eq!(resume(dir.path()).is_ok(), end == 0 || end == first - 1, "cut off at {end}");
        }
    }

    #[test]
    fn a_process_killed_between_line_and_sums_loses_that_render() {
        let dir = tempfile::tempdir().unwrap();
        let measured = filled(dir.path());
        let mut file = OpenOptions::new().append(true).open(dir.path().join(NAME)).unwrap();
        file.write_all(line(&run(1, 3)).as_bytes()).unwrap();
        assert_eq!(resume(dir.path()).unwrap().1, measured);
    }

    #[test]
    fn damage_is_named() {
        let dir = tempfile::tempdir().unwrap();
        filled(dir.path());
        let path = dir.path().join(NAME);
        let whole = fs::read_to_string(&path).unwrap();
        let said = |text: &str| {
            fs::write(&path, text).unwrap();
            resume(dir.path()).unwrap_err().to_string()
        };
        assert!(said(&whole.replacen("\"seed\":78", "\"seed\":79", 1)).contains("journal.jsonl:4: its checksum"));
        assert!(said(&whole.replacen("\"run\"", "\"ran\"", 1)).contains("journal.jsonl:2: "));
        let lines: Vec<&str> = whole.lines().collect();
        let without = [&lines[..3], &lines[4..]].concat().join("\n") + "\n";
        assert!(said(&without).contains("run 1 of configuration 0 is missing"));
        fs::write(&path, &whole).unwrap();
        let other = Journal::resume(dir.path(), json!({"scene": "b"}), 2, 1).unwrap_err().to_string();
        assert!(other.contains("scene is \"a\" there and \"b\" here"), "{other}");

        fs::write(sums_path(dir.path(), 0), "damaged").unwrap();
        let (_, found, notes) = resume(dir.path()).unwrap();
        assert_eq!((found.runs[0].len(), found.runs[1].len()), (0, 3));
        assert!(notes[0].text.contains("sums-0.bin") && notes[0].text.contains("3 renders"), "{notes:?}");
    }
}
