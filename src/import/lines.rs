//! Text input a token at a time: cursors that know where they are, cuts at line ends, and faults that become
//! located errors.

use super::number;
use crate::error::{At, Error};
use std::ops::Range;
use std::path::Path;

/// What is wrong at a byte of a text; its line is only worked out when it must be told.
#[derive(Debug)]
pub struct Fault {
    /// The byte, counted from the start of the file.
    pub offset: usize,
    /// What is wrong.
    pub what: String,
    /// What a usable file would hold there.
    pub expected: String,
}

/// A file of lines.
#[derive(Clone, Copy)]
pub struct Text<'a> {
    /// The whole file.
    pub bytes: &'a [u8],
    /// The byte that ends a line.
    pub eol: u8,
    /// A backslash before the end of a line joins it to the next.
    pub continues: bool,
}

impl<'a> Text<'a> {
    /// Takes a file: lines end with a line feed, or with a carriage return where there is no line feed at all.
    pub fn new(bytes: &'a [u8], continues: bool) -> Self {
        let eol = if bytes.contains(&b'\n') { b'\n' } else { b'\r' };
        Self { bytes, eol, continues }
    }

    /// The line that a byte is on.
    pub fn line(&self, offset: usize) -> At {
        let before = &self.bytes[..offset.min(self.bytes.len())];
        At::Line(1 + count(before, self.eol) as u64)
    }

    /// The error for a fault in this text.
    pub fn error(&self, path: &Path, fault: Fault) -> Error {
        Error::expected(path, self.line(fault.offset), fault.what, fault.expected)
    }

    /// Reads from the start of `range` to its end.
    pub fn cursor(&self, range: Range<usize>) -> Cursor<'a> {
        let bytes = &self.bytes[..range.end];
        Cursor { bytes, at: range.start, eol: self.eol, continues: self.continues }
    }

    /// Cuts `range` at line ends into pieces of about `size` bytes.
    pub fn pieces(&self, range: Range<usize>, size: usize) -> Vec<Range<usize>> {
        let mut pieces = Vec::new();
        let mut start = range.start;
        while start < range.end {
            let mut end = (start + size).min(range.end);
            while end < range.end {
                end = self.line_end(end, range.end);
                if !self.joined(end - 1) {
                    break;
                }
            }
            pieces.push(start..end);
            start = end;
        }
        pieces
    }

    /// Where the next `lines` lines from `start` end.
    pub fn skip_lines(&self, start: usize, lines: u64) -> usize {
        let mut left = lines;
        let mut at = start;
        for block in self.bytes[start..].chunks(1 << 12) {
            let ends = count(block, self.eol) as u64;
            if ends >= left {
                break;
            }
            left -= ends;
            at += block.len();
        }
        while left > 0 && at < self.bytes.len() {
            at = self.line_end(at, self.bytes.len());
            left -= 1;
        }
        at
    }

    /// One after the end of the line that `at` is on.
    fn line_end(&self, at: usize, limit: usize) -> usize {
        self.bytes[at..limit].iter().position(|&byte| byte == self.eol).map_or(limit, |length| at + length + 1)
    }

    /// The line end at this byte is hidden behind a backslash.
    fn joined(&self, at: usize) -> bool {
        self.continues && backslash_before(self.bytes, at, self.eol)
    }
}

/// A backslash stands before the line end at this byte.
fn backslash_before(bytes: &[u8], end: usize, eol: u8) -> bool {
    let before = &bytes[..end];
    let before = if eol == b'\n' { before.strip_suffix(b"\r").unwrap_or(before) } else { before };
    before.last() == Some(&b'\\')
}

fn count(bytes: &[u8], wanted: u8) -> usize {
    // Blocks short enough for byte-wide sums, which the compiler turns into vector code.
    let block = |block: &[u8]| usize::from(block.iter().map(|&byte| u8::from(byte == wanted)).sum::<u8>());
    bytes.chunks(255).map(block).sum()
}

/// The lines of many places, in rising order, without counting from the start for each.
pub struct Lines<'a> {
    text: Text<'a>,
    offset: usize,
    line: u64,
}

impl<'a> Lines<'a> {
    /// Starts at the first line.
    pub fn new(text: Text<'a>) -> Self {
        Self { text, offset: 0, line: 1 }
    }

    /// The line of a place at or after the last one asked for.
    pub fn at(&mut self, offset: usize) -> At {
        let between = self.text.bytes.get(self.offset..offset).unwrap_or_default();
        self.line += count(between, self.text.eol) as u64;
        self.offset = self.offset.max(offset);
        At::Line(self.line)
    }
}

/// A token's text for a message, cut short and without control characters.
pub fn shown(token: &[u8]) -> String {
    const LONGEST: usize = 32;
    let text = String::from_utf8_lossy(&token[..token.len().min(LONGEST)]);
    let dots = if token.len() > LONGEST { "…" } else { "" };
    format!("“{}{dots}”", text.escape_debug())
}

