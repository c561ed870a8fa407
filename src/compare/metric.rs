//! Metrics by name, for limits.

use super::Comparison;
use super::bias::Estimate;

/// Which end of a metric is the good one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Better {
    /// Errors: a limit is the most that is allowed.
    Smaller,
    /// Likenesses: a limit is the least that is asked for.
    Larger,
}

/// A figure that can be limited.
#[derive(Clone, Copy, Debug)]
pub struct Metric {
    /// As the command line has it.
    pub name: &'static str,
    /// What it is.
    pub help: &'static str,
    /// Which end is good.
    pub better: Better,
    /// Its value, if it can be known.
    pub value: fn(&Comparison) -> Option<f64>,
}

/// All of them.
pub const METRICS: [Metric; 16] = [
    metric("mse", "mean squared error", |c| Some(c.mse.rgb)),
    metric("rmse", "its root", |c| Some(c.rmse.rgb)),
    metric("max-abs", "largest absolute difference of a channel", |c| Some(c.max_abs.rgb)),
    metric("relmse", "mean of (a - b)^2 / (b^2 + epsilon)", |c| Some(c.relmse.rgb)),
    metric("mrse", "mean of ((a - b) / (b + epsilon))^2", |c| Some(c.mrse.rgb)),
    metric("flip", "mean FLIP error, 0 to 1", |c| Some(c.flip)),
    Metric { better: Better::Larger, ..metric("psnr", "dB, of encoded values up to 1", |c| Some(c.psnr.rgb)) },
    Metric { better: Better::Larger, ..metric("ssim", "structural similarity, up to 1", |c| c.ssim) },
    metric("mean", "largest |mean of a - mean of b| of a channel", |c| {
        Some((0..3).map(|i| (c.mean_a.each[i] - c.mean_b.each[i]).abs()).fold(0.0, f64::max))
    }),
    metric("bias2", "estimate of bias^2", |c| c.bias.map(|bias| bias.bias2.value)),
    metric("bias2-z", "that, in standard errors", |c| c.bias.map(|bias| bias.bias2.z())),
    metric("mean-z", "largest |z| of the mean difference of a channel", |c| {
        c.bias.map(|bias| bias.z.iter().fold(0.0, |most, z| z.abs().max(most)))
    }),
    metric("z2", "mean of z^2 over pixels", |c| c.z_test.map(|test| test.mean_square.value)),
    metric("z2-z", "distance of that from 1 in standard errors", |c| {
        c.z_test.map(|test| Estimate { value: test.mean_square.value - 1.0, ..test.mean_square }.z().abs())
    }),
    metric("failing", "share of pixels that fail the z-test", |c| c.z_test.map(|test| 1.0 - test.passing)),
    metric("left-out", "number of pixels that are not finite", |c| Some(c.left_out.either as f64)),
];

const fn metric(name: &'static str, help: &'static str, value: fn(&Comparison) -> Option<f64>) -> Metric {
    Metric { name, help, better: Better::Smaller, value }
}

/// The metric of this name.
pub fn find(name: &str) -> Option<&'static Metric> {
    METRICS.iter().find(|metric| metric.name == name)
}

#[cfg(test)]
mod tests {
    use super::super::pair::tests::{pair, pattern};
    use super::super::{Settings, compare};
    use super::*;

    #[test]
    fn a_picture_is_like_itself_by_every_metric() {
        let same = pair(48, pattern(1, 48, 36), pattern(1, 48, 36));
        let figures = compare(&same, Settings::default()).figures;
        assert!(figures.identical);
        for metric in &METRICS {
            let want = match metric.name {
                "psnr" => Some(f64::INFINITY),
                "ssim" => Some(1.0),
                "bias2" | "bias2-z" | "mean-z" | "z2" | "z2-z" | "failing" => None,
                _ => Some(0.0),
            };
            let got = (metric.value)(&figures);
            let close = got == want || got.zip(want).is_some_and(|(got, want)| (got - want).abs() < 1e-12);
            assert!(close, "{}: {got:?}", metric.name);
        }
    }
}
