//! Parsers of single values. Each error says what is allowed.

use crate::options::Roulette;
use crate::transport::reuse::MOST_PIXELS;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use glam::DVec3;
use std::ffi::OsString;
use std::ops::RangeInclusive;
use std::time::Duration;

/// One of several words, each with its meaning for the long help.
pub fn choice<T>(choices: &'static [(&'static str, &'static str, T)]) -> impl TypedValueParser<Value = T>
where
    T: Copy + Send + Sync + 'static,
{
    PossibleValuesParser::new(choices.iter().map(|(word, help, _)| PossibleValue::new(*word).help(*help)))
        .map(|word: String| choices.iter().find(|c| c.0 == word).expect("clap lets only these words through").2)
}

/// One of the words of [`choice`], where it is not clap that asks.
pub fn chosen<T: Copy>(choices: &[(&str, &str, T)], text: &str) -> Result<T, String> {
    let found = choices.iter().find(|(word, ..)| *word == text).map(|(.., value)| *value);
    found.ok_or_else(|| {
        let words: Vec<&str> = choices.iter().map(|(word, ..)| *word).collect();
        let (last, others) = words.split_last().expect("there is a choice");
        format!("must be {} or {last}", others.join(", "))
    })
}

/// A whole number within limits.
pub fn whole(least: u32, most: u32) -> impl Fn(&str) -> Result<u32, String> + Clone + Send + Sync + 'static {
    move |text| whole_in(text, least..=most)
}

/// A whole number within limits; the function behind [`whole`].
pub fn whole_in(text: &str, allowed: RangeInclusive<u32>) -> Result<u32, String> {
    match text.parse() {
        Ok(number) if allowed.contains(&number) => Ok(number),
        _ => Err(format!("must be a whole number from {} to {}", allowed.start(), allowed.end())),
    }
}

/// A power of two, up to 4096.
pub fn power_of_two(text: &str) -> Result<u32, String> {
    power_of_two_up_to(4096, text)
}

/// Pixels of a block that share paths: a power of two, up to 64.
pub fn block(text: &str) -> Result<u32, String> {
    power_of_two_up_to(MOST_PIXELS, text)
}

fn power_of_two_up_to(most: u32, text: &str) -> Result<u32, String> {
    match text.parse::<u32>() {
        Ok(number) if number.is_power_of_two() && number <= most => Ok(number),
        _ => Err(format!("must be a power of two from 1 to {most}")),
    }
}

/// A word of letters, digits and dots.
pub fn word(text: &str) -> Result<String, String> {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '.';
    if !text.is_empty() && text.chars().all(plain) { Ok(text.into()) } else { Err("is not a word".into()) }
}

/// Stops of exposure.
pub fn exposure(text: &str) -> Result<f32, String> {
    match text.parse() {
        Ok(stops) if (-64.0..=64.0).contains(&stops) => Ok(stops),
        _ => Err("must be a number from -64 to 64".into()),
    }
}

/// A field of view in degrees.
pub fn angle(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(degrees) if degrees > 0.0 && degrees < 180.0 => Ok(degrees),
        _ => Err("must be a number of degrees above 0 and below 180".into()),
    }
}

/// A share of something: 0 is none of it.
pub fn share(text: &str) -> Result<f32, String> {
    match text.parse() {
        Ok(share) if (0.0..=1.0).contains(&share) => Ok(share),
        _ => Err("must be a number from 0 to 1".into()),
    }
}

/// An amount of memory: `1.5GiB`, `500M`. Units are binary but for kB, MB, GB and TB.
pub fn size(text: &str) -> Result<u64, String> {
    const UNITS: [(&str, u64); 16] = [
        ("", 1),
        ("B", 1),
        ("K", 1 << 10),
        ("k", 1 << 10),
        ("KiB", 1 << 10),
        ("kB", 1000),
        ("KB", 1000),
        ("M", 1 << 20),
        ("MiB", 1 << 20),
        ("MB", 1_000_000),
        ("G", 1 << 30),
        ("GiB", 1 << 30),
        ("GB", 1_000_000_000),
        ("T", 1 << 40),
        ("TiB", 1 << 40),
        ("TB", 1_000_000_000_000),
    ];
    let (number, unit) = text.split_at(text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len()));
    let unit = UNITS.iter().find(|(name, _)| *name == unit).map(|(_, bytes)| *bytes as f64);
    let plain = number.trim_end().bytes().all(|c| c.is_ascii_digit() || c == b'.');
    match (number.trim_end().parse::<f64>(), unit) {
        (Ok(number), Some(unit)) if plain && number * unit < 2f64.powi(63) => Ok((number * unit) as u64),
        _ => Err("must be a size, as in 500M, 1.5GiB or 8GB".into()),
    }
}

