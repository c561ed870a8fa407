//! `<triangles>`, `<polylist>`, `<polygons>` and strips: from interleaved indices to an indexed triangle mesh.

use super::document::{Document, Node};
use super::geometry::{Geometries, Primitive};
use super::source::{Source, inputs};
use crate::error::Result;
use glam::DVec3;
use std::collections::HashMap;

/// Reads a primitive element.
pub(super) fn read<'a>(geometries: &mut Geometries<'_, 'a>, element: Node<'a>) -> Result<Primitive<'a>> {
    let document = geometries.document();
    let count = document.count_attribute(element, "count")?;
    let kind = element.tag_name().name();
    let lists: Vec<Node<'a>> = document.children(element, "p").collect();
    if let Some(holes) = document.child(element, "ph") {
        return Err(document.expected(holes, "a polygon with holes (<ph>)", "polygons without holes"));
    }
    if lists.is_empty() && count.unwrap_or(0) == 0 {
        return Ok(Builder::new(document, element, Inputs::none()).primitive);
    }
    let inputs = Inputs::read(geometries, element)?;
    let mut builder = Builder::new(document, element, inputs);
    let stated = |found: usize| match count {
        Some(count) if count != found as u64 => {
            let what = format!("<{kind} count=\"{count}\"> holds {found}");
            Err(document.expected(element, what, "as many as it says"))
        }
        _ => Ok(()),
    };
    match kind {
        "triangles" => {
            let mut found = 0;
            for list in lists {
                let corners = builder.corners(list)?;
                if corners.len() % 3 != 0 {
                    let what = format!("<triangles> with {} corners", corners.len());
                    return Err(document.expected(list, what, "a multiple of 3"));
                }
                found += corners.len() / 3;
                corners.chunks_exact(3).for_each(|triangle| builder.triangle([triangle[0], triangle[1], triangle[2]]));
            }
            stated(found)?;
        }
        "polylist" => {
            let sizes = match document.child(element, "vcount") {
                Some(vcount) => document.index_list(vcount)?,
                None => Vec::new(),
            };
            stated(sizes.len())?;
            let [list] = lists[..] else {
                let what = format!("a <polylist> with {} <p> elements", lists.len());
                return Err(document.expected(element, what, "one"));
            };
            let corners = builder.corners(list)?;
            let total: u64 = sizes.iter().map(|size| u64::from(*size)).sum();
            if total != corners.len() as u64 {
                let what = format!("<vcount> adds up to {total} corners, <p> holds {}", corners.len());
                return Err(document.expected(list, what, "the same number"));
            }
            let mut rest = corners.as_slice();
            for size in sizes {
                let (polygon, others) = rest.split_at(size as usize);
                rest = others;
                builder.polygon(geometries, polygon)?;
            }
        }
        "polygons" => {
            stated(lists.len())?;
            for list in lists {
                let corners = builder.corners(list)?;
                builder.polygon(geometries, &corners)?;
            }
        }
        _ => {
            stated(lists.len())?;
            for list in lists {
                let corners = builder.corners(list)?;
                for (number, window) in corners.windows(3).enumerate() {
                    let [a, b, c] = [window[0], window[1], window[2]];
                    match (kind, number % 2) {
                        ("trifans", _) => builder.triangle([corners[0], b, c]),
                        (_, 0) => builder.triangle([a, b, c]),
                        // Every other triangle of a strip is wound the other way.
                        _ => builder.triangle([b, a, c]),
                    }
                }
            }
        }
    }
    Ok(builder.primitive)
}

/// The inputs of a primitive that matter here.
struct Inputs<'a> {
    /// Indices a corner.
    stride: usize,
    /// Positions and the offset of their index.
    positions: Option<(usize, Source<'a>)>,
    /// Normals and the offset of their index.
    normals: Option<(usize, Source<'a>)>,
}

impl<'a> Inputs<'a> {
    fn none() -> Self {
        Inputs { stride: 1, positions: None, normals: None }
    }

    fn read(geometries: &mut Geometries<'_, 'a>, element: Node<'a>) -> Result<Self> {
        let document = geometries.document();
        let offset = |input: Node<'a>| -> Result<usize> {
            let offset = document.count_attribute(input, "offset")?.unwrap_or(0);
            // No list of indices is that wide; the length check would say so less clearly.
            if offset > 255 {
                return Err(document.expected(input, format!("an input offset of {offset}"), "at most 255"));
            }
            Ok(offset as usize)
        };
        let mut stride = 1;
        for input in document.children(element, "input") {
            stride = stride.max(offset(input)? + 1);
        }
        let Some(vertex) = inputs(element, "VERTEX").next() else {
            let what = format!("<{}> without a VERTEX input", element.tag_name().name());
            return Err(document.expected(element, what, "an <input semantic=\"VERTEX\">"));
        };
        let vertices = document.resolve(vertex, "source", "vertices")?;
        let (positions, shared_normals) = geometries.vertices(vertices)?;
        let normals = match (inputs(element, "NORMAL").next(), shared_normals) {
            (Some(normal), _) => Some((offset(normal)?, geometries.input_source(normal)?)),
            (None, Some(normals)) => Some((offset(vertex)?, normals)),
            (None, None) => None,
        };
        let positions = Some((offset(vertex)?, positions));
        Ok(Inputs { stride, positions, normals })
    }
}

