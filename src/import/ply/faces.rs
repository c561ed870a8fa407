//! Faces as they are read, and as triangles.

use crate::import::polygon;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use smallvec::SmallVec;

/// Faces in file order. Polygons wait for their vertices, which may come later in the file.
#[derive(Default)]
pub struct Faces {
    /// The triangles among the faces.
    pub triangles: Vec<[u32; 3]>,
    /// Faces left out because two corners of a triangle are the same vertex.
    pub collapsed: u64,
    /// Faces left out because they have fewer than three corners.
    pub short: u64,
    polygons: Vec<Polygon>,
    corners: Vec<u32>,
}

#[derive(Clone, Copy)]
struct Polygon {
    /// How many triangles stand before it.
    before: usize,
    /// Where its corners end.
    end: usize,
}

/// What became of the faces.
pub struct Split {
    pub triangles: Vec<[u32; 3]>,
    pub collapsed: u64,
    /// Polygons whose triangles may not cover them.
    pub uncovered: u64,
}

/// Two corners are the same vertex.
pub fn collapsed([a, b, c]: [u32; 3]) -> bool {
    a == b || b == c || c == a
}

impl Faces {
    /// Adds one face.
    #[inline]
    pub fn push(&mut self, corners: &[u32]) {
        match *corners {
            [a, b, c] if collapsed([a, b, c]) => self.collapsed += 1,
            [a, b, c] => self.triangles.push([a, b, c]),
            [] | [_] | [_, _] => self.short += 1,
            _ => {
                self.corners.extend_from_slice(corners);
                self.polygons.push(Polygon { before: self.triangles.len(), end: self.corners.len() });
            }
        }
    }

    /// Adds a triangle strip: every vertex after the second makes a triangle, every other one turned over.
    ///
    /// Collapsed triangles are how strips turn corners, so they are not counted.
    pub fn push_strip(&mut self, strip: &[u32]) {
        for (number, corners) in strip.windows(3).enumerate() {
            let triangle = if number.is_multiple_of(2) { [0, 1, 2] } else { [1, 0, 2] }.map(|corner| corners[corner]);
            if !collapsed(triangle) {
                self.triangles.push(triangle);
            }
        }
    }

    /// Adds the faces that follow these in the file.
    pub fn append(&mut self, mut next: Faces) {
        self.collapsed += next.collapsed;
        self.short += next.short;
        if self.triangles.is_empty() && self.polygons.is_empty() {
            // Most files have one table of faces: nothing to copy.
            self.triangles = next.triangles;
            self.polygons = next.polygons;
            self.corners = next.corners;
            return;
        }
        let (triangles, corners) = (self.triangles.len(), self.corners.len());
        let moved = |p: &Polygon| Polygon { before: p.before + triangles, end: p.end + corners };
        self.polygons.extend(next.polygons.iter().map(moved));
        self.triangles.append(&mut next.triangles);
        self.corners.append(&mut next.corners);
    }

    /// Splits the polygons into triangles, in file order. `double` has the positions in double precision, or nothing.
    pub fn split(self, positions: &[Vec3], double: &[DVec3]) -> Split {
        if self.polygons.is_empty() {
            return Split { triangles: self.triangles, collapsed: self.collapsed, uncovered: 0 };
        }
        const BATCH: usize = 1 << 14;
        let batches: Vec<Split> = (0..self.polygons.len())
            .into_par_iter()
            .step_by(BATCH)
            .map(|first| self.split_batch(positions, double, first, (first + BATCH).min(self.polygons.len())))
            .collect();
        let mut all = Split { triangles: Vec::new(), collapsed: self.collapsed, uncovered: 0 };
        all.triangles.reserve(batches.iter().map(|batch| batch.triangles.len()).sum());
        for mut batch in batches {
            all.triangles.append(&mut batch.triangles);
            all.collapsed += batch.collapsed;
            all.uncovered += batch.uncovered;
        }
        all
    }

    /// The triangles of polygons `first..end`, and those between them; after the last, the rest.
    fn split_batch(&self, positions: &[Vec3], double: &[DVec3], first: usize, end: usize) -> Split {
        let mut split = Split { triangles: Vec::new(), collapsed: 0, uncovered: 0 };
        let before = |polygon: usize| self.polygons.get(polygon).copied();
        let previous = first.checked_sub(1).and_then(before).unwrap_or(Polygon { before: 0, end: 0 });
        let Polygon { before: mut done, end: mut corner } = previous;
        let mut places: SmallVec<[Vec3; 8]> = SmallVec::new();
        let mut triangles = polygon::Triangles::new();
        for polygon in &self.polygons[first..end] {
            split.triangles.extend_from_slice(&self.triangles[done..polygon.before]);
            let corners = &self.corners[corner..polygon.end];
            (done, corner) = (polygon.before, polygon.end);
            places.clear();
            match corners.first().and_then(|&index| double.get(index as usize)) {
                None => {
                    places.extend(corners.iter().map(|&i| positions.get(i as usize).copied().unwrap_or_default()));
                }
                // As seen from the first corner, so that rounding keeps its shape.
                Some(&from) => {
                    let place = |i: u32| double.get(i as usize).map_or(Vec3::ZERO, |p| (*p - from).as_vec3());
                    places.extend(corners.iter().map(|&i| place(i)));
                }
            }
            split.uncovered += u64::from(!polygon::triangulate(&places, &mut triangles));
            for triangle in triangles.iter().map(|triangle| triangle.map(|number| corners[number as usize])) {
                if collapsed(triangle) {
                    split.collapsed += 1;
                } else {
                    split.triangles.push(triangle);
                }
            }
        }
        if end == self.polygons.len() {
            split.triangles.extend_from_slice(&self.triangles[done..]);
        }
        split
    }
}