/// The first digits of a key of the cache.
pub fn key_digits(text: &str) -> Result<String, String> {
    let digits = text.bytes().all(|c| matches!(c, b'0'..=b'9' | b'a'..=b'f'));
    if digits && (4..=32).contains(&text.len()) {
        return Ok(text.to_owned());
    }
    Err("must be 4 to 32 hexadecimal digits, as `comber cache ls` prints them".into())
}

/// A length of time: `90m`, `12h`, `30d`.
pub fn age(text: &str) -> Result<Duration, String> {
    let wrong = || "must be a whole number of minutes, hours, days or weeks, as in 90m, 12h, 30d or 4w".to_owned();
    let unit = text.chars().next_back().ok_or_else(wrong)?;
    let seconds = match unit {
        'm' => 60,
        'h' => 3600,
        'd' => 86_400,
        'w' => 7 * 86_400,
        _ => return Err(wrong()),
    };
    let number = whole_in(text.trim_end_matches(unit), 0..=1_000_000).map_err(|_| wrong())?;
    Ok(Duration::from_secs(u64::from(number) * seconds))
}

/// A length of time: `500ms`, `90s`, `1.5m`, `2h`.
pub fn span(text: &str) -> Result<Duration, String> {
    let (number, unit) = text.split_at(text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len()));
    let unit =
        [("ms", 1e-3), ("s", 1.0), ("m", 60.0), ("min", 60.0), ("h", 3600.0)].iter().find(|(name, _)| *name == unit);
    let plain = number.bytes().all(|c| c.is_ascii_digit() || c == b'.');
    match (number.parse::<f64>(), unit) {
        (Ok(number), Some((_, seconds))) if plain && number > 0.0 && number * seconds < 1e9 => {
            Ok(Duration::from_secs_f64(number * seconds))
        }
        _ => Err("must be a length of time above 0, as in 500ms, 90s, 1.5m or 2h".into()),
    }
}

/// A relative error: `0.01`, or `1%`.
pub fn relative_error(text: &str) -> Result<f64, String> {
    let (number, unit) = text.strip_suffix('%').map_or((text, 1.0), |number| (number, 0.01));
    match number.trim_end().parse::<f64>() {
        Ok(error) if (1e-6..=1.0).contains(&(error * unit)) => Ok(error * unit),
        _ => Err("must be a number from 0.000001 to 1, or as many percent, as in 0.01 or 1%".into()),
    }
}

/// A finite number above 0.
pub fn positive(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(number) if number > 0.0 && number.is_finite() => Ok(number),
        _ => Err("must be a finite number above 0, as in 0.05".into()),
    }
}

/// `X,Y,Z`. Numbers that single precision cannot hold are refused, because cameras are single precision.
pub fn vector(text: &str) -> Result<DVec3, String> {
    let numbers: Vec<f64> = text.split(',').map_while(|part| part.trim().parse().ok()).collect();
    match numbers[..] {
        [x, y, z]
            if text.split(',').count() == 3 && numbers.iter().all(|number| number.abs() <= f64::from(f32::MAX)) =>
        {
            Ok(DVec3::new(x, y, z))
        }
        _ => Err("must be three finite numbers, as in 1,-2.5,3".into()),
    }
}

/// Two whole numbers.
pub fn pixel(text: &str) -> Result<[u32; 2], String> {
    let parts = text.split_once(',').map(|(x, y)| (x.trim().parse(), y.trim().parse()));
    match parts {
        Some((Ok(x), Ok(y))) => Ok([x, y]),
        _ => Err("must be two whole numbers, as in 240,180".into()),
    }
}

