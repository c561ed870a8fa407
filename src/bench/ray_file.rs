//! Sets of rays on disk, so that others can trace the same ones, and compare hits.
//!
//! All numbers are little-endian; `f32` are IEEE 754 binary32.
//!
//! | bytes | what |
//! |---|---|
//! | 8 | `COMBRAYS` |
//! | u32 | version: 1 |
//! | u32 | CRC-32 (IEEE 802.3) of everything that follows |
//! | u64 | triangles of the scene |
//! | u64 | spheres of the scene |
//! | u32, bytes | length and text of the scene's name, UTF-8 |
//! | u32 | number of sets; then for each: |
//! | u32, bytes | length and text of the set's name, UTF-8, at most 64 bytes |
//! | u8 | asked: 0 closest hit, 1 any hit |
//! | u8 | bit 0: rays have distances; bit 1: answers follow |
//! | u64 | number of rays |
//! | u32 | number of batches, and for each a u32: its rays in the lower 31 bits, coherent in the highest |
//! | f32 × rays | origin x, then y, z, direction x, y, z, and the farthest distance that counts if they have any |
//! | f32, u32 × rays | answers, closest: distance, then primitive; infinite and 2³² − 1 for a miss |
//! | u8 × rays | answers, any: 1 if something is hit |
//!
//! Batches are what comber's waves were; together they have as many rays as the set. Primitives are numbered as in comber:
//! triangles in the order of the scene, then spheres.

use super::agreement::Answers;
use super::rays::{Batch, RaySet, Rays};
use crate::bvh::Query;
use crate::error::{At, Error, Result};
use crate::film::atomic_file;
use std::io::Write as _;
use std::path::Path;

const MAGIC: &[u8; 8] = b"COMBRAYS";
const VERSION: u32 = 1;
/// Bytes before what the checksum covers.
const HEADER: usize = 16;
const COHERENT: u32 = 1 << 31;
const DISTANCES: u8 = 1;
const ANSWERS: u8 = 2;
/// Longest name of a set.
const NAME: usize = 64;

/// What a file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct RayFile {
    /// The scene's name, for people.
    pub scene: String,
    /// Triangles and spheres of the scene that the rays were made for.
    pub primitives: [u64; 2],
    /// The sets, with the answers of whoever wrote the file.
    pub sets: Vec<(RaySet, Option<Answers>)>,
}

/// Replaces the file at `path`.
///
/// # Errors
/// The system's, and names that are too long.
pub fn write(path: &Path, file: &RayFile) -> Result<()> {
    let mut body = Vec::new();
    file.primitives.iter().for_each(|count| body.extend(count.to_le_bytes()));
    text(&mut body, &file.scene);
    word(&mut body, file.sets.len());
    for (set, answers) in &file.sets {
        text(&mut body, &set.name);
        body.push(u8::from(set.query == Query::Any));
        let distances = if set.rays.t_max.is_some() { DISTANCES } else { 0 };
        body.push(distances | if answers.is_some() { ANSWERS } else { 0 });
        body.extend((set.rays.len() as u64).to_le_bytes());
        word(&mut body, set.batches.len());
        for batch in &set.batches {
            word(&mut body, (batch.rays | if batch.coherent { COHERENT } else { 0 }) as usize);
        }
        for column in set.rays.columns.iter().chain(&set.rays.t_max) {
            body.extend(column.iter().flat_map(|value| value.to_le_bytes()));
        }
        match answers {
            Some(Answers::Closest(hits)) => {
                body.extend(hits.iter().flat_map(|hit| hit.0.to_le_bytes()));
                body.extend(hits.iter().flat_map(|hit| hit.1.to_le_bytes()));
            }
            Some(Answers::Any(hits)) => body.extend(hits.iter().map(|&hit| u8::from(hit))),
            None => {}
        }
    }
    atomic_file::write(path, |out| {
        let parts = [&MAGIC[..], &VERSION.to_le_bytes(), &crc32fast::hash(&body).to_le_bytes(), &body];
        parts.into_iter().try_for_each(|part| out.write_all(part)).map_err(|e| Error::io(path, "write", e))
    })
}

