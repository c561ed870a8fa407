//! INT and TERM: the first asks a render to finish its waves and write what there is, the second ends the process.

use super::exit::{INTERRUPTED, complain};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Watches for signals in a thread of its own.
///
/// Before [`Interrupt::rendering`] there is nothing to keep, and the first signal ends the process.
#[derive(Clone, Debug)]
pub struct Interrupt(Arc<State>);

#[derive(Debug, Default)]
struct State {
    /// There are samples that are worth keeping.
    rendering: AtomicBool,
    /// A signal has asked to stop.
    stop: AtomicBool,
}

impl Interrupt {
    /// Starts watching. `outputs` are the files that may be half written when the process has to end.
    pub fn watch<'a>(outputs: impl IntoIterator<Item = &'a Path>) -> anyhow::Result<Self> {
        let directories = directories(outputs);
        let mut signals = Signals::new([SIGINT, SIGTERM])?;
        let state = Arc::new(State::default());
        let seen = Arc::clone(&state);
        std::thread::Builder::new().name("signals".into()).spawn(move || {
            for _ in signals.forever() {
                if !seen.rendering.load(Ordering::SeqCst) || seen.stop.swap(true, Ordering::SeqCst) {
                    remove_temporaries(&directories);
                    signal_hook::low_level::exit(i32::from(INTERRUPTED));
                }
                complain("comber: finishing the waves under way; another signal ends comber at once");
            }
        })?;
        Ok(Interrupt(state))
    }

    /// From now on there is something to keep.
    pub fn rendering(&self) {
        self.0.rendering.store(true, Ordering::SeqCst);
    }

    /// Whether a signal has asked to stop.
    pub fn stop_requested(&self) -> bool {
        self.0.stop.load(Ordering::Relaxed)
    }
}

/// The directories that hold `outputs`, links followed, as temporary files stand beside the file they will replace.
fn directories<'a>(outputs: impl IntoIterator<Item = &'a Path>) -> Vec<PathBuf> {
    let parent = |path: PathBuf| match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_path_buf(),
        _ => PathBuf::from("."),
    };
    let outputs = outputs.into_iter().map(|path| fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf()));
    let mut directories: Vec<_> = outputs.map(parent).collect();
    directories.sort();
    directories.dedup();
    directories
}

/// Removes what [`crate::film::atomic_file`] has begun in this process.
fn remove_temporaries(directories: &[PathBuf]) {
    let prefix = format!(".comber-{}-", std::process::id());
    let files = directories.iter().filter_map(|directory| fs::read_dir(directory).ok()).flatten().flatten();
    for file in files.filter(|file| file.file_name().to_string_lossy().starts_with(&prefix)) {
        let _ = fs::remove_file(file.path());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_temporaries_of_this_process_are_removed() {
        let directory = tempfile::tempdir().unwrap();
        let own = directory.path().join(format!(".comber-{}-0.tmp", std::process::id()));
        let (other, result) = (directory.path().join(".comber-1-0.tmp"), directory.path().join("a.png"));
        for path in [&own, &other, &result] {
            fs::write(path, "").unwrap();
        }
        remove_temporaries(&directories([result.as_path()]));
        assert!(!own.exists() && other.exists() && result.exists());
    }

    #[test]
    fn directories_are_named_once() {
        assert_eq!(directories(["a.png", "b.exr"].map(Path::new)), [PathBuf::from(".")]);
    }
}
