//! OpenEXR pictures: every layer as linear 32-bit floats under the names that other tools use.
//!
//! | Layer | Channels | Named after |
//! |---|---|---|
//! | beauty | `R G B` | OpenEXR |
//! | albedo | `Albedo.R/G/B` | pbrt-v4 |
//! | normal | `Ns.X/Y/Z` | pbrt-v4 (shading normal) |
//! | depth | `Z` | OpenEXR |
//! | variance | `Variance.R/G/B` | pbrt-v4 |
//! | sample count | `Debug Sample Count.X` | Cycles |
//!
//! The sample count is a float too, as Cycles has it, because some viewers show nothing else; so counts are exact up
//! to 2²⁴ = 16,777,216. There is no alpha. The display window is the whole frame, the data window the rendered part.
//!
//! Provenance is one string attribute, `comber`, of ASCII JSON. It is one because the `exr` crate keeps custom
//! attributes in a hash map: two of them would change places from run to run, and equal pictures must be equal bytes.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use exr::block::lines::LineRefMut;
use exr::image::write::samples::{SamplesWriter, WritableSamples};
use exr::math::RoundingMode;
use exr::meta::attribute::LevelMode;
use exr::meta::header::Header;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Blocks, Compression, Encoding, FlatSamples, Image, ImageAttributes,
    IntegerBounds, Layer, LayerAttributes, LineOrder, ReadChannels as _, ReadLayers as _, SampleType, Text, Vec2,
    WritableImage as _, read as exr_read,
};
use serde_json::Value;

use crate::error::{At, Error, Result};
use crate::film::atomic_file;
use crate::film::picture::Picture;

/// Name of the attribute that holds the provenance.
pub(crate) const PROVENANCE: &str = "comber";

/// ZIP over 16 lines: on noisy renders both smaller and faster than PIZ, the usual advice for grainy pictures.
///
/// 960 × 720 pixels, 2 threads, MB and seconds to write. Beauty alone: none 8.3 / 0.02, RLE 7.8 / 0.04, ZIP16 7.4 / 0.31,
/// PIZ 7.5 / 0.48. All layers: none 38.7 / 0.07, RLE 35.0 / 0.14, ZIP1 21.1 / 0.74, ZIP16 15.7 / 0.77, PIZ 19.0 / 1.02.
const COMPRESSION: Compression = Compression::ZIP16;

/// Writes all layers of `picture` to `path`, whole or not at all.
///
/// The same picture gives the same bytes, for any number of threads.
///
/// # Errors
///
/// [`Error::Encode`] if a layer is not `width · height` long or the data window is empty or leaves the frame;
/// [`Error::Io`] if the file cannot be written.
pub fn write(path: &Path, picture: &Picture) -> Result<()> {
    check(picture).map_err(|what| Error::Encode { path: path.to_path_buf(), what })?;

    let mut channels = Vec::new();
    colour(&mut channels, ["R", "G", "B"], Some(&picture.beauty));
    colour(&mut channels, ["Albedo.R", "Albedo.G", "Albedo.B"], picture.albedo.as_ref());
    colour(&mut channels, ["Ns.X", "Ns.Y", "Ns.Z"], picture.normal.as_ref());
    colour(&mut channels, ["Variance.R", "Variance.G", "Variance.B"], picture.variance.as_ref());
    if let Some(depth) = &picture.depth {
        channels.push(AnyChannel::new("Z", Plane::Scalar(depth)));
    }
    if let Some(count) = &picture.sample_count {
        channels.push(AnyChannel::new("Debug Sample Count.X", Plane::Count(count)));
    }

    let mut layer = LayerAttributes { layer_position: Vec2(picture.x as i32, picture.y as i32), ..Default::default() };
    layer.other.insert(Text::from(PROVENANCE), AttributeValue::Text(Text::from(ascii(&picture.provenance).as_str())));
    let image = Image::new(
        ImageAttributes::new(IntegerBounds::from_dimensions(picture.full)),
        Layer::new(
            (picture.width, picture.height),
            layer,
            Encoding { compression: COMPRESSION, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing },
            AnyChannels::sort(channels.into()),
        ),
    );
    atomic_file::write(path, |file| {
        image.write().to_buffered(file).map_err(|error| match error {
            exr::error::Error::Io(source) => Error::io(path, "write", source),
            other => Error::Encode { path: path.to_path_buf(), what: other.to_string() },
        })
    })
}