fn word(body: &mut Vec<u8>, value: usize) {
    body.extend((value as u32).to_le_bytes());
}

fn text(body: &mut Vec<u8>, text: &str) {
    word(body, text.len());
    body.extend(text.as_bytes());
}

/// Reads the file at `path`.
///
/// # Errors
/// With the byte where it is wrong: not such a file, another version, damaged, cut short, counts that do not match, or rays that
/// nothing can trace.
pub fn read(path: &Path) -> Result<RayFile> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, "read", e))?;
    let mut reader = Reader { path, bytes: &bytes, at: 0 };
    if reader.take(8, "the magic word")? != MAGIC {
        return Err(Error::expected(path, At::Byte(0), "not a file of rays", "COMBRAYS, as --dump-rays writes it"));
    }
    let version = reader.u32("the version")?;
    if version != VERSION {
        return Err(Error::expected(path, At::Byte(8), format!("version {version}"), format!("version {VERSION}")));
    }
    let checksum = reader.u32("the checksum")?;
    let found = crc32fast::hash(&bytes[HEADER..]);
    if checksum != found {
        let what = format!("the file is damaged or cut short: its checksum is {found:08x}");
        return Err(Error::expected(path, At::Byte(12), what, format!("{checksum:08x}")));
    }
    let primitives = [reader.u64("the number of triangles")?, reader.u64("the number of spheres")?];
    let scene = reader.text(bytes.len(), "the scene's name")?;
    let count = reader.u32("the number of sets")?;
    let mut sets: Vec<(RaySet, Option<Answers>)> = Vec::new();
    for _ in 0..count {
        let at = reader.at;
        let (set, answers) = reader.set()?;
        if sets.iter().any(|(other, _)| other.name == set.name) {
            return Err(reader.wrong(at, format!("a second set of the name '{}'", set.name)));
        }
        sets.push((set, answers));
    }
    if reader.at != bytes.len() {
        return Err(reader.wrong(reader.at, format!("{} bytes after the last set", bytes.len() - reader.at)));
    }
    Ok(RayFile { scene, primitives, sets })
}