/// A place in a text that moves forward token by token and never past the end of a line unasked.
#[derive(Clone)]
pub struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    eol: u8,
    continues: bool,
}

impl<'a> Cursor<'a> {
    /// The place, counted from the start of the file.
    pub fn offset(&self) -> usize {
        self.at
    }

    /// Nothing is left.
    pub fn finished(&self) -> bool {
        self.at >= self.bytes.len()
    }

    /// Moves to the next token; `false` if the line has none.
    #[inline]
    pub fn find_token(&mut self) -> bool {
        loop {
            match self.bytes.get(self.at) {
                None => return false,
                Some(&byte) if byte == self.eol => return false,
                Some(b' ' | b'\t' | b'\r' | b'\n' | b'\x0b' | b'\x0c') => self.at += 1,
                Some(b'\\') => match self.continuation() {
                    Some(length) => self.at += length,
                    None => return true,
                },
                Some(_) => return true,
            }
        }
    }

    /// The length of a backslash and line end here.
    fn continuation(&self) -> Option<usize> {
        let rest = self.bytes.get(self.at..).filter(|_| self.continues)?;
        match rest {
            [b'\\', end, ..] if *end == self.eol => Some(2),
            [b'\\', b'\r', end, ..] if *end == self.eol => Some(3),
            _ => None,
        }
    }

    /// The token ends here.
    #[inline]
    pub fn at_break(&self) -> bool {
        match self.bytes.get(self.at) {
            None => true,
            Some(b' ' | b'\t' | b'\r' | b'\n' | b'\x0b' | b'\x0c') => true,
            Some(b'\\') => self.continuation().is_some(),
            Some(_) => false,
        }
    }

