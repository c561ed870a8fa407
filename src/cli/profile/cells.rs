//! What the tables of the terminal and of the report both show.

use crate::measure::units;
use crate::profile::stage_table::StageRow;

/// Headings of [`times`].
pub const TIMES: [&str; 9] =
    ["stage", "calls", "rows in", "rows out", "thread ms", "share", "ns/row", "quartiles", "Mray/s a thread"];

/// What a row of stages took.
pub fn times(name: String, row: &StageRow) -> [String; 9] {
    [
        name,
        units::count(row.calls),
        units::count(row.rows_in),
        units::count(row.rows_out),
        format!("{:.2}", row.seconds * 1e3),
        percent(row.share),
        format!("{:.2}", row.nanos_a_row.median),
        format!("{:.2}–{:.2}", row.nanos_a_row.low, row.nanos_a_row.high),
        row.rays_a_second.map_or("–".into(), |rays| format!("{:.2}", rays * 1e-6)),
    ]
}

/// A share of one.
pub fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}