/// Reads a picture: all layers of ours, or the `R G B` of any other flat scan-line or tiled file.
///
/// Of a file with several parts the first counts; other channels than those in the table above are ignored, and a
/// layer of which a channel is missing is absent. Half floats and integers are widened to floats.
///
/// # Errors
///
/// [`Error::Io`] if the file cannot be read; [`Error::Import`] if it is not a usable OpenEXR file, has no `R G B`,
/// is subsampled, holds a data window outside of its display window, or claims more than [`most_bytes`] of pixels.
pub fn read(path: &Path) -> Result<Picture> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, "read", e))?;
    // The exr crate indexes and asserts by what the file says: a broken file may panic in it. The file's bytes are
    // not changed by the attempt, and everything that the attempt built is dropped.
    let decoded = catch_unwind(AssertUnwindSafe(|| decode(&bytes)));
    let wrong = |what: String| Error::expected(path, At::File, what, "an OpenEXR picture");
    decoded.unwrap_or_else(|_| Err("the file is damaged (its decoder gave up)".into())).map_err(wrong)
}

/// Most bytes of pixels that a file of this length may claim: 256 MiB and 4096 times its length.
///
/// Without a limit a file of a hundred bytes could ask for more memory than there is, and end the process.
/// ZIP cannot shrink data more than 1032 times.
pub fn most_bytes(file_length: usize) -> usize {
    file_length.saturating_mul(4096).saturating_add(256 << 20)
}

/// Says what makes a picture unfit to be written, if anything.
fn check(picture: &Picture) -> std::result::Result<(), String> {
    let Picture { width, height, x, y, full, .. } = *picture;
    if width == 0 || height == 0 {
        return Err(format!("the picture is empty ({width} × {height})"));
    }
    if x + width > full.0 || y + height > full.1 {
        return Err(format!("the part {width} × {height} at ({x}, {y}) leaves the frame of {} × {}", full.0, full.1));
    }
    let lengths = [
        ("beauty", Some(picture.beauty.len())),
        ("albedo", picture.albedo.as_ref().map(Vec::len)),
        ("normal", picture.normal.as_ref().map(Vec::len)),
        ("depth", picture.depth.as_ref().map(Vec::len)),
        ("variance", picture.variance.as_ref().map(Vec::len)),
        ("sample count", picture.sample_count.as_ref().map(Vec::len)),
    ];
    match lengths.into_iter().find(|(_, length)| length.is_some_and(|l| l != width * height)) {
        Some((name, length)) => {
            Err(format!("layer {name} has {} values for {width} × {height} pixels", length.unwrap_or_default()))
        }
        None => Ok(()),
    }
}

/// JSON in ASCII, whatever the strings in it: attributes of OpenEXR have no declared encoding.
fn ascii(value: &Value) -> String {
    let mut text = String::new();
    for c in value.to_string().chars() {
        if c.is_ascii() {
            text.push(c);
        } else {
            // JSON writes what is beyond ASCII, which only occurs within strings, as UTF-16.
            for unit in c.encode_utf16(&mut [0; 2]) {
                text.push_str(&format!("\\u{unit:04x}"));
            }
        }
    }
    text
}

/// Where the samples of one channel come from: the layers as they are, so that writing copies no picture.
enum Plane<'a> {
    /// One component of a vector.
    Component(&'a [[f32; 3]], usize),
    /// A float.
    Scalar(&'a [f32]),
    /// A whole number, written as a float.
    Count(&'a [u32]),
}

/// Adds the three channels of a layer, if it is present.
fn colour<'a>(channels: &mut Vec<AnyChannel<Plane<'a>>>, names: [&str; 3], layer: Option<&'a Vec<[f32; 3]>>) {
    let Some(values) = layer else { return };
    channels.extend(names.into_iter().enumerate().map(|(i, name)| AnyChannel::new(name, Plane::Component(values, i))));
}

impl<'a> WritableSamples<'a> for Plane<'_> {
    type Writer = PlaneWriter<'a>;

    fn sample_type(&self) -> SampleType {
        SampleType::F32
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_samples_writer(&'a self, header: &Header) -> PlaneWriter<'a> {
        PlaneWriter { plane: self, width: header.layer_size.width() }
    }
}

/// Hands out the lines of a [`Plane`].
struct PlaneWriter<'a> {
    plane: &'a Plane<'a>,
    width: usize,
}

impl SamplesWriter for PlaneWriter<'_> {
    fn extract_line(&self, line: LineRefMut<'_>) {
        let start = line.location.position.y() * self.width + line.location.position.x();
        match *self.plane {
            Plane::Component(values, component) => line.write_samples(|i| values[start + i][component]),
            Plane::Scalar(values) => line.write_samples(|i| values[start + i]),
            Plane::Count(values) => line.write_samples(|i| values[start + i] as f32),
        }
        .expect("the encoder's line buffer has room for its own line");
    }
}

