//! Numbers in element text.

use super::document::{Document, Node, clip};
use crate::error::Result;
use glam::Vec3;

impl<'a> Document<'a> {
    /// The blank-separated words of an element's text. Comments in between separate words too.
    pub fn words(&self, node: Node<'a>) -> impl Iterator<Item = &'a str> + use<'a> {
        let texts = node.children().filter(|child| child.is_text());
        texts.filter_map(|child| child.text()).flat_map(str::split_ascii_whitespace)
    }

    /// All numbers of an element's text, which may include NaN and infinities.
    pub fn float_list(&self, node: Node<'a>) -> Result<Vec<f64>> {
        self.words(node).map(|word| word.parse().map_err(|_| self.bad_word(node, word, "a number"))).collect()
    }

    /// All indices or counts of an element's text.
    pub fn index_list(&self, node: Node<'a>) -> Result<Vec<u32>> {
        let expected = "a whole number from 0 to 4294967295";
        self.words(node).map(|word| word.parse().map_err(|_| self.bad_word(node, word, expected))).collect()
    }

    /// Exactly `N` finite numbers.
    pub fn floats<const N: usize>(&self, node: Node<'a>) -> Result<[f64; N]> {
        let mut values = [0.0; N];
        let mut words = self.words(node);
        for (have, value) in values.iter_mut().enumerate() {
            let Some(word) = words.next() else {
                return Err(self.wrong_amount(node, &format!("only {have}"), &N.to_string()));
            };
            *value = self.finite(node, word)?;
        }
        match words.next() {
            Some(_) => Err(self.wrong_amount(node, &format!("more than {N}"), &N.to_string())),
            None => Ok(values),
        }
    }

    /// One finite number.
    pub fn float(&self, node: Node<'a>) -> Result<f64> {
        self.floats::<1>(node).map(|[value]| value)
    }

    /// A colour: three or four numbers, each finite and not negative; alpha is left out.
    pub fn color(&self, node: Node<'a>) -> Result<Vec3> {
        let mut channels = [0.0_f32; 4];
        let mut count = 0;
        for word in self.words(node).take(5) {
            let value = self.finite(node, word)? as f32;
            if !(value.is_finite() && value >= 0.0) {
                return Err(self.bad_word(node, word, "a colour channel: finite and not below 0"));
            }
            if let Some(channel) = channels.get_mut(count) {
                *channel = value;
            }
            count += 1;
        }
        match count {
            3 | 4 => Ok(Vec3::new(channels[0], channels[1], channels[2])),
            5.. => Err(self.wrong_amount(node, "more than 4", "3 or 4")),
            _ => Err(self.wrong_amount(node, &format!("only {count}"), "3 or 4")),
        }
    }

    /// An attribute that counts something, if it is there.
    pub fn count_attribute(&self, node: Node<'a>, name: &str) -> Result<Option<u64>> {
        let Some(text) = node.attribute(name) else { return Ok(None) };
        text.trim_ascii().parse().map(Some).map_err(|_| {
            let what = format!("{name}=\"{}\" in <{}>", clip(text), clip(node.tag_name().name()));
            self.expected(node, what, "a whole number")
        })
    }

    /// An error at word number `index` of an element's text.
    pub fn error_at_index(
        &self,
        node: Node<'a>,
        index: usize,
        what: impl Into<String>,
        expected: impl Into<String>,
    ) -> crate::error::Error {
        match self.words(node).nth(index) {
            Some(word) => self.error_at_word(node, word, what, expected),
            None => self.expected(node, what, expected),
        }
    }

    fn finite(&self, node: Node<'a>, word: &str) -> Result<f64> {
        match word.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(self.bad_word(node, word, "a finite number")),
        }
    }

    fn bad_word(&self, node: Node<'a>, word: &str, expected: &str) -> crate::error::Error {
        let what = format!("\"{}\" in <{}>", clip(word), clip(node.tag_name().name()));
        self.error_at_word(node, word, what, expected)
    }

    fn wrong_amount(&self, node: Node<'a>, have: &str, expected: &str) -> crate::error::Error {
        let what = format!("<{}> holds {have} numbers", clip(node.tag_name().name()));
        self.expected(node, what, expected)
    }
}