/// `off`, `fixed:P`, `throughput[:START]` or `efficiency[:FACTOR]`.
pub fn roulette(text: &str) -> Result<Roulette, String> {
    let (kind, argument) = match text.split_once(':') {
        Some((kind, argument)) => (kind, Some(argument)),
        None => (text, None),
    };
    match (kind, argument) {
        ("off", None) => Ok(Roulette::Off),
        ("fixed", Some(probability)) => match probability.parse() {
            Ok(probability) if probability > 0.0 && probability <= 1.0 => Ok(Roulette::Fixed(probability)),
            _ => Err("the probability must be above 0 and at most 1, as in fixed:0.7".into()),
        },
        ("throughput", None) => Ok(Roulette::THROUGHPUT),
        ("throughput", Some(start)) => whole_in(start, 0..=65536)
            .map(|start| Roulette::Throughput { start })
            .map_err(|why| format!("the number of bounces {why}, as in throughput:3")),
        ("efficiency", None) => Ok(Roulette::EFFICIENCY),
        ("efficiency", Some(factor)) => match factor.parse() {
            Ok(factor) if factor > 0.0 && factor <= 1e3 => Ok(Roulette::Efficiency { factor }),
            _ => Err("the factor must be above 0 and at most 1000, as in efficiency:0.5".into()),
        },
        _ => Err("must be off, fixed:P, throughput[:START] or efficiency[:FACTOR]".into()),
    }
}

/// Rewrites `--vp 1 -2 3` as `--vp=1,-2,3` (and so for `--vi`, `--vu`).
///
/// An option that takes either one value or three cannot be told to clap: it would take `--vp 1,2,3 scene.dae` for
/// two values.
pub fn join_vectors(arguments: impl IntoIterator<Item = OsString>) -> Vec<OsString> {
    let mut rest = arguments.into_iter().collect::<Vec<_>>().into_iter();
    let mut joined = Vec::with_capacity(rest.len());
    while let Some(argument) = rest.next() {
        if argument == "--" {
            joined.push(argument);
            break;
        }
        let is_vector = ["--vp", "--vi", "--vu"].iter().any(|option| argument == *option);
        let numbers: Vec<&str> = rest.as_slice().iter().take(3).map_while(|next| number(next)).collect();
        if is_vector && numbers.len() == 3 {
            let mut whole = argument;
            whole.push("=");
            whole.push(numbers.join(","));
            joined.push(whole);
            rest.nth(2);
        } else {
            joined.push(argument);
        }
    }
    joined.extend(rest);
    joined
}

