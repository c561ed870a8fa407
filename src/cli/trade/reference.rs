//! The reference that renders are compared with: given, kept from an earlier call, or rendered.

use super::args::TradeOptions;
use crate::bvh::Accel;
use crate::cli::args::ReportArgs;
use crate::cli::diff;
use crate::cli::exit::complain;
use crate::cli::interrupt::Interrupt;
use crate::cli::load::Loaded;
use crate::cli::provenance::creation_time;
use crate::cli::reference::make::{Wanted, percent, picture, subject_of};
use crate::cli::reference::{reusable, write};
use crate::error::Result;
use crate::film::picture::Picture;
use crate::film::read::Found;
use crate::options::RenderOptions;
use serde_json::Value;
use std::path::Path;

/// The relative error of a reference, unless another is asked for.
const ERROR: f64 = 0.01;

/// The file that was named, if one was.
pub fn read(options: &TradeOptions) -> Result<Option<Found>> {
    let Some(path) = &options.reference else { return Ok(None) };
    diff::found(path, options.reference_stderr.as_deref(), None).map(Some)
}

/// What a reference is made of.
pub struct ToMake<'a> {
    /// The scene.
    pub loaded: &'a Loaded,
    /// The tree of `base`.
    pub accel: &'a Accel,
    /// How it is rendered: as asked for, without what is varied.
    pub base: &'a RenderOptions,
    /// Its error.
    pub options: &'a TradeOptions,
    /// Where it is kept.
    pub folder: Option<&'a Path>,
}

impl ToMake<'_> {
    /// The reference and what to call it; none if it was interrupted.
    pub fn get(&self, interrupt: &Interrupt, report: ReportArgs) -> Result<Option<(Found, String)>> {
        let target = self.options.reference_error.unwrap_or(ERROR);
        let path = self.folder.map(|folder| folder.join("reference.exr"));
        let about = subject_of(self.loaded, self.base);
        if let Some((path, kept)) = path.as_ref().and_then(|path| Some((path, reusable(path, &about, target)?))) {
            let error = kept.provenance["reference"]["relative_error"].as_f64().unwrap_or(f64::NAN);
            let name = format!("{}, rendered earlier to a relative error of {}", path.display(), percent(error));
            return Ok(Some((found(kept), name)));
        }
        let sums = self.folder.map(|folder| folder.join("reference.sums"));
        let made = Wanted {
            loaded: self.loaded,
            accel: self.accel,
            options: self.base,
            target,
            sums: sums.as_deref(),
            resume: self.options.resume,
            max_time: None,
            interrupt,
            show: !report.quiet,
        }
        .make()?;
        let error = percent(made.error);
        if !made.reached {
            let target = percent(target);
            complain(&format!("comber: interrupted: the error of the reference is {error} of {target}"));
            return Ok(None);
        }
        let name = match &path {
            Some(path) => {
                write(path, self.loaded, self.base, &made, &creation_time()?)?;
                format!("{}, rendered to a relative error of {error}", path.display())
            }
            None => format!("rendered to a relative error of {error}, and not kept"),
        };
        Ok(Some((found(picture(&made, self.base, Value::Object(Default::default()), about)), name)))
    }
}

fn found(picture: Picture) -> Found {
    let Picture { width, height, x, y, full, beauty, variance, .. } = picture;
    Found { width, height, x, y, full, colours: beauty, variance, ..Found::default() }
}
