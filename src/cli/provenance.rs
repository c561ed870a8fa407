//! Where a picture comes from, as data that is stored in it.

use super::load::Loaded;
use crate::accumulate::about::of_picture;
use crate::error::{Error, Result};
use crate::options::RenderOptions;
use glam::DVec3;
use serde_json::{Value, json};
use std::time::{SystemTime, UNIX_EPOCH};

/// Scene, options, seed, version and time. What cannot change the picture is left out, so that it cannot change the file either.
pub fn provenance(loaded: &Loaded, options: &RenderOptions, samples: u64, stopped: bool, created: &str) -> Value {
    let options = of_picture(options);
    let mut provenance = json!({
        "comber": env!("CARGO_PKG_VERSION"),
        "scene": loaded.name,
        "stage": loaded.stage,
        "camera": loaded.camera,
        "seed": options["seed"],
        "samples": samples,
        "stopped": stopped,
        "options": options,
        "created": created,
    });
    if loaded.scene.origin != DVec3::ZERO {
        provenance["origin"] = json!(loaded.scene.origin);
    }
    provenance
}

/// The time that pictures are stamped with: `SOURCE_DATE_EPOCH` if that is set
/// (<https://reproducible-builds.org/specs/source-date-epoch/>), now if not.
pub fn creation_time() -> Result<String> {
    let Some(text) = std::env::var_os("SOURCE_DATE_EPOCH") else {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        return Ok(rfc3339(now.as_secs()));
    };
    match text.to_str().and_then(|text| text.parse().ok()) {
        Some(seconds) if seconds <= LAST_SECOND => Ok(rfc3339(seconds)),
        _ => Err(Error::Options(format!(
            "SOURCE_DATE_EPOCH is '{}'; it must be the seconds since 1970 as a whole number, at most {LAST_SECOND}",
            text.display(),
        ))),
    }
}

/// 9999-12-31T23:59:59Z: RFC 3339 has no longer years.
const LAST_SECOND: u64 = 253_402_300_799;

/// `2026-11-05T17:03:09Z` for seconds since 1970.
///
/// Days become a date by counting from 0000-03-01, so that a leap day ends its year (Hinnant,
/// "chrono-Compatible Low-Level Date Algorithms", `civil_from_days`).
fn rfc3339(seconds: u64) -> String {
    let (days, second) = (seconds / 86400, seconds % 86400);
    let days = days + 719_468;
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    // March is 0. Five months have 153 days, over and over.
    let month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month + 2) / 5 + 1;
    let (month, carry) = if month < 10 { (month + 3, 0) } else { (month - 9, 1) };
    let year = era * 400 + year_of_era + carry;
    let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_agree_with_the_calendar() {
        for (seconds, date) in [
            (0, "1970-01-01T00:00:00Z"),
            (951_782_399, "2000-02-28T23:59:59Z"),
            (951_782_400, "2000-02-29T00:00:00Z"),
            (951_868_800, "2000-03-01T00:00:00Z"),
            (1_709_164_800, "2024-02-29T00:00:00Z"),
            (1_735_689_599, "2024-12-31T23:59:59Z"),
            (1_735_689_600, "2025-01-01T00:00:00Z"),
            (4_107_542_400, "2100-03-01T00:00:00Z"),
            (LAST_SECOND, "9999-12-31T23:59:59Z"),
        ] {
            assert_eq!(rfc3339(seconds), date);
        }
    }

    #[test]
    fn every_day_follows_the_one_before() {
        let days_in = |year: u64, month: u64| match month {
            2 if year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400)) => 29,
            2 => 28,
            4 | 6 | 9 | 11 => 30,
            _ => 31,
        };
        let (mut year, mut month, mut day) = (1970, 1, 1);
        for days in 0..200_000 {
            assert_eq!(rfc3339(days * 86400), format!("{year:04}-{month:02}-{day:02}T00:00:00Z"));
            day += 1;
            if day > days_in(year, month) {
                (month, day) = (month + 1, 1);
            }
            if month > 12 {
                (year, month) = (year + 1, 1);
            }
        }
    }
}
