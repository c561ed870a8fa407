//! A spread on disk, to go on from: little-endian, every byte under a checksum.
//!
//! | bytes | |
//! |---|---|
//! | 8 | `comberΣ` (UTF-8) |
//! | 4 | version of the format: 1 |
//! | 4 | rounds |
//! | 8 | pixels |
//! | 8 | weight |
//! | 8 | length of what follows |
//! | … | what the sums are of, as JSON ([`super::about`]) |
//! | 24 a pixel | means |
//! | 24 a pixel | sums of squares |
//! | 16 | XXH3 of all that stands before |

use super::Spread;
use super::about::difference;
use crate::error::{At, Error, Result};
use crate::film::atomic_file;
use serde_json::Value;
use std::io::{ErrorKind, Write as _};
use std::path::Path;
use xxhash_rust::xxh3::xxh3_128;

const MAGIC: &[u8; 8] = b"comber\xce\xa3";
const VERSION: u32 = 1;
/// Bytes before the JSON.
const HEADER: usize = 40;
const CHECKSUM: usize = 16;

/// Replaces the file at `path`, whole or not at all.
///
/// # Errors
/// The system's.
pub fn write(path: &Path, about: &Value, spread: &Spread) -> Result<()> {
    let about = about.to_string();
    let mut bytes = Vec::with_capacity(HEADER + about.len() + 48 * spread.mean.len() + CHECKSUM);
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&VERSION.to_le_bytes());
    bytes.extend_from_slice(&spread.rounds.to_le_bytes());
    bytes.extend_from_slice(&(spread.mean.len() as u64).to_le_bytes());
    bytes.extend_from_slice(&spread.weight.to_le_bytes());
    bytes.extend_from_slice(&(about.len() as u64).to_le_bytes());
    bytes.extend_from_slice(about.as_bytes());
    for value in spread.mean.iter().chain(&spread.m2).flatten() {
        bytes.extend_from_slice(&value.to_le_bytes());
    }
    let checksum = xxh3_128(&bytes);
    bytes.extend_from_slice(&checksum.to_le_bytes());
    atomic_file::write(path, |out| out.write_all(&bytes).map_err(|e| Error::io(path, "write", e)))
}

/// Reads the sums at `path` if they are of `about` and `pixels` pixels; none if there is no file.
///
/// # Errors
/// The system's; [`Error::Import`] for a file that is damaged, or is of something else: it then says of what.
pub fn read(path: &Path, about: &Value, pixels: usize) -> Result<Option<Spread>> {
    let bytes = match std::fs::read(path) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(Error::io(path, "read", e)),
    };
    let wrong = |what: String| Error::expected(path, At::File, what, "sums of renders that comber kept");
    parse(&bytes, about, pixels).map(Some).map_err(wrong)
}

/// An error is a sentence.
fn parse(bytes: &[u8], about: &Value, pixels: usize) -> std::result::Result<Spread, String> {
    if bytes.len() < HEADER + CHECKSUM || &bytes[..8] != MAGIC {
        return Err("it does not begin as such a file".into());
    }
    let (body, checksum) = bytes.split_at(bytes.len() - CHECKSUM);
    let four = |at: usize| u32::from_le_bytes(*body[at..].first_chunk().expect("within the header"));
    let eight = |at: usize| *body[at..].first_chunk::<8>().expect("within the header");
    if four(8) != VERSION {
        return Err(format!("it has version {} of the format; this comber reads {VERSION}", four(8)));
    }
    if checksum != xxh3_128(body).to_le_bytes() {
        return Err(format!("its {} bytes do not have their checksum: it is damaged or cut off", bytes.len()));
    }
    let (count, text) = (u64::from_le_bytes(eight(16)), u64::from_le_bytes(eight(32)));
    let rest = (body.len() - HEADER) as u64;
    if count.checked_mul(Spread::BYTES_A_PIXEL).and_then(|sums| sums.checked_add(text)) != Some(rest) {
        return Err(format!("it says that it holds {count} pixels, but has {rest} bytes for them"));
    }
    let (text, sums) = body[HEADER..].split_at(text as usize);
    let there: Value = serde_json::from_slice(text).map_err(|e| format!("what it is of is not JSON: {e}"))?;
    if there != *about {
        return Err(format!("it is of something else: {}", difference(&there, about)));
    }
    if count != pixels as u64 {
        return Err(format!("it is of {count} pixels, and {pixels} are wanted"));
    }
    let mut numbers = sums.chunks_exact(8).map(|chunk| f64::from_le_bytes(chunk.try_into().expect("eight bytes")));
    let mut layer = || -> Vec<[f64; 3]> {
        (0..pixels).map(|_| [(); 3].map(|()| numbers.next().expect("the length was checked"))).collect()
    };
    Ok(Spread { rounds: four(12), weight: f64::from_le_bytes(eight(24)), mean: layer(), m2: layer() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn sums_are_written_and_read_to_the_bit_and_nothing_else_is() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.sums");
        let about = json!({"scene": "a", "options": {"seed": 1}});
        assert_eq!(read(&path, &about, 3).unwrap(), None);
        let mut spread = Spread::new(3);
        spread.add(&[[0.1, 0.2, 0.3], [1e-30, 5.0, 0.0], [7.0; 3]], 4.0).unwrap();
        spread.add(&[[0.3, 0.1, 0.3], [1e-20, 5.5, 0.0], [8.0; 3]], 8.0).unwrap();
        write(&path, &about, &spread).unwrap();
        assert_eq!(read(&path, &about, 3).unwrap().as_ref(), Some(&spread));

        let refused = |about: &Value, pixels| read(&path, about, pixels).unwrap_err().to_string();
        let other = json!({"scene": "a", "options": {"seed": 2}});
        assert!(refused(&other, 3).contains("options.seed is 1 there and 2 here"), "{}", refused(&other, 3));
        assert!(refused(&about, 4).contains("3 pixels"), "{}", refused(&about, 4));
        let bytes = std::fs::read(&path).unwrap();
        for end in 0..bytes.len() {
            std::fs::write(&path, &bytes[..end]).unwrap();
            assert!(read(&path, &about, 3).is_err(), "cut off at {end}");
        }
        for at in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x10;
            std::fs::write(&path, &damaged).unwrap();
            assert!(read(&path, &about, 3).is_err(), "byte {at}");
        }
    }
}
