//! Access to the XML tree: children by name, references by id, and errors that say where.

use super::lines::Lines;
use crate::error::{At, Error, Result};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::Path;

/// An element of the tree.
pub(super) type Node<'a> = roxmltree::Node<'a, 'a>;

/// Longest quotation from the file in a message or a name, in characters.
const MAX_QUOTE: usize = 80;

/// A parsed document with what is needed to find things in it.
pub(super) struct Document<'a> {
    path: &'a Path,
    lines: Lines<'a>,
    tree: &'a roxmltree::Document<'a>,
    /// Elements by tag name and id. Exporters reuse an id for elements of different kinds.
    ids: HashMap<(&'a str, &'a str), Target<'a>>,
    has_course_profile: bool,
}

/// What an id stands for.
enum Target<'a> {
    One(Node<'a>),
    /// Used by two elements of the same kind: an error when something refers to it.
    Ambiguous(Node<'a>, Node<'a>),
}

impl<'a> Document<'a> {
    /// Indexes `tree`.
    pub fn new(path: &'a Path, lines: Lines<'a>, tree: &'a roxmltree::Document<'a>) -> Self {
        let mut ids = HashMap::new();
        let mut has_course_profile = false;
        for node in tree.root().descendants().filter(|node| node.is_element()) {
            has_course_profile |= is_course_technique(node);
            let Some(id) = node.attribute("id") else { continue };
            match ids.entry((node.tag_name().name(), id)) {
                Entry::Vacant(entry) => {
                    entry.insert(Target::One(node));
                }
                Entry::Occupied(mut entry) => {
                    if let Target::One(first) = *entry.get() {
                        entry.insert(Target::Ambiguous(first, node));
                    }
                }
            }
        }
        Document { path, lines, tree, ids, has_course_profile }
    }

    /// The root element.
    pub fn root(&self) -> Node<'a> {
        self.tree.root_element()
    }

    /// Whether any `<technique>` carries a course profile.
    pub fn has_course_profile(&self) -> bool {
        self.has_course_profile
    }

    /// The first child element with a name.
    pub fn child(&self, node: Node<'a>, name: &str) -> Option<Node<'a>> {
        node.children().find(|child| child.has_tag_name_local(name))
    }

    /// All child elements with a name.
    pub fn children(&self, node: Node<'a>, name: &'static str) -> impl Iterator<Item = Node<'a>> + use<'a> {
        node.children().filter(move |child| child.has_tag_name_local(name))
    }

    /// The descendant reached by following child names, if all are there.
    pub fn descend(&self, node: Node<'a>, names: &[&str]) -> Option<Node<'a>> {
        names.iter().try_fold(node, |node, name| self.child(node, name))
    }

    /// The first child element with a name, or an error at `node`.
    pub fn required(&self, node: Node<'a>, name: &str) -> Result<Node<'a>> {
        self.child(node, name).ok_or_else(|| {
            let what = format!("<{}> without <{name}>", clip(node.tag_name().name()));
            self.expected(node, what, format!("a <{name}> element in it"))
        })
    }

    /// The value of an attribute, or an error at `node`.
    pub fn required_attribute(&self, node: Node<'a>, name: &str) -> Result<&'a str> {
        node.attribute(name).ok_or_else(|| {
            let what = format!("<{}> without the attribute {name}", clip(node.tag_name().name()));
            self.expected(node, what, "that attribute")
        })
    }

    /// The element with tag name `kind` that a reference such as `url="#id"` names.
    pub fn resolve(&self, node: Node<'a>, attribute: &str, kind: &'static str) -> Result<Node<'a>> {
        let url = self.required_attribute(node, attribute)?;
        let Some(id) = url.strip_prefix('#') else {
            let what = format!("the reference \"{}\" leaves the document", clip(url));
            return Err(self.expected(node, what, "\"#\" and the id of an element in this file"));
        };
        match self.ids.get(&(kind, id)) {
            Some(Target::One(target)) => Ok(*target),
            Some(Target::Ambiguous(first, second)) => {
                let (first, second) = (self.line(*first), self.line(*second));
                let what = format!("two <{kind}> elements have the id \"{}\": lines {first} and {second}", clip(id));
                Err(self.expected(node, what, "an id that is used once"))
            }
            None => Err(self.expected(
                node,
                format!("no <{kind}> has the id \"{}\"", clip(id)),
                format!("a reference to a <{kind}>"),
            )),
        }
    }

    /// What to call an element in messages: its name, else its id.
    pub fn name(&self, node: Node<'a>) -> String {
        let name = node.attribute("name").filter(|name| !name.is_empty()).or_else(|| node.attribute("id"));
        name.map_or_else(|| "(unnamed)".to_string(), clip)
    }

    /// The line an element starts on.
    pub fn line(&self, node: Node<'a>) -> u64 {
        self.lines.line(node.range().start)
    }

    /// The line an element starts on, as a place.
    pub fn at(&self, node: Node<'a>) -> At {
        At::Line(self.line(node))
    }

    /// An error at an element that says what was expected there.
    pub fn expected(&self, node: Node<'a>, what: impl Into<String>, expected: impl Into<String>) -> Error {
        Error::expected(self.path, self.lines.line_column(node.range().start), what, expected)
    }

    /// An error at a word of an element's text; at the element if the word is not literally in the file.
    pub fn error_at_word(
        &self,
        node: Node<'a>,
        word: &str,
        what: impl Into<String>,
        expected: impl Into<String>,
    ) -> Error {
        let offset = self.lines.offset_of(word).unwrap_or(node.range().start);
        Error::expected(self.path, self.lines.line_column(offset), what, expected)
    }
}

/// Whether an element is a `<technique>` of one of the course's profiles.
pub(super) fn is_course_technique(node: Node<'_>) -> bool {
    node.has_tag_name_local("technique") && matches!(node.attribute("profile"), Some("CGL" | "CMU462"))
}

/// Text from the file, cut to a length that suits a message.
pub(super) fn clip(text: &str) -> String {
    match text.char_indices().nth(MAX_QUOTE) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_string(),
    }
}

/// Tag names without regard to the namespace: files in circulation declare it, misspell it, or leave it out.
pub(super) trait LocalName {
    /// Whether this is an element with a local name.
    fn has_tag_name_local(&self, name: &str) -> bool;
}

impl LocalName for Node<'_> {
    fn has_tag_name_local(&self, name: &str) -> bool {
        self.is_element() && self.tag_name().name() == name
    }
}
