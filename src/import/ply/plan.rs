//! What to do with each element and property: found once from the header, followed for every record.

use super::header::{Element, Header, Kind, Scalar};
use crate::error::{At, Error, Result};
use crate::import::Around;
use std::path::Path;

/// What to do with a property.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Keep the scalar: x, y, z, nx, ny, nz are 0 to 5.
    Keep(usize),
    /// Keep the list: it holds vertex indices.
    Indices,
    /// Skip a scalar.
    Skip,
    /// Skip a list.
    SkipList,
}

/// What to do with an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    Vertices,
    Faces,
    Strips,
    Skip,
}

/// An element with its instructions.
#[derive(Debug)]
pub struct Task<'a> {
    pub role: Role,
    pub element: &'a Element,
    /// One step a property.
    pub steps: Vec<Step>,
}

/// Instructions for a whole body.
#[derive(Debug)]
pub struct Plan<'a> {
    pub tasks: Vec<Task<'a>>,
    /// Every index must be below this.
    pub vertices: u32,
    /// The vertices carry normals.
    pub normals: bool,
    /// How positions are taken.
    pub around: Around,
    /// Where the faces are declared.
    pub at: At,
}

impl<'a> Plan<'a> {
    /// Finds vertices and faces among the elements.
    pub fn new(path: &Path, header: &'a Header, around: Around) -> Result<Self> {
        let mut plan = Plan { tasks: Vec::new(), vertices: 0, normals: false, around, at: At::File };
        let (mut vertices, mut faces, mut strips) = (None, None, None);
        for element in &header.elements {
            let (role, seen) = match element.name.as_str() {
                "vertex" => (Role::Vertices, &mut vertices),
                "face" => (Role::Faces, &mut faces),
                "tristrips" => (Role::Strips, &mut strips),
                _ => {
                    plan.tasks.push(skip(element));
                    continue;
                }
            };
            if seen.replace(element).is_some() {
                let what = format!("element {} is declared twice", element.name);
                return Err(Error::expected(path, element.at, what, "one declaration"));
            }
            if role != Role::Vertices && element.count == 0 {
                plan.tasks.push(skip(element));
                continue;
            }
            let steps = if role == Role::Vertices {
                plan.vertices = vertex_count(path, element)?;
                let (steps, normals) = vertex_steps(path, element)?;
                plan.normals = normals;
                steps
            } else {
                plan.at = element.at;
                index_steps(path, element)?
            };
            plan.tasks.push(Task { role, element, steps });
        }
        if vertices.is_none() {
            let what = "the header declares no vertices";
            return Err(Error::expected(path, At::File, what, "“element vertex COUNT” with x, y and z"));
        }
        if !plan.tasks.iter().any(|task| matches!(task.role, Role::Faces | Role::Strips)) {
            let at = faces.or(strips).map_or(At::File, |element| element.at);
            return Err(Error::expected(path, at, "there are no faces, so nothing to render", "“element face COUNT”"));
        }
        Ok(plan)
    }

    /// `value` of the number in slot `slot` of a vertex, rounded once; less the origin if it is a coordinate.
    #[inline]
    pub fn vertex_value(&self, slot: usize, value: f64) -> f32 {
        if slot < 3 { (value - self.around.origin[slot]) as f32 } else { value as f32 }
    }

    /// Whether a binary file states coordinates in single precision.
    pub fn is_single(&self) -> bool {
        let vertices = self.tasks.iter().filter(|task| task.role == Role::Vertices);
        let mut properties = vertices.flat_map(|task| task.steps.iter().zip(&task.element.properties));
        properties.any(|(step, property)| matches!((step, property.kind), (Step::Keep(..3), Kind::Scalar(Scalar::F32))))
    }
}

fn skip(element: &Element) -> Task<'_> {
    let steps = element.properties.iter().map(|property| skip_step(property.kind)).collect();
    Task { role: Role::Skip, element, steps }
}

fn skip_step(kind: Kind) -> Step {
    match kind {
        Kind::Scalar(_) => Step::Skip,
        Kind::List { .. } => Step::SkipList,
    }
}

fn vertex_count(path: &Path, element: &Element) -> Result<u32> {
    u32::try_from(element.count).map_err(|_| {
        let what = format!("{} vertices are too many", element.count);
        Error::expected(path, element.at, what, format!("at most {}", u32::MAX))
    })
}

/// The steps for a vertex, and whether it has a normal.
fn vertex_steps(path: &Path, element: &Element) -> Result<(Vec<Step>, bool)> {
    const NAMES: [&str; 6] = ["x", "y", "z", "nx", "ny", "nz"];
    let mut found = [false; 6];
    let mut steps = Vec::with_capacity(element.properties.len());
    for property in &element.properties {
        let slot = NAMES.iter().position(|name| *name == property.name);
        let step = match (slot, property.kind) {
            (Some(slot), Kind::Scalar(_)) if found[slot] => {
                let what = format!("vertex property {} is declared twice", NAMES[slot]);
                return Err(Error::expected(path, element.at, what, "one declaration"));
            }
            (Some(slot), Kind::Scalar(_)) => {
                found[slot] = true;
                Step::Keep(slot)
            }
            (_, kind) => skip_step(kind),
        };
        steps.push(step);
    }
    if let Some(missing) = found[..3].iter().position(|found| !found) {
        let what = format!("the vertices have no {}", NAMES[missing]);
        return Err(Error::expected(path, element.at, what, "scalar properties x, y and z"));
    }
    let normals = found[3..].iter().all(|&found| found);
    if !normals {
        // A normal that lacks a component is none.
        steps.iter_mut().filter(|step| matches!(step, Step::Keep(3..))).for_each(|step| *step = Step::Skip);
    }
    Ok((steps, normals))
}

fn index_steps(path: &Path, element: &Element) -> Result<Vec<Step>> {
    let mut found = false;
    let mut steps = Vec::with_capacity(element.properties.len());
    for property in &element.properties {
        let wanted = matches!(property.name.as_str(), "vertex_indices" | "vertex_index");
        steps.push(match property.kind {
            Kind::List { .. } if wanted && !found => {
                found = true;
                Step::Indices
            }
            kind => skip_step(kind),
        });
    }
    if found {
        return Ok(steps);
    }
    let what = format!("element {} has no vertex indices", element.name);
    Err(Error::expected(path, element.at, what, "“property list TYPE TYPE vertex_indices”"))
}