struct Reader<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    fn wrong(&self, at: usize, what: impl Into<String>) -> Error {
        Error::import(self.path, At::Byte(at as u64), what)
    }

    /// The next `count` bytes, of what `what` names.
    fn take(&mut self, count: usize, what: &str) -> Result<&'a [u8]> {
        let rest = &self.bytes[self.at..];
        if count > rest.len() {
            let expected = format!("{count} bytes of {what}");
            let what = format!("the file ends after {} more bytes", rest.len());
            return Err(Error::expected(self.path, At::Byte(self.at as u64), what, expected));
        }
        self.at += count;
        Ok(&rest[..count])
    }

    fn array<const N: usize>(&mut self, what: &str) -> Result<[u8; N]> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N, what)?);
        Ok(array)
    }

    fn u32(&mut self, what: &str) -> Result<u32> {
        self.array(what).map(u32::from_le_bytes)
    }

    fn u64(&mut self, what: &str) -> Result<u64> {
        self.array(what).map(u64::from_le_bytes)
    }

    /// `count` 32-bit words. The file is known to hold them before anything is allocated.
    fn words(&mut self, count: usize, what: &str) -> Result<impl Iterator<Item = [u8; 4]> + 'a> {
        let bytes = self.take(count.saturating_mul(4), what)?;
        Ok(bytes.as_chunks::<4>().0.iter().copied())
    }

    fn text(&mut self, longest: usize, what: &str) -> Result<String> {
        let at = self.at;
        let length = self.u32(what)? as usize;
        if length > longest {
            return Err(self.wrong(at, format!("{what} is {length} bytes long; at most {longest} are allowed")));
        }
        let text = std::str::from_utf8(self.take(length, what)?);
        text.map(str::to_owned).map_err(|_| self.wrong(at, format!("{what} is not UTF-8")))
    }

    fn set(&mut self) -> Result<(RaySet, Option<Answers>)> {
        let at = self.at;
        let name = self.text(NAME, "the name of a set")?;
        if name.is_empty() || !name.chars().all(|c| c.is_ascii_alphanumeric() || "_-.".contains(c)) {
            return Err(self.wrong(at, "the name of a set has other characters than letters, digits, '_', '-' and '.'"));
        }
        let at = self.at;
        let query = match self.array("what is asked")? {
            [0] => Query::Closest,
            [1] => Query::Any,
            [other] => return Err(self.wrong(at, format!("what is asked is {other}, neither 0 nor 1"))),
        };
        let at = self.at;
        let [flags] = self.array("the flags")?;
        if flags & !(DISTANCES | ANSWERS) != 0 {
            return Err(self.wrong(at, format!("unknown flags {flags:#x}")));
        }
        let at = self.at;
        let count = self.u64("the number of rays")?;
        // Rays are numbered by 32 bits.
        let count =
            u32::try_from(count).map_err(|_| self.wrong(at, format!("{count} rays, more than a set can have")))?;
        let count = count as usize;
        let batches = self.batches(count)?;
        let rays = self.rays(count, flags & DISTANCES != 0)?;
        let answers = if flags & ANSWERS != 0 { Some(self.answers(query, count)?) } else { None };
        Ok((RaySet { name, query, rays, batches }, answers))
    }

    fn batches(&mut self, rays: usize) -> Result<Vec<Batch>> {
        let at = self.at;
        let count = self.u32("the number of batches")? as usize;
        let words = self.words(count, "the batches")?.map(u32::from_le_bytes);
        let batches: Vec<Batch> =
            words.map(|word| Batch { rays: word & !COHERENT, coherent: word & COHERENT != 0 }).collect();
        let sum: u64 = batches.iter().map(|batch| u64::from(batch.rays)).sum();
        if sum != rays as u64 || batches.iter().any(|batch| batch.rays == 0) {
            return Err(self.wrong(at, format!("batches of {sum} rays in all (none may be empty), of a set of {rays}")));
        }
        Ok(batches)
    }

    fn rays(&mut self, count: usize, distances: bool) -> Result<Rays> {
        let mut rays = Rays::default();
        let at = self.at;
        for column in &mut rays.columns {
            *column = self.words(count, "a column of rays")?.map(f32::from_le_bytes).collect();
        }
        if distances {
            rays.t_max = Some(self.words(count, "the distances")?.map(f32::from_le_bytes).collect());
        }
        let all = rays.all();
        // Peers may do anything with rays that nothing can trace.
        match (0..count).find(|&row| !all.ray(row).is_traceable()) {
            Some(row) => Err(self.wrong(
                at + 4 * row,
                format!("ray {row} cannot be traced ({:?}): it needs finite numbers and a direction", all.ray(row)),
            )),
            None => Ok(rays),
        }
    }

    fn answers(&mut self, query: Query, count: usize) -> Result<Answers> {
        match query {
            Query::Closest => {
                let distances = self.words(count, "the distances of the answers")?.map(f32::from_le_bytes);
                let primitives = self.words(count, "the primitives of the answers")?.map(u32::from_le_bytes);
                Ok(Answers::Closest(distances.zip(primitives).collect()))
            }
            Query::Any => {
                let at = self.at;
                let bytes = self.take(count, "the answers")?;
                match bytes.iter().position(|&byte| byte > 1) {
                    Some(row) => Err(self.wrong(at + row, format!("the answer is {}, neither 0 nor 1", bytes[row]))),
                    None => Ok(Answers::Any(bytes.iter().map(|&byte| byte == 1).collect())),
                }
            }
        }
    }
}
