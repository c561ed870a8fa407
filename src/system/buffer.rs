//! Storage of large tables: on huge pages, or in a mapped file.

use std::alloc::{Layout, handle_alloc_error};
use std::fmt;
use std::ops::{Deref, DerefMut};
use std::ptr::NonNull;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use memmap2::{MmapMut, MmapOptions};
use rayon::prelude::*;

use super::{MappedFile, Pages};

/// A huge page of x86-64, and of AArch64 with pages of 4 KiB.
const HUGE_PAGE: usize = 2 << 20;
/// Buffers from this size on are laid on huge pages; on average half of one page is left unused.
pub const HUGE_FROM: usize = 2 * HUGE_PAGE;

/// A slice of plain values: of a fixed length, on a 64-byte boundary, and on huge pages if it is large.
///
/// Rays wait for the pages of a large tree: on 28.9 million triangles (1.7 GiB; Linux 6.18 as a virtual machine, 2 cores), diffuse
/// bounce rays take 1.25 times as long on small pages as on huge ones (1.22 to 1.29), on the dragon (57 MiB) 1.04 times. Huge
/// pages are also three times as fast to come by (0.26 s against 0.75 s for 1.7 GB), unless a virtual machine's host has to find them first
/// (up to 5 s, once). Linux maps the cached pages of large files as huge
/// ones by itself, and rays are then as fast as here.
///
/// Any type without padding for which all bit patterns are valid can be stored: `#[derive(Pod, Zeroable)]` on a
/// `repr(C)` type says so, and checks it. Like a vector it is a slice to who reads it. It is filled in one of three
/// ways: from a slice, from a parallel iterator, or zeroed and written to.
pub struct Buffer<T> {
    start: NonNull<T>,
    len: usize,
    storage: Storage,
}

