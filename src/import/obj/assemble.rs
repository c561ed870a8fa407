//! Chunks into meshes: one a material, with positions and normals under one index.

use super::chunk::{Chunk, Corner, Event, NO_NORMAL};
use crate::error::Note;
use crate::import::lines::{Text, shown};
use crate::import::polygon;
use crate::scene::description::MeshDescription;
use glam::{DVec3, Vec3};
use smallvec::SmallVec;
use std::collections::HashMap;
use std::path::Path;

/// The meshes, and what was left out of them.
#[derive(Default)]
pub struct Assembly {
    pub meshes: Vec<MeshDescription>,
    /// The material's name, a mesh each; empty for none.
    pub materials: Vec<String>,
    /// Where each mesh starts.
    pub offsets: Vec<usize>,
    collapsed: u64,
    uncovered: u64,
    short: u64,
    thin: u64,
    unknown: Option<(u64, usize, String)>,
}

impl Assembly {
    /// Says what was left out.
    pub fn tell(&self, path: &Path, text: &Text, notes: &mut Vec<Note>) {
        let counts = [
            (self.short, "faces with fewer than three corners are left out"),
            (self.collapsed, "triangles that use a vertex twice are left out"),
            (
                self.uncovered,
                "polygons cross themselves or are too long to split well; their triangles may not cover them",
            ),
            (self.thin, "lines and points are left out"),
        ];
        for (count, what) in counts.into_iter().filter(|(count, _)| *count > 0) {
            notes.push(Note::warning(format!("{}: {count} {what}", path.display())));
        }
        if let Some((count, offset, word)) = &self.unknown {
            let place = format!("{}{}", path.display(), text.line(*offset));
            notes.push(Note::warning(format!("{place}: {word} is no known keyword; {count} such lines are ignored")));
        }
    }
}

/// The faces of one material: stretches of a chunk's faces.
struct Part<'a> {
    material: &'a [u8],
    groups: SmallVec<[&'a [u8]; 4]>,
    offset: usize,
    runs: Vec<Run>,
}

struct Run {
    chunk: usize,
    faces: std::ops::Range<usize>,
}

/// How many group names a mesh's name may hold.
const NAMES: usize = 4;

/// Makes one mesh of each material that has faces, in the order of first use.
pub fn assemble(mut chunks: Vec<Chunk>) -> Assembly {
    let mut assembly = Assembly::default();
    for chunk in &chunks {
        assembly.short += chunk.short;
        assembly.thin += chunk.thin;
        if let Some((count, offset, word)) = chunk.unknown {
            assembly.unknown.get_or_insert_with(|| (0, offset, shown(word))).0 += count;
        }
    }
    let positions = joined(&mut chunks, |chunk| &mut chunk.positions);
    let double = joined(&mut chunks, |chunk| &mut chunk.double);
    let normals = joined(&mut chunks, |chunk| &mut chunk.normals);
    let parts = parts(&chunks);
    let shared = parts.len() == 1 && chunks.iter().all(|chunk| chunk.corners.iter().all(|c| c.normal == NO_NORMAL));
    let mut unifier = Unifier::new(&positions, &double, &normals, shared);
    for part in &parts {
        let mut mesh = MeshDescription { name: name(part), ..MeshDescription::default() };
        unifier.start();
        for run in &part.runs {
            faces(&chunks[run.chunk], run, &mut unifier, &mut mesh, &mut assembly);
        }
        if mesh.triangles.is_empty() {
            continue;
        }
        if !unifier.any_normal {
            mesh.normals = Vec::new();
        }
        assembly.meshes.push(mesh);
        assembly.materials.push(String::from_utf8_lossy(part.material).into_owned());
        assembly.offsets.push(part.offset);
    }
    if shared && let Some(mesh) = assembly.meshes.first_mut() {
        mesh.positions = positions;
        mesh.double = double;
    }
    assembly
}

/// All chunks' vectors in one.
fn joined<'a, T>(chunks: &mut [Chunk<'a>], field: impl for<'b> Fn(&'b mut Chunk<'a>) -> &'b mut Vec<T>) -> Vec<T> {
    let mut all = Vec::with_capacity(chunks.iter_mut().map(|chunk| field(chunk).len()).sum());
    for chunk in chunks {
        all.append(field(chunk));
    }
    all
}

/// Sorts the faces by material.
fn parts<'a>(chunks: &[Chunk<'a>]) -> Vec<Part<'a>> {
    let mut parts: Vec<Part> = Vec::new();
    let mut numbers: HashMap<&[u8], usize> = HashMap::new();
    let (mut material, mut group): (&[u8], &[u8]) = (b"", b"");
    // Faces before any material start with the first face.
    let mut place = chunks.iter().find_map(|chunk| chunk.first).unwrap_or(0);
    for (number, chunk) in chunks.iter().enumerate() {
        let mut add = |faces: std::ops::Range<usize>, offset: usize, material, group: &'a [u8]| {
            if faces.is_empty() {
                return;
            }
            let part = *numbers.entry(material).or_insert_with(|| {
                parts.push(Part { material, groups: SmallVec::new(), offset, runs: Vec::new() });
                parts.len() - 1
            });
            let part = &mut parts[part];
            if part.groups.len() <= NAMES && !group.is_empty() && !part.groups.contains(&group) {
                part.groups.push(group);
            }
            part.runs.push(Run { chunk: number, faces });
        };
        let mut first = 0;
        for (next, offset, event) in &chunk.events {
            add(first..*next, place, material, group);
            first = *next;
            match event {
                Event::Material(name) => (material, place) = (name, *offset),
                Event::Group(name) => group = name,
                Event::Library(_) => {}
            }
        }
        add(first..chunk.faces.len(), place, material, group);
    }
    parts
}

