//! Files that appear whole or not at all.
//!
//! A render can take an hour and be killed at any moment, so a result never overwrites an earlier one in
//! place: it is written beside it under a temporary name, forced to the disk, and renamed over it. A run that
//! fails removes its temporary file; one that is killed by force leaves `.comber-<pid>-<n>.tmp` behind, and the
//! earlier result as it was.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use crate::error::{Error, Result};

/// Replaces the file at `path` with what `fill` writes, in one step.
///
/// A symbolic link is followed: the file that it points to is replaced. Devices and pipes (`/dev/null`) have no
/// content to protect and are written directly.
///
/// # Errors
///
/// [`Error::Io`] if `path` cannot be a file, its directory is missing, or the system refuses (no permission,
/// full disk); and whatever `fill` returns. After an error the earlier file, if there was one, is untouched.
pub fn write(path: &Path, fill: impl FnOnce(&mut BufWriter<File>) -> Result<()>) -> Result<()> {
    match resolve(path)? {
        Target::Special => {
            let file = OpenOptions::new().write(true).open(path).map_err(|e| Error::io(path, "write", e))?;
            let mut writer = BufWriter::new(file);
            fill(&mut writer)?;
            writer.flush().map_err(|e| Error::io(path, "write", e))
        }
        Target::Regular { file, directory } => {
            let (temporary, handle) = Temporary::create(path, &directory)?;
            let mut writer = BufWriter::new(handle);
            fill(&mut writer)?;
            let handle = writer.into_inner().map_err(|e| Error::io(path, "write", e.into_error()))?;
            // Without this, a power cut after the rename could leave a file of the right name without content.
            handle.sync_all().map_err(|e| Error::io(path, "write", e))?;
            drop(handle);
            temporary.rename_to(path, &file)
        }
    }
}

/// Checks that [`write()`] could write `path` now, without touching a file that is already there.
///
/// Meant for the start of a render. It creates and removes a temporary file in the directory, because that alone
/// answers for permissions, read-only file systems and quotas.
///
/// # Errors
///
/// The [`Error::Io`] that [`write()`] would give, but for a disk that fills up later.
pub fn check_writable(path: &Path) -> Result<()> {
    match resolve(path)? {
        Target::Special => OpenOptions::new().write(true).open(path).map(drop).map_err(|e| Error::io(path, "write", e)),
        Target::Regular { directory, .. } => Temporary::create(path, &directory).map(drop),
    }
}

/// What a path names, links followed.
enum Target {
    /// A device or a pipe.
    Special,
    /// A regular file, present or to be made, and the directory that holds it.
    Regular { file: PathBuf, directory: PathBuf },
}

/// Finds out what `path` names, and refuses what cannot be replaced.
fn resolve(path: &Path) -> Result<Target> {
    let refuse = |kind, why: String| Err(Error::io(path, "write", io::Error::new(kind, why)));
    let mut file = path.to_path_buf();
    match fs::metadata(path) {
        Ok(found) if found.is_dir() => return refuse(ErrorKind::IsADirectory, "it is a directory".into()),
        Ok(found) if !found.is_file() => return Ok(Target::Special),
        // A rename would replace it all the same: only the directory's permission counts for that.
        Ok(found) if found.permissions().readonly() => {
            return refuse(ErrorKind::PermissionDenied, "the existing file is read-only".into());
        }
        Ok(_) => match fs::canonicalize(path) {
            Ok(real) => file = real,
            // Somebody has removed it since: as if it had been missing before.
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            Err(error) => return Err(Error::io(path, "write", error)),
        },
        // A missing file is no obstacle; a missing directory is found below.
        Err(error) if error.kind() == ErrorKind::NotFound => {}
        Err(error) => return Err(Error::io(path, "write", error)),
    }
    if file.file_name().is_none() {
        return refuse(ErrorKind::InvalidInput, "it does not name a file".into());
    }
    let directory = match file.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_path_buf(),
        _ => PathBuf::from("."),
    };
    if !directory.is_dir() {
        return refuse(ErrorKind::NotFound, format!("there is no directory {}", directory.display()));
    }
    Ok(Target::Regular { file, directory })
}

/// A file that is removed when dropped, unless it has been renamed.
struct Temporary {
    path: PathBuf,
    renamed: bool,
}