/// A position and a normal index; the latter is 0 without normals.
type Corner = (u32, u32);

/// Gathers triangles and makes one vertex of each distinct corner.
struct Builder<'d, 'a> {
    document: &'d Document<'a>,
    inputs: Inputs<'a>,
    /// For each position the normal it first came with, and that vertex: in most meshes all there is. Empty where
    /// the element is too small for a table of its positions, lest many small ones share a large source.
    first: Vec<Option<(u32, u32)>>,
    /// The vertices of all other corners.
    others: HashMap<Corner, u32>,
    primitive: Primitive<'a>,
    /// Reused from polygon to polygon.
    split: Vec<[u32; 3]>,
}

impl<'d, 'a> Builder<'d, 'a> {
    fn new(document: &'d Document<'a>, element: Node<'a>, inputs: Inputs<'a>) -> Self {
        let primitive = Primitive {
            node: element,
            at: document.at(element),
            symbol: element.attribute("material"),
            positions: Vec::new(),
            normals: Vec::new(),
            triangles: Vec::new(),
            degenerate: 0,
        };
        let positions = inputs.positions.as_ref().map_or(0, |(_, positions)| positions.count);
        let first = if positions <= element.range().len() { vec![None; positions] } else { Vec::new() };
        Builder { document, inputs, first, others: HashMap::new(), primitive, split: Vec::new() }
    }

    /// The corners of a `<p>`, all indices checked.
    fn corners(&self, list: Node<'a>) -> Result<Vec<Corner>> {
        let indices = self.document.index_list(list)?;
        let stride = self.inputs.stride;
        if indices.len() % stride != 0 {
            let what = format!("<p> holds {} indices", indices.len());
            return Err(self.document.expected(list, what, format!("a multiple of {stride}, one an input")));
        }
        let Some((position_offset, positions)) = &self.inputs.positions else { return Ok(Vec::new()) };
        let check = |number: usize, offset: usize, source: &Source<'a>, what: &str| -> Result<u32> {
            let index = indices[number * stride + offset];
            if (index as usize) < source.count {
                return Ok(index);
            }
            let expected = match source.count {
                0 => format!("no index: there are no {what}s"),
                count => format!("0 to {}", count - 1),
            };
            let message = format!("{what} index {index} is out of range");
            Err(self.document.error_at_index(list, number * stride + offset, message, expected))
        };
        let corner = |number: usize| -> Result<Corner> {
            let position = check(number, *position_offset, positions, "position")?;
            let normal = match &self.inputs.normals {
                Some((offset, normals)) => check(number, *offset, normals, "normal")?,
                None => 0,
            };
            positions.check_finite(self.document, position as usize)?;
            Ok((position, normal))
        };
        (0..indices.len() / stride).map(corner).collect()
    }

    fn polygon(&mut self, geometries: &mut Geometries<'_, 'a>, corners: &[Corner]) -> Result<()> {
        match *corners {
            [a, b, c] => self.triangle([a, b, c]),
            [_, _, _, ..] => {
                let Some((_, positions)) = &self.inputs.positions else { return Ok(()) };
                let points: smallvec::SmallVec<[DVec3; 8]> =
                    corners.iter().map(|(position, _)| positions.get(*position as usize)).collect();
                let mut split = std::mem::take(&mut self.split);
                split.clear();
                geometries.splitter().split(&points, &mut split).map_err(|_| {
                    let what = format!("concave polygons with too many corners (this one has {})", corners.len());
                    self.document.expected(self.primitive.node, what, "smaller polygons, or triangles")
                })?;
                split.iter().for_each(|triangle| self.triangle(triangle.map(|corner| corners[corner as usize])));
                self.split = split;
            }
            _ => self.primitive.degenerate += 1,
        }
        Ok(())
    }

    fn triangle(&mut self, corners: [Corner; 3]) {
        let [a, b, c] = corners.map(|(position, _)| position);
        if a == b || b == c || c == a {
            self.primitive.degenerate += 1;
            return;
        }
        let triangle = corners.map(|corner| self.vertex(corner));
        self.primitive.triangles.push(triangle);
    }

    /// The vertex of a corner, made at its first use.
    fn vertex(&mut self, corner: Corner) -> u32 {
        // Positions never outnumber the 32-bit offsets of the text they come from.
        let fresh = self.primitive.positions.len() as u32;
        let vertex = match self.first.get_mut(corner.0 as usize) {
            Some(first @ None) => {
                *first = Some((corner.1, fresh));
                fresh
            }
            Some(Some((normal, vertex))) if *normal == corner.1 => *vertex,
            _ => *self.others.entry(corner).or_insert(fresh),
        };
        if vertex == fresh {
            if let Some((_, positions)) = &self.inputs.positions {
                self.primitive.positions.push(positions.get(corner.0 as usize));
            }
            if let Some((_, normals)) = &self.inputs.normals {
                self.primitive.normals.push(normals.get(corner.1 as usize));
            }
        }
        vertex
    }
}
