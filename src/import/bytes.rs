//! A whole file in memory.
//!
//! Plain reading, not mapping: a mapped file that someone truncates kills the process (SIGBUS), and scene files are
//! not comber's to guard. The price is one copy out of the page cache, made by all threads.

use crate::error::{Error, Result};
use crate::system::Buffer;
use rayon::prelude::*;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Deref;
use std::path::Path;

/// The bytes of one file.
#[derive(Debug)]
pub struct FileBytes(Buffer<u8>);

impl Deref for FileBytes {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.0
    }
}

/// Bytes that a thread reads at a time.
const PIECE: usize = 16 << 20;

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
    // A failed reservation is an error message; `fs::read` on a sparse terabyte would not be as polite.
    let Some(mut bytes) = usize::try_from(length).ok().and_then(Buffer::<u8>::try_zeroed) else {
        let what = format!("its {length} bytes do not fit in memory");
        return Err(failed(io::Error::new(io::ErrorKind::OutOfMemory, what)));
    };
    // A file that grows meanwhile is cut at the length it had: parsing a moving target helps nobody.
    let pieces = bytes.par_chunks_mut(PIECE).enumerate();
    pieces.try_for_each(|(number, piece)| read_at(path, (number * PIECE) as u64, piece)).map_err(failed)?;
    Ok(FileBytes(bytes))
}

/// Fills `piece` from `offset` on. Each piece has a file of its own, whose position no other thread moves.
fn read_at(path: &Path, offset: u64, piece: &mut [u8]) -> io::Result<()> {
    let mut file = File::open(path)?;
    file.seek(SeekFrom::Start(offset))?;
    file.read_exact(piece).map_err(|error| match error.kind() {
        io::ErrorKind::UnexpectedEof => io::Error::new(error.kind(), "it has become shorter meanwhile"),
        _ => error,
    })
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
        let long: Vec<u8> = (0..2 * PIECE + 3).map(|i| (i / 7 + i / 4099) as u8).collect();
        std::fs::write(&path, &long).expect("write");
        assert!(*read(&path).expect("readable") == long[..]);
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
