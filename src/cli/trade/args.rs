//! Arguments of `comber trade` as typed.

use super::knobs::{self, KNOBS, Knob};
use crate::cli::args::{CameraArgs, FrameArgs, ReportArgs, SamplingArgs, SceneArgs, SpeedArgs, TransportArgs};
use crate::cli::values::{self, whole};
use clap::Args;
use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

/// `comber trade`.
#[derive(Debug, Args)]
#[command(args_override_self = true, after_help = notes())]
pub struct TradeArgs {
    /// Which scene.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// What is measured.
    #[command(flatten)]
    pub trade: TradeOptions,
    /// How large.
    #[command(flatten)]
    pub frame: FrameArgs,
    /// How many samples.
    #[command(flatten)]
    pub sampling: SamplingArgs,
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

/// What is measured, and where it goes.
#[derive(Debug, Args)]
#[command(next_help_heading = "Trade")]
pub struct TradeOptions {
    /// Measure each of these values of a knob; given several times, all combinations. Knobs are listed below.
    #[arg(long, value_name = "KNOB=V1,V2,…", value_parser = variation, required = true)]
    pub vary: Vec<Variation>,
    /// The picture that renders are compared with: OpenEXR, PFM or PNG. Without -r, its size is that of renders
    /// [default: one is rendered as the options say, without what is varied].
    #[arg(long, value_name = "FILE")]
    pub reference: Option<PathBuf>,
    /// Standard errors of the reference, as a picture of the same size. EXR files of comber hold their own.
    #[arg(long, value_name = "FILE", requires = "reference")]
    pub reference_stderr: Option<PathBuf>,
    /// The relative error of a reference that is rendered, as in `comber reference` [default: 0.01].
    #[arg(long, value_name = "X", value_parser = values::relative_error, conflicts_with = "reference",
          allow_negative_numbers = true)]
    pub reference_error: Option<f64>,
    /// Renders of each combination [default: 16; with --budget, as many as it has time for].
    #[arg(long, value_name = "N", value_parser = whole(1, 100_000), allow_negative_numbers = true)]
    pub runs: Option<u32>,
    /// Measure for no longer than this, as in 90s or 10m. Loading, building and a reference that is rendered come on top.
    #[arg(long, value_name = "TIME", value_parser = values::span, allow_negative_numbers = true)]
    pub budget: Option<Duration>,
    /// Go on from the renders that an earlier call with the same options has kept.
    #[arg(long)]
    pub resume: bool,
    /// Write the table as comma-separated values.
    #[arg(long, value_name = "FILE.csv")]
    pub csv: Option<PathBuf>,
    /// Write a report to look at in a browser, with pictures at equal time: one file that needs no other.
    #[arg(long, value_name = "FILE.html")]
    pub html: Option<PathBuf>,
}

/// A knob and its values.
#[derive(Clone)]
pub struct Variation {
    /// Which.
    pub knob: &'static Knob,
    /// As typed.
    pub values: Vec<String>,
}

impl fmt::Debug for Variation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.knob.name, self.values.join(","))
    }
}

/// `KNOB=V1,V2,…`. What values may be is for the knob to say, when all are known.
pub fn variation(text: &str) -> Result<Variation, String> {
    let Some((name, values)) = text.split_once('=') else {
        return Err("must be KNOB=V1,V2,…, as in samples=1,4,16".into());
    };
    let Some(knob) = knobs::find(name) else {
        let names: Vec<&str> = KNOBS.iter().map(|knob| knob.name).collect();
        return Err(format!("there is no knob '{name}', but {}", names.join(", ")));
    };
    let values: Vec<String> = values.split(',').map(str::to_owned).collect();
    for (index, value) in values.iter().enumerate() {
        if value.is_empty() {
            return Err(format!("a value of {name} is empty"));
        }
        if values[..index].contains(value) {
            return Err(format!("{name} has the value {value} twice"));
        }
    }
    Ok(Variation { knob, values })
}

fn notes() -> String {
    let widest = KNOBS.iter().map(|knob| knob.name.len()).max().unwrap_or(0);
    let knob = |knob: &Knob| format!("  {:widest$}  {}", knob.name, hanging(knob.help, widest + 4));
    NOTES.replace("KNOBS", &KNOBS.iter().map(knob).collect::<Vec<_>>().join("\n"))
}

/// Breaks a text into lines, all but the first indented, that fit the width of help.
fn hanging(text: &str, indent: usize) -> String {
    const WIDTH: usize = 98;
    let (mut broken, mut column) = (String::new(), indent);
    for (index, word) in text.split(' ').enumerate() {
        let length = word.chars().count();
        if column + 1 + length > WIDTH {
            broken += &format!("\n{:indent$}", "");
            column = indent;
        } else if index > 0 {
            broken.push(' ');
            column += 1;
        }
        broken += word;
        column += length;
    }
    broken
}

const NOTES: &str = "\
Every combination is rendered many times with different seeds, in turns, and each render is compared with the reference. \
Reported are time (median and quartiles), rays a second, MSE and relMSE (epsilon 0.01) with their standard errors, the part of \
MSE that is bias, efficiency 1/(MSE x time), the slope of MSE against samples, and which combinations no other beats. Noise \
that the reference is known to have is taken off.

Knobs, with what they cost and gain (time and relative MSE, in units of those of the default, on two Cornell boxes and the dragon at 64 \
samples; profiling/knobs.py measures it):
KNOBS

With --html or --csv, finished renders are kept in a folder beside the file (NAME.trade), as is a reference that was rendered; \
a process that is stopped or killed loses one render at most, and --resume goes on.

Examples:
  comber trade box.dae --vary samples=1,4,16,64 --vary direct=light,mis
  comber trade box.dae --vary depth=2,5,20 --reference deep.exr --html depth.html --csv depth.csv
  comber trade --vary bvh=fast,default,best --vary samples=1,16 --budget 2m
  comber trade box.dae --vary tolerance=0.2,0.1,0.05 -s 4096 -a 16 0.1 --runs 32 --json

Exit status: 0 done, 1 failed, 2 misused, 130 interrupted: the report then is of what was done.";
