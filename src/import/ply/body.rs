//! What a body holds once read: the same for every encoding.

use super::faces::Faces;
use super::plan::Role;
use crate::error::At;
use crate::import::unit_or_zero;
use glam::{DVec3, Vec3};
use smallvec::SmallVec;

/// A stretch of records, or all of them.
#[derive(Default)]
pub struct Piece {
    pub records: u64,
    pub positions: Vec<Vec3>,
    /// The positions in double precision, if that is wanted.
    pub double: Vec<DVec3>,
    pub normals: Vec<Vec3>,
    pub faces: Faces,
}

/// A whole body.
#[derive(Default)]
pub struct Body {
    pub positions: Vec<Vec3>,
    /// As [`Piece::double`].
    pub double: Vec<DVec3>,
    pub normals: Vec<Vec3>,
    pub faces: Faces,
    /// Where data that nothing declares starts, and how many bytes it has.
    pub leftover: Option<(At, usize)>,
}

/// A value that cannot be used.
#[derive(Debug)]
pub struct Wrong {
    pub what: String,
    pub expected: String,
}

impl Piece {
    /// Adds the records that follow these.
    pub fn append(&mut self, mut next: Piece) {
        self.records += next.records;
        self.positions.append(&mut next.positions);
        self.double.append(&mut next.double);
        self.normals.append(&mut next.normals);
        self.faces.append(next.faces);
    }

    /// Adds a vertex from x, y, z, nx, ny, nz.
    #[inline]
    pub fn vertex(&mut self, [x, y, z, nx, ny, nz]: [f32; 6], normals: bool) -> Result<(), Wrong> {
        let position = Vec3::new(x, y, z);
        if !position.is_finite() {
            return Err(not_finite(position));
        }
        self.positions.push(position);
        if normals {
            self.normals.push(unit_or_zero(Vec3::new(nx, ny, nz)));
        }
        Ok(())
    }
}

/// What to say of a position that is nowhere.
pub fn not_finite(position: Vec3) -> Wrong {
    let Vec3 { x, y, z } = position;
    Wrong { what: format!("the vertex is at ({x}, {y}, {z})"), expected: "finite coordinates".into() }
}

impl Body {
    /// Adds the records of one element.
    pub fn append(&mut self, mut piece: Piece) {
        // Most files have one element of each kind: take its vectors whole.
        if self.positions.is_empty() {
            self.positions = piece.positions;
            self.double = piece.double;
            self.normals = piece.normals;
        } else {
            self.positions.append(&mut piece.positions);
            self.double.append(&mut piece.double);
            self.normals.append(&mut piece.normals);
        }
        self.faces.append(piece.faces);
    }
}

/// How to take the indices of one list.
#[derive(Clone, Copy)]
pub struct IndexList {
    /// Faces or strips.
    pub role: Role,
    /// How many vertices the file declares.
    pub vertices: u32,
    /// The indices may be negative.
    pub signed: bool,
}

impl IndexList {
    /// Takes the next index; in a strip, −1 ends one and starts another.
    #[inline]
    pub fn push<A: smallvec::Array<Item = u32>>(
        &self,
        index: i64,
        corners: &mut SmallVec<A>,
        faces: &mut Faces,
    ) -> Result<(), Wrong> {
        if (0..i64::from(self.vertices)).contains(&index) {
            corners.push(index as u32);
            return Ok(());
        }
        // Types without a sign spell −1 as their largest value.
        let restart = if self.signed { -1 } else { i64::from(u32::MAX) };
        if self.role == Role::Strips && index == restart {
            self.finish(corners, faces);
            return Ok(());
        }
        Err(self.out_of_range(index))
    }

    /// Ends the list.
    #[inline]
    pub fn finish<A: smallvec::Array<Item = u32>>(&self, corners: &mut SmallVec<A>, faces: &mut Faces) {
        match self.role {
            Role::Strips => faces.push_strip(corners),
            _ => faces.push(corners),
        }
        corners.clear();
    }

    #[cold]
    fn out_of_range(&self, index: i64) -> Wrong {
        let what = format!("vertex index {index} is out of range");
        let expected = match self.vertices.checked_sub(1) {
            Some(last) => format!("0 to {last}"),
            None => "no face, as there are no vertices".into(),
        };
        Wrong { what, expected }
    }
}
