//! Arguments of `comber diff` as typed.

use crate::cli::args::ReportArgs;
use crate::cli::values::{self, whole};
use crate::compare::metric::{self, Better, METRICS, Metric};
use clap::{ArgAction, Args};
use std::path::PathBuf;

/// `comber diff`.
#[derive(Debug, Args)]
#[command(args_override_self = true, after_help = DIFF_NOTES)]
pub struct DiffArgs {
    /// The picture: OpenEXR, PFM or PNG.
    #[arg(value_name = "A")]
    pub a: PathBuf,
    /// The reference, of the same size.
    #[arg(value_name = "B")]
    pub b: PathBuf,
    /// Fail if METRIC is more than VALUE, or cannot be known. May be given several times.
    #[arg(long, value_name = "METRIC=VALUE", value_parser = at_most, help_heading = "Limits")]
    pub max: Vec<Limit>,
    /// Fail if METRIC (psnr, ssim) is less than VALUE, or cannot be known. May be given several times.
    #[arg(long, value_name = "METRIC=VALUE", value_parser = at_least, help_heading = "Limits")]
    pub min: Vec<Limit>,
    /// Compare only these pixels of the frame.
    #[arg(long, num_args = 4, value_names = ["X", "Y", "DX", "DY"], value_parser = whole(0, 1 << 20),
          action = ArgAction::Set, allow_negative_numbers = true, help_heading = "Pictures")]
    pub crop: Option<Vec<u32>>,
    /// Layer or channel of both files, which then must be OpenEXR: Albedo, Z, ViewLayer.DiffDir [default: the colour].
    #[arg(long, value_name = "NAME", help_heading = "Pictures")]
    pub layer: Option<String>,
    /// Standard errors of A, as a picture of the same size. EXR files of comber hold their own.
    #[arg(long, value_name = "FILE", help_heading = "Pictures")]
    pub stderr_a: Option<PathBuf>,
    /// Standard errors of B.
    #[arg(long, value_name = "FILE", help_heading = "Pictures")]
    pub stderr_b: Option<PathBuf>,
    /// Stops of exposure of what is seen: PSNR, SSIM, FLIP and pictures. Other metrics are of the values as they are.
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, value_parser = values::exposure,
          allow_negative_numbers = true, help_heading = "Metrics")]
    pub exposure: f32,
    /// Epsilon of relMSE and MRSE.
    #[arg(long, value_name = "E", default_value_t = crate::compare::relative::EPSILON, value_parser = positive,
          allow_negative_numbers = true, help_heading = "Metrics")]
    pub epsilon: f64,
    /// Pixels a degree of the visual angle, for FLIP.
    #[arg(long, value_name = "N", default_value_t = crate::compare::flip::PIXELS_PER_DEGREE, value_parser = ppd,
          allow_negative_numbers = true, help_heading = "Metrics")]
    pub ppd: f64,
    /// Regions across and down, for the table [default: 4 3].
    #[arg(long, num_args = 2, value_names = ["NX", "NY"], value_parser = whole(1, 64), action = ArgAction::Set,
          allow_negative_numbers = true, help_heading = "Metrics")]
    pub regions: Option<Vec<u32>>,
    /// Write pictures of the differences: NAME_signed.png, NAME_relative.png, NAME_flip.png and, if standard errors are
    /// known, NAME_z.png. In a directory, NAME is diff.
    #[arg(short, long, value_name = "NAME|DIR", help_heading = "Output")]
    pub output: Option<PathBuf>,
    /// Write a report to look at in a browser: one file that needs no other.
    #[arg(long, value_name = "FILE.html", help_heading = "Output")]
    pub html: Option<PathBuf>,
    /// What to say.
    #[command(flatten)]
    pub report: ReportArgs,
}

/// What a metric may be at most, or must be at least.
#[derive(Clone, Copy, Debug)]
pub struct Limit {
    /// Which.
    pub metric: &'static Metric,
    /// Its limit.
    pub value: f64,
}

/// `METRIC=VALUE` for `--max`.
fn at_most(text: &str) -> Result<Limit, String> {
    let limit = limit(text)?;
    match limit.metric.better {
        Better::Smaller => Ok(limit),
        Better::Larger => Err(format!("{} is better the larger it is: use --min {text}", limit.metric.name)),
    }
}

/// `METRIC=VALUE` for `--min`.
fn at_least(text: &str) -> Result<Limit, String> {
    let limit = limit(text)?;
    match limit.metric.better {
        Better::Larger => Ok(limit),
        Better::Smaller => Err(format!("{} is better the smaller it is: use --max {text}", limit.metric.name)),
    }
}

fn limit(text: &str) -> Result<Limit, String> {
    let Some((name, value)) = text.split_once('=') else { return Err("must be METRIC=VALUE, as in rmse=0.01".into()) };
    let Some(metric) = metric::find(name) else {
        let names: Vec<&str> = METRICS.iter().map(|metric| metric.name).collect();
        return Err(format!("there is no metric '{name}', but {}", names.join(", ")));
    };
    match value.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(Limit { metric, value }),
        _ => Err(format!("the limit of {name} must be a finite number, as in {name}=0.01")),
    }
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (1e-30..=1e30).contains(&value) => Ok(value),
        _ => Err("must be a number from 1e-30 to 1e30".into()),
    }
}

fn ppd(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (1.0..=1000.0).contains(&value) => Ok(value),
        _ => Err("must be a number from 1 to 1000".into()),
    }
}

const DIFF_NOTES: &str = "\
A is compared with the reference B, where both have pixels. Values are linear: PNG is decoded by the sRGB curve. PSNR, SSIM \
and FLIP are of what is seen: values brightened by --exposure, clamped to 0..1 and sRGB-encoded; the peak of PSNR is 1. \
Pixels that are not finite are counted, left out and reported.

Metrics that --max knows: mse, rmse, max-abs, relmse = mean of (a-b)^2/(b^2+epsilon), mrse = mean of ((a-b)/(b+epsilon))^2, \
flip, mean (largest difference of the means of a channel), left-out (pixels); and where standard errors are known: bias2, \
bias2-z, mean-z, z2 (mean z^2; 1 if both pictures differ by noise alone), z2-z, failing (share of pixels that fail a z-test \
at 0.01, Sidak-corrected). Those that --min knows: psnr, ssim.

Of EXR files the colour is read: R G B, or a layer Combined, Beauty, Color or RGBA (Blender's ViewLayer.Combined, say), of the \
first part that has one. Variance.R/G/B of comber's files are the squares of its standard errors.

Examples:
  comber diff a.exr reference.exr
  comber diff a.exr b.exr --html report.html -o diff
  comber diff a.exr b.exr --max relmse=0.01 --max failing=0.001 --min ssim=0.98 -q
  comber diff mitsuba.exr blender.exr --exposure 1 --crop 100 50 200 100
  comber diff a.exr b.exr --layer Albedo --json

Exit status: 0 done, 1 failed or beyond a limit, 2 misused, 130 interrupted.";
