//! The header: what the body holds and where it starts.

use crate::error::{At, Error, Result};
use crate::import::lines::{Cursor, Text, shown};
use std::path::Path;

/// How the body is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    Ascii,
    Little,
    Big,
}

/// A scalar type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    /// Bytes in a binary body.
    pub fn size(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }

    fn named(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"int8" => Scalar::I8,
            b"uchar" | b"uint8" => Scalar::U8,
            b"short" | b"int16" => Scalar::I16,
            b"ushort" | b"uint16" => Scalar::U16,
            b"int" | b"int32" => Scalar::I32,
            b"uint" | b"uint32" => Scalar::U32,
            b"float" | b"float32" => Scalar::F32,
            b"double" | b"float64" => Scalar::F64,
            _ => return None,
        })
    }
}

/// What a property holds in each record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

impl Kind {
    /// The least bytes it takes in a binary body.
    pub fn least(self) -> usize {
        match self {
            Kind::Scalar(scalar) => scalar.size(),
            Kind::List { count, .. } => count.size(),
        }
    }
}

/// A declared property.
#[derive(Debug)]
pub struct Property {
    pub name: String,
    pub kind: Kind,
}

/// A declared element: a table of records.
#[derive(Debug)]
pub struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
    /// The header line that declares it.
    pub at: At,
}

/// A read header.
#[derive(Debug)]
pub struct Header {
    pub format: Format,
    pub elements: Vec<Element>,
    /// Where the body starts.
    pub body: usize,
    /// What ends the lines.
    pub eol: u8,
}

/// Reads the header at the start of a file.
pub fn read(path: &Path, bytes: &[u8]) -> Result<Header> {
    let first_end = bytes.iter().position(|byte| matches!(byte, b'\r' | b'\n'));
    // A binary body may hold any byte: only the first line end tells the convention.
    let eol = match first_end.map(|end| &bytes[end..]) {
        Some([b'\r', next, ..]) if *next != b'\n' => b'\r',
        Some([b'\r']) => b'\r',
        _ => b'\n',
    };
    if bytes[..first_end.unwrap_or(bytes.len())].trim_ascii_end() != b"ply" {
        let what = if bytes.is_empty() { "the file is empty" } else { "this is no PLY file" };
        return Err(Error::expected(path, At::Line(1), what, "a first line “ply”"));
    }
    let text = Text { bytes, eol, continues: false };
    let mut cursor = text.cursor(0..bytes.len());
    cursor.next_line();
    let mut reader = Reader { path, line: 1, format: None, elements: Vec::new() };
    while !cursor.finished() {
        reader.line += 1;
        if reader.keyword(&mut cursor)? {
            let body = (cursor.offset() + 1).min(bytes.len());
            let format = reader.format.ok_or_else(|| reader.wrong("the format is missing", FORMATS))?;
            return Ok(Header { format, elements: reader.elements, body, eol });
        }
        cursor.next_line();
    }
    Err(reader.wrong("the header does not end", "a line “end_header”"))
}

const FORMATS: &str = "“format ascii 1.0”, “format binary_little_endian 1.0” or “format binary_big_endian 1.0”";
const TYPES: &str = "char, uchar, short, ushort, int, uint, float or double";

struct Reader<'a> {
    path: &'a Path,
    line: u64,
    format: Option<Format>,
    elements: Vec<Element>,
}

impl Reader<'_> {
    fn wrong(&self, what: impl Into<String>, expected: &str) -> Error {
        Error::expected(self.path, At::Line(self.line), what, expected)
    }

    /// Reads one line; `true` at the end of the header.
    fn keyword(&mut self, cursor: &mut Cursor) -> Result<bool> {
        match cursor.token() {
            None => {}
            Some(b"comment" | b"obj_info") => {
                cursor.rest();
            }
            Some(b"format") => self.format(cursor)?,
            Some(b"element") => self.element(cursor)?,
            Some(b"property") => self.property(cursor)?,
            Some(b"end_header") => {
                self.end(cursor)?;
                return Ok(true);
            }
            Some(word) => {
                let what = format!("{} is no header keyword", shown(word));
                return Err(self.wrong(what, "comment, obj_info, element, property or end_header"));
            }
        }
        self.end(cursor)?;
        Ok(false)
    }

    fn end(&self, cursor: &mut Cursor) -> Result<()> {
        match cursor.token() {
            None => Ok(()),
            Some(token) => Err(self.wrong(format!("{} follows a complete line", shown(token)), "the end of the line")),
        }
    }

    fn format(&mut self, cursor: &mut Cursor) -> Result<()> {
        let name = cursor.token().unwrap_or_default();
        let format = match name {
            b"ascii" => Format::Ascii,
            b"binary_little_endian" => Format::Little,
            b"binary_big_endian" => Format::Big,
            _ => return Err(self.wrong(format!("{} is no known format", shown(name)), FORMATS)),
        };
        match cursor.token() {
            Some(b"1.0") if self.format.is_none() => self.format = Some(format),
            Some(b"1.0") => return Err(self.wrong("the format is given twice", "one format line")),
            version => {
                let version = shown(version.unwrap_or_default());
                return Err(self.wrong(format!("{version} is no known version of the format"), "1.0"));
            }
        }
        Ok(())
    }

    fn element(&mut self, cursor: &mut Cursor) -> Result<()> {
        let name = cursor.token().unwrap_or_default();
        let count = cursor.token().unwrap_or_default();
        let number = std::str::from_utf8(count).ok().and_then(|text| text.parse().ok());
        let Some(number) = number else {
            return Err(self.wrong(format!("{} is no count of records", shown(count)), "“element NAME COUNT”"));
        };
        self.elements.push(Element {
            name: String::from_utf8_lossy(name).into_owned(),
            count: number,
            properties: Vec::new(),
            at: At::Line(self.line),
        });
        Ok(())
    }

    fn property(&mut self, cursor: &mut Cursor) -> Result<()> {
        let kind = match cursor.token() {
            Some(b"list") => Kind::List { count: self.scalar(cursor.token())?, item: self.scalar(cursor.token())? },
            token => Kind::Scalar(self.scalar(token)?),
        };
        let Some(name) = cursor.token() else {
            return Err(
                self.wrong("the property has no name", "“property TYPE NAME” or “property list TYPE TYPE NAME”")
            );
        };
        let name = String::from_utf8_lossy(name).into_owned();
        match self.elements.last_mut() {
            Some(element) => element.properties.push(Property { name, kind }),
            None => return Err(self.wrong("the property belongs to no element", "an element line before it")),
        }
        Ok(())
    }

    fn scalar(&self, token: Option<&[u8]>) -> Result<Scalar> {
        let token = token.unwrap_or_default();
        Scalar::named(token).ok_or_else(|| self.wrong(format!("{} is no type", shown(token)), TYPES))
    }
}
