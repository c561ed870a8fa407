//! What reports have in common: pages that need no other file and no script.

pub mod images;

use crate::error::{Error, Result};
use crate::film::atomic_file;
use crate::measure::plot::escape;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

/// Colours for screens that are light or dark, and for paper.
const STYLE: &str = include_str!("style.css");

/// A page: `title` is text, all else is HTML. Sections without content are left out.
pub fn page(title: &str, header: &str, sections: &[(&str, String)]) -> String {
    let mut body = String::new();
    for (heading, section) in sections.iter().filter(|(_, section)| !section.is_empty()) {
        let _ = write!(body, "<section><h2>{heading}</h2>\n{section}</section>\n");
    }
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{}</title>\n<style>\n{STYLE}</style></head>\n<body>\n{header}{body}</body></html>\n",
        escape(title)
    )
}

/// Writes a page, whole or not at all.
///
/// # Errors
/// The system's.
pub fn write(path: &Path, page: &str) -> Result<()> {
    atomic_file::write(path, |out| out.write_all(page.as_bytes()).map_err(|e| Error::io(path, "write", e)))
}

/// A table of cells that are HTML already; `class` of each row.
pub fn table(headings: &[&str], rows: impl Iterator<Item = (&'static str, Vec<String>)>) -> String {
    let head: String = headings.iter().map(|heading| format!("<th>{heading}</th>")).collect();
    let rows: String = rows
        .map(|(class, cells)| {
            let cells: String = cells.iter().map(|cell| format!("<td>{cell}</td>")).collect();
            format!("<tr class=\"{class}\">{cells}</tr>\n")
        })
        .collect();
    format!("<table><thead><tr>{head}</tr></thead><tbody>\n{rows}</tbody></table>\n")
}

/// Figures that matter most, each with what it is.
pub fn cards(cards: &[(String, String)]) -> String {
    let cards: String = cards
        .iter()
        .map(|(b, s)| format!("<div class=\"card\"><b>{}</b><span>{}</span></div>", escape(b), escape(s)))
        .collect();
    format!("<div class=\"cards\">{cards}</div>\n")
}

/// The command line, quoted where a shell needs it.
pub fn command() -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "_-./:,=+%@".contains(c);
    let quote = |argument: String| match !argument.is_empty() && argument.chars().all(plain) {
        true => argument,
        false => format!("'{}'", argument.replace('\'', "'\\''")),
    };
    let arguments = std::env::args_os().skip(1).map(|argument| quote(argument.to_string_lossy().into_owned()));
    ["comber".to_owned()].into_iter().chain(arguments).collect::<Vec<_>>().join(" ")
}