/// What keeps the values alive.
enum Storage {
    /// A few cache lines of the heap.
    Heap(#[expect(dead_code, reason = "read through `start`")] Vec<Line>),
    /// Pages of its own.
    Pages(#[expect(dead_code, reason = "read through `start`")] MmapMut),
    /// Part of a file, not to be written to.
    File(Arc<MappedFile>),
}

/// A cache line.
#[derive(Clone, Copy, Zeroable, Pod)]
#[repr(C, align(64))]
struct Line([u8; 64]);

impl<T: Pod + Send + Sync> Buffer<T> {
    /// `len` values of which all bits are 0. Ends the process if there is no memory, as a vector does.
    pub fn zeroed(len: usize) -> Buffer<T> {
        Self::try_zeroed(len).unwrap_or_else(|| {
            // The layout of what does not fit in the address space does not exist.
            handle_alloc_error(Layout::array::<T>(len).unwrap_or(Layout::new::<T>()))
        })
    }

    /// The same; `None` if there is no memory.
    fn try_zeroed(len: usize) -> Option<Buffer<T>> {
        const { assert!(align_of::<T>() <= align_of::<Line>()) };
        let bytes = Layout::array::<T>(len).ok()?.size();
        if bytes >= HUGE_FROM {
            return Self::on_pages(len, bytes, Pages::Huge);
        }
        let mut lines = vec![Line::zeroed(); bytes.div_ceil(size_of::<Line>())];
        // A vector's pointer is never null, and is as aligned as its lines are.
        let start = NonNull::new(lines.as_mut_ptr().cast())?;
        Some(Buffer { start, len, storage: Storage::Heap(lines) })
    }

    /// `len` values of which all bits are 0, on pages of their own of that size; `None` if there is no memory.
    pub fn zeroed_on(len: usize, size: Pages) -> Option<Buffer<T>> {
        const { assert!(align_of::<T>() <= align_of::<Line>()) };
        Self::on_pages(len, Layout::array::<T>(len).ok()?.size(), size)
    }

    /// Zeroed pages of its own, huge ones if wanted and where the system has them to give.
    fn on_pages(len: usize, bytes: usize, size: Pages) -> Option<Buffer<T>> {
        // The system promises the alignment of a small page only. What is never touched takes no memory.
        let pages = bytes.checked_next_multiple_of(HUGE_PAGE)?;
        let mut map = MmapOptions::new().len(pages.checked_add(HUGE_PAGE)?).map_anon().ok()?;
        let skipped = map.as_ptr().align_offset(HUGE_PAGE);
        // A wish: a system without huge pages gives small ones.
        #[cfg(target_os = "linux")]
        let _ = match size {
            Pages::Small => map.advise_range(memmap2::Advice::NoHugePage, skipped, pages),
            Pages::Huge => map.advise_range(memmap2::Advice::HugePage, skipped, pages),
        };
        #[cfg(not(target_os = "linux"))]
        let _ = size;
        let start = NonNull::from(&mut map[skipped..skipped + bytes]).cast();
        Some(Buffer { start, len, storage: Storage::Pages(map) })
    }

    /// A copy of `values`, made in parallel.
    pub fn from_slice(values: &[T]) -> Buffer<T> {
        Self::from_par_iter(values.par_iter().copied())
    }

    /// The values of an iterator, in its order.
    pub fn from_par_iter<I>(values: I) -> Buffer<T>
    where
        I: IntoParallelIterator<Item = T, Iter: IndexedParallelIterator>,
    {
        let values = values.into_par_iter();
        let mut buffer = Buffer::zeroed(values.len());
        buffer.par_iter_mut().zip(values).for_each(|(slot, value)| *slot = value);
        buffer
    }

    /// The `len` values that start at byte `offset` of a mapped file; `None` if the file ends before them, or they are
    /// not aligned. They cannot be written to in place: [`DerefMut`] makes a copy.
    pub fn mapped(file: &Arc<MappedFile>, offset: usize, len: usize) -> Option<Buffer<T>> {
        let bytes = file.get(offset..)?.get(..Layout::array::<T>(len).ok()?.size())?;
        let values: &[T] = bytemuck::try_cast_slice(bytes).ok()?;
        Some(Buffer { start: NonNull::from(values).cast(), len, storage: Storage::File(Arc::clone(file)) })
    }
}

// SAFETY: a buffer owns its values as a vector does; the pages of a mapped file are only read.
unsafe impl<T: Send> Send for Buffer<T> {}
// SAFETY: as above; a shared buffer gives out shared values only.
unsafe impl<T: Sync> Sync for Buffer<T> {}

impl<T> Deref for Buffer<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        // SAFETY: `start` points at `len` aligned values in `storage`, which lives as long as `self` and stays where it
        // is when `self` moves. They are initialised: `T` was plain data when they were made, and so any bytes are.
        unsafe { std::slice::from_raw_parts(self.start.as_ptr(), self.len) }
    }
}

impl<T: Pod + Send + Sync> DerefMut for Buffer<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        if let Storage::File(_) = self.storage {
            *self = Buffer::from_slice(self);
        }
        // SAFETY: as in `deref`, and the storage is memory of this buffer alone, which `&mut self` borrows.
        unsafe { std::slice::from_raw_parts_mut(self.start.as_ptr(), self.len) }
    }
}

impl<T: Pod + Send + Sync> Default for Buffer<T> {
    fn default() -> Self {
        Buffer::zeroed(0)
    }
}

impl<T: Pod + Send + Sync> Clone for Buffer<T> {
    fn clone(&self) -> Self {
        match &self.storage {
            Storage::File(file) => {
                Buffer { start: self.start, len: self.len, storage: Storage::File(Arc::clone(file)) }
            }
            Storage::Heap(_) | Storage::Pages(_) => Buffer::from_slice(self),
        }
    }
}

