//! Binary bodies of either byte order: tables of fixed stride at once, the rest record by record.

use super::body::{Body, IndexList, Piece, Wrong, not_finite};
use super::faces::collapsed;
use super::header::{Header, Kind, Scalar};
use super::plan::{Plan, Role, Step, Task};
use crate::error::{At, Error};
use crate::import::unit_or_zero;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use smallvec::SmallVec;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// Reads the body; `BIG` is its byte order.
pub fn read<const BIG: bool>(path: &Path, bytes: &[u8], header: &Header, plan: &Plan) -> crate::error::Result<Body> {
    let mut body = Body::default();
    let mut at = header.body;
    for task in &plan.tasks {
        let mut walk = Walk::<BIG> { bytes, at, task, plan, piece: Piece::default() };
        walk.records().map_err(|fault| {
            Error::expected(path, At::Byte(fault.offset as u64), fault.wrong.what, fault.wrong.expected)
        })?;
        at = walk.at;
        body.append(walk.piece);
    }
    if at < bytes.len() {
        body.leftover = Some((At::Byte(at as u64), bytes.len() - at));
    }
    Ok(body)
}

/// What is wrong at a byte of the file.
struct Fault {
    offset: usize,
    wrong: Wrong,
}

/// A way through the records of one element.
struct Walk<'a, const BIG: bool> {
    bytes: &'a [u8],
    at: usize,
    task: &'a Task<'a>,
    plan: &'a Plan<'a>,
    piece: Piece,
}

type Corners = SmallVec<[u32; 16]>;

impl<'a, const BIG: bool> Walk<'a, BIG> {
    fn records(&mut self) -> Result<(), Fault> {
        let element = self.task.element;
        // A declared count is only believed as far as the bytes reach.
        let least: usize = element.properties.iter().map(|property| property.kind.least()).sum();
        let table = usize::try_from(element.count).ok().and_then(|count| count.checked_mul(least));
        let Some(table) = table.filter(|&table| table <= self.bytes.len() - self.at) else {
            return Err(self.too_few(element.count, least));
        };
        let fixed = element.properties.iter().all(|property| matches!(property.kind, Kind::Scalar(_)));
        match self.task.role {
            Role::Skip if fixed => self.at += table,
            Role::Vertices if fixed => {
                let layout = Vertex::new(self.task, least);
                self.piece = self.vertices(&self.bytes[self.at..self.at + table], &layout)?;
                self.at += table;
            }
            Role::Faces => {
                if !self.triangles() {
                    self.one_by_one(element.count)?;
                }
            }
            _ => self.one_by_one(element.count)?,
        }
        Ok(())
    }

    fn too_few(&self, count: u64, least: usize) -> Fault {
        let (name, left) = (&self.task.element.name, self.bytes.len() - self.at);
        let what = format!("the file ends after {left} bytes of {count} {name} records");
        self.fault(self.bytes.len(), what, format!("at least {} bytes", u128::from(count) * least as u128))
    }

    fn fault(&self, offset: usize, what: impl Into<String>, expected: impl Into<String>) -> Fault {
        Fault { offset, wrong: Wrong { what: what.into(), expected: expected.into() } }
    }

    fn vertices(&self, table: &[u8], layout: &Vertex) -> Result<Piece, Fault> {
        let mut piece = Piece::default();
        let records = table.par_chunks_exact(layout.stride);
        let position = |record: &[u8]| Vec3::from_array(layout.values::<BIG>(record, 0, self.plan));
        records.clone().map(position).collect_into_vec(&mut piece.positions);
        if let Some(bad) = piece.positions.par_iter().position_first(|position| !position.is_finite()) {
            let wrong = not_finite(piece.positions[bad]);
            return Err(Fault { offset: self.at + bad * layout.stride, wrong });
        }
        if self.plan.around.in_double() {
            let double = |record: &[u8]| layout.in_double::<BIG>(record, self.plan);
            records.clone().map(double).collect_into_vec(&mut piece.double);
        }
        if self.plan.normals {
            let normal = |record: &[u8]| unit_or_zero(Vec3::from_array(layout.values::<BIG>(record, 3, self.plan)));
            records.map(normal).collect_into_vec(&mut piece.normals);
        }
        Ok(piece)
    }

