//! The files that a comparison leaves.

use super::args::DiffArgs;
use super::{Diffed, html, maps};
use crate::error::Result;
use crate::film::heatmap;
use std::path::{Path, PathBuf};

/// Where to leave what.
pub struct Files<'a> {
    html: Option<&'a Path>,
    /// Start of the names of pictures.
    name: Option<PathBuf>,
}

impl<'a> Files<'a> {
    /// As `args` ask.
    pub fn new(args: &'a DiffArgs) -> Files<'a> {
        let name = args.output.as_ref().map(|output| {
            let ends_as_one = output.as_os_str().as_encoded_bytes().ends_with(b"/");
            if ends_as_one || output.is_dir() { output.join("diff") } else { output.clone() }
        });
        Files { html: args.html.as_deref(), name }
    }

    /// All that may be written.
    pub fn paths(&self) -> Vec<PathBuf> {
        let pictures = self.name.iter().flat_map(|name| maps::ENDS.iter().map(|end| ending(name, end)));
        self.html.iter().map(|path| path.to_path_buf()).chain(pictures).collect()
    }

    /// Writes all of them, and says which there are.
    pub fn write(&self, diffed: &Diffed) -> Result<Vec<PathBuf>> {
        if self.html.is_none() && self.name.is_none() {
            return Ok(Vec::new());
        }
        let maps = maps::all(diffed);
        let mut written = Vec::new();
        if let Some(name) = &self.name {
            for map in &maps {
                let path = ending(name, map.end);
                heatmap::write(&path, &map.heat_map(diffed.pair))?;
                written.push(path);
            }
        }
        if let Some(path) = self.html {
            crate::cli::html::write(path, &html::page(diffed, &maps))?;
            written.push(path.to_path_buf());
        }
        Ok(written)
    }
}

fn ending(name: &Path, end: &str) -> PathBuf {
    let mut path = name.as_os_str().to_owned();
    path.push(format!("_{end}.png"));
    path.into()
}
