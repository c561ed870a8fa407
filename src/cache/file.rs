//! One cached tree in one file.
//!
//! A header of 4096 bytes, then the sections of the tree, each padded with zeros to a multiple of 4096 bytes. Numbers have
//! the byte order of the machine. Every byte is covered: the header by a checksum of its own, a section and its
//! padding by one in the header.

use std::fs::File;
use std::io::{Read, Write};
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::digest::digest;
use super::key::{Key, describe};
use crate::bvh::stored::{Facts, ROWS, SECTIONS, Stored};
use crate::bvh::{Aabb, Accel, Bvh4, Grid};
use crate::error::{Error, Result};
use crate::options::AccelOptions;
use crate::scene::shapes::Shapes;
use crate::system::MappedFile;

/// Raised whenever the layout of a file changes, or the builder makes another tree from the same input, or of other parts of it.
pub const VERSION: u32 = 5;

const MAGIC: [u8; 8] = *b"comber\r\n";
/// Reads as another number on a machine of the other byte order.
const ENDIAN: u32 = 0x0403_0201;
const HEADER: usize = 4096;
const ALIGN: usize = 4096;
/// Bytes written at a time.
const BATCH: usize = 16 << 20;

/// What stands at the beginning of a file.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Header {
    magic: [u8; 8],
    endian: u32,
    version: u32,
    key: [u64; 2],
    /// Length of the whole file.
    pub file_bytes: u64,
    /// How many primitives the tree holds; a few more may stand beside it.
    pub primitives: u64,
    /// Seconds that building it took.
    pub build_seconds: f64,
    sah_cost: f64,
    bounds: [f32; 6],
    grid: Grid,
    spare: u32,
    sections: [SectionPlace; SECTIONS],
    /// Of which scene, as UTF-8 cut to size.
    name: [u8; 256],
    /// [`describe`], cut to size: for people, as the key has all of it.
    options: [u8; 512],
    unused: [u8; HEADER - 1112],
    checksum: [u64; 2],
}

/// Where a section lies.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct SectionPlace {
    offset: u64,
    bytes: u64,
    row: u64,
    checksum: [u64; 2],
}

const _: () = assert!(size_of::<Header>() == HEADER);

fn halves(number: u128) -> [u64; 2] {
    [number as u64, (number >> 64) as u64]
}

/// As much of `text` as fits.
fn cut<const N: usize>(text: &str) -> [u8; N] {
    let mut bytes = [0; N];
    let end = (0..=N.min(text.len())).rev().find(|&end| text.is_char_boundary(end)).unwrap_or(0);
    bytes[..end].copy_from_slice(&text.as_bytes()[..end]);
    bytes
}

fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|&byte| byte == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).into_owned()
}

impl Header {
    /// Of a tree, which it hashes.
    fn new(bvh: &Bvh4, key: Key, name: &str, options: &AccelOptions) -> Header {
        let (sections, facts) = (bvh.sections(), bvh.facts());
        let mut header = Header {
            magic: MAGIC,
            endian: ENDIAN,
            version: VERSION,
            key: halves(key.0),
            primitives: bvh.stats().primitives as u64,
            build_seconds: facts.build_seconds,
            grid: facts.grid,
            sah_cost: facts.sah_cost,
            name: cut(name),
            options: cut(&describe(options)),
            ..Header::zeroed()
        };
        header.bounds[..3].copy_from_slice(&facts.bounds.min.to_array());
        header.bounds[3..].copy_from_slice(&facts.bounds.max.to_array());
        let mut offset = HEADER;
        for ((place, bytes), row) in header.sections.iter_mut().zip(sections).zip(ROWS) {
            let checksum = halves(digest(&[bytes, padding(bytes.len())]));
            *place = SectionPlace { offset: offset as u64, bytes: bytes.len() as u64, row: row as u64, checksum };
            offset = (offset + bytes.len()).next_multiple_of(ALIGN);
        }
        header.file_bytes = offset as u64;
        header.checksum = header.own_checksum();
        header
    }

    fn own_checksum(&self) -> [u64; 2] {
        halves(digest(&[&bytemuck::bytes_of(self)[..HEADER - size_of::<[u64; 2]>()]]))
    }

    /// Reads the header of a file of `length` bytes and checks all that it says; or tells what is wrong.
    pub fn read(file: &mut File, length: u64) -> std::result::Result<Header, String> {
        let mut header = Header::zeroed();
        if length < HEADER as u64 {
            return Err(format!("it has {length} bytes, less than a header"));
        }
        file.read_exact(bytemuck::bytes_of_mut(&mut header)).map_err(|e| format!("it cannot be read: {e}"))?;
        let wrong = |what: &str| Err(what.to_owned());
        if header.magic != MAGIC {
            return wrong("it is no file of this cache");
        }
        if header.endian != ENDIAN {
            return wrong("it is from a machine of another byte order");
        }
        if header.version != VERSION {
            return Err(format!("it has version {}; expected {VERSION}", header.version));
        }
        if header.checksum != header.own_checksum() {
            return wrong("the checksum of its header is wrong");
        }
        if header.file_bytes != length {
            return Err(format!("it has {length} bytes; expected {}", header.file_bytes));
        }
        if header.places().is_none() {
            return wrong("its sections do not lie as they should");
        }
        Ok(header)
    }