/// Refuses files of deep data, and such as claim more than [`most_bytes`] of pixels.
pub(crate) fn check_claims(headers: &[Header], file_length: usize) -> std::result::Result<(), String> {
    let limit = most_bytes(file_length);
    let mut claimed = 0usize;
    for header in headers {
        if header.deep {
            return Err("it holds deep data".into());
        }
        let channels = header.channels.list.iter().map(|c| c.sample_type.bytes_per_sample()).sum::<usize>();
        let pixels = header.layer_size.width().saturating_mul(header.layer_size.height());
        claimed = claimed.saturating_add(pixels.saturating_mul(channels));
    }
    if claimed > limit {
        return Err(format!("it claims {claimed} bytes of pixels in a file of {} bytes", file_length));
    }
    Ok(())
}

/// Decodes a file; an error is one sentence.
fn decode(bytes: &[u8]) -> std::result::Result<Picture, String> {
    let chunks = exr::block::read(std::io::Cursor::new(bytes), false).map_err(|e| e.to_string())?;
    check_claims(chunks.headers(), bytes.len())?;
    // One thread: a panic in a worker of the crate's pool would end the process.
    let image = exr_read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_chunks(chunks)
        .map_err(|e| e.to_string())?;
    let layer = image.layer_data;
    let Vec2(width, height) = layer.size;

    let frame = image.attributes.display_window;
    let inside = |data: i32, size: usize, frame: i32, frame_size: usize| {
        let offset = usize::try_from(i64::from(data) - i64::from(frame)).ok()?;
        (offset.checked_add(size)? <= frame_size).then_some(offset)
    };
    let Vec2(left, top) = layer.attributes.layer_position;
    let x = inside(left, width, frame.position.x(), frame.size.width());
    let y = inside(top, height, frame.position.y(), frame.size.height());
    let (Some(x), Some(y)) = (x, y) else { return Err("its data window leaves its display window".into()) };

    let provenance = match layer.attributes.other.get(PROVENANCE.as_bytes()) {
        Some(AttributeValue::Text(text)) => serde_json::from_str(&text.to_string())
            .map_err(|e| format!("its attribute {PROVENANCE} is not JSON: {e}"))?,
        _ => Value::Null,
    };

    let channels = Channels { list: &layer.channel_data.list, pixels: width * height };
    Ok(Picture {
        width,
        height,
        x,
        y,
        full: (frame.size.width(), frame.size.height()),
        beauty: channels.vectors(["R", "G", "B"])?.ok_or("it has no channels R, G and B")?,
        albedo: channels.vectors(["Albedo.R", "Albedo.G", "Albedo.B"])?,
        normal: channels.vectors(["Ns.X", "Ns.Y", "Ns.Z"])?,
        depth: channels.scalars("Z")?,
        variance: channels.vectors(["Variance.R", "Variance.G", "Variance.B"])?,
        sample_count: channels.counts("Debug Sample Count.X")?,
        provenance,
    })
}

/// The channels of a file, to be found by name.
struct Channels<'a> {
    list: &'a [AnyChannel<FlatSamples>],
    pixels: usize,
}

impl Channels<'_> {
    /// The samples of one channel, or none if there is no such channel.
    fn find(&self, name: &str) -> std::result::Result<Option<&FlatSamples>, String> {
        let Some(channel) = self.list.iter().find(|c| c.name.eq(name)) else { return Ok(None) };
        if channel.sampling != Vec2(1, 1) || channel.sample_data.len() != self.pixels {
            return Err(format!("its channel {name} is subsampled"));
        }
        Ok(Some(&channel.sample_data))
    }

    fn scalars(&self, name: &str) -> std::result::Result<Option<Vec<f32>>, String> {
        Ok(self.find(name)?.map(|samples| samples.values_as_f32().collect()))
    }

    /// Counts may be stored as floats or as integers; what is not a count becomes the nearest that is.
    fn counts(&self, name: &str) -> std::result::Result<Option<Vec<u32>>, String> {
        Ok(self.find(name)?.map(|samples| match samples {
            FlatSamples::U32(values) => values.clone(),
            other => other.values_as_f32().map(|v| v.round() as u32).collect(),
        }))
    }

    fn vectors(&self, names: [&str; 3]) -> std::result::Result<Option<Vec<[f32; 3]>>, String> {
        let [Some(a), Some(b), Some(c)] = [self.find(names[0])?, self.find(names[1])?, self.find(names[2])?] else {
            return Ok(None);
        };
        let components = a.values_as_f32().zip(b.values_as_f32()).zip(c.values_as_f32());
        Ok(Some(components.map(|((a, b), c)| [a, b, c]).collect()))
    }
}
