//! Columns in memory: slices that start on a cache line and end on one.

use std::ops::{Deref, DerefMut};

/// A cache line of 32-bit words.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Line([u32; 16]);

/// A 32-bit number that any bit pattern is valid for.
pub trait Word: Copy + sealed::Sealed {}
impl Word for f32 {}
impl Word for u32 {}

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for u32 {}
}

/// A slice of 32-bit numbers, zeroed at first, that begins on a 64-byte boundary.
pub struct Aligned<T: Word> {
    lines: Vec<Line>,
    len: usize,
    number: std::marker::PhantomData<T>,
}

impl<T: Word> Aligned<T> {
    /// `len` zeros.
    pub fn zeroed(len: usize) -> Self {
        Aligned { lines: vec![Line([0; 16]); len.div_ceil(16)], len, number: std::marker::PhantomData }
    }
}

impl<T: Word> Deref for Aligned<T> {
    type Target = [T];
    #[inline(always)]
    fn deref(&self) -> &[T] {
        debug_assert!(self.len <= self.lines.len() * 16);
        // SAFETY: the lines hold at least `len` initialised 32-bit words, `T` is 32 bits wide, needs no more
        // alignment than a line has, and accepts every bit pattern (`Word` is sealed to f32 and u32).
        unsafe { std::slice::from_raw_parts(self.lines.as_ptr().cast(), self.len) }
    }
}

impl<T: Word> DerefMut for Aligned<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T] {
        debug_assert!(self.len <= self.lines.len() * 16);
        // SAFETY: as in `deref`; `&mut self` makes the access exclusive.
        unsafe { std::slice::from_raw_parts_mut(self.lines.as_mut_ptr().cast(), self.len) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_start_on_a_cache_line_and_hold_what_is_written() {
        for len in [0, 1, 15, 16, 17, 1000] {
            let mut column = Aligned::<f32>::zeroed(len);
            assert_eq!(column.len(), len);
            assert_eq!(column.as_ptr().addr() % 64, 0);
            assert!(column.iter().all(|&x| x == 0.0));
            column.iter_mut().enumerate().for_each(|(i, x)| *x = i as f32);
            assert!(column.iter().enumerate().all(|(i, &x)| x == i as f32));
        }
    }
}
