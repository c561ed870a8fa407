//! The acceleration structure of a scene: from the cache, or built and kept there.

use super::args::ReportArgs;
use super::budget::{self, Budget, Phase};
use super::exit::complain;
use super::load::{phase, timed};
use super::resolve::StorageRequest;
use crate::bvh::Accel;
use crate::cache::folder::Found;
use crate::cache::{Cache, Contents};
use crate::error::Result;
use crate::measure::progress::Progress;
use crate::measure::units;
use crate::options::AccelOptions;
use crate::scene::shapes::Shapes;
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

/// Predictions from here on are worth a line.
const LARGE: u64 = 512 << 20;

/// Where a tree came from.
#[derive(Clone, Debug, Serialize)]
pub struct Origin {
    /// `built` or `cache`.
    pub source: &'static str,
    /// The file that it was taken from or left in.
    pub file: Option<PathBuf>,
    /// Wall times.
    pub seconds: TreeSeconds,
    /// Memory of building it.
    pub memory: Option<Phase>,
}

/// Wall times, in seconds, of what it took to get a tree.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct TreeSeconds {
    /// Hashing the scene, to know the tree's name in the cache.
    pub hash: f64,
    /// Looking for it in the cache: mapping it, and checking it.
    pub load: f64,
    /// Building it.
    pub build: f64,
    /// Writing it to the cache.
    pub save: f64,
}

/// What is wanted.
pub struct Wanted<'a> {
    /// Name of the scene.
    pub name: &'a str,
    /// What rays can hit.
    pub shapes: &'a Shapes,
    /// How to build it.
    pub options: AccelOptions,
    /// Where to keep it.
    pub storage: &'a StorageRequest,
    /// What to say.
    pub report: ReportArgs,
}

/// A cache, and what the names of this scene's trees in it are made of.
type Kept<'a> = (&'a Cache, Contents);

impl Wanted<'_> {
    /// Gets the tree. What goes wrong with the cache is a warning: the tree is then built, or not kept.
    pub fn get(&self) -> Result<(Accel, Origin)> {
        let mut seconds = TreeSeconds::default();
        let mut kept = None;
        if let Some(cache) = self.cache() {
            let (contents, hash) = phase("hashing", !self.report.quiet, || Ok(Contents::of(self.shapes)))?;
            seconds.hash = hash;
            kept = Some((cache, contents));
        }
        if let Some(found) = self.look(kept, &self.options, &mut seconds)? {
            return Ok(found);
        }
        let budget = Budget { limit: self.storage.memory_limit };
        let (options, memory) = budget::tree_that_fits(self.options, self.shapes, &budget)?;
        if options != self.options
            && let Some(found) = self.look(kept, &options, &mut seconds)?
        {
            return Ok(found);
        }
        let (accel, memory) = self.build(&options, memory, &mut seconds)?;
        let file = self.keep(kept, &options, &accel, &mut seconds);
        Ok((accel, Origin { source: "built", file, seconds, memory: Some(memory) }))
    }

    /// Looks for a tree of these options in the cache.
    fn look(
        &self,
        kept: Option<Kept>,
        options: &AccelOptions,
        seconds: &mut TreeSeconds,
    ) -> Result<Option<(Accel, Origin)>> {
        let Some((cache, contents)) = kept else { return Ok(None) };
        let key = contents.key(options);
        let (found, load) =
            phase("loading the tree", !self.report.quiet, || Ok(cache.load(key, self.shapes, options)))?;
        seconds.load += load;
        match found {
            Found::Tree(accel) => {
                let origin = Origin { source: "cache", file: Some(cache.path(key)), seconds: *seconds, memory: None };
                return Ok(Some((*accel, origin)));
            }
            Found::Nothing => {}
            Found::Damaged(why) => {
                complain(&format!("warning: {}: {why}; the tree is built anew", cache.path(key).display()));
            }
        }
        Ok(None)
    }

    /// The cache, if it is meant for such a tree.
    fn cache(&self) -> Option<&Cache> {
        let kept = self.options.is_four_wide() && self.shapes.prim_count() > self.storage.cache_above;
        self.storage.cache.as_ref().filter(|_| kept)
    }

    fn build(&self, options: &AccelOptions, memory: Phase, seconds: &mut TreeSeconds) -> Result<(Accel, Phase)> {
        let needed = budget::tree(options, self.shapes.prim_count());
        if needed >= LARGE && !self.report.quiet {
            let (needed, all) = (units::bytes(needed), units::bytes(memory.predicted));
            complain(&format!("note: building the tree takes about {needed} of memory, {all} with the scene"));
        }
        let progress = match options.is_four_wide() {
            true => Progress::new("building", 1, !self.report.quiet),
            false => Progress::busy("building", !self.report.quiet),
        };
        let (accel, taken) = timed(progress, |progress| {
            Accel::build_watched(self.shapes, options, &|done, all| progress.set_of(done, all))
        })?;
        seconds.build = taken;
        Ok((accel, memory.done()))
    }

    /// Leaves the tree in the cache; its file.
    fn keep(
        &self,
        kept: Option<Kept>,
        options: &AccelOptions,
        accel: &Accel,
        seconds: &mut TreeSeconds,
    ) -> Option<PathBuf> {
        let ((cache, contents), tree) = kept.zip(accel.tree())?;
        let start = Instant::now();
        let progress = Progress::new("saving", 1, !self.report.quiet);
        let kept =
            cache.store(contents.key(options), tree, self.name, options, &|done, all| progress.set_of(done, all));
        progress.finish();
        seconds.save = start.elapsed().as_secs_f64();
        kept.inspect_err(|error| complain(&format!("warning: the tree is not kept: {error}"))).ok()
    }
}
