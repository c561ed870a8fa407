//! Figures as tables, for the terminal and for pages.

use super::Diffed;
use crate::cli::report::{Facts, table};
use crate::compare::bias::{Bias, Estimate};
use crate::compare::regions::Region;
use crate::compare::z_test::ZTest;
use crate::compare::{Channels, Comparison};
use crate::film::read::Found;
use crate::measure::units;
use std::path::Path;

/// All that was found, for the terminal.
pub fn text(diffed: &Diffed) -> String {
    let figures = &diffed.compared.figures;
    let mut head = Facts::default();
    pictures(diffed).into_iter().for_each(|[name, value]| head.add(&name, value));
    let mut text = format!("{}\n\n{}\n", head.text(), table(METRIC_HEADINGS, 1, metrics(figures).into_iter()));
    let (bias, z_test) = (figures.bias.as_ref().map(bias), figures.z_test.as_ref().map(z_test));
    let mut facts = Facts::default();
    bias.into_iter().chain(z_test).flatten().for_each(|[name, value]| facts.add(&name, value));
    let facts = facts.text();
    if !facts.is_empty() {
        text += &format!("\n{facts}\n");
    }
    text + &format!("\nluminance by region\n{}\n", table(REGION_HEADINGS, 1, figures.regions.iter().map(region)))
}

/// Which pictures, and which part of them.
pub fn pictures(diffed: &Diffed) -> Vec<[String; 2]> {
    let (pair, figures) = (diffed.pair, &diffed.compared.figures);
    let mut part = format!("{} × {} pixels", pair.width, pair.height);
    if (pair.width, pair.height) != diffed.found[0].full {
        part += &format!(" at ({}, {})", pair.x, pair.y);
    }
    if figures.left_out.either > 0 {
        part += &format!(", {} of them left out", units::count(figures.left_out.either as u64));
    }
    if figures.identical {
        part += ": the same";
    }
    vec![
        ["A".into(), picture(&diffed.args.a, diffed.found[0])],
        ["B".into(), picture(&diffed.args.b, diffed.found[1])],
        ["compared".into(), part],
    ]
}

fn picture(path: &Path, found: &Found) -> String {
    let errors = if found.variance.is_some() { ", with standard errors" } else { "" };
    let frame = match (found.width, found.height) == found.full {
        true => String::new(),
        false => format!(" of {} × {}", found.full.0, found.full.1),
    };
    format!("{}: {} × {}{frame}, {}{errors}", path.display(), found.width, found.height, found.what)
}

/// Of [`metrics`].
pub const METRIC_HEADINGS: [&str; 6] = ["metric", "RGB", "R", "G", "B", "luminance"];

/// Metrics, a row each.
pub fn metrics(figures: &Comparison) -> Vec<[String; 6]> {
    let epsilon = figures.settings.epsilon;
    let row = |name: String, c: &Channels| {
        [name, number(c.rgb), number(c.each[0]), number(c.each[1]), number(c.each[2]), number(c.luminance)]
    };
    let alone = |name: String, rgb: Option<f64>, luminance: Option<f64>| {
        let cell = |value: Option<f64>| value.map_or("–".into(), number);
        [name, cell(rgb), String::new(), String::new(), String::new(), cell(luminance)]
    };
    vec![
        row("mean A".into(), &figures.mean_a),
        row("mean B".into(), &figures.mean_b),
        row("MSE".into(), &figures.mse),
        row("RMSE".into(), &figures.rmse),
        row("largest |A − B|".into(), &figures.max_abs),
        row(format!("relMSE (ε = {epsilon})"), &figures.relmse),
        row(format!("MRSE (ε = {epsilon})"), &figures.mrse),
        row("PSNR, dB (sRGB, peak 1)".into(), &figures.psnr),
        alone("SSIM (sRGB, 11 × 11)".into(), None, figures.ssim),
        alone(format!("FLIP ({} pixels a degree)", figures.settings.pixels_per_degree), Some(figures.flip), None),
    ]
}

