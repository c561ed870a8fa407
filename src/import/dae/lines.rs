//! From byte offsets to lines and columns.

use crate::error::At;

/// The line starts of a text, for many look-ups.
pub(super) struct Lines<'a> {
    bytes: &'a [u8],
    /// Byte offset of each line's first byte; the first is 0.
    starts: Vec<usize>,
}

impl<'a> Lines<'a> {
    /// Indexes `bytes`, which need not be UTF-8.
    pub fn new(bytes: &'a [u8]) -> Self {
        let ends = bytes.iter().enumerate().filter(|(_, byte)| **byte == b'\n');
        let starts = std::iter::once(0).chain(ends.map(|(offset, _)| offset + 1)).collect();
        Lines { bytes, starts }
    }

    /// The line of a byte offset, counted from 1.
    pub fn line(&self, offset: usize) -> u64 {
        self.starts.partition_point(|start| *start <= offset) as u64
    }

    /// Line and column of a byte offset. Takes time in proportion to the line's length: for errors only.
    pub fn line_column(&self, offset: usize) -> At {
        let offset = offset.min(self.bytes.len());
        let line = self.line(offset);
        let start = self.starts[line as usize - 1];
        // A column is a character: bytes 10xxxxxx continue one.
        let column = self.bytes[start..offset].iter().filter(|byte| **byte & 0xc0 != 0x80).count() + 1;
        At::LineColumn(line, column as u64)
    }

    /// The offset of `part` in the text, if it is a slice of it.
    pub fn offset_of(&self, part: &str) -> Option<usize> {
        let offset = (part.as_ptr() as usize).checked_sub(self.bytes.as_ptr() as usize)?;
        (offset + part.len() <= self.bytes.len()).then_some(offset)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_count_characters_from_one() {
        let text = "ab\né€x\r\n\n";
        let lines = Lines::new(text.as_bytes());
        assert_eq!(lines.line_column(0), At::LineColumn(1, 1));
        assert_eq!(lines.line_column(2), At::LineColumn(1, 3));
        assert_eq!(lines.line_column(text.find('x').unwrap()), At::LineColumn(2, 3));
        assert_eq!(lines.line_column(text.len()), At::LineColumn(4, 1));
        assert_eq!(lines.line_column(usize::MAX), At::LineColumn(4, 1));
        assert_eq!(Lines::new(b"").line_column(0), At::LineColumn(1, 1));
    }

    #[test]
    fn a_slice_is_found_and_a_stranger_is_not() {
        let text = "one two".to_string();
        let lines = Lines::new(text.as_bytes());
        assert_eq!(lines.offset_of(&text[4..]), Some(4));
        assert_eq!(lines.offset_of(&String::from("two")), None);
    }
}