    /// The next token of the line.
    pub fn token(&mut self) -> Option<&'a [u8]> {
        if !self.find_token() {
            return None;
        }
        let start = self.at;
        while !self.at_break() {
            self.at += 1;
        }
        Some(&self.bytes[start..self.at])
    }

    /// The rest of the line, without the spaces around it.
    pub fn rest(&mut self) -> &'a [u8] {
        self.find_token();
        let start = self.at;
        while self.bytes.get(self.at).is_some_and(|&byte| byte != self.eol) {
            self.at += 1;
        }
        self.bytes[start..self.at].trim_ascii()
    }

    /// Moves past the end of the line, whatever is left on it.
    pub fn next_line(&mut self) {
        loop {
            let rest = self.bytes.get(self.at..).unwrap_or_default();
            let length = rest.iter().position(|&byte| byte == self.eol).unwrap_or(rest.len());
            let end = self.at + length;
            self.at = end + 1;
            // Looks back past where it started: a backslash may end what was just taken.
            let joined = self.continues && end < self.bytes.len() && backslash_before(self.bytes, end, self.eol);
            if !joined {
                break;
            }
        }
    }

    /// Moves past the end of the line, which a backslash does not hide.
    pub fn skip_comment(&mut self) {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        self.at += rest.iter().position(|&byte| byte == self.eol).unwrap_or(rest.len()) + 1;
    }

    /// A number, exactly rounded; it may be infinite or not a number.
    #[inline]
    pub fn f32(&mut self, name: &str) -> Result<f32, Fault> {
        let start = self.at;
        if self.find_token()
            && let Some((value, length)) = number::f32_prefix(&self.bytes[self.at..])
        {
            self.at += length;
            if self.at_break() {
                return Ok(value);
            }
        }
        self.at = start;
        self.unusual_f32(name)
    }

    /// A number less `origin`, rounded once.
    #[inline]
    pub fn coordinate(&mut self, name: &str, origin: f64) -> Result<f32, Fault> {
        if origin == 0.0 { self.f32(name) } else { self.far_coordinate(name, origin) }
    }

    #[cold]
    fn far_coordinate(&mut self, name: &str, origin: f64) -> Result<f32, Fault> {
        Ok((self.f64(name)? - origin) as f32)
    }

    /// A number, exactly rounded to `f64`.
    pub fn f64(&mut self, name: &str) -> Result<f64, Fault> {
        let token = self.required(name)?;
        number::parse_f64(token).ok_or_else(|| self.wrong(token, name, "a number"))
    }

    #[cold]
    fn unusual_f32(&mut self, name: &str) -> Result<f32, Fault> {
        let token = self.required(name)?;
        number::parse_f32(token).ok_or_else(|| self.wrong(token, name, "a number"))
    }

    /// A whole number.
    #[inline]
    pub fn integer(&mut self, name: &str) -> Result<i64, Fault> {
        let start = self.at;
        if self.find_token()
            && let Some((value, length)) = number::integer_prefix(&self.bytes[self.at..])
        {
            self.at += length;
            if self.at_break() {
                return Ok(value);
            }
        }
        self.at = start;
        self.unusual_integer(name)
    }

    /// Whole numbers also come spelled `3.0` and `1e3`, where a file declares them as floating-point.
    #[cold]
    fn unusual_integer(&mut self, name: &str) -> Result<i64, Fault> {
        let token = self.required(name)?;
        let value = std::str::from_utf8(token).ok().and_then(|text| text.parse::<f64>().ok());
        match value {
            Some(value) if value.trunc() == value && value.abs() < 1e18 => Ok(value as i64),
            _ => Err(self.wrong(token, name, "a whole number")),
        }
    }

    /// A whole number in the middle of a token.
    #[inline]
    pub fn part(&mut self) -> Option<i64> {
        let (value, length) = number::integer_prefix(&self.bytes[self.at..])?;
        self.at += length;
        Some(value)
    }

    /// Takes a slash, if there is one here.
    #[inline]
    pub fn slash(&mut self) -> bool {
        let found = self.bytes.get(self.at) == Some(&b'/');
        self.at += usize::from(found);
        found
    }

    fn required(&mut self, name: &str) -> Result<&'a [u8], Fault> {
        self.token().ok_or_else(|| self.fault("the line ends too early", format!("a value for {name}")))
    }

    fn wrong(&self, token: &[u8], name: &str, kind: &str) -> Fault {
        self.fault(format!("{} is no value for {name}", shown(token)), kind)
    }

    /// A fault on this line.
    pub fn fault(&self, what: impl Into<String>, expected: impl Into<String>) -> Fault {
        Fault { offset: self.at, what: what.into(), expected: expected.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tokens(bytes: &[u8], continues: bool) -> Vec<Vec<String>> {
        let text = Text::new(bytes, continues);
        let mut cursor = text.cursor(0..bytes.len());
        let mut lines = Vec::new();
        while !cursor.finished() {
            let mut line = Vec::new();
            while let Some(token) = cursor.token() {
                line.push(String::from_utf8_lossy(token).into_owned());
            }
            lines.push(line);
            cursor.next_line();
        }
        lines
    }

    #[test]
    fn all_line_ends() {
        let expected = [vec!["a", "b"], vec![], vec!["c"]];
        for text in ["a b\n\n c ", "a\tb \r\n\r\nc\r\n", "a b\r\r\tc\r"] {
            assert_eq!(tokens(text.as_bytes(), false), expected, "{text:?}");
        }
    }

    #[test]
    fn backslashes_join_lines_only_where_asked() {
        assert_eq!(tokens(b"f 1 \\\n2\\\r\n3\nv", true), [vec!["f", "1", "2", "3"], vec!["v"]]);
        assert_eq!(tokens(b"f\\\nv", false), [vec!["f\\"], vec!["v"]]);
        assert_eq!(tokens(b"a\\b \\", true), [vec!["a\\b", "\\"]]);
    }

    #[test]
    fn pieces_cover_the_text_and_end_with_lines() {
        let bytes: Vec<u8> =
            (0..500).flat_map(|i| format!("{i}{}\n", if i % 3 == 0 { "\\" } else { "" }).into_bytes()).collect();
        let text = Text::new(&bytes, true);
        for size in [1, 7, 100, 10_000] {
            let pieces = text.pieces(0..bytes.len(), size);
            assert_eq!(pieces.iter().flat_map(|p| bytes[p.clone()].to_vec()).collect::<Vec<_>>(), bytes);
            for piece in &pieces {
                assert!(bytes[piece.clone()].ends_with(b"\n") && !bytes[piece.clone()].ends_with(b"\\\n"));
            }
        }
    }

    #[test]
    fn lines_are_skipped_and_counted() {
        let bytes: Vec<u8> = (0..3000).flat_map(|i| format!("{i}\n").into_bytes()).chain(*b"end").collect();
        let text = Text::new(&bytes, false);
        let mut found = Lines::new(text);
        for lines in [0, 1, 2, 999, 1000, 2999] {
            let at = text.skip_lines(0, lines);
            assert!(bytes[at..].starts_with(format!("{lines}\n").as_bytes()), "{lines}");
            assert_eq!(text.line(at), At::Line(lines + 1));
            assert_eq!(found.at(at), At::Line(lines + 1));
        }
        assert_eq!(text.skip_lines(0, 3001), bytes.len());
        assert_eq!(text.skip_lines(0, u64::MAX), bytes.len());
    }

    #[test]
    fn long_tokens_are_cut_in_messages() {
        assert_eq!(shown(b"a\x00\xff"), "“a\\0�”");
        assert!(shown(&[b'x'; 1 << 20]).len() < 60);
    }
}