/// Bias and variance.
pub fn bias(bias: &Bias) -> Vec<[String; 2]> {
    let known = match bias.known {
        [true, true] => "of A and B",
        [true, false] => "of A; B counts as exact",
        _ => "of B; A counts as exact",
    };
    let channel = |c: usize| format!("{} {} (z {:+.2})", ["R", "G", "B"][c], plus_minus(bias.difference[c]), bias.z[c]);
    vec![
        ["standard errors".into(), format!("{known}, in {} pixels", units::count(bias.pixels as u64))],
        ["mean A − B".into(), [0, 1, 2].map(channel).join(", ")],
        ["bias²".into(), format!("{} (z {:+.2})", plus_minus(bias.bias2), bias.bias2.z())],
        [
            "MSE".into(),
            format!(
                "{} = bias² + variance of A {} + variance of B {}",
                number(bias.mse),
                number(bias.variance[0]),
                number(bias.variance[1])
            ),
        ],
    ]
}

/// The z-test.
pub fn z_test(test: &ZTest) -> Vec<[String; 2]> {
    let mut passing = format!(
        "{:.3} % of {} pixels pass |z| ≤ {:.2} (α = {}, Šidák); largest {:.2}",
        100.0 * test.passing,
        units::count(test.pixels as u64),
        test.limit,
        test.alpha,
        test.largest
    );
    if test.impossible > 0 {
        passing += &format!("; {} pixels differ without variance", units::count(test.impossible as u64));
    }
    if test.untested > 0 {
        passing += &format!("; {} pixels have no standard error", units::count(test.untested as u64));
    }
    let mean = test.mean_square;
    let off = Estimate { value: mean.value - 1.0, ..mean }.z();
    let chi2 = |c: usize| {
        let degrees = units::count(test.degrees[c] as u64);
        format!("{} {:.0} of {degrees} (p {})", ["R", "G", "B"][c], test.chi2[c], p(test.p[c]))
    };
    vec![
        ["z-test".into(), passing],
        ["mean z²".into(), format!("{:.4} ± {:.4} ({off:+.2} standard errors from 1)", mean.value, mean.error)],
        ["χ²".into(), [0, 1, 2].map(chi2).join(", ")],
    ]
}

fn p(p: f64) -> String {
    if p < 1e-3 { format!("{p:.0e}") } else { format!("{p:.3}") }
}

/// Of [`region`].
pub const REGION_HEADINGS: [&str; 10] =
    ["at", "size", "A", "B", "A − B", "relative", "RMSE", "relMSE", "z of R, G, B", "left out"];

/// A region as a row.
pub fn region(region: &Region) -> [String; 10] {
    let z = |z: [f64; 3]| z.map(|z| format!("{z:+.2}")).join(" ");
    [
        format!("{}, {}", region.x, region.y),
        format!("{} × {}", region.width, region.height),
        number(region.mean_a),
        number(region.mean_b),
        number(region.difference),
        if region.relative.is_finite() { format!("{:+.3} %", 100.0 * region.relative) } else { "–".into() },
        number(region.rmse),
        number(region.relmse),
        region.z.map_or("–".into(), z),
        (region.width * region.height - region.pixels).to_string(),
    ]
}

fn plus_minus(estimate: Estimate) -> String {
    format!("{} ± {}", number(estimate.value), number(estimate.error))
}

/// Five significant digits.
pub fn number(value: f64) -> String {
    let size = value.abs();
    match size {
        0.0 => "0".into(),
        _ if size.is_nan() => "–".into(),
        f64::INFINITY => if value > 0.0 { "∞" } else { "−∞" }.into(),
        1e-3..1e6 => format!("{value:.*}", (4 - size.log10().floor() as i32).max(0) as usize),
        _ => format!("{value:.3e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_five_digits() {
        for (value, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (0.012_345_67, "0.012346"),
            (-123.456_78, "-123.46"),
            (999_999.0, "999999"),
            (1.5e-7, "1.500e-7"),
            (f64::NAN, "–"),
            (f64::INFINITY, "∞"),
        ] {
            assert_eq!(number(value), text);
        }
    }
}
