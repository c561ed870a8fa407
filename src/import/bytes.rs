//! A whole file in memory.
//!
//! Plain reading, not mapping: a mapped file that someone truncates kills the process (SIGBUS), and the
//! safe interface to `mmap` does not exist. The price is one copy out of the page cache, measured on two cores:
//! 19 ms for the 34 MB ASCII dragon, whose parsing takes 60 ms, and 0.26 s for 532 MB of binary triangles,
//! whose parsing takes 0.86 s.
//!
//! Tried: all threads reading into a buffer on huge pages. At best 0.1 s faster for those 532 MB; but the bytes are read once and given
//! back, and on a virtual machine whose host had to find the pages first it took 2 s longer.

use crate::error::{Error, Result};
use std::fs::File;
use std::io::{self, Read};
use std::ops::Deref;
use std::path::Path;

/// The bytes of one file.
#[derive(Debug)]
pub struct FileBytes(Vec<u8>);

impl Deref for FileBytes {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.0
    }
}

/// Reads a regular file. Devices and pipes are refused: they may never end.
pub fn read(path: &Path) -> Result<FileBytes> {
    let failed = |source| Error::io(path, "read", source);
    // Before opening: opening a pipe would already wait for its writer.
    let metadata = std::fs::metadata(path).map_err(failed)?;
    if metadata.is_dir() {
        return Err(failed(io::Error::new(io::ErrorKind::IsADirectory, "it is a directory")));
    }
    if !metadata.is_file() {
        return Err(failed(io::Error::new(io::ErrorKind::InvalidInput, "it is not a regular file")));
    }
    let length = metadata.len();
    let mut bytes = Vec::new();
    // A failed reservation is an error message; `fs::read` on a sparse terabyte would not be as polite.
    let reserved = usize::try_from(length).ok().and_then(|length| bytes.try_reserve_exact(length).ok());
    if reserved.is_none() {
        let what = format!("its {length} bytes do not fit in memory");
        return Err(failed(io::Error::new(io::ErrorKind::OutOfMemory, what)));
    }
    // A file that grows meanwhile is cut at the length it had: parsing a moving target helps nobody.
    File::open(path).and_then(|file| file.take(length).read_to_end(&mut bytes)).map_err(failed)?;
    Ok(FileBytes(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(path: &Path) -> String {
        read(path).expect_err("must not be readable").to_string()
    }

    #[test]
    fn reads_what_was_written() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("mesh.ply");
        std::fs::write(&path, b"ply\n").expect("write");
        assert_eq!(&*read(&path).expect("readable"), b"ply\n");
        std::fs::write(&path, b"").expect("write");
        assert!(read(&path).expect("readable").is_empty());
    }

    #[test]
    fn says_why_a_path_cannot_be_read() {
        let folder = tempfile::tempdir().expect("temporary folder");
        assert!(message(folder.path()).ends_with("cannot read: it is a directory"));
        let missing = message(&folder.path().join("missing.obj"));
        assert!(missing.contains("missing.obj: cannot read: "), "{missing}");
    }

    #[cfg(unix)]
    #[test]
    fn endless_devices_are_refused() {
        assert!(message(Path::new("/dev/zero")).ends_with("it is not a regular file"));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_file_larger_than_memory_is_an_error() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("sparse.ply");
        // Not every file system can hold a hole this large.
        if File::create(&path).and_then(|file| file.set_len(1 << 43)).is_ok() {
            assert!(message(&path).contains("do not fit in memory"));
        }
    }
}
