//! Trees of all configurations, each built once.

use crate::bvh::Accel;
use crate::cli::load::Loaded;
use crate::cli::resolve::RenderRequest;
use crate::cli::tree;
use crate::error::Result;
use crate::options::AccelOptions;

/// Trees of all configurations, each built once.
pub struct Trees {
    others: Vec<Accel>,
    kinds: Vec<AccelOptions>,
}

impl Trees {
    /// Gets the trees that are not there yet: the first is `loaded`'s.
    pub fn get(loaded: &Loaded, kinds: Vec<AccelOptions>, request: &RenderRequest) -> Result<Trees> {
        let (storage, report) = (&request.scene.storage, request.report);
        let get = |&options: &AccelOptions| {
            let shapes = &loaded.scene.shapes;
            Ok(tree::Wanted { name: &loaded.name, shapes, options, storage, report }.get()?.0)
        };
        Ok(Trees { others: kinds[1..].iter().map(get).collect::<Result<_>>()?, kinds })
    }

    /// All of them, in the order of kinds.
    pub fn all<'a>(&'a self, loaded: &'a Loaded) -> Vec<&'a Accel> {
        [&loaded.accel].into_iter().chain(&self.others).collect()
    }

    /// Which of [`Trees::all`] is of this kind.
    pub fn number(&self, kind: AccelOptions) -> usize {
        self.kinds.iter().position(|other| *other == kind).expect("all kinds are there")
    }
}
