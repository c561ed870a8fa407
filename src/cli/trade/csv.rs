//! The table as comma-separated values: plain numbers, seconds, rays a second. A number that is not known is empty.

use super::Traded;
use crate::error::{Error, Result};
use crate::film::atomic_file;
use crate::trade::front::Place;
use std::io::Write as _;
use std::path::Path;

/// A column, and its number in the table.
type Column = (&'static str, fn(&crate::trade::figures::Figures) -> f64);

const COLUMNS: [Column; 22] = [
    ("runs", |f| f.runs as f64),
    ("disturbed_runs", |f| f.disturbed as f64),
    ("samples", |f| f.samples),
    ("seconds", |f| f.seconds.median),
    ("seconds_low_quartile", |f| f.seconds.low),
    ("seconds_high_quartile", |f| f.seconds.high),
    ("rays_per_second", |f| f.rays_a_second.median),
    ("mse", |f| f.mse.value),
    ("mse_stderr", |f| f.mse.error),
    ("relmse", |f| f.relmse.value),
    ("relmse_stderr", |f| f.relmse.error),
    ("variance", |f| f.variance.value),
    ("variance_stderr", |f| f.variance.error),
    ("bias2", |f| f.bias2.value),
    ("bias2_stderr", |f| f.bias2.error),
    ("bias_test", |f| f.bias_test.value),
    ("bias_test_stderr", |f| f.bias_test.error),
    ("bias_test_z", |f| f.bias_test.z()),
    ("reference_noise", |f| f.reference_noise),
    ("efficiency", |f| f.efficiency.value),
    ("efficiency_stderr", |f| f.efficiency.error),
    ("non_finite_samples", |f| f.non_finite as f64),
];

/// Writes the table, whole or not at all.
pub fn write(path: &Path, traded: &Traded) -> Result<()> {
    let text = text(traded);
    atomic_file::write(path, |out| out.write_all(text.as_bytes()).map_err(|e| Error::io(path, "write", e)))
}

/// Names of knobs and their values have neither commas nor quotes.
fn text(traded: &Traded) -> String {
    let knobs = traded.options.vary.iter().map(|each| format!("knob_{}", each.knob.name.replace('-', "_")));
    let names = COLUMNS.iter().map(|(name, _)| (*name).to_owned());
    let ends = ["build_seconds", "place", "slope", "slope_stderr"].map(str::to_owned);
    let mut lines = vec![knobs.chain(names).chain(ends).collect::<Vec<_>>().join(",")];
    for (number, configuration) in traded.configurations.iter().enumerate() {
        let figures = traded.figures[number].as_ref();
        let numbers = COLUMNS.iter().map(|(_, of)| plain(figures.map_or(f64::NAN, of)));
        let group = traded.groups.iter().find(|group| group.members.contains(&number));
        let slope = group.and_then(|group| group.slope);
        let place = match traded.places[number] {
            Place::Front => "front",
            Place::Tie => "tie",
            Place::Behind => "behind",
            Place::Unknown => "",
        };
        let ends = [
            plain(traded.build[number]),
            place.to_owned(),
            plain(slope.map_or(f64::NAN, |slope| slope.value)),
            plain(slope.map_or(f64::NAN, |slope| slope.error)),
        ];
        lines.push(configuration.values.iter().cloned().chain(numbers).chain(ends).collect::<Vec<_>>().join(","));
    }
    lines.join("\n") + "\n"
}

fn plain(value: f64) -> String {
    if value.is_finite() { value.to_string() } else { String::new() }
}