impl Temporary {
    /// Creates an empty file of a new name in `directory`; errors speak of `wanted`.
    fn create(wanted: &Path, directory: &Path) -> Result<(Self, File)> {
        static COUNTER: AtomicU32 = AtomicU32::new(0);
        loop {
            let number = COUNTER.fetch_add(1, Ordering::Relaxed);
            let path = directory.join(format!(".comber-{}-{number}.tmp", std::process::id()));
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                Ok(file) => return Ok((Temporary { path, renamed: false }, file)),
                // Left by a killed run, or by another machine on a shared disk.
                Err(error) if error.kind() == ErrorKind::AlreadyExists => continue,
                Err(error) => return Err(Error::io(wanted, "write", error)),
            }
        }
    }

    /// Moves the file to its final place; errors speak of `wanted`.
    fn rename_to(mut self, wanted: &Path, file: &Path) -> Result<()> {
        fs::rename(&self.path, file).map_err(|e| Error::io(wanted, "rename the finished file to it", e))?;
        self.renamed = true;
        Ok(())
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.renamed {
            // Nothing sensible is left to do if this fails too.
            let _ = fs::remove_file(&self.path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(directory: &Path) -> Vec<String> {
        let entries = fs::read_dir(directory).unwrap();
        let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    fn write_text(path: &Path, text: &str) -> Result<()> {
        write(path, |w| w.write_all(text.as_bytes()).map_err(|e| Error::io(path, "write", e)))
    }

    #[test]
    fn writes_and_replaces() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        write_text(&path, "first, and longer").unwrap();
        write_text(&path, "second").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "second");
        assert_eq!(names(dir.path()), ["a.txt"]);
    }

    #[test]
    fn a_failure_or_panic_leaves_the_old_file_and_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        write_text(&path, "old").unwrap();
        let failed = write(&path, |w| {
            w.write_all(b"half of the new").unwrap();
            Err(Error::Scene("encoder gave up".into()))
        });
        assert!(failed.is_err());
        let panicked = std::panic::catch_unwind(|| write(&path, |_| panic!("encoder panicked")));
        assert!(panicked.is_err());
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(names(dir.path()), ["a.txt"]);
    }

    #[test]
    fn check_does_not_clobber_or_leave_anything() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        check_writable(&path).unwrap();
        assert!(names(dir.path()).is_empty());
        write_text(&path, "old").unwrap();
        check_writable(&path).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(names(dir.path()), ["a.txt"]);
    }

    #[test]
    fn says_what_is_wrong() {
        let dir = tempfile::tempdir().unwrap();
        for (path, expected) in [
            (dir.path().to_path_buf(), "it is a directory"),
            (dir.path().join("missing/a.txt"), "there is no directory"),
            (dir.path().join("missing/.."), "it does not name a file"),
        ] {
            for result in [check_writable(&path), write_text(&path, "x")] {
                let message = result.unwrap_err().to_string();
                assert!(message.contains(expected), "{message}");
                assert!(message.starts_with(&path.display().to_string()), "{message}");
            }
        }
    }

    #[test]
    fn refuses_a_read_only_file() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        write_text(&path, "precious").unwrap();
        let mut permissions = fs::metadata(&path).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&path, permissions).unwrap();
        assert!(check_writable(&path).is_err());
        assert!(write_text(&path, "x").is_err());
        assert_eq!(fs::read_to_string(&path).unwrap(), "precious");
    }

    #[cfg(unix)]
    #[test]
    fn follows_links_to_files_and_devices() {
        let dir = tempfile::tempdir().unwrap();
        let (file, link) = (dir.path().join("real.txt"), dir.path().join("link.txt"));
        write_text(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write_text(&link, "new").unwrap();
        assert_eq!(fs::read_to_string(&file).unwrap(), "new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());

        let null = dir.path().join("null.txt");
        std::os::unix::fs::symlink("/dev/null", &null).unwrap();
        check_writable(&null).unwrap();
        write_text(&null, "gone").unwrap();
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn reports_a_full_disk() {
        let message = write_text(Path::new("/dev/full"), "x").unwrap_err().to_string();
        assert!(message.contains("No space left on device"), "{message}");
    }
}
