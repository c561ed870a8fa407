//! One set of rays, measured: candidates chosen, answers compared, turns taken.

use super::agreement::{self, Answers, Comparison};
use super::contest::Contestant;
use super::interleave::{Effort, Sample, Summary, interleave};
use super::kernels::{self, Kernel};
use super::probe::Probe;
use super::rays::RaySet;
use crate::bvh::{Accel, Brute, Query, Traversal, TraversalCounts};
use crate::options::Intersection;
use crate::peer::embree::modes::Mode;
use crate::peer::embree::scene::Tree;
use crate::scene::shapes::Shapes;
use crate::simd::Tier;
use serde::Serialize;
use std::time::Duration;

/// Who is to be measured, and how.
pub struct Contest<'a> {
    /// comber's tree.
    pub accel: &'a Accel,
    /// comber's kernels.
    pub kernels: Vec<Kernel>,
    /// Instruction set of those.
    pub tier: Tier,
    /// The peer's trees; none if there is no peer.
    pub trees: &'a [Tree],
    /// Part of the names of the peer's modes that are measured; all of them if empty.
    pub mode: &'a str,
    /// Every mode of the peer takes turns, not only the fastest three.
    pub all_modes: bool,
    /// Rays a call of streams that are not of all rays.
    pub wave: usize,
    /// Size of the scene.
    pub extent: f32,
    /// How often.
    pub effort: Effort,
}

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct SetReport {
    /// Name of the set.
    pub set: String,
    /// What is asked.
    pub query: Query,
    /// Rays in it.
    pub rays: usize,
    /// How many of them hit something.
    pub hits: usize,
    /// Threads that trace.
    pub threads: usize,
    /// Everyone who took turns: comber's kernels first.
    pub contestants: Vec<ContestantReport>,
    /// Index of the peer's mode with the highest median.
    pub best_peer: Option<usize>,
    /// A quick look at all of the peer's modes, which decided who took turns.
    pub modes: Vec<ModeReport>,
    /// Every sample of every contestant was disturbed.
    pub all_disturbed: bool,
}

/// One contestant.
#[derive(Clone, Debug, Serialize)]
pub struct ContestantReport {
    /// Kernel, or library, tree and mode.
    pub name: String,
    /// `comber` or `embree`.
    pub who: &'static str,
    /// Rays a second, all threads together.
    pub rate: Summary,
    /// This rate over that of the peer's best mode, turn by turn.
    pub ratio: Option<Summary>,
    /// Nodes, leaves and primitive tests of the whole set; comber's kernels only.
    pub counts: Option<TraversalCounts>,
    /// Rays whose answers are not those of the reference.
    pub disagreements: usize,
    /// Turn by turn.
    pub samples: Vec<Sample>,
}

/// A mode at a quick look.
#[derive(Clone, Debug, Serialize)]
pub struct ModeReport {
    /// Library, tree and mode.
    pub name: String,
    /// Rays a second: the better of two looks at a part of the set.
    pub rate: f64,
}

/// Answers that are not those of the reference.
#[derive(Debug)]
pub struct Disagreed {
    /// Whose.
    pub name: String,
    /// How many, and the first of them.
    pub comparison: Comparison,
}

/// Modes that take turns, unless all do.
const CANDIDATES: usize = 3;
/// The quick look takes one batch of so many.
const QUICK: usize = 8;