/// The argument as text, if it reads as a number.
fn number(argument: &OsString) -> Option<&str> {
    argument.to_str().filter(|text| text.parse::<f64>().is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_stay_within_their_limits() {
        assert_eq!(whole_in("1", 1..=4), Ok(1));
        assert_eq!(whole_in("4", 1..=4), Ok(4));
        for absurd in ["0", "5", "-1", "1.5", "", "one", "99999999999999999999999", "NaN"] {
            assert_eq!(whole_in(absurd, 1..=4), Err("must be a whole number from 1 to 4".into()), "{absurd}");
        }
    }

    #[test]
    fn vectors() {
        assert_eq!(vector("1,-2.5,3e2"), Ok(DVec3::new(1.0, -2.5, 300.0)));
        assert_eq!(vector(" 1, 2, 3"), Ok(DVec3::new(1.0, 2.0, 3.0)));
        for wrong in ["", "1", "1,2", "1,2,3,4", "1,2,", "1,2,x", "x,1,2,3", "1,2,inf", "1,2,nan", "1,2,1e39"] {
            assert!(vector(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn three_numbers_become_one_vector() {
        let joined = |line: &str| {
            let words = join_vectors(line.split(' ').map(OsString::from));
            words.iter().map(|word| word.to_str().unwrap().to_owned()).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(joined("render --vp -1 2 -3e1 a.dae"), "render --vp=-1,2,-3e1 a.dae");
        assert_eq!(joined("--vp 1 2 3 --vi 4 5 6"), "--vp=1,2,3 --vi=4,5,6");
        for unchanged in ["--vp 1,2,3 a.dae", "--vp=1,2,3 4", "--vp 1 2", "-r 1 2 3", "-- --vp 1 2 3", "--vp"] {
            assert_eq!(joined(unchanged), unchanged);
        }
    }

    #[test]
    fn roulettes() {
        assert_eq!(roulette("off"), Ok(Roulette::Off));
        assert_eq!(roulette("fixed:0.7"), Ok(Roulette::Fixed(0.7)));
        assert_eq!(roulette("fixed:1"), Ok(Roulette::Fixed(1.0)));
        assert_eq!(roulette("throughput"), Ok(Roulette::Throughput { start: 3 }));
        assert_eq!(roulette("throughput:0"), Ok(Roulette::Throughput { start: 0 }));
        for wrong in ["", "on", "off:1", "fixed", "fixed:", "fixed:0", "fixed:1.1", "fixed:nan", "fixed:-0.5"] {
            assert!(roulette(wrong).is_err(), "{wrong}");
        }
        assert!(roulette("throughput:-1").is_err());
        assert_eq!(roulette("efficiency"), Ok(Roulette::EFFICIENCY));
        assert_eq!(roulette("efficiency:0.25"), Ok(Roulette::Efficiency { factor: 0.25 }));
        for wrong in ["efficiency:", "efficiency:0", "efficiency:-1", "efficiency:nan", "efficiency:inf"] {
            assert!(roulette(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn sizes_and_ages() {
        for (text, bytes) in
            [("0", 0), ("4096", 4096), ("1K", 1024), ("1.5GiB", 3 << 29), ("2 MiB", 2 << 20), ("8GB", 8_000_000_000)]
        {
            assert_eq!(size(text), Ok(bytes), "{text}");
        }
        for wrong in ["", "G", "-1", "1X", "1e9", "inf", "nan", "9999999999999G", "1.2.3", "1 G B"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
        assert_eq!(age("90m"), Ok(Duration::from_secs(5400)));
        assert_eq!(age("2w"), Ok(Duration::from_secs(14 * 86_400)));
        for wrong in ["", "d", "30", "-1d", "1.5h", "1y", "9999999d", "3€"] {
            assert!(age(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn spans_and_relative_errors() {
        for (text, seconds) in [("500ms", 0.5), ("90s", 90.0), ("1.5m", 90.0), ("2h", 7200.0), ("0.25min", 15.0)] {
            assert_eq!(span(text), Ok(Duration::from_secs_f64(seconds)), "{text}");
        }
        for wrong in ["", "s", "0s", "-1s", "5", "1e3s", "nans", "9999999h", "1.2.3s", "5 s"] {
            assert!(span(wrong).is_err(), "{wrong}");
        }
        assert_eq!((relative_error("0.01"), relative_error("1%"), relative_error("1")), (Ok(0.01), Ok(0.01), Ok(1.0)));
        for wrong in ["", "0", "1.5", "-0.1", "nan", "200%", "x"] {
            assert!(relative_error(wrong).is_err(), "{wrong}");
        }
        assert_eq!(chosen(&[("a", "", 1), ("b", "", 2), ("c", "", 3)], "b"), Ok(2));
        assert_eq!(chosen(&[("a", "", 1), ("b", "", 2), ("c", "", 3)], "d"), Err("must be a, b or c".into()));
    }

    #[test]
    fn angles_tolerances_exposures() {
        assert_eq!(angle("45"), Ok(45.0));
        assert_eq!(positive("0.05"), Ok(0.05));
        assert_eq!(exposure("-1.5"), Ok(-1.5));
        for wrong in ["0", "180", "-10", "nan", "inf", ""] {
            assert!(angle(wrong).is_err(), "{wrong}");
        }
        for wrong in ["0", "-1", "inf", "nan", "1e40", "x"] {
            assert!(positive(wrong).is_err(), "{wrong}");
        }
        for wrong in ["65", "nan", "inf"] {
            assert!(exposure(wrong).is_err(), "{wrong}");
        }
    }
}
