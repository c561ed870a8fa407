//! `<geometry>` elements: spheres of the course's profiles, and meshes with their sources.

use super::document::{Document, Node, is_course_technique};
use super::polygon::Splitter;
use super::primitives;
use super::source::{Source, Sources};
use crate::error::{At, Note, Result};
use glam::DVec3;
use roxmltree::NodeId;
use std::collections::HashMap;
use std::rc::Rc;

/// A geometry in its local frame.
pub(super) enum Geometry<'a> {
    /// A sphere about the origin.
    Sphere {
        /// Radius, above 0.
        radius: f64,
    },
    /// Primitives, each with its own material symbol.
    Mesh(Vec<Primitive<'a>>),
}

/// One `<triangles>`, `<polylist>` or `<polygons>` as an indexed triangle mesh.
pub(super) struct Primitive<'a> {
    /// The element, to report something about it once however often it is instanced.
    pub node: Node<'a>,
    /// Where it stands.
    pub at: At,
    /// The symbol that the instance binds a material to.
    pub symbol: Option<&'a str>,
    /// Finite positions, one a distinct pair of position and normal.
    pub positions: Vec<DVec3>,
    /// Normals as the file states them, one a position, or empty.
    pub normals: Vec<DVec3>,
    /// Indices into the positions.
    pub triangles: Vec<[u32; 3]>,
    /// Triangles and polygons that were left out: two corners the same, or fewer than three.
    pub degenerate: usize,
}

/// Reads geometries, each once.
pub(super) struct Geometries<'d, 'a> {
    document: &'d Document<'a>,
    read: HashMap<NodeId, Rc<Geometry<'a>>>,
    sources: Sources<'a>,
    splitter: Splitter,
}

impl<'d, 'a> Geometries<'d, 'a> {
    /// None read yet.
    pub fn new(document: &'d Document<'a>) -> Self {
        Geometries { document, read: HashMap::new(), sources: Sources::default(), splitter: Splitter::new() }
    }

    /// The geometry of a `<geometry>` element.
    pub fn get(&mut self, element: Node<'a>, notes: &mut Vec<Note>) -> Result<Rc<Geometry<'a>>> {
        if let Some(geometry) = self.read.get(&element.id()) {
            return Ok(Rc::clone(geometry));
        }
        let geometry = Rc::new(match self.sphere(element)? {
            Some(sphere) => sphere,
            None => Geometry::Mesh(self.mesh(element, notes)?),
        });
        self.read.insert(element.id(), Rc::clone(&geometry));
        Ok(geometry)
    }

    /// How many polygons of the geometries read so far cross themselves.
    pub fn crossing_polygons(&self) -> usize {
        self.splitter.crossing
    }

    fn sphere(&self, element: Node<'a>) -> Result<Option<Geometry<'a>>> {
        let document = self.document;
        let techniques = document.children(element, "extra").flat_map(|extra| document.children(extra, "technique"));
        let sphere =
            techniques.filter(|node| is_course_technique(*node)).find_map(|node| document.child(node, "sphere"));
        let Some(sphere) = sphere else { return Ok(None) };
        let element = document.required(sphere, "radius")?;
        let radius = document.float(element)?;
        if radius > 0.0 {
            Ok(Some(Geometry::Sphere { radius }))
        } else {
            Err(document.expected(element, format!("a sphere of radius {radius}"), "a radius above 0"))
        }
    }

    fn mesh(&mut self, element: Node<'a>, notes: &mut Vec<Note>) -> Result<Vec<Primitive<'a>>> {
        let document = self.document;
        let Some(mesh) = document.child(element, "mesh") else {
            let (name, line) = (document.name(element), document.line(element));
            notes.push(Note::warning(format!("line {line}: geometry {name} holds no <mesh>: left out")));
            return Ok(Vec::new());
        };
        let mut primitives = Vec::new();
        for child in mesh.children().filter(|child| child.is_element()) {
            let name = child.tag_name().name();
            match name {
                "triangles" | "polylist" | "polygons" | "tristrips" | "trifans" => {
                    primitives.push(primitives::read(self, child)?);
                }
                "lines" | "linestrips" => {
                    let (geometry, line) = (document.name(element), document.line(child));
                    notes.push(Note::warning(format!("line {line}: <{name}> in geometry {geometry}: left out")));
                }
                _ => {}
            }
        }
        Ok(primitives)
    }

    /// The document.
    pub fn document(&self) -> &'d Document<'a> {
        self.document
    }

    /// The polygon splitter, whose budget is for the whole document.
    pub fn splitter(&mut self) -> &mut Splitter {
        &mut self.splitter
    }

    /// The positions of a `<vertices>` element, and its normals if it has any.
    pub fn vertices(&mut self, element: Node<'a>) -> Result<(Source<'a>, Option<Source<'a>>)> {
        self.sources.vertices(self.document, element)
    }

    /// The source that an `<input>` names.
    pub fn input_source(&mut self, input: Node<'a>) -> Result<Source<'a>> {
        self.sources.of_input(self.document, input)
    }
}
