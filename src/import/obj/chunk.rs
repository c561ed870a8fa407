//! A stretch of lines, read by one thread.

use crate::import::Around;
use crate::import::lines::{Cursor, Fault, shown};
use crate::import::unit_or_zero;
use glam::{DVec3, Vec3};

/// The normal of a corner that has none.
pub const NO_NORMAL: u32 = u32::MAX;

/// How many of each a stretch of lines defines.
#[derive(Clone, Copy, Default)]
pub struct Counts {
    pub vertices: u64,
    pub normals: u64,
    pub coordinates: u64,
}

impl Counts {
    /// Adds `more`, and returns what was there before.
    pub fn advance(&mut self, more: &Counts) -> Counts {
        let before = *self;
        self.vertices += more.vertices;
        self.normals += more.normals;
        self.coordinates += more.coordinates;
        before
    }
}

/// A corner: which position, which normal (or [`NO_NORMAL`]).
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Corner {
    pub position: u32,
    pub normal: u32,
}

/// A line between faces that changes what follows.
pub enum Event<'a> {
    /// Faces from here on have this material.
    Material(&'a [u8]),
    /// Faces from here on belong to this object or group.
    Group(&'a [u8]),
    /// Materials are defined in these files.
    Library(&'a [u8]),
}

/// What the lines hold.
#[derive(Default)]
pub struct Chunk<'a> {
    pub positions: Vec<Vec3>,
    /// The same in double precision, if that is wanted.
    pub double: Vec<DVec3>,
    pub normals: Vec<Vec3>,
    /// The corners of all faces, one face after the other.
    pub corners: Vec<Corner>,
    /// Where each face's corners end.
    pub faces: Vec<u32>,
    /// Events, with the number of the next face and the place.
    pub events: Vec<(usize, usize, Event<'a>)>,
    /// Faces with fewer than three corners.
    pub short: u64,
    /// Lines and points.
    pub thin: u64,
    /// Lines that mean nothing here, and the first of them.
    pub unknown: Option<(u64, usize, &'a [u8])>,
    /// Where the first face is.
    pub first: Option<usize>,
}

impl<'a> Chunk<'a> {
    /// The places and names of material libraries.
    pub fn libraries(&self) -> impl Iterator<Item = (usize, &'a [u8])> {
        self.events.iter().filter_map(|(_, offset, event)| match event {
            Event::Library(names) => Some((*offset, *names)),
            _ => None,
        })
    }
}

/// Counts the definitions without reading their numbers.
pub fn count(mut cursor: Cursor) -> Counts {
    let mut counts = Counts::default();
    while !cursor.finished() {
        match cursor.token() {
            Some(b"v") => counts.vertices += 1,
            Some(b"vn") => counts.normals += 1,
            Some(b"vt") => counts.coordinates += 1,
            Some([b'#', ..]) => {
                cursor.skip_comment();
                continue;
            }
            _ => {}
        }
        cursor.next_line();
    }
    counts
}

/// Reads the lines. `before` says what earlier lines define, `total` what the whole file defines; `around` how positions are taken.
pub fn read<'a>(mut cursor: Cursor<'a>, before: Counts, total: Counts, around: Around) -> Result<Chunk<'a>, Fault> {
    let mut chunk = Chunk::default();
    let mut coordinates = before.coordinates;
    while !cursor.finished() {
        let offset = cursor.offset();
        let event = match cursor.token() {
            Some(b"v") => {
                let position = position(&mut cursor, around, &mut chunk.double)?;
                if !position.is_finite() {
                    let Vec3 { x, y, z } = position;
                    return Err(cursor.fault(format!("the vertex is at ({x}, {y}, {z})"), "finite coordinates"));
                }
                chunk.positions.push(position);
                None
            }
            Some(b"vn") => {
                let normal = vec3(&mut cursor, DVec3::ZERO)?;
                chunk.normals.push(unit_or_zero(normal));
                None
            }
            Some(b"vt") => {
                coordinates += 1;
                None
            }
            Some(b"f") => {
                let defined = Counts {
                    vertices: before.vertices + chunk.positions.len() as u64,
                    normals: before.normals + chunk.normals.len() as u64,
                    coordinates,
                };
                chunk.first.get_or_insert(offset);
                face(&mut cursor, &mut chunk, defined, total)?;
                None
            }
            Some(b"usemtl") => Some(Event::Material(cursor.rest())),
            Some(b"o" | b"g") => Some(Event::Group(cursor.rest())),
            Some(b"mtllib") => Some(Event::Library(cursor.rest())),
            Some(b"l" | b"p") => {
                chunk.thin += 1;
                None
            }
            Some(b"s") | None => None,
            Some([b'#', ..]) => {
                cursor.skip_comment();
                continue;
            }
            Some(word) => {
                chunk.unknown.get_or_insert((0, offset, word)).0 += 1;
                None
            }
        };
        if let Some(event) = event {
            chunk.events.push((chunk.faces.len(), offset, event));
        }
        cursor.next_line();
    }
    Ok(chunk)
}

/// A position, in `double` too if that is wanted.
fn position(cursor: &mut Cursor, around: Around, double: &mut Vec<DVec3>) -> Result<Vec3, Fault> {
    if !around.in_double() {
        return vec3(cursor, around.origin);
    }
    let position = DVec3::new(cursor.f64("x")?, cursor.f64("y")?, cursor.f64("z")?) - around.origin;
    double.push(position);
    Ok(position.as_vec3())
}

fn vec3(cursor: &mut Cursor, origin: DVec3) -> Result<Vec3, Fault> {
    let mut number = |name, origin| cursor.coordinate(name, origin);
    Ok(Vec3::new(number("x", origin.x)?, number("y", origin.y)?, number("z", origin.z)?))
}

fn face(cursor: &mut Cursor, chunk: &mut Chunk, defined: Counts, total: Counts) -> Result<(), Fault> {
    let start = chunk.corners.len();
    while cursor.find_token() {
        let corner = cursor.corner()?;
        let position = resolve(cursor, corner.position, defined.vertices, total.vertices, "vertex")?;
        if let Some(index) = corner.coordinate {
            resolve(cursor, index, defined.coordinates, total.coordinates, "texture coordinate")?;
        }
        let normal = match corner.normal {
            Some(index) => resolve(cursor, index, defined.normals, total.normals, "normal")?,
            None => NO_NORMAL,
        };
        chunk.corners.push(Corner { position, normal });
    }
    if chunk.corners.len() - start < 3 {
        chunk.corners.truncate(start);
        chunk.short += 1;
        return Ok(());
    }
    // A piece is cut after one line, but a line may be any length.
    let Ok(end) = u32::try_from(chunk.corners.len()) else {
        return Err(cursor.fault("the face has too many corners", "fewer than 2³² corners"));
    };
    chunk.faces.push(end);
    Ok(())
}

/// An index from 1, or from the last definition backwards, becomes one from 0.
#[inline]
fn resolve(cursor: &Cursor, index: i64, defined: u64, total: u64, name: &str) -> Result<u32, Fault> {
    let from_zero = if index < 0 { defined as i64 + index } else { index - 1 };
    if index == 0 || !(0..total as i64).contains(&from_zero) {
        return Err(out_of_range(cursor, index, defined, total, name));
    }
    Ok(from_zero as u32)
}

#[cold]
fn out_of_range(cursor: &Cursor, index: i64, defined: u64, total: u64, name: &str) -> Fault {
    let expected = match (index, defined, total) {
        (_, _, 0) => format!("a {name} to be defined"),
        (..0, 0, _) => format!("a {name} to be defined before it"),
        (..0, _, _) => format!("-{defined} to -1"),
        _ => format!("1 to {total}"),
    };
    cursor.fault(format!("{name} index {index} is out of range"), expected)
}

/// A corner as written.
struct Indices {
    position: i64,
    coordinate: Option<i64>,
    normal: Option<i64>,
}

impl Cursor<'_> {
    /// `a`, `a/b`, `a//c` or `a/b/c`.
    #[inline]
    fn corner(&mut self) -> Result<Indices, Fault> {
        let start = self.clone();
        let mut read = || {
            let position = self.part()?;
            let mut corner = Indices { position, coordinate: None, normal: None };
            if self.slash() {
                if !self.slash() {
                    corner.coordinate = Some(self.part()?);
                    if self.at_break() {
                        return Some(corner);
                    }
                    if !self.slash() {
                        return None;
                    }
                }
                corner.normal = Some(self.part()?);
            }
            self.at_break().then_some(corner)
        };
        match read() {
            Some(corner) => Ok(corner),
            None => Err(wrong_corner(start)),
        }
    }
}

#[cold]
fn wrong_corner(mut cursor: Cursor) -> Fault {
    let token = cursor.token().unwrap_or_default();
    cursor.fault(format!("{} is no corner of a face", shown(token)), "a, a/b, a//c or a/b/c, in whole numbers")
}
