//! `<source>` elements: position and normal triples in number arrays.

use super::document::{Document, LocalName, Node, clip};
use crate::error::Result;
use glam::DVec3;
use roxmltree::NodeId;
use std::collections::HashMap;
use std::rc::Rc;

/// Positions and, where `<vertices>` has them, normals.
type Vertices<'a> = (Source<'a>, Option<Source<'a>>);

/// Reads sources, each once however many primitives share it.
#[derive(Default)]
pub(super) struct Sources<'a> {
    arrays: HashMap<NodeId, Rc<Vec<f64>>>,
    sources: HashMap<NodeId, Source<'a>>,
    vertices: HashMap<NodeId, Vertices<'a>>,
}

impl<'a> Sources<'a> {
    /// The source that an `<input>` names.
    pub fn of_input(&mut self, document: &Document<'a>, input: Node<'a>) -> Result<Source<'a>> {
        let element = document.resolve(input, "source", "source")?;
        self.get(document, element)
    }

    /// The positions of a `<vertices>` element, and its normals if it has any.
    pub fn vertices(&mut self, document: &Document<'a>, element: Node<'a>) -> Result<Vertices<'a>> {
        if let Some(vertices) = self.vertices.get(&element.id()) {
            return Ok(vertices.clone());
        }
        let Some(position) = inputs(element, "POSITION").next() else {
            let what = "<vertices> without a POSITION input";
            return Err(document.expected(element, what, "an <input semantic=\"POSITION\">"));
        };
        let positions = self.of_input(document, position)?;
        let normals = match inputs(element, "NORMAL").next() {
            Some(normal) => Some(self.of_input(document, normal)?),
            None => None,
        };
        self.vertices.insert(element.id(), (positions.clone(), normals.clone()));
        Ok((positions, normals))
    }

    /// The triples of a `<source>`.
    fn get(&mut self, document: &Document<'a>, element: Node<'a>) -> Result<Source<'a>> {
        if let Some(source) = self.sources.get(&element.id()) {
            return Ok(source.clone());
        }
        let source = self.read(document, element)?;
        self.sources.insert(element.id(), source.clone());
        Ok(source)
    }

    fn read(&mut self, document: &Document<'a>, element: Node<'a>) -> Result<Source<'a>> {
        let accessor = document.descend(element, &["technique_common", "accessor"]);
        let array_element = match accessor {
            Some(accessor) => document.resolve(accessor, "source", "float_array")?,
            None => document.required(element, "float_array")?,
        };
        let array = self.array(document, array_element)?;
        let attribute = |name, default| match accessor {
            Some(accessor) => Ok(document.count_attribute(accessor, name)?.unwrap_or(default)),
            None => Ok(default),
        };
        let stride = attribute("stride", if accessor.is_some() { 1 } else { 3 })?;
        let offset = attribute("offset", 0)?;
        // A parameter without a name is padding.
        let params: Vec<_> = accessor.map_or_else(Vec::new, |node| document.children(node, "param").collect());
        let named =
            |param: &Node<'a>| params.len() <= 3 || param.attribute("name").is_some_and(|name| !name.is_empty());
        let mut columns = params.iter().enumerate().filter(|(_, param)| named(param)).map(|(column, _)| column);
        let xyz = match (columns.next(), columns.next(), columns.next()) {
            (Some(x), Some(y), Some(z)) => [x, y, z],
            _ if params.is_empty() => [0, 1, 2],
            _ => return Err(document.expected(element, "a source with fewer than 3 parameters", "X, Y and Z")),
        };
        let at = accessor.unwrap_or(element);
        if stride <= xyz[2] as u64 {
            return Err(document.expected(at, format!("a stride of {stride}"), format!("at least {}", xyz[2] + 1)));
        }
        let held = (array.len() as u64).saturating_sub(offset);
        let fits = held.saturating_sub(xyz[2] as u64).div_ceil(stride);
        let count = attribute("count", fits)?;
        if count > fits {
            let what = format!("an accessor of {count} × {stride} numbers from {offset} into {}", array.len());
            return Err(document.expected(at, what, format!("a count of at most {fits}")));
        }
        // All are below the array's length now, or there is nothing to read.
        let [offset, stride, count] = [offset, stride, count].map(|value| usize::try_from(value).unwrap_or(usize::MAX));
        Ok(Source { array_element, array, offset, stride, count, xyz })
    }

    fn array(&mut self, document: &Document<'a>, element: Node<'a>) -> Result<Rc<Vec<f64>>> {
        if let Some(array) = self.arrays.get(&element.id()) {
            return Ok(Rc::clone(array));
        }
        let array = document.float_list(element)?;
        if let Some(count) = document.count_attribute(element, "count")?
            && count != array.len() as u64
        {
            let what = format!("<float_array count=\"{count}\"> holds {} numbers", array.len());
            return Err(document.expected(element, what, "as many as it says"));
        }
        let array = Rc::new(array);
        self.arrays.insert(element.id(), Rc::clone(&array));
        Ok(array)
    }
}

/// Triples in a number array.
#[derive(Clone)]
pub(super) struct Source<'a> {
    array_element: Node<'a>,
    array: Rc<Vec<f64>>,
    offset: usize,
    stride: usize,
    /// How many triples there are.
    pub count: usize,
    xyz: [usize; 3],
}

impl<'a> Source<'a> {
    /// Triple number `index`, which is below `count`.
    pub fn get(&self, index: usize) -> DVec3 {
        let start = self.offset + index * self.stride;
        DVec3::from(self.xyz.map(|column| self.array[start + column]))
    }

    /// An error at the first number of triple `index` that is not finite, if there is one.
    pub fn check_finite(&self, document: &Document<'a>, index: usize) -> Result<()> {
        let start = self.offset + index * self.stride;
        let bad = self.xyz.iter().map(|column| start + column).find(|index| !self.array[*index].is_finite());
        bad.map_or(Ok(()), |index| {
            let word = document.words(self.array_element).nth(index).unwrap_or("");
            let what = format!("the coordinate \"{}\"", clip(word));
            Err(document.error_at_index(self.array_element, index, what, "a finite number"))
        })
    }
}

/// The `<input>` children with a semantic.
pub(super) fn inputs<'a>(element: Node<'a>, semantic: &'static str) -> impl Iterator<Item = Node<'a>> {
    let inputs = element.children().filter(|child| child.has_tag_name_local("input"));
    inputs.filter(move |input| input.attribute("semantic") == Some(semantic))
}
