//! Errors that say where: file, line or byte offset, what is wrong and what was expected.

use std::fmt;
use std::path::{Path, PathBuf};

/// A place in an input file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum At {
    /// The file as a whole.
    #[default]
    File,
    /// A line, counted from 1.
    Line(u64),
    /// A line and a column, both counted from 1.
    LineColumn(u64, u64),
    /// A byte offset, counted from 0.
    Byte(u64),
}

impl fmt::Display for At {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            At::File => Ok(()),
            At::Line(line) => write!(f, ":{line}"),
            At::LineColumn(line, column) => write!(f, ":{line}:{column}"),
            At::Byte(byte) => write!(f, ": byte {byte}"),
        }
    }
}

/// Everything that can go wrong between a command line and a picture.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system refused a file.
    #[error("{}: cannot {action}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What was tried, as a verb: `read`, `write`, `rename`.
        action: &'static str,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A scene file that cannot be used.
    #[error("{}{at}: {what}{}", path.display(), expected.as_ref().map(|e| format!("; expected {e}")).unwrap_or_default())]
    Import {
        /// The file.
        path: PathBuf,
        /// Where in it.
        at: At,
        /// What is wrong.
        what: String,
        /// What a usable file would hold there.
        expected: Option<String>,
    },
    /// A scene that was read but cannot be rendered (a material that is not modelled, no geometry, …).
    #[error("{0}")]
    Scene(String),
    /// Options that contradict each other or the scene.
    #[error("{0}")]
    Options(String),
    /// Pictures that cannot be compared.
    #[error("{0}")]
    Pictures(String),
    /// An image that cannot be encoded.
    #[error("{}: cannot encode: {what}", path.display())]
    Encode {
        /// The file that was to be written.
        path: PathBuf,
        /// The encoder's reason.
        what: String,
    },
}

/// The crate's result.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// An [`Error::Io`] for `path`.
    pub fn io(path: &Path, action: &'static str, source: std::io::Error) -> Self {
        Error::Io { path: path.to_path_buf(), action, source }
    }

    /// An [`Error::Import`] that says what is wrong at a place.
    pub fn import(path: &Path, at: At, what: impl Into<String>) -> Self {
        Error::Import { path: path.to_path_buf(), at, what: what.into(), expected: None }
    }

    /// An [`Error::Import`] that also says what was expected there.
    pub fn expected(path: &Path, at: At, what: impl Into<String>, expected: impl Into<String>) -> Self {
        Error::Import { path: path.to_path_buf(), at, what: what.into(), expected: Some(expected.into()) }
    }
}

/// Something the user should know about an input that is usable all the same.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// `true`: the picture may differ from what the file says. `false`: for information.
    pub warning: bool,
    /// One sentence, with the place where it has one.
    pub text: String,
}

impl Note {
    /// Information: nothing is lost.
    pub fn info(text: impl Into<String>) -> Self {
        Note { warning: false, text: text.into() }
    }

    /// A warning: something in the input was left out or replaced.
    pub fn warning(text: impl Into<String>) -> Self {
        Note { warning: true, text: text.into() }
    }
}
