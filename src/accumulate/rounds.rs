//! Renders until the mean is known well enough: rounds of independent samples, whose spread tells the error of their mean.

use super::{ROUND_SEEDS, Spread, seed};
use crate::bvh::Accel;
use crate::compare::relative::EPSILON;
use crate::drive::{self, Outcome};
use crate::error::Result;
use crate::film::picture::Picture;
use crate::observer::Observer;
use crate::options::{Cell, RenderOptions};
use crate::plan::Plan;
use crate::scene::Scene;
use crate::scene::camera::Camera;

/// Rounds before an end is thought of: the standard error of a standard error of 16 rounds is a fifth of it, and averages out over pixels.
pub const FEWEST: u32 = 16;

/// What is rendered.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its tree.
    pub accel: &'a Accel,
    /// From where it is seen.
    pub camera: &'a Camera,
    /// How. Samples and adaptive sampling are not asked for.
    pub options: &'a RenderOptions,
}

/// Samples a pixel of a round: 4 at first, twice as many every 16 rounds, 64 at most, so that a round stays short and what is lost with
/// one that is interrupted small.
pub fn samples(round: u32) -> u32 {
    4 << (round / 16).min(4)
}

/// Samples a pixel of so many rounds.
pub fn samples_of_all(rounds: u32) -> u64 {
    let growing = rounds.min(5 * 16);
    (0..growing).map(|round| u64::from(samples(round))).sum::<u64>() + u64::from(rounds - growing) * 64
}

impl Subject<'_> {
    /// Renders round number `round`. Its picture depends on the options and that number alone.
    ///
    /// # Errors
    /// Those of planning and rendering.
    pub fn round(&self, round: u32, observer: &dyn Observer) -> Result<Outcome> {
        let options = RenderOptions {
            samples: samples(round),
            seed: seed(self.options.seed, ROUND_SEEDS + round),
            adaptive: None,
            aovs: false,
            ..self.options.clone()
        };
        let plan = Plan::new(self.scene, self.accel, &options)?;
        drive::render(self.scene, self.accel, self.camera, &plan, observer)
    }

    /// Adds rounds to `spread` until the relative error of its mean is at most `target`; `false` if `observer` stopped it before, and then
    /// the round under way is left out. `after` is called after each round, with the error then.
    ///
    /// # Errors
    /// Those of planning and rendering, and what `after` returns.
    pub fn converge(
        &self,
        spread: &mut Spread,
        target: f64,
        observer: &dyn Observer,
        mut after: impl FnMut(&Spread, f64, &Outcome) -> Result<()>,
    ) -> Result<bool> {
        while spread.rounds < FEWEST || spread.relative_error(EPSILON) > target {
            let outcome = self.round(spread.rounds, observer)?;
            if outcome.stopped {
                return Ok(false);
            }
            spread.add(&outcome.picture.beauty, f64::from(samples(spread.rounds)))?;
            after(spread, spread.relative_error(EPSILON), &outcome)?;
            if observer.stop() {
                return Ok(spread.rounds >= FEWEST && spread.relative_error(EPSILON) <= target);
            }
        }
        Ok(true)
    }
}

/// The mean of `cell` as a picture with variances.
pub fn picture(spread: &Spread, cell: Cell, full: (u32, u32)) -> Picture {
    let samples = u32::try_from(samples_of_all(spread.rounds)).unwrap_or(u32::MAX);
    Picture {
        width: cell.width as usize,
        height: cell.height as usize,
        x: cell.x as usize,
        y: cell.y as usize,
        full: (full.0 as usize, full.1 as usize),
        beauty: spread.mean.iter().map(|mean| mean.map(|m| m as f32)).collect(),
        variance: Some((0..spread.mean.len()).map(|at| spread.variance_of_mean(at).map(|v| v as f32)).collect()),
        sample_count: Some(vec![samples; spread.mean.len()]),
        ..Picture::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_grow_to_a_limit() {
        assert_eq!([0, 15, 16, 63, 64, 1000, u32::MAX].map(samples), [4, 4, 8, 32, 64, 64, 64]);
        let mut sum = 0;
        for rounds in 0..200 {
            assert_eq!(samples_of_all(rounds), sum);
            sum += u64::from(samples(rounds));
        }
    }
}
