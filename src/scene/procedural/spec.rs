//! Reads specifications: `proc:NAME[,tris=N][,seed=S]`.

use crate::error::{Error, Result};

/// The fewest triangles that can be asked for.
pub const MIN_TRIANGLES: u64 = 12;
/// The most triangles that can be asked for.
pub const MAX_TRIANGLES: u64 = 30_000_000;
/// What a specification without `tris=` gets.
pub const DEFAULT_TRIANGLES: u64 = 100_000;

/// A family of shapes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// A unit sphere.
    Sphere,
    /// A ring torus.
    Torus,
    /// A trefoil of three twisted strands with a fine grain.
    Knot,
    /// A fractal heightfield: the one smooth family with an edge.
    Terrain,
    /// A softly displaced sphere.
    Blob,
    /// A sphere displaced by ridges over many octaves.
    Coral,
    /// Random small triangles in a ball: nothing for a BVH to hold on to.
    Soup,
    /// Turned cubes on a lattice; a single one for 12 triangles.
    Cubes,
}

impl Family {
    /// All of them, by the name that specifications use.
    pub const ALL: [(&'static str, Family); 8] = [
        ("sphere", Family::Sphere),
        ("torus", Family::Torus),
        ("knot", Family::Knot),
        ("terrain", Family::Terrain),
        ("blob", Family::Blob),
        ("coral", Family::Coral),
        ("soup", Family::Soup),
        ("cubes", Family::Cubes),
    ];
}

/// A specification, understood.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Spec {
    /// What to make.
    pub family: Family,
    /// How many triangles to aim for.
    pub triangles: u64,
    /// Seed of everything random about it.
    pub seed: u32,
}

impl Spec {
    /// Reads `proc:NAME[,tris=N][,seed=S]`; errors quote `text` and say what would do.
    pub fn parse(text: &str) -> Result<Spec> {
        let fail = |what: String| Error::Options(format!("`{text}`: {what}"));
        let body = text
            .strip_prefix("proc:")
            .ok_or_else(|| fail("a procedural mesh is written proc:NAME[,tris=N][,seed=S]".into()))?;
        let mut parts = body.split(',');
        let name = parts.next().unwrap_or_default();
        let family =
            Family::ALL.iter().find(|(known, _)| *known == name).map(|&(_, family)| family).ok_or_else(|| {
                let known: Vec<&str> = Family::ALL.iter().map(|(known, _)| *known).collect();
                fail(format!("there is no procedural mesh called `{name}`; there are {}", known.join(", ")))
            })?;
        let default = if family == Family::Cubes { MIN_TRIANGLES } else { DEFAULT_TRIANGLES };
        let mut spec = Spec { family, triangles: default, seed: 0 };
        for part in parts {
            match part.split_once('=') {
                Some(("tris", value)) => spec.triangles = triangle_count(value).map_err(&fail)?,
                Some(("seed", value)) => {
                    spec.seed = value
                        .parse()
                        .map_err(|_| fail(format!("`{value}` is no seed; expected a whole number below 2³²")))?;
                }
                _ => return Err(fail(format!("`{part}` is not understood; expected tris=N or seed=S"))),
            }
        }
        Ok(spec)
    }
}

/// Reads a number of triangles: digits, perhaps with a fraction, then perhaps `k` (thousand) or `M` (million).
fn triangle_count(text: &str) -> std::result::Result<u64, String> {
    let (digits, factor) = match text.strip_suffix(['k', 'K']) {
        Some(digits) => (digits, 1e3),
        None => text.strip_suffix(['m', 'M']).map_or((text, 1.0), |digits| (digits, 1e6)),
    };
    let plain = digits.starts_with(|c: char| c.is_ascii_digit()) && digits.ends_with(|c: char| c.is_ascii_digit());
    let number =
        digits.parse::<f64>().ok().filter(|_| plain && digits.bytes().all(|b| b.is_ascii_digit() || b == b'.'));
    let number = number.ok_or_else(|| format!("`{text}` is no number of triangles; expected 12, 1k, 2.5M, …"))?;
    let count = (number * factor).round();
    if !(MIN_TRIANGLES as f64..=MAX_TRIANGLES as f64).contains(&count) {
        return Err(format!("{text} triangles are out of range; expected {MIN_TRIANGLES} to 30M"));
    }
    Ok(count as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_read_with_their_suffixes() {
        for (text, count) in [
            ("12", 12),
            ("1k", 1000),
            ("1K", 1000),
            ("1M", 1_000_000),
            ("2.5M", 2_500_000),
            ("30M", 30_000_000),
            ("0.5k", 500),
        ] {
            assert_eq!(triangle_count(text), Ok(count), "{text}");
        }
    }

    #[test]
    fn what_is_no_count_is_refused() {
        for text in ["", "k", "M", "-5", "+50", "1e3", "inf", "NaN", "1.2.3", "50.", ".5M", "1kM", "12 ", "0x20", "११"]
        {
            let message = triangle_count(text).unwrap_err();
            assert!(message.contains("no number"), "{text}: {message}");
        }
        for text in ["0", "11", "30000001", "31M", "99999999999999999999999999"] {
            let message = triangle_count(text).unwrap_err();
            assert!(message.contains("out of range"), "{text}: {message}");
        }
    }

    #[test]
    fn specifications_are_read_in_any_order() {
        let spec = Spec::parse("proc:knot,seed=7,tris=2k").unwrap();
        assert_eq!(spec, Spec { family: Family::Knot, triangles: 2000, seed: 7 });
        assert_eq!(Spec::parse("proc:sphere").unwrap().triangles, DEFAULT_TRIANGLES);
        assert_eq!(Spec::parse("proc:cubes").unwrap().triangles, 12);
    }

    #[test]
    fn unknown_names_list_the_known_ones() {
        let message = Spec::parse("proc:teapot").unwrap_err().to_string();
        for (name, _) in Family::ALL {
            assert!(message.contains(name), "{message}");
        }
        for text in ["knot", "proc:", "proc:knot,tris", "proc:knot,size=2", "proc:knot,seed=-1", "proc:knot,"] {
            assert!(Spec::parse(text).is_err(), "{text}");
        }
    }
}