    /// Where the sections lie: one after the other, up to the end of the file.
    fn places(&self) -> Option<[Range<usize>; SECTIONS]> {
        let mut places = [const { 0..0 }; SECTIONS];
        let mut offset = HEADER as u64;
        for ((place, range), row) in self.sections.iter().zip(&mut places).zip(ROWS) {
            let end = offset.checked_add(place.bytes)?;
            if place.offset != offset || place.row != row as u64 || place.bytes % place.row != 0 {
                return None;
            }
            *range = usize::try_from(offset).ok()?..usize::try_from(end).ok()?;
            offset = end.checked_next_multiple_of(ALIGN as u64)?;
        }
        (offset == self.file_bytes).then_some(places)
    }

    /// The key of the tree.
    pub fn key(&self) -> Key {
        Key(u128::from(self.key[1]) << 64 | u128::from(self.key[0]))
    }

    /// Name of the scene that it was built for.
    pub fn name(&self) -> String {
        text(&self.name)
    }

    /// The options that it was built with.
    pub fn options(&self) -> String {
        text(&self.options)
    }
}

/// The zeros after a section of so many bytes.
fn padding(bytes: usize) -> &'static [u8] {
    const ZEROS: [u8; ALIGN] = [0; ALIGN];
    &ZEROS[..bytes.next_multiple_of(ALIGN) - bytes]
}

/// A tree about to be written: its header has been computed.
pub struct Image<'a> {
    bvh: &'a Bvh4,
    header: Header,
}

impl<'a> Image<'a> {
    /// Hashes the tree.
    pub fn new(bvh: &'a Bvh4, key: Key, name: &str, options: &AccelOptions) -> Image<'a> {
        Image { bvh, header: Header::new(bvh, key, name, options) }
    }

    /// Bytes of the file.
    pub fn bytes(&self) -> u64 {
        self.header.file_bytes
    }

    /// Writes the file. `progress` hears how many bytes are written.
    pub fn write(&self, path: &Path, out: &mut impl Write, progress: &dyn Fn(u64)) -> Result<()> {
        let mut done = 0;
        let mut put = |bytes: &[u8]| {
            for batch in bytes.chunks(BATCH) {
                out.write_all(batch).map_err(|e| Error::io(path, "write", e))?;
                done += batch.len() as u64;
                progress(done);
            }
            Ok(())
        };
        put(bytemuck::bytes_of(&self.header))?;
        for section in self.bvh.sections() {
            put(section)?;
            put(padding(section.len()))?;
        }
        Ok(())
    }
}

/// Maps the tree over `shapes` from a file, and builds what stands beside it; or tells what is wrong with the file.
///
/// All of it is looked at, for damage and for sense: 1.7 GiB in the system's cache take two cores 0.36 s, of which the checksums are 0.16 s, and
/// finding out what stands beside the tree 0.1 s.
// Tried: asking for the pages with MADV_WILLNEED, and reading the file to hash it before mapping it. Neither was faster, from the disk
// (5 to 6 s beside other work) or from the system's cache.
pub fn load(mut file: File, key: Key, shapes: &Shapes, options: &AccelOptions) -> std::result::Result<Accel, String> {
    let unreadable = |e: std::io::Error| format!("it cannot be read: {e}");
    let length = file.metadata().map_err(unreadable)?.len();
    let header = Header::read(&mut file, length)?;
    if header.key() != key {
        return Err(format!("it holds the tree {} under another name", header.key()));
    }
    let places = header.places().ok_or("its sections do not lie as they should")?;
    let map = Arc::new(MappedFile::new(&file).map_err(unreadable)?);
    for (place, range) in header.sections.iter().zip(&places) {
        let end = range.end.next_multiple_of(ALIGN);
        let (section, rest) = map.get(range.start..end).ok_or("it has become shorter")?.split_at(range.len());
        if halves(digest(&[section, rest])) != place.checksum {
            return Err(format!("the checksum of its bytes {} to {} is wrong", range.start, end));
        }
    }
    let [a, b, c, d, e, f] = header.bounds;
    let facts = Facts {
        bounds: Aabb { min: Vec3::new(a, b, c), max: Vec3::new(d, e, f) },
        grid: header.grid,
        sah_cost: header.sah_cost,
        build_seconds: header.build_seconds,
    };
    Accel::load(Stored { file: &map, sections: &places, facts }, shapes, options)
}
