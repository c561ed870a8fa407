//! `<instance_geometry>`: a geometry with a material for each of its primitives.

use super::document::{Document, Node, clip};
use super::geometry::{Geometries, Geometry, Primitive};
use super::materials::Materials;
use crate::error::{Note, Result};
use roxmltree::NodeId;
use std::collections::{HashMap, HashSet};
use std::rc::Rc;

/// A geometry with its materials.
pub(super) struct Bound<'a> {
    /// The geometry.
    pub geometry: Rc<Geometry<'a>>,
    /// Material numbers, one a primitive; a sphere has one.
    pub materials: Vec<u32>,
}

/// Resolves instances of geometries, each element once: the node it stands in may itself be instanced often.
pub(super) struct Bindings<'d, 'a> {
    document: &'d Document<'a>,
    /// The geometries read so far.
    pub geometries: Geometries<'d, 'a>,
    /// The materials in use so far.
    pub materials: Materials<'d, 'a>,
    bound: HashMap<NodeId, Rc<Bound<'a>>>,
    /// Elements without material about which there is a note already.
    unbound: HashSet<NodeId>,
}

impl<'d, 'a> Bindings<'d, 'a> {
    /// None resolved yet.
    pub fn new(document: &'d Document<'a>) -> Self {
        let (geometries, materials) = (Geometries::new(document), Materials::new(document));
        Bindings { document, geometries, materials, bound: HashMap::new(), unbound: HashSet::new() }
    }

    /// The geometry and materials of an `<instance_geometry>`.
    pub fn get(&mut self, instance: Node<'a>, notes: &mut Vec<Note>) -> Result<Rc<Bound<'a>>> {
        if let Some(bound) = self.bound.get(&instance.id()) {
            return Ok(Rc::clone(bound));
        }
        let document = self.document;
        let element = document.resolve(instance, "url", "geometry")?;
        let geometry = self.geometries.get(element, notes)?;
        let bindings: Vec<Node<'a>> = document
            .descend(instance, &["bind_material", "technique_common"])
            .map_or_else(Vec::new, |technique| document.children(technique, "instance_material").collect());
        let mut by_symbol = HashMap::new();
        for binding in &bindings {
            by_symbol.entry(binding.attribute("symbol").unwrap_or("")).or_insert(*binding);
        }
        // What has no symbol of its own (a sphere never has) takes the first binding, as the course does.
        let binding_of = |symbol: Option<&str>| match symbol {
            Some(symbol) => by_symbol.get(symbol).copied(),
            None => bindings.first().copied(),
        };
        let materials = match &*geometry {
            Geometry::Sphere { .. } => vec![self.material(element, None, binding_of(None), notes)?],
            Geometry::Mesh(primitives) => {
                let material = |primitive: &Primitive<'a>| {
                    self.material(primitive.node, primitive.symbol, binding_of(primitive.symbol), notes)
                };
                primitives.iter().map(material).collect::<Result<_>>()?
            }
        };
        let bound = Rc::new(Bound { geometry, materials });
        self.bound.insert(instance.id(), Rc::clone(&bound));
        Ok(bound)
    }

    /// The material number for a binding; the default, with a note, if there is none.
    fn material(
        &mut self,
        user: Node<'a>,
        symbol: Option<&str>,
        binding: Option<Node<'a>>,
        notes: &mut Vec<Note>,
    ) -> Result<u32> {
        if let Some(binding) = binding {
            let element = self.document.resolve(binding, "target", "material")?;
            return self.materials.get(element, notes);
        }
        if self.unbound.insert(user.id()) {
            let line = self.document.line(user);
            let to_symbol = symbol.map(|symbol| format!(" to \"{}\"", clip(symbol))).unwrap_or_default();
            notes.push(Note::info(format!("line {line}: no material is bound{to_symbol}: it becomes mid-grey")));
        }
        Ok(self.materials.default_material())
    }
}
