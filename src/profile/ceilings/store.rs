//! Ceilings kept in the user's cache folder, so that they are measured once.

use std::fs;
use std::io::Write as _;
use std::path::Path;

use super::{Ceilings, Key};
use crate::cache::Cache;
use crate::cache::folder::make_private;
use crate::error::Error;
use crate::film::atomic_file;

/// The file in comber's cache folder.
const NAME: &str = "ceilings.json";
/// Longer files are none of ours.
const LONGEST: u64 = 1 << 20;

impl Ceilings {
    /// As [`Ceilings::measure`], unless an earlier run on this machine has: then what that one found. What cannot be read
    /// is measured anew, and what cannot be written is not kept.
    pub fn cached(threads: usize) -> Ceilings {
        let file = Cache::users_folder().map(|folder| folder.join(NAME));
        load_or_measure(file.as_deref(), Key::here(threads.max(1)), || Ceilings::measure(threads))
    }

    /// As [`Ceilings::measure`], and kept for [`Ceilings::cached`].
    pub fn renewed(threads: usize) -> Ceilings {
        let ceilings = Ceilings::measure(threads);
        if let Some(folder) = Cache::users_folder() {
            store(&folder.join(NAME), &ceilings);
        }
        ceilings
    }
}

fn load_or_measure(file: Option<&Path>, key: Key, measure: impl FnOnce() -> Ceilings) -> Ceilings {
    if let Some(ceilings) = file.and_then(load).filter(|ceilings| ceilings.key == key) {
        return ceilings;
    }
    let ceilings = measure();
    if let Some(file) = file {
        store(file, &ceilings);
    }
    ceilings
}

/// What the file holds, if that is ceilings.
fn load(file: &Path) -> Option<Ceilings> {
    // Before opening: opening a pipe would wait for its writer.
    fs::metadata(file).ok().filter(|found| found.is_file() && found.len() <= LONGEST)?;
    let ceilings: Ceilings = serde_json::from_slice(&fs::read(file).ok()?).ok()?;
    ceilings.is_sound().then_some(ceilings)
}

/// Writes the file; leaves alone what is no file, and does without where the system refuses.
fn store(file: &Path, ceilings: &Ceilings) {
    if fs::metadata(file).is_ok_and(|found| !found.is_file()) {
        return;
    }
    let Ok(text) = serde_json::to_vec_pretty(ceilings) else { return };
    let _ = file.parent().map(make_private);
    let _ = atomic_file::write(file, |out| out.write_all(&text).map_err(|e| Error::io(file, "write", e)));
}

#[cfg(test)]
mod tests {
    use super::super::tests::made_up;
    use super::*;

    fn never() -> Ceilings {
        panic!("measured although the file has it")
    }

    #[test]
    fn what_was_measured_once_is_found_again() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("new/folder").join(NAME);
        let (key, ceilings) = (Key::here(3), made_up(Key::here(3)));
        assert_eq!(load_or_measure(Some(&file), key.clone(), || ceilings.clone()), ceilings);
        assert_eq!(load_or_measure(Some(&file), key, never), ceilings);
    }

    #[test]
    fn what_another_machine_or_version_found_is_measured_anew() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(NAME);
        let here = Key::here(2);
        let others = [
            Key { processor: "Z80".into(), ..here.clone() },
            Key { threads: 3, ..here.clone() },
            Key { tier: "mmx".into(), ..here.clone() },
            Key { version: "0.0.1".into(), ..here.clone() },
            Key { format: here.format + 1, ..here.clone() },
            Key { caches: super::super::CacheSizes { l3: Some(1), ..here.caches }, ..here.clone() },
        ];
        for other in others {
            store(&file, &made_up(other.clone()));
            assert_eq!(load(&file).unwrap().key, other);
            assert_eq!(load_or_measure(Some(&file), here.clone(), || made_up(here.clone())).key, here);
            assert_eq!(load(&file).unwrap().key, here, "and kept");
        }
    }

    #[test]
    fn damaged_files_are_measured_anew_and_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(NAME);
        let key = Key::here(2);
        let good = serde_json::to_string(&made_up(key.clone())).unwrap();
        let absurd = good.replace("2.0", "-2.0");
        let huge = " ".repeat(LONGEST as usize + 1);
        let half = &good[..good.len() / 2];
        for text in ["", "{}", "null", "\0\u{ff}", half, &absurd, &huge, &good.replace("\"L3\"", "\"L9\"")] {
            fs::write(&file, text).unwrap();
            assert!(load(&file).is_none());
            assert_eq!(load_or_measure(Some(&file), key.clone(), || made_up(key.clone())).key, key);
            assert_eq!(load_or_measure(Some(&file), key.clone(), never).key, key);
        }
        fs::write(&file, [0xff; 10]).unwrap();
        assert!(load(&file).is_none(), "not text");
    }

    #[test]
    fn where_nothing_can_be_kept_nothing_fails() {
        let folder = tempfile::tempdir().unwrap();
        let key = Key::here(1);
        let blocked = folder.path().join("file");
        fs::write(&blocked, "").unwrap();
        for file in [None, Some(folder.path()), Some(&*blocked.join(NAME)), Some(Path::new("/dev/full"))] {
            let measured = load_or_measure(file, key.clone(), || made_up(key.clone()));
            assert_eq!(measured, made_up(key.clone()));
        }
    }
}
