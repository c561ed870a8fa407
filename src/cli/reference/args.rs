//! Arguments of `comber reference` as typed.

use crate::cli::args::{CameraArgs, FrameArgs, ReportArgs, SceneArgs, SpeedArgs, TransportArgs};
use crate::cli::values::{self, whole};
use clap::Args;
use std::path::PathBuf;
use std::time::Duration;

/// `comber reference`.
#[derive(Debug, Args)]
#[command(args_override_self = true, after_help = REFERENCE_NOTES)]
pub struct ReferenceArgs {
    /// Which scene.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// How well it is to be known.
    #[command(flatten)]
    pub target: TargetArgs,
    /// How large.
    #[command(flatten)]
    pub frame: FrameArgs,
    /// Which light.
    #[command(flatten)]
    pub transport: TransportArgs,
    /// From where.
    #[command(flatten)]
    pub camera: CameraArgs,
    /// How fast.
    #[command(flatten)]
    pub speed: SpeedArgs,
    /// What to say.
    #[command(flatten)]
    pub report: ReportArgs,
}

/// How well a reference is to be known, and where it goes.
#[derive(Debug, Args)]
#[command(next_help_heading = "Reference")]
pub struct TargetArgs {
    /// Render until the relative error of the picture is at most X, as in 0.005 or 0.5%: the root of the mean, over pixels
    /// and channels, of (standard error)² / (mean² + 0.01).
    #[arg(long, value_name = "X", value_parser = values::relative_error, allow_negative_numbers = true)]
    pub rel_error: f64,
    /// Write the picture and its standard errors here, and sums to go on from beside it.
    #[arg(short, long, visible_alias = "outfile", value_name = "FILE.exr", default_value = "reference.exr")]
    pub output: PathBuf,
    /// Give up after this time of rendering, as in 90s or 2h: the picture so far is written, and the exit status is 1.
    #[arg(long, value_name = "TIME", value_parser = values::span, allow_negative_numbers = true)]
    pub max_time: Option<Duration>,
    /// Go on from the sums that an earlier call with the same options has kept; X may be another.
    #[arg(long)]
    pub resume: bool,
    /// Seed from which those of all rounds follow.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = whole(0, u32::MAX),
          allow_negative_numbers = true)]
    pub seed: u32,
}

const REFERENCE_NOTES: &str = "\
Rounds of 4 to 64 samples a pixel are rendered, each with a seed of its own. Standard errors follow from the spread \
between rounds, of which there are 16 at least; they are stored as variances, as in the EXR files of `comber render`, and \
`comber diff` and `comber trade` use them.

The sums of all rounds are kept beside FILE.exr (FILE.sums, 48 bytes a pixel) every ten seconds and at the end. After an \
interruption, --resume goes on and ends with the same picture, byte for byte, as if it had not been interrupted; it also \
makes a finished picture better. Without --resume, all begins anew.

Examples:
  comber reference box.dae --rel-error 0.01 -o box_reference.exr
  comber reference box.dae --rel-error 0.2% --max-time 2h -o box_reference.exr
  comber reference box.dae --rel-error 0.2% --resume -o box_reference.exr
  comber diff box.exr box_reference.exr

Exit status: 0 done, 1 failed or not reached in time, 2 misused, 130 interrupted: the picture so far is written.";
