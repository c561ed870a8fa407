//! Pictures to files, the format chosen by the file's extension.

use std::path::Path;

use crate::error::{Error, Result};
use crate::film::picture::Picture;
use crate::film::{atomic_file, exr_output, png_output};

/// What a picture can be written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// All layers, linear floats.
    Exr,
    /// The beauty layer, 8-bit sRGB.
    Png,
}

impl Format {
    /// The format that a path's extension names, in upper or lower case.
    ///
    /// # Errors
    ///
    /// [`Error::Options`] naming the known extensions.
    pub fn of(path: &Path) -> Result<Self> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("exr") => Ok(Format::Exr),
            Some("png") => Ok(Format::Png),
            Some(other) => Err(Error::Options(format!(
                "{}: cannot write .{other} pictures; known: .exr (all layers, linear floats), .png (8-bit sRGB)",
                path.display()
            ))),
            None => Err(Error::Options(format!(
                "{}: needs an extension that names the format: .exr (all layers, linear floats) or .png (8-bit sRGB)",
                path.display()
            ))),
        }
    }
}

/// Writes `picture` to `path`, whole or not at all. `exposure`, in stops, is for PNG; EXR stays linear.
///
/// # Errors
///
/// [`Error::Options`] for an unknown extension, [`Error::Encode`] for a picture that does not fit the format,
/// [`Error::Io`] if the file cannot be written; an earlier file is then untouched.
pub fn write(path: &Path, picture: &Picture, exposure: f32) -> Result<()> {
    match Format::of(path)? {
        Format::Exr => exr_output::write(path, picture),
        Format::Png => png_output::write(path, picture, exposure),
    }
}

/// Checks before a render that [`write()`] will know the format and may write the file, without touching it.
///
/// # Errors
///
/// [`Error::Options`] for an unknown extension, [`Error::Io`] if the file could not be written.
pub fn check(path: &Path) -> Result<()> {
    Format::of(path)?;
    atomic_file::check_writable(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats() {
        assert_eq!(Format::of(Path::new("a.b/c.EXR")).unwrap(), Format::Exr);
        assert_eq!(Format::of(Path::new("c.png")).unwrap(), Format::Png);
        for path in ["c.jpg", "exr", ".exr", ""] {
            let error = Format::of(Path::new(path)).unwrap_err();
            assert!(matches!(error, Error::Options(_)));
            assert!(error.to_string().contains(".exr") && error.to_string().contains(".png"), "{error}");
        }
    }
}
