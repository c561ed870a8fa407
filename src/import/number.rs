//! Decimal numbers out of text, exactly rounded and faster than [`str::parse`].

/// Powers of ten that `f64` holds exactly.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

/// As many decimal digits as always fit in a `u64`.
const MAX_DIGITS: usize = 19;

/// The number that a whole token spells, as [`str::parse`] would round it (`nan` and `inf` included).
pub fn parse_f32(token: &[u8]) -> Option<f32> {
    match f32_prefix(token) {
        Some((value, length)) if length == token.len() => Some(value),
        _ => std::str::from_utf8(token).ok()?.parse().ok(),
    }
}

/// As [`parse_f32`], in `f64`.
pub fn parse_f64(token: &[u8]) -> Option<f64> {
    std::str::from_utf8(token).ok()?.parse().ok()
}

/// The number at the start of `bytes` and its length, where that is quick and certain to be exactly rounded.
///
/// The caller checks that the token ends there, and asks [`parse_f32`] otherwise and after `None`.
pub fn f32_prefix(bytes: &[u8]) -> Option<(f32, usize)> {
    let (negative, mut at) = sign(bytes);
    let mut mantissa = 0u64;
    let start = at;
    at = digits(bytes, at, &mut mantissa);
    let mut seen = at - start;
    let mut power = 0i64;
    if bytes.get(at) == Some(&b'.') {
        let fraction = at + 1;
        at = digits(bytes, fraction, &mut mantissa);
        seen += at - fraction;
        power = -((at - fraction) as i64);
    }
    // Beyond this the mantissa may have wrapped round.
    if seen == 0 || seen > MAX_DIGITS {
        return None;
    }
    if let Some(b'e' | b'E') = bytes.get(at) {
        let (negative, first) = sign(&bytes[at + 1..]);
        let mut exponent = 0u64;
        let first = at + 1 + first;
        at = digits(bytes, first, &mut exponent);
        if at == first || at - first > 4 {
            return None;
        }
        power += if negative { -(exponent as i64) } else { exponent as i64 };
    }
    let scale = *POWERS.get(power.unsigned_abs() as usize)?;
    if mantissa > 1 << f64::MANTISSA_DIGITS {
        return None;
    }
    // Both operands are exact, so this one operation is exactly rounded to f64.
    let wide = if power < 0 { mantissa as f64 / scale } else { mantissa as f64 * scale };
    let value = narrow(wide)?;
    Some((if negative { -value } else { value }, at))
}

/// Rounds to `f32` where that surely equals rounding the exact value once.
///
/// Rounding twice goes wrong only where the first step lands halfway between two `f32`s: the exact value may
/// have been on either side. Below the normal numbers the halfway points are elsewhere.
fn narrow(wide: f64) -> Option<f32> {
    const DROPPED: u64 = (1 << 29) - 1;
    const HALFWAY: u64 = 1 << 28;
    let halfway = wide.to_bits() & DROPPED == HALFWAY;
    let tiny = wide != 0.0 && wide < f64::from(f32::MIN_POSITIVE);
    (!halfway && !tiny).then_some(wide as f32)
}

/// The whole number at the start of `bytes` and its length; `None` if there is none or it has over 18 digits.
pub fn integer_prefix(bytes: &[u8]) -> Option<(i64, usize)> {
    let (negative, first) = sign(bytes);
    let mut value = 0u64;
    let end = digits(bytes, first, &mut value);
    if end == first || end - first >= MAX_DIGITS {
        return None;
    }
    let value = value as i64;
    Some((if negative { -value } else { value }, end))
}

fn sign(bytes: &[u8]) -> (bool, usize) {
    match bytes.first() {
        Some(b'-') => (true, 1),
        Some(b'+') => (false, 1),
        _ => (false, 0),
    }
}

/// Appends the decimal digits from `at` on to `value` (wrapping round), and returns where they end.
#[inline]
fn digits(bytes: &[u8], mut at: usize, value: &mut u64) -> usize {
    while let Some(digit) = bytes.get(at).map(|byte| byte.wrapping_sub(b'0')).filter(|&digit| digit < 10) {
        *value = value.wrapping_mul(10).wrapping_add(u64::from(digit));
        at += 1;
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn same_as_std(text: &str) {
        let expected = text.parse::<f32>().ok().map(f32::to_bits);
        assert_eq!(parse_f32(text.as_bytes()).map(f32::to_bits), expected, "{text}");
    }

    #[test]
    fn odd_spellings_match_std() {
        for text in [
            "0",
            "-0",
            "+1",
            "1.",
            ".5",
            "-.5e1",
            "+.5E+1",
            ".",
            "",
            "-",
            "e5",
            "1e",
            "1e+",
            "1e5",
            "1E-5",
            "1e39",
            "1e-46",
            "1e99999",
            "1.5f",
            "0x10",
            "nan",
            "NaN",
            "inf",
            "-infinity",
            "1,5",
            "1 2",
            "٣",
            "3.4028235e38",
            "3.4028236e38",
            "340282356779733661637539395458142568447",
            "1.1754943e-38",
            "1.4e-45",
            "7e-46",
            "1e-45",
            "00000000000000000000000000001",
            "0.00000000000000000000000000000000001",
            "9007199254740993",
            "18446744073709551616",
            "99999999999999999999999999",
            "16777217",
            "16777219",
            "1.00000005960464477539",
            "1.000000059604644775390625",
            "1.0000000596046447753906251",
            "1.00000005960464477",
            "1.00000017881393432617",
        ] {
            same_as_std(text);
        }
    }

    #[test]
    fn integers() {
        assert_eq!(integer_prefix(b"12/3"), Some((12, 2)));
        assert_eq!(integer_prefix(b"-1 "), Some((-1, 2)));
        assert_eq!(integer_prefix(b"+7"), Some((7, 2)));
        assert_eq!(integer_prefix(b"999999999999999999"), Some((999_999_999_999_999_999, 18)));
        for text in ["", "-", "x", "9999999999999999999"] {
            assert_eq!(integer_prefix(text.as_bytes()), None, "{text}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn any_f32_survives(bits: u32) {
            let value = f32::from_bits(bits);
            same_as_std(&format!("{value}"));
            same_as_std(&format!("{value:e}"));
            same_as_std(&format!("{value:.6}"));
            same_as_std(&format!("{value:.8e}"));
        }

        /// The decimal neighbourhood of points halfway between two floats, where rounding twice goes wrong.
        #[test]
        fn halfway_points_match_std(bits in 0x2000_0000u32..0x6000_0000, ulps in -2i64..=2, places in 6usize..20) {
            let low = f64::from(f32::from_bits(bits));
            let high = f64::from(f32::from_bits(bits + 1));
            let near = f64::from_bits(((low + high) / 2.0).to_bits().wrapping_add_signed(ulps));
            same_as_std(&format!("{near:.places$e}"));
            same_as_std(&format!("{near}"));
        }

        #[test]
        fn decimal_shapes_match_std(text in "[-+]?[0-9]{0,12}(\\.[0-9]{0,12})?([eE][-+]?[0-9]{0,3})?") {
            same_as_std(&text);
        }

        #[test]
        fn any_bytes_match_std(bytes in proptest::collection::vec(any::<u8>(), 0..12)) {
            let expected = std::str::from_utf8(&bytes).ok().and_then(|text| text.parse::<f32>().ok());
            prop_assert_eq!(parse_f32(&bytes).map(f32::to_bits), expected.map(f32::to_bits));
        }
    }
}