    /// Takes all records at once if they are triangles with `int` or `uint` indices and nothing else of varying
    /// length. Returns `false`, having done nothing, where they are not or an index is wrong: the walk says which.
    fn triangles(&mut self) -> bool {
        const RECORDS: usize = 1 << 14;
        let Some(layout) = Triangle::new(self.task) else { return false };
        // The table fits in memory even for lists of no items, so this cannot wrap round.
        let count = self.task.element.count as usize;
        let length = count.checked_mul(layout.stride).and_then(|length| self.at.checked_add(length));
        let Some(table) = length.and_then(|end| self.bytes.get(self.at..end)) else { return false };
        let below = if layout.signed { self.plan.vertices.min(1 << 31) } else { self.plan.vertices };
        let lost = AtomicU64::new(0);
        let mut triangles = vec![[0u32; 3]; count];
        let all =
            triangles.par_chunks_mut(RECORDS).zip(table.par_chunks(RECORDS * layout.stride)).all(|(out, records)| {
                let (mut good, mut degenerate) = (true, 0);
                for (triangle, record) in out.iter_mut().zip(records.chunks_exact(layout.stride)) {
                    let (three, indices) = layout.read::<BIG>(record);
                    good &= three && indices.iter().all(|&index| index < below);
                    degenerate += u64::from(collapsed(indices));
                    *triangle = indices;
                }
                lost.fetch_add(degenerate, Ordering::Relaxed);
                good
            });
        if !all {
            return false;
        }
        let lost = lost.into_inner();
        if lost > 0 {
            triangles.retain(|&triangle| !collapsed(triangle));
        }
        self.piece.faces.triangles = triangles;
        self.piece.faces.collapsed = lost;
        self.at += table.len();
        true
    }

    fn one_by_one(&mut self, count: u64) -> Result<(), Fault> {
        // Records without properties take no bytes: their count could be anything.
        if self.task.steps.is_empty() {
            return Ok(());
        }
        let mut corners = Corners::new();
        for _ in 0..count {
            self.record(&mut corners)?;
        }
        Ok(())
    }

    fn record(&mut self, corners: &mut Corners) -> Result<(), Fault> {
        let start = self.at;
        let (mut values, mut double) = ([0.0; 6], DVec3::ZERO);
        for (step, property) in self.task.steps.iter().zip(&self.task.element.properties) {
            match (*step, property.kind) {
                (Step::Keep(slot), Kind::Scalar(scalar)) => {
                    let value = self.scalar(scalar)?;
                    values[slot] = self.plan.vertex_value(slot, value);
                    if slot < 3 {
                        double[slot] = value - self.plan.around.origin[slot];
                    }
                }
                (_, Kind::Scalar(scalar)) => {
                    self.take(1, scalar)?;
                }
                (Step::Indices, Kind::List { count, item }) => self.indices(count, item, corners)?,
                (_, Kind::List { count, item }) => {
                    let count = self.count(count, &property.name)?;
                    self.take(count, item)?;
                }
            }
        }
        if self.task.role == Role::Vertices {
            let added = self.piece.vertex(values, self.plan.normals);
            added.map_err(|wrong| Fault { offset: start, wrong })?;
            self.piece.double.extend(self.plan.around.in_double().then_some(double));
        }
        Ok(())
    }

    fn indices(&mut self, count: Scalar, item: Scalar, corners: &mut Corners) -> Result<(), Fault> {
        let count = self.count(count, "of vertex indices")?;
        let start = self.at;
        let items = self.take(count, item)?;
        let list = IndexList { role: self.task.role, vertices: self.plan.vertices, signed: item != Scalar::U32 };
        for (number, bytes) in items.chunks_exact(item.size()).enumerate() {
            let value = decode::<BIG>(item, bytes);
            let index = value as i64;
            let wrong = if index as f64 == value {
                list.push(index, corners, &mut self.piece.faces)
            } else {
                Err(Wrong { what: format!("{value:?} is no vertex index"), expected: "a whole number".into() })
            };
            wrong.map_err(|wrong| Fault { offset: start + number * item.size(), wrong })?;
        }
        list.finish(corners, &mut self.piece.faces);
        Ok(())
    }

    /// The length of a list.
    fn count(&mut self, scalar: Scalar, name: &str) -> Result<usize, Fault> {
        let start = self.at;
        let value = self.scalar(scalar)?;
        let count = value as usize;
        if value < 0.0 || count as f64 != value {
            return Err(self.fault(
                start,
                format!("{value:?} is no length for list {name}"),
                "a whole number, 0 or more",
            ));
        }
        Ok(count)
    }

    fn scalar(&mut self, scalar: Scalar) -> Result<f64, Fault> {
        Ok(decode::<BIG>(scalar, self.take(1, scalar)?))
    }

    /// The bytes of the next `count` scalars.
    fn take(&mut self, count: usize, scalar: Scalar) -> Result<&'a [u8], Fault> {
        let bytes = self.bytes;
        let end = count.checked_mul(scalar.size()).and_then(|length| self.at.checked_add(length));
        match end.filter(|&end| end <= bytes.len()) {
            Some(end) => {
                let start = std::mem::replace(&mut self.at, end);
                Ok(&bytes[start..end])
            }
            None => {
                let name = &self.task.element.name;
                let left = self.bytes.len() - self.at;
                let what = format!("the file ends inside element {name}, {left} bytes after byte {}", self.at);
                Err(self.fault(self.bytes.len(), what, format!("{count} values of {} bytes", scalar.size())))
            }
        }
    }
}

