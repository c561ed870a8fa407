//! Numbers for people: three significant digits and a unit.

use std::time::Duration;

/// A whole number with separators: `871,414`.
pub fn count(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::with_capacity(digits.len() * 4 / 3);
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// An amount of memory in binary units: `1.25 GiB`, `512 B`.
pub fn bytes(number: u64) -> String {
    const UNITS: [&str; 6] = ["KiB", "MiB", "GiB", "TiB", "PiB", "EiB"];
    if number < 1024 {
        return format!("{number} B");
    }
    let (value, unit) = scaled(number as f64 / 1024.0, 1024.0, &UNITS);
    format!("{value} {unit}")
}

/// `number` things in `time`, as a rate with a decimal prefix: `rate(123e6, 10 s, "ray")` is `12.3 Mray/s`.
///
/// A time of zero, or a number that is not finite, gives `– ray/s`.
pub fn rate(number: f64, time: Duration, unit: &str) -> String {
    let per_second = number / time.as_secs_f64();
    if !per_second.is_finite() {
        return format!("– {unit}/s");
    }
    let (value, prefix) = scaled(per_second, 1000.0, &["", "k", "M", "G", "T", "P"]);
    format!("{value} {prefix}{unit}/s")
}

/// A length of time: `850 µs`, `3.2 s`, `2 min 05 s`, `1 h 02 min`, `3 d 04 h`.
pub fn duration(time: Duration) -> String {
    let seconds = time.as_secs_f64();
    // The limits are where rounding would carry: 59.96 s is "1 min 00 s", not "60.0 s".
    if seconds < 0.000_999_5 {
        return format!("{:.0} µs", seconds * 1e6);
    }
    if seconds < 0.999_5 {
        return format!("{} ms", significant(seconds * 1e3));
    }
    if seconds < 59.95 {
        return format!("{seconds:.1} s");
    }
    let whole = (seconds + 0.5) as u64;
    let minutes = (seconds / 60.0 + 0.5) as u64;
    if whole < 3600 {
        format!("{} min {:02} s", whole / 60, whole % 60)
    } else if minutes < 24 * 60 {
        format!("{} h {:02} min", minutes / 60, minutes % 60)
    } else {
        let hours = (seconds / 3600.0 + 0.5) as u64;
        format!("{} d {:02} h", hours / 24, hours % 24)
    }
}

/// A plain number of about three significant digits for a label: `0.0123`, `41.5`, `1.23k`, `2.05M`.
///
/// Whole numbers below 100,000 are given in full; beyond 0.001 and 10¹⁵ it is `1.5e-7`; what is not finite prints as `NaN`, `inf` or `-inf`.
pub fn short(number: f64) -> String {
    let size = number.abs();
    if !size.is_finite() || (size < 1e5 && size.fract() == 0.0) {
        // Adding zero turns -0 into 0.
        return (number + 0.0).to_string();
    }
    if !(1e-3..1e15).contains(&size) {
        return format!("{number:.1e}");
    }
    let sign = if number < 0.0 { "-" } else { "" };
    if size < 1.0 {
        // 0.5 has its first digit at the first decimal, 0.05 at the second.
        let decimals = (2.0 - size.log10().floor()) as usize;
        return format!("{sign}{}", trimmed(format!("{size:.decimals$}")));
    }
    let (value, prefix) = scaled(size, 1000.0, &["", "k", "M", "G", "T"]);
    format!("{sign}{}{prefix}", trimmed(value))
}

/// Divides by `step` until less than `step` is left, and names the unit that this leads to.
fn scaled<'a>(value: f64, step: f64, units: &[&'a str]) -> (String, &'a str) {
    let mut value = value;
    let mut unit = 0;
    // 999.5 would round to "1000".
    while value.abs() >= step - 0.5 && unit + 1 < units.len() {
        value /= step;
        unit += 1;
    }
    (significant(value), units[unit])
}

/// Three significant digits, but never fewer than the whole part has.
fn significant(value: f64) -> String {
    let size = value.abs();
    let decimals = if size < 9.995 {
        2
    } else if size < 99.95 {
        1
    } else {
        0
    };
    format!("{value:.decimals$}")
}

/// Without the zeros that end a decimal fraction.
fn trimmed(text: String) -> String {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_string() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts() {
        for (number, text) in [(0, "0"), (999, "999"), (1000, "1,000"), (871_414, "871,414"), (1_234_567, "1,234,567")]
        {
            assert_eq!(count(number), text);
        }
        assert_eq!(count(u64::MAX), "18,446,744,073,709,551,615");
    }

    #[test]
    fn memory() {
        for (number, text) in [
            (0, "0 B"),
            (1023, "1023 B"),
            (1024, "1.00 KiB"),
            (1_342_177_280, "1.25 GiB"),
            ((1 << 20) - 1, "1.00 MiB"),
            (u64::MAX, "16.0 EiB"),
        ] {
            assert_eq!(bytes(number), text);
        }
    }

    #[test]
    fn rates() {
        let ten = Duration::from_secs(10);
        assert_eq!(rate(123e6, ten, "ray"), "12.3 Mray/s");
        assert_eq!(rate(9999.0, ten, "path"), "1.00 kpath/s");
        assert_eq!(rate(0.0, ten, "ray"), "0.00 ray/s");
        assert_eq!(rate(5.0, Duration::ZERO, "ray"), "– ray/s");
    }

    #[test]
    fn times() {
        for (seconds, text) in [
            (0.0, "0 µs"),
            (0.000_85, "850 µs"),
            (0.012_34, "12.3 ms"),
            (3.2, "3.2 s"),
            (59.94, "59.9 s"),
            (59.96, "1 min 00 s"),
            (125.0, "2 min 05 s"),
            (3599.6, "1 h 00 min"),
            (3720.0, "1 h 02 min"),
            (86_399.0, "1 d 00 h"),
            (273_600.0, "3 d 04 h"),
        ] {
            assert_eq!(duration(Duration::from_secs_f64(seconds)), text);
        }
        assert!(duration(Duration::MAX).ends_with(" h"));
    }

    #[test]
    fn labels() {
        for (number, text) in [
            (0.0, "0"),
            (0.05, "0.05"),
            (0.012_34, "0.0123"),
            (0.999_9, "1"),
            (41.0, "41"),
            (2048.0, "2048"),
            (-0.0, "0"),
            (-1500.5, "-1.5k"),
            (123_456.0, "123k"),
            (999_999.0, "1M"),
            (1.5e-7, "1.5e-7"),
            (3e20, "3.0e20"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(short(number), text);
        }
    }
}
