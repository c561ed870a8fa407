//! Speed against accuracy, measured: many short renders of each of several configurations, beside a reference.
//!
//! A short render that is repeated tells what one long render cannot: the error of its error, and how much of it more samples would
//! take away (A. Celarek, W. Jakob, M. Wimmer, J. Lehtinen, "Quantifying the Error of Light Transport Algorithms", CGF 38(4), 2019).
//!
//! | | |
//! |---|---|
//! | [`truth`] | what renders are compared with |
//! | [`mod@measure`] | renders in turns, within a budget of time |
//! | [`figures`] | what they say: time, error, bias and variance, efficiency |
//! | [`slope`] | how fast the error falls with the number of samples |
//! | [`front`] | which configurations no other beats |
//! | [`journal`] | finished renders on disk, to go on from |

pub mod figures;
pub mod front;
pub mod journal;
pub mod measure;
pub mod slope;
pub mod truth;

pub use measure::measure;

use crate::bench::probe::Reading;
use crate::options::RenderOptions;
use serde::{Deserialize, Serialize};

/// A way of rendering.
#[derive(Clone, Debug, Serialize)]
pub struct Configuration {
    /// The value of each knob, as typed.
    pub values: Vec<String>,
    /// What they come to.
    pub options: RenderOptions,
}

/// A finished render.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Of which configuration.
    pub configuration: u32,
    /// Which of its renders: 0, 1, ….
    pub run: u32,
    /// Its seed.
    pub seed: u32,
    /// Wall time of rendering.
    pub seconds: f64,
    /// Rays traced.
    pub rays: u64,
    /// Samples in the film.
    pub samples: u64,
    /// Samples that were left out because they were not finite.
    pub non_finite: u64,
    /// Mean squared difference from the reference.
    pub mse: f64,
    /// The same relative to the reference: relMSE.
    pub relmse: f64,
    /// The slower of the readings of the probe right before and after.
    pub probe: Reading,
}