/// The groups' names, then the material's.
fn name(part: &Part) -> String {
    let text = |name: &[u8]| String::from_utf8_lossy(name).into_owned();
    let mut names: Vec<_> = part.groups.iter().take(NAMES).map(|group| text(group)).collect();
    if part.groups.len() > NAMES {
        names.push("…".into());
    }
    let groups = names.join("+");
    match (groups.is_empty(), part.material.is_empty()) {
        (true, true) => "default".into(),
        (true, false) => text(part.material),
        (false, true) => groups,
        (false, false) => format!("{groups} ({})", text(part.material)),
    }
}

/// Adds the faces of a run, as triangles.
fn faces(chunk: &Chunk, run: &Run, unifier: &mut Unifier, mesh: &mut MeshDescription, assembly: &mut Assembly) {
    let mut vertices: SmallVec<[u32; 8]> = SmallVec::new();
    let mut places: SmallVec<[Vec3; 8]> = SmallVec::new();
    let mut triangles = polygon::Triangles::new();
    let mut start = run.faces.start.checked_sub(1).map_or(0, |before| chunk.faces[before] as usize);
    for &end in &chunk.faces[run.faces.clone()] {
        let corners = &chunk.corners[start..end as usize];
        start = end as usize;
        if corners.len() == 3 {
            triangles.clear();
            triangles.push([0, 1, 2]);
        } else {
            places.clear();
            places.extend(corners.iter().map(|corner| unifier.place(*corner, corners[0])));
            assembly.uncovered += u64::from(!polygon::triangulate(&places, &mut triangles));
        }
        vertices.clear();
        for corner in corners {
            vertices.push(unifier.vertex(*corner, mesh));
        }
        for triangle in &triangles {
            // By position: two vertices with different normals in one place are no triangle's edge either.
            let [a, b, c] = triangle.map(|number| corners[number as usize].position);
            if a == b || b == c || c == a {
                assembly.collapsed += 1;
            } else {
                mesh.triangles.push(triangle.map(|number| vertices[number as usize]));
            }
        }
    }
}

/// Gives every pair of position and normal that a mesh uses one vertex.
struct Unifier<'a> {
    positions: &'a [Vec3],
    /// Positions in double precision, or none.
    double: &'a [DVec3],
    normals: &'a [Vec3],
    /// Positions are the vertices: there is one mesh and it has no normals.
    shared: bool,
    any_normal: bool,
    mesh: u32,
    /// A position's first vertex: the mesh it was made for, its normal, its number. Most have no other.
    first: Vec<(u32, u32, u32)>,
    others: HashMap<Corner, u32>,
}

impl<'a> Unifier<'a> {
    fn new(positions: &'a [Vec3], double: &'a [DVec3], normals: &'a [Vec3], shared: bool) -> Self {
        let first = if shared { Vec::new() } else { vec![(0, 0, 0); positions.len()] };
        Self { positions, double, normals, shared, any_normal: false, mesh: 0, first, others: HashMap::new() }
    }

    /// Begins another mesh.
    fn start(&mut self) {
        self.mesh += 1;
        self.any_normal = false;
        self.others = HashMap::new();
    }

    /// Where a corner of a polygon lies; in double precision as seen from its first corner, so that rounding keeps its shape.
    fn place(&self, corner: Corner, first: Corner) -> Vec3 {
        match self.double.is_empty() {
            true => self.positions[corner.position as usize],
            false => (self.double[corner.position as usize] - self.double[first.position as usize]).as_vec3(),
        }
    }

    fn vertex(&mut self, corner: Corner, mesh: &mut MeshDescription) -> u32 {
        if self.shared {
            return corner.position;
        }
        let next = mesh.positions.len() as u32;
        let first = &mut self.first[corner.position as usize];
        let vertex = if first.0 != self.mesh {
            *first = (self.mesh, corner.normal, next);
            next
        } else if first.1 == corner.normal {
            first.2
        } else {
            *self.others.entry(corner).or_insert(next)
        };
        if vertex == next {
            mesh.positions.push(self.positions[corner.position as usize]);
            mesh.double.extend(self.double.get(corner.position as usize));
            let normal = self.normals.get(corner.normal as usize);
            self.any_normal |= normal.is_some();
            mesh.normals.push(normal.copied().unwrap_or_default());
        }
        vertex
    }
}
