//! ASCII bodies: one record a line, read in parallel pieces.

use super::body::{Body, IndexList, Piece};
use super::header::{Header, Kind, Scalar};
use super::plan::{Plan, Role, Step, Task};
use crate::error;
use crate::import::lines::{Cursor, Fault, Text};
use glam::DVec3;
use rayon::prelude::*;
use smallvec::SmallVec;
use std::path::Path;

/// Bytes a thread takes at a time: long enough to forget the start, short enough to share evenly.
const PIECE: usize = 1 << 18;

/// Reads the body.
pub fn read(path: &Path, bytes: &[u8], header: &Header, plan: &Plan) -> error::Result<Body> {
    let text = Text { bytes, eol: header.eol, continues: false };
    let mut body = Body::default();
    let mut at = header.body;
    for task in &plan.tasks {
        // Records without properties would be empty lines, which do not count.
        if task.steps.is_empty() {
            continue;
        }
        let piece = records(&text, &mut at, task, plan).map_err(|fault| text.error(path, fault))?;
        body.append(piece);
    }
    let left = &bytes[at..];
    if let Some(blank) = left.iter().position(|byte| !byte.is_ascii_whitespace()) {
        body.leftover = Some((text.line(at + blank), left.len() - blank));
    }
    Ok(body)
}

/// Reads the lines of one element. Empty lines do not count: when a first try came short, more lines are taken.
fn records(text: &Text, at: &mut usize, task: &Task, plan: &Plan) -> Result<Piece, Fault> {
    let wanted = task.element.count;
    let mut all = Piece::default();
    while all.records < wanted {
        if *at >= text.bytes.len() {
            let (name, read) = (&task.element.name, all.records);
            let what = format!("the file ends after {read} of {wanted} {name} records");
            let offset = text.bytes.trim_ascii_end().len();
            return Err(Fault { offset, what, expected: format!("{} more lines", wanted - read) });
        }
        let end = text.skip_lines(*at, wanted - all.records);
        let pieces = text.pieces(*at..end, PIECE);
        let read = |piece| lines(text.cursor(piece), task, plan);
        // Starting threads for a few lines costs more than reading them.
        let results: Vec<_> = if pieces.len() > 1 {
            pieces.into_par_iter().map(read).collect()
        } else {
            pieces.into_iter().map(read).collect()
        };
        for result in results {
            all.append(result?);
        }
        *at = end;
    }
    Ok(all)
}

fn lines(mut cursor: Cursor, task: &Task, plan: &Plan) -> Result<Piece, Fault> {
    let mut piece = Piece::default();
    let mut corners = SmallVec::new();
    while !cursor.finished() {
        if cursor.find_token() {
            match task.role {
                Role::Vertices => vertex(&mut cursor, task, plan, &mut piece)?,
                Role::Faces | Role::Strips => face(&mut cursor, task, plan, &mut corners, &mut piece)?,
                Role::Skip => {
                    cursor.rest();
                }
            }
            piece.records += 1;
            if cursor.find_token() {
                return Err(too_long(&cursor, task));
            }
        }
        cursor.next_line();
    }
    Ok(piece)
}

fn vertex(cursor: &mut Cursor, task: &Task, plan: &Plan, piece: &mut Piece) -> Result<(), Fault> {
    let (mut values, mut double) = ([0.0; 6], DVec3::ZERO);
    let around = plan.around;
    for (step, property) in task.steps.iter().zip(&task.element.properties) {
        match *step {
            Step::Keep(slot @ ..3) if around.in_double() => {
                double[slot] = cursor.f64(&property.name)? - around.origin[slot];
                values[slot] = double[slot] as f32;
            }
            Step::Keep(slot @ ..3) => values[slot] = cursor.coordinate(&property.name, around.origin[slot])?,
            Step::Keep(slot) => values[slot] = cursor.f32(&property.name)?,
            Step::Skip => skip(cursor, &property.name)?,
            Step::Indices | Step::SkipList => skip_list(cursor, &property.name)?,
        }
    }
    piece.double.extend(around.in_double().then_some(double));
    piece.vertex(values, plan.normals).map_err(|wrong| cursor.fault(wrong.what, wrong.expected))
}

type Corners = SmallVec<[u32; 16]>;

fn face(cursor: &mut Cursor, task: &Task, plan: &Plan, corners: &mut Corners, piece: &mut Piece) -> Result<(), Fault> {
    for (step, property) in task.steps.iter().zip(&task.element.properties) {
        match *step {
            Step::Indices => {
                let signed = matches!(property.kind, Kind::List { item, .. } if item != Scalar::U32);
                let list = IndexList { role: task.role, vertices: plan.vertices, signed };
                for _ in 0..count(cursor, &property.name)? {
                    let index = cursor.integer(&property.name)?;
                    list.push(index, corners, &mut piece.faces)
                        .map_err(|wrong| cursor.fault(wrong.what, wrong.expected))?;
                }
                list.finish(corners, &mut piece.faces);
            }
            Step::SkipList => skip_list(cursor, &property.name)?,
            Step::Keep(_) | Step::Skip => skip(cursor, &property.name)?,
        }
    }
    Ok(())
}

/// The length of a list. Any number will do: the line ends first.
fn count(cursor: &mut Cursor, name: &str) -> Result<u64, Fault> {
    let count = cursor.integer(name)?;
    u64::try_from(count).map_err(|_| cursor.fault(format!("{count} is no length for list {name}"), "0 or more"))
}

fn skip(cursor: &mut Cursor, name: &str) -> Result<(), Fault> {
    match cursor.token() {
        Some(_) => Ok(()),
        None => Err(cursor.fault("the line ends too early", format!("a value for {name}"))),
    }
}

fn skip_list(cursor: &mut Cursor, name: &str) -> Result<(), Fault> {
    for _ in 0..count(cursor, name)? {
        skip(cursor, name)?;
    }
    Ok(())
}

fn too_long(cursor: &Cursor, task: &Task) -> Fault {
    let what = format!("the line goes on after a complete {} record", task.element.name);
    cursor.fault(what, "the declared properties and nothing more, one record a line")
}
