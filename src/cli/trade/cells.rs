//! What the tables of the terminal and of the page both show.

use super::{Group, Traded};
use crate::cli::report::seconds;
use crate::compare::bias::Estimate;
use crate::measure::units::{self, short};
use crate::trade::figures::Figures;
use crate::trade::front::Place;

/// Headings of [`row`], after those of the knobs.
pub const HEADINGS: [&str; 10] =
    ["time", "quartiles", "Mray/s", "MSE", "relMSE", "variance", "bias²", "bias?", "1/(MSE·s)", "front"];

/// Of the table: the knobs first.
pub fn headings(traded: &Traded) -> Vec<&'static str> {
    traded.options.vary.iter().map(|each| each.knob.name).chain(HEADINGS).collect()
}

/// A configuration.
pub fn row(traded: &Traded, number: usize) -> Vec<String> {
    let values = traded.configurations[number].values.iter().cloned();
    let figures = match &traded.figures[number] {
        Some(figures) => figures_row(figures, traded.limit, traded.places[number]),
        None => vec!["–".to_owned(); HEADINGS.len()],
    };
    values.chain(figures).collect()
}

fn figures_row(f: &Figures, limit: f64, place: Place) -> Vec<String> {
    vec![
        seconds(f.seconds.median),
        range(seconds(f.seconds.low), seconds(f.seconds.high)),
        format!("{:.2}", f.rays_a_second.median * 1e-6),
        share(f.mse),
        share(f.relmse),
        number(f.variance.value),
        plus_minus(f.bias2),
        match f.bias2.value.is_nan() {
            true => "–",
            false if f.bias_is_in_the_noise(limit) => "no",
            false => "yes",
        }
        .into(),
        share(f.efficiency),
        match place {
            Place::Front => "front",
            Place::Tie => "tie",
            Place::Behind => "",
            Place::Unknown => "–",
        }
        .into(),
    ]
}

/// From one value to another: a unit that both have is written once.
fn range(low: String, high: String) -> String {
    match (low.split_once(' '), high.split_once(' ')) {
        (Some((number, a)), Some((_, b))) if a == b => format!("{number}–{high}"),
        _ => format!("{low}–{high}"),
    }
}

/// Headings of [`slope_row`].
pub const SLOPE_HEADINGS: [&str; 4] = ["", "from", "to", "slope of MSE"];

/// How the error of a group falls; none if it has no slope.
pub fn slope_row(traded: &Traded, group: &Group) -> Option<[String; 4]> {
    let slope = group.slope?;
    let samples = |number: &usize| units::short(traded.figures[*number].map_or(f64::NAN, |f| f.samples));
    let [first, last] = [group.members.first()?, group.members.last()?];
    Some([group.name.clone(), samples(first), samples(last), format!("{:+.3} ± {:.3}", slope.value, slope.error)])
}

/// A value, and its error as a part of it: `0.00123 ± 0.8 %`.
pub fn share(estimate: Estimate) -> String {
    let error = 100.0 * (estimate.error / estimate.value).abs();
    match error.is_finite() {
        true => format!(
            "{} ± {} %",
            number(estimate.value),
            if error < 10.0 { format!("{error:.1}") } else { format!("{error:.0}") }
        ),
        false => number(estimate.value),
    }
}

/// A value and its error, where the value may be nothing.
fn plus_minus(estimate: Estimate) -> String {
    match estimate.value.is_nan() {
        true => "–".into(),
        false => format!("{:.1e} ± {:.1e}", estimate.value, estimate.error),
    }
}

/// Three digits.
pub fn number(value: f64) -> String {
    match value.abs() {
        _ if value.is_nan() => "–".into(),
        size if size != 0.0 && (size < 1e-3) => format!("{value:.2e}"),
        _ => short(value),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_parts_of_values() {
        let of = |value: f64, error: f64| share(Estimate { value, error });
        assert_eq!(of(0.5, 0.005), "0.5 ± 1.0 %");
        assert_eq!(of(1.234e-5, 3e-6), "1.23e-5 ± 24 %");
        assert_eq!(of(0.5, f64::NAN), "0.5");
        assert_eq!(of(f64::NAN, f64::NAN), "–");
        assert_eq!(plus_minus(Estimate { value: -1e-6, error: 2e-6 }), "-1.0e-6 ± 2.0e-6");
        assert_eq!(range("1.5 s".into(), "1.7 s".into()), "1.5–1.7 s");
        assert_eq!(range("980 ms".into(), "1.1 s".into()), "980 ms–1.1 s");
    }
}