impl<'a> Contest<'a> {
    /// The reference: one ray after another.
    pub fn reference(&self) -> Contestant<'a> {
        self.comber(Kernel::Way(Traversal::Single))
    }

    fn comber(&self, kernel: Kernel) -> Contestant<'a> {
        Contestant::Comber { accel: self.accel, kernel, tier: self.tier }
    }

    /// All of the peer's modes that were asked for.
    pub fn modes(&self) -> Vec<Contestant<'a>> {
        let of = |tree: &'a Tree| {
            Mode::all(tree.device(), self.wave).into_iter().map(move |mode| Contestant::Embree { tree, mode })
        };
        self.trees.iter().flat_map(of).filter(|mode| mode.name().contains(self.mode)).collect()
    }

    /// Measures `set` on `threads` threads. `step` is called after each piece of work, with a word on it.
    ///
    /// # Errors
    /// Answers that disagree with the reference: figures of something wrong are worth nothing.
    pub fn measure(
        &self,
        set: &RaySet,
        threads: usize,
        probe: &mut Probe,
        mut step: impl FnMut(&str),
    ) -> Result<SetReport, Disagreed> {
        let mut contestants: Vec<Contestant> = self.kernels.iter().map(|&kernel| self.comber(kernel)).collect();
        let own = contestants.len();
        let mut modes = Vec::new();
        if !self.trees.is_empty() {
            step("choosing the peer's modes");
            let (quick, chosen) = self.quick_look(set, threads);
            modes = quick;
            contestants.extend(chosen);
        }
        step("comparing answers");
        let reference = self.reference().answers(set);
        let mut disagreements = Vec::new();
        for contestant in &contestants {
            let comparison = agreement::compare(set, self.extent, &reference, &contestant.answers(set));
            if comparison.fails(contestant.may_differ()) {
                return Err(Disagreed { name: contestant.name(), comparison });
            }
            disagreements.push(comparison.different);
        }
        let turns = interleave(contestants.len(), threads, self.effort, probe, |c| {
            step("measuring");
            contestants[c].turn(set, threads, self.effort.turn)
        });
        let median = |c: usize| turns.summary(c).rate.median;
        let best_peer = (own..contestants.len()).max_by(|&a, &b| median(a).total_cmp(&median(b)));
        let report = |(c, contestant): (usize, &Contestant)| ContestantReport {
            name: contestant.name(),
            who: if c < own { "comber" } else { "embree" },
            rate: turns.summary(c),
            ratio: best_peer.map(|best| turns.ratio(c, best)),
            counts: self.kernels.get(c).map(|&kernel| kernels::counts(self.accel, kernel, self.tier, set)),
            disagreements: disagreements[c],
            samples: turns.samples[c].clone(),
        };
        let contestants: Vec<_> = contestants.iter().enumerate().map(report).collect();
        Ok(SetReport {
            set: set.name.clone(),
            query: set.query,
            rays: set.rays.len(),
            hits: reference.hits(),
            threads,
            all_disturbed: contestants.iter().all(|contestant| contestant.rate.all_disturbed),
            contestants,
            best_peer,
            modes,
        })
    }

    /// The rates of all modes on a part of `set`, best first, and those that are to take turns.
    fn quick_look(&self, set: &RaySet, threads: usize) -> (Vec<ModeReport>, Vec<Contestant<'a>>) {
        let part = set.thinned(if set.batches.len() >= 2 * QUICK { QUICK } else { 1 });
        let look = |mode: Contestant<'a>| {
            let rate = (0..2).map(|_| mode.turn(&part, threads, Duration::ZERO).rate).fold(0.0, f64::max);
            (rate, mode)
        };
        let mut all: Vec<_> = self.modes().into_iter().map(look).collect();
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        let reports = all.iter().map(|(rate, mode)| ModeReport { name: mode.name(), rate: *rate }).collect();
        let count = if self.all_modes { all.len() } else { CANDIDATES };
        (reports, all.into_iter().take(count).map(|(_, mode)| mode).collect())
    }

    /// Compares the reference with the oracle that tests every primitive, on some rays spread over `set`; `None` if the scene
    /// is too large for that, or the test is the fast one, which makes up hits that the tree need not find. Gives the number of rays compared.
    ///
    /// # Errors
    /// Answers that differ: the two must be equal to the bit.
    pub fn spot_check(&self, set: &RaySet, shapes: &Shapes) -> Result<Option<usize>, Disagreed> {
        /// Primitive tests that are worth it: a second or so.
        const TESTS: usize = 100_000_000;
        /// Rays that are enough, and that are too few.
        const RAYS: (usize, usize) = (256, 16);
        if self.accel.intersection() == Intersection::Fast {
            return Ok(None);
        }
        let affordable = (TESTS / shapes.prim_count().max(1)).min(RAYS.0).min(set.rays.len());
        if affordable < RAYS.1.min(set.rays.len()) || set.rays.is_empty() {
            return Ok(None);
        }
        let rows = (0..affordable).map(|i| i * set.rays.len() / affordable);
        let mut rays = super::rays::Rays::default();
        rows.for_each(|row| rays.push(set.rays.all().ray(row)));
        let few = RaySet::in_waves(&set.name, set.query, rays, affordable, false);
        let brute = Accel::Brute(Brute::build(shapes, Intersection::Watertight), 0.0);
        let oracle = Contestant::Comber { accel: &brute, kernel: Kernel::Suited, tier: self.tier };
        let (expected, found) = (oracle.answers(&few), self.reference().answers(&few));
        if expected == found {
            return Ok(Some(affordable));
        }
        let comparison = agreement::compare(&few, 0.0, &expected, &found);
        Err(Disagreed { name: "the reference kernel (against every primitive)".into(), comparison })
    }
}

impl Answers {
    /// How many rays hit something.
    pub fn hits(&self) -> usize {
        match self {
            Answers::Closest(hits) => hits.iter().filter(|hit| hit.0.is_finite()).count(),
            Answers::Any(hits) => hits.iter().filter(|&&hit| hit).count(),
        }
    }
}