/// Where a vertex record of fixed stride keeps its values.
struct Vertex {
    stride: usize,
    places: [(usize, Scalar); 6],
}

impl Vertex {
    fn new(task: &Task, stride: usize) -> Self {
        let mut places = [(0, Scalar::F32); 6];
        let mut offset = 0;
        for (step, property) in task.steps.iter().zip(&task.element.properties) {
            if let (Step::Keep(slot), Kind::Scalar(scalar)) = (*step, property.kind) {
                places[slot] = (offset, scalar);
            }
            offset += property.kind.least();
        }
        Self { stride, places }
    }

    /// The position of a record in double precision.
    fn in_double<const BIG: bool>(&self, record: &[u8], plan: &Plan) -> DVec3 {
        let [x, y, z] = [0, 1, 2].map(|slot| {
            let (offset, scalar) = self.places[slot];
            decode::<BIG>(scalar, &record[offset..])
        });
        DVec3::new(x, y, z) - plan.around.origin
    }

    /// Three values of a record.
    #[inline]
    fn values<const BIG: bool>(&self, record: &[u8], first: usize, plan: &Plan) -> [f32; 3] {
        [first, first + 1, first + 2].map(|slot| {
            let (offset, scalar) = self.places[slot];
            match scalar {
                // As it stands where nothing is subtracted, payloads of NaN and all.
                Scalar::F32 if plan.around.origin == DVec3::ZERO => f32::from_bits(word::<BIG>(&record[offset..])),
                other => plan.vertex_value(slot, decode::<BIG>(other, &record[offset..])),
            }
        })
    }
}

/// Where a face record keeps its indices, if it is a triangle.
struct Triangle {
    stride: usize,
    count: (usize, Scalar),
    indices: usize,
    signed: bool,
}

impl Triangle {
    /// `None` if triangles would not all take the same room or their indices are not words.
    fn new(task: &Task) -> Option<Self> {
        let mut stride = 0;
        let mut layout = None;
        for (step, property) in task.steps.iter().zip(&task.element.properties) {
            match (*step, property.kind) {
                (Step::Indices, Kind::List { count, item: item @ (Scalar::I32 | Scalar::U32) }) => {
                    layout = Some(((stride, count), stride + count.size(), item == Scalar::I32));
                    stride += count.size() + 3 * item.size();
                }
                (_, Kind::Scalar(scalar)) => stride += scalar.size(),
                (_, Kind::List { .. }) => return None,
            }
        }
        layout.map(|(count, indices, signed)| Self { stride, count, indices, signed })
    }

    /// Whether the record is a triangle, and its indices.
    #[inline]
    fn read<const BIG: bool>(&self, record: &[u8]) -> (bool, [u32; 3]) {
        let (offset, scalar) = self.count;
        let three = match scalar {
            Scalar::U8 | Scalar::I8 => record[offset] == 3,
            other => decode::<BIG>(other, &record[offset..]) == 3.0,
        };
        let indices = &record[self.indices..self.indices + 12];
        (three, [0, 4, 8].map(|at| word::<BIG>(&indices[at..])))
    }
}

/// The first `N` bytes, lowest first.
#[inline]
fn ordered<const BIG: bool, const N: usize>(bytes: &[u8]) -> [u8; N] {
    let mut out = [0; N];
    out.copy_from_slice(&bytes[..N]);
    if BIG {
        out.reverse();
    }
    out
}

#[inline]
fn word<const BIG: bool>(bytes: &[u8]) -> u32 {
    u32::from_le_bytes(ordered::<BIG, 4>(bytes))
}

/// A scalar as `f64`, which holds every value of every type.
#[inline]
fn decode<const BIG: bool>(scalar: Scalar, bytes: &[u8]) -> f64 {
    match scalar {
        Scalar::I8 => i8::from_le_bytes(ordered::<BIG, 1>(bytes)).into(),
        Scalar::U8 => bytes[0].into(),
        Scalar::I16 => i16::from_le_bytes(ordered::<BIG, 2>(bytes)).into(),
        Scalar::U16 => u16::from_le_bytes(ordered::<BIG, 2>(bytes)).into(),
        Scalar::I32 => i32::from_le_bytes(ordered::<BIG, 4>(bytes)).into(),
        Scalar::U32 => word::<BIG>(bytes).into(),
        Scalar::F32 => f32::from_bits(word::<BIG>(bytes)).into(),
        Scalar::F64 => f64::from_le_bytes(ordered::<BIG, 8>(bytes)),
    }
}