impl<T> fmt::Debug for Buffer<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let storage = match &self.storage {
            Storage::Heap(_) => "heap",
            Storage::Pages(_) => "pages",
            Storage::File(_) => "file",
        };
        f.debug_struct("Buffer").field("len", &self.len).field("storage", &storage).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::super::share_on_huge_pages;
    use super::*;
    use std::fs::File;

    /// As large as a triangle block, and as aligned.
    #[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
    #[repr(C, align(64))]
    struct Block([u32; 48]);

    fn block(i: usize) -> Block {
        Block(std::array::from_fn(|word| (48 * i + word) as u32))
    }

    const LENGTHS: [usize; 6] = [0, 1, 1000, HUGE_FROM / 192, HUGE_FROM / 192 + 1, 100_000];

    #[test]
    fn zeroed_buffers_are_aligned_and_keep_what_is_written() {
        for len in LENGTHS {
            let mut buffer = Buffer::<Block>::zeroed(len);
            assert_eq!(buffer.len(), len);
            let huge = len * 192 >= HUGE_FROM;
            assert_eq!(buffer.as_ptr().addr() % if huge { HUGE_PAGE } else { 64 }, 0, "{len}");
            assert!(buffer.iter().all(|block| *block == Block([0; 48])));
            buffer.par_iter_mut().enumerate().for_each(|(i, slot)| *slot = block(i));
            let moved = buffer;
            assert!(moved.iter().enumerate().all(|(i, value)| *value == block(i)));
        }
    }

    #[test]
    fn pages_have_the_size_asked_for() {
        for size in [Pages::Small, Pages::Huge] {
            let mut buffer = Buffer::<u32>::zeroed_on(HUGE_FROM, size).unwrap();
            assert!(buffer.iter().all(|word| *word == 0));
            buffer.par_iter_mut().for_each(|word| *word = 1);
            // Huge ones are a wish, small ones a right; the system need not tell which it gave.
            let huge = share_on_huge_pages(buffer.as_ptr().addr());
            assert!(huge.is_none_or(|share| (0.0..=1.0).contains(&share) && (size == Pages::Huge || share == 0.0)));
        }
        assert!(Buffer::<Block>::zeroed_on(usize::MAX, Pages::Small).is_none());
    }

    #[test]
    fn more_than_there_is_can_be_asked_for() {
        assert!(Buffer::<Block>::try_zeroed(usize::MAX).is_none());
        assert!(Buffer::<Block>::try_zeroed(isize::MAX as usize / 192).is_none());
    }

    #[test]
    fn parallel_iterators_and_slices_keep_their_order() {
        for len in LENGTHS {
            let serial: Vec<Block> = (0..len).map(block).collect();
            let parallel = Buffer::from_par_iter((0..len).into_par_iter().map(block));
            assert_eq!(parallel[..], serial[..]);
            let mut clone = parallel.clone();
            if let Some(first) = clone.first_mut() {
                *first = block(7);
                assert_ne!(clone[..], parallel[..], "a clone is a copy");
            }
            assert_eq!(Buffer::from_slice(&serial)[..], serial[..]);
        }
    }

    #[test]
    fn parts_of_a_file_are_read_in_place_and_written_to_a_copy() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("numbers");
        let numbers: Vec<u32> = (0..4096).collect();
        std::fs::write(&path, bytemuck::cast_slice::<u32, u8>(&numbers)).unwrap();
        let file = Arc::new(MappedFile::new(&File::open(&path).unwrap()).unwrap());
        let part = Buffer::<u32>::mapped(&file, 64, 100).unwrap();
        let mut copy = part.clone();
        drop(file);
        assert_eq!(part[..], numbers[16..116]);
        assert_eq!(part.as_ptr(), copy.as_ptr(), "a clone shares the file");
        copy[0] = 99;
        assert_eq!((part[0], copy[0], copy[1]), (16, 99, 17));
    }

    #[test]
    fn parts_that_a_file_does_not_have_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("numbers");
        std::fs::write(&path, [0; 256]).unwrap();
        let file = Arc::new(MappedFile::new(&File::open(&path).unwrap()).unwrap());
        assert!(Buffer::<u32>::mapped(&file, 0, 64).is_some());
        assert!(Buffer::<u32>::mapped(&file, 256, 0).is_some());
        for (offset, len) in [(0, 65), (4, 64), (1, 1), (257, 0), (usize::MAX, 1), (0, usize::MAX), (4, usize::MAX / 4)]
        {
            assert!(Buffer::<u32>::mapped(&file, offset, len).is_none(), "{offset} {len}");
        }
        assert!(Buffer::<Block>::mapped(&file, 32, 1).is_none(), "not aligned");
    }
}
