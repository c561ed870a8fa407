//! Arguments of `comber profile` as typed.

use crate::cli::args::RenderArgs;
use crate::cli::values::whole;
use clap::Args;
use std::path::PathBuf;

/// `comber profile`.
#[derive(Debug, Args)]
#[command(args_override_self = true, after_help = PROFILE_NOTES)]
pub struct ProfileArgs {
    /// The render to profile.
    #[command(flatten)]
    pub render: RenderArgs,
    /// What is measured.
    #[command(flatten)]
    pub profile: ProfileOptions,
}

/// What is measured, and where it goes.
#[derive(Debug, Args)]
#[command(next_help_heading = "Profile")]
pub struct ProfileOptions {
    /// Timed renders; the table shows the one of median time, and quartiles of all.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = whole(1, 1000), allow_negative_numbers = true)]
    pub repeats: u32,
    /// Leave out the depth-first control, which renders the same picture one path at a time in turns with waves.
    #[arg(long)]
    pub no_control: bool,
    /// Measure waves of other sizes, too (a report always does).
    #[arg(long)]
    pub curve: bool,
    /// Measure the machine's ceilings anew. They are kept in the user's cache folder.
    #[arg(long)]
    pub new_ceilings: bool,
    /// Write a report to look at in a browser: one file that needs no other.
    #[arg(long, value_name = "FILE.html")]
    pub html: Option<PathBuf>,
    /// Write a timeline for <https://ui.perfetto.dev> or chrome://tracing: a track a worker, a slice a batch.
    #[arg(long, value_name = "FILE.json")]
    pub trace: Option<PathBuf>,
    /// Write folded stacks, for flame graphs.
    #[arg(long, value_name = "FILE.txt")]
    pub folded: Option<PathBuf>,
    /// Write maps of what each pixel cost: NAME_time.png, NAME_visits.png, NAME_bounces.png, NAME_samples.png, and all in
    /// NAME.exr.
    #[arg(long, value_name = "NAME")]
    pub maps: Option<PathBuf>,
    /// Keep the figures under this name in the user's data folder; a name that ends in .json is a path.
    #[arg(long, value_name = "NAME")]
    pub save: Option<String>,
    /// Compare each stage with the figures kept under this name. Where the median of one lies within the quartiles of
    /// the other, it is a tie.
    #[arg(long, value_name = "NAME")]
    pub against: Option<String>,
}

const PROFILE_NOTES: &str = "\
The scene is rendered several times, with the options of `comber render`. One render counts what rays visit, which slows \
it; the others are timed, in turns with the depth-first control. Pictures and rays of all of them are compared, and are \
the same to the bit. A picture is written only with -o.

Examples:
  comber profile                                          comber's own scene
  comber profile box.dae --html report.html -o box.png
  comber profile dragon.ply --threads 1 --trace dragon.json --folded dragon.txt
  comber profile bunny.ply --maps bunny_cost
  comber profile --save before bunny.ply                  and, after a change:
  comber profile --against before bunny.ply

Exit status: 0 done, 1 failed, 2 misused.";
