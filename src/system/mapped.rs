//! A file as memory.

use std::fs::File;
use std::io;
use std::ops::Deref;

use memmap2::{Mmap, MmapOptions};

/// A file mapped for reading, from its first byte to the last that it had when it was opened.
///
/// Pages come from the system's cache when they are touched, and belong to all processes that map the file. What that
/// asks of the file: nobody may write to it or cut it short while it is mapped. Removing it or renaming another over
/// it is harmless, as the mapped one then lives on without a name.
#[derive(Debug)]
pub struct MappedFile(Mmap);

impl MappedFile {
    /// Maps all of `file`, which may be closed afterwards.
    pub fn new(file: &File) -> io::Result<MappedFile> {
        // SAFETY: the bytes stay as they are as long as the file does, which is what the type asks of its file; no
        // safe interface to mapped files can ask for less.
        unsafe { MmapOptions::new().map(file) }.map(MappedFile)
    }
}

impl Deref for MappedFile {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.0
    }
}
