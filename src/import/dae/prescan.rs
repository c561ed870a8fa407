//! A look at the bytes before the XML parser sees them: nesting, attributes and namespaces within limits.
//!
//! The tree parser compares each attribute with the others of its tag and copies namespaces from tag to tag, so a
//! hostile file could make it quadratic; and a document nested a million deep is no scene.

/// Deepest nesting of elements.
const MAX_DEPTH: usize = 1024;
/// Longest tag in bytes, from `<` to `>`.
const MAX_TAG: usize = 1 << 16;
/// Most attributes of one element.
const MAX_ATTRIBUTES: usize = 256;
/// Most `xmlns` declarations in the document.
const MAX_NAMESPACES: usize = 256;

/// A limit that the document exceeds.
#[derive(Debug)]
pub(super) struct Excess {
    /// Byte offset of the tag.
    pub offset: usize,
    /// What is too much.
    pub what: String,
    /// The limit.
    pub expected: String,
}

/// Checks `text` against the limits. Text that is no XML passes: the parser has the better messages.
pub(super) fn check(text: &str) -> Result<(), Excess> {
    let mut depth = 0_usize;
    let mut namespaces = 0_usize;
    let mut at = 0_usize;
    while let Some(found) = text.as_bytes()[at..].iter().position(|byte| *byte == b'<') {
        let start = at + found;
        let rest = &text[start..];
        // Declarations other than comments and CDATA end the scan: the parser refuses them.
        let (open, close) = match rest.as_bytes().get(1) {
            Some(b'!') if rest.starts_with("<!--") => ("<!--", "-->"),
            Some(b'!') if rest.starts_with("<![CDATA[") => ("<![CDATA[", "]]>"),
            Some(b'!') => return Ok(()),
            Some(b'?') => ("<?", "?>"),
            _ => ("", ""),
        };
        if !open.is_empty() {
            let Some(end) = rest[open.len()..].find(close) else { return Ok(()) };
            at = start + open.len() + end + close.len();
            continue;
        }
        let excess = |what: String, expected: String| Excess { offset: start, what, expected };
        let Some(tag) = Tag::scan(rest.as_bytes()) else {
            return if rest.len() > MAX_TAG { Err(excess(long_tag(), tag_limit())) } else { Ok(()) };
        };
        if tag.length > MAX_TAG {
            return Err(excess(long_tag(), tag_limit()));
        }
        if tag.attributes > MAX_ATTRIBUTES {
            let what = format!("an element with {} attributes", tag.attributes);
            return Err(excess(what, format!("at most {MAX_ATTRIBUTES}")));
        }
        namespaces += rest[..tag.length].matches("xmlns").count();
        if namespaces > MAX_NAMESPACES {
            return Err(excess("too many xmlns declarations".into(), format!("at most {MAX_NAMESPACES}")));
        }
        if rest.starts_with("</") {
            depth = depth.saturating_sub(1);
        } else if !tag.empty {
            depth += 1;
            if depth > MAX_DEPTH {
                let what = format!("elements are nested more than {MAX_DEPTH} deep");
                return Err(excess(what, "a document that is less deep".into()));
            }
        }
        at = start + tag.length;
    }
    Ok(())
}

fn long_tag() -> String {
    format!("a tag longer than {MAX_TAG} bytes")
}

fn tag_limit() -> String {
    "element names and attributes of ordinary length".into()
}

/// The extent of one tag.
struct Tag {
    /// Bytes up to and including `>`.
    length: usize,
    /// How many `=` stand outside quotes.
    attributes: usize,
    /// Closes itself: `<a/>`.
    empty: bool,
}

impl Tag {
    /// Scans the tag at the start of `bytes`; nothing if it does not end within the limit.
    fn scan(bytes: &[u8]) -> Option<Tag> {
        let mut quote = None;
        let mut attributes = 0;
        for (offset, byte) in bytes.iter().enumerate().take(MAX_TAG + 1).skip(1) {
            match (quote, *byte) {
                (Some(open), byte) if byte == open => quote = None,
                (Some(_), _) => {}
                (None, b'"' | b'\'') => quote = Some(*byte),
                (None, b'=') => attributes += 1,
                (None, b'>') => {
                    return Some(Tag { length: offset + 1, attributes, empty: bytes[offset - 1] == b'/' });
                }
                (None, _) => {}
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ordinary_documents_pass() {
        for text in ["", "no xml", "<a", "<a><b c='>' d=\"<\"/></a>", "<?xml?><!-- <a><a> --><a><![CDATA[<b>]]></a>"] {
            check(text).unwrap();
        }
        let wide = "<a/>".repeat(10 * MAX_DEPTH);
        check(&wide).unwrap();
        let siblings = "<a></a>".repeat(10 * MAX_DEPTH);
        check(&siblings).unwrap();
    }

    #[test]
    fn depth_is_limited() {
        check(&"<a>".repeat(MAX_DEPTH)).unwrap();
        let excess = check(&"<a>".repeat(1_000_000)).unwrap_err();
        assert_eq!(excess.offset, 3 * MAX_DEPTH);
        assert!(excess.what.contains("nested"), "{}", excess.what);
    }

    #[test]
    fn tags_are_limited() {
        assert!(check(&format!("<a b='{}'/>", "x".repeat(2 * MAX_TAG))).unwrap_err().what.contains("longer"));
        assert!(check(&"<a".repeat(MAX_TAG)).unwrap_err().what.contains("longer"));
        let many: String = (0..300).map(|i| format!(" a{i}=''")).collect();
        assert!(check(&format!("<a{many}/>")).unwrap_err().what.contains("300 attributes"));
        let spaces: String = (0..300).map(|i| format!("<a xmlns:n{i}='u'/>")).collect();
        assert!(check(&spaces).unwrap_err().what.contains("xmlns"));
    }
}
