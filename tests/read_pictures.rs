//! Pictures of any program are read as they are, and broken ones are errors that say where.

use comber::film::read::{Found, read};
use exr::prelude::*;
use std::fs;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

fn directory() -> TempDir {
    tempfile::tempdir().unwrap()
}

fn file(dir: &TempDir, name: &str, bytes: &[u8]) -> PathBuf {
    let path = dir.path().join(name);
    fs::write(&path, bytes).unwrap();
    path
}

/// What is said of a file that cannot be read: its name, then why.
fn complaint(path: &Path, layer: Option<&str>) -> String {
    let error = catch_unwind(|| read(path, layer)).expect("no panic").expect_err("an error");
    let message = error.to_string();
    assert!(message.starts_with(&path.display().to_string()), "{message}");
    message
}

fn pfm(header: &str, values: &[f32], little: bool) -> Vec<u8> {
    let number = |v: &f32| if little { v.to_le_bytes() } else { v.to_be_bytes() };
    header.bytes().chain(values.iter().flat_map(number)).collect()
}

#[test]
fn float_maps_of_either_byte_order() {
    let dir = directory();
    // Two rows, the bottom one first.
    let values: Vec<f32> = (0..12).map(|i| i as f32 - 1.5).collect();
    for (header, little) in
        [("PF\n2 2\n-1.0\n", true), ("PF\n2 2\n1.0\n", false), ("PF 2\t2\r-1 ", true), ("PF\r\n2 2\r\n-1\r\n", true)]
    {
        let found = read(&file(&dir, "a.pfm", &pfm(header, &values, little)), None).unwrap();
        assert_eq!((found.width, found.height, found.full, found.grey), (2, 2, (2, 2), false));
        assert_eq!(found.colours[0], [4.5, 5.5, 6.5], "the top left");
        assert_eq!(found.colours[2], [-1.5, -0.5, 0.5], "the bottom left");
        assert!(found.notes.is_empty());
    }
    let found =
        read(&file(&dir, "a.pfm", &pfm("Pf\n3 1\n-2.5\n", &[1.0, f32::NAN, f32::INFINITY], true)), None).unwrap();
    assert!(found.grey && found.colours[0] == [2.5; 3] && found.colours[1][0].is_nan());
    assert!(found.colours[2][0].is_infinite() && found.notes[0].text.contains("2.5"));
    let found = read(&file(&dir, "a.pfm", &pfm("Pf\n1 1\n-1\n", &[1.0, 2.0], true)), None).unwrap();
    assert!(found.notes[0].text.contains("4 bytes after the pixels"));
}

#[test]
fn broken_float_maps_say_where() {
    let dir = directory();
    for (bytes, expected) in [
        ("PF\n2 2\n-1.0\n\0\0\0\0\0\0\0", "byte 12: 7 bytes of pixels; expected 48 for 2 × 2 pixels of 3 floats"),
        ("PF\n4000000000 4000000000\n-1\nxx", "a size that memory can hold"),
        ("PF\n400000 400000\n-1\nxx", "expected 1920000000000 for"),
        ("PF\n-3 2\n-1\n", "byte 3: '-3'; expected the width"),
        ("PF\n0 2\n-1\n", "byte 3: '0'; expected the width"),
        ("PF\n3 2.5\n-1\n", "byte 5: '2.5'; expected the height"),
        ("PF\n3 2\n0\n", "byte 7: '0'; expected the scale"),
        ("PF\n3 2\nnan\n", "expected the scale"),
        ("PF\n3 2\n-1", "byte 7: the header ends early"),
        ("PF\n3", "byte 3: the header ends early"),
        ("PF\n", "the header ends early"),
        ("PF\n99999999999999999999999999999999999999999999 2\n", "the header ends early"),
        ("PF4\n1 1\n-1\n", "it starts with the bytes 50 46 34 0a; expected an OpenEXR"),
    ] {
        let message = complaint(&file(&dir, "a.pfm", bytes.as_bytes()), None);
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn what_is_no_picture_is_an_error() {
    let dir = directory();
    assert!(complaint(&file(&dir, "a.exr", b""), None).contains("byte 0: the file is empty"));
    assert!(complaint(&file(&dir, "a.exr", b"GIF89a"), None).contains("47 49 46 38"));
    assert!(complaint(dir.path(), None).contains("not a regular file"));
    assert!(complaint(&dir.path().join("missing.png"), None).contains("cannot read"));
    #[cfg(unix)]
    assert!(complaint(Path::new("/dev/zero"), None).contains("not a regular file"));
    let float_map = file(&dir, "a.pfm", &pfm("Pf\n1 1\n-1\n", &[1.0], true));
    assert!(complaint(&float_map, Some("Albedo")).contains("has no layers"));
}

fn png(path: &Path, width: u32, height: u32, bytes: &[u8], color: image::ColorType) -> Vec<u8> {
    image::save_buffer(path, bytes, width, height, color).unwrap();
    fs::read(path).unwrap()
}

fn linear(encoded: f64) -> f32 {
    (if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }) as f32
}

#[test]
fn png_of_every_depth_is_decoded_to_linear() {
    use image::ColorType::*;
    let dir = directory();
    let path = dir.path().join("a.png");
    let half = linear(128.0 / 255.0);
    // 16-bit samples are handed over in the byte order of the machine.
    let [low, high] = 0x1234u16.to_ne_bytes();
    let sixteen = linear(f64::from(0x1234) / 65535.0);
    for (color, bytes, want, grey) in [
        (Rgb8, vec![0, 128, 255], [0.0, half, 1.0], false),
        (Rgba8, vec![0, 128, 255, 255], [0.0, half, 1.0], false),
        (L8, vec![128], [half; 3], true),
        (La8, vec![128, 255], [half; 3], true),
        (L16, vec![low, high], [sixteen; 3], true),
        (Rgb16, vec![0, 0, low, high, 255, 255], [0.0, sixteen, 1.0], false),
    ] {
        png(&path, 1, 1, &bytes, color);
        let found = read(&path, None).unwrap();
        assert_eq!((found.colours[0], found.grey), (want, grey), "{color:?}: {}", found.what);
        assert!(found.notes.is_empty(), "{color:?}");
    }
    png(&path, 2, 1, &[255, 0, 0, 0, 0, 255, 0, 255], Rgba8);
    let found = read(&path, None).unwrap();
    assert_eq!(found.colours, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], "alpha is left out");
    assert!(found.notes[0].warning && found.notes[0].text.contains("1 pixels are transparent"), "{:?}", found.notes);
}

#[test]
fn broken_png_files_are_errors_not_panics() {
    let dir = directory();
    let noise: Vec<u8> = (0..3 * 40 * 30).map(|i: u32| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    let good = png(&dir.path().join("good.png"), 40, 30, &noise, image::ColorType::Rgb8);
    for percent in 0..99 {
        complaint(&file(&dir, "a.png", &good[..good.len() * percent / 100]), None);
    }
    for at in 0..good.len().min(600) {
        for flip in [0x01, 0x80, 0xff] {
            let mut bytes = good.clone();
            bytes[at] ^= flip;
            let path = file(&dir, "a.png", &bytes);
            let _ = catch_unwind(|| read(&path, None)).expect("no panic");
        }
    }
    // A header that is whole, and claims 12 GB.
    let mut huge = good[..33].to_vec();
    huge[16..24].copy_from_slice(&[0, 0, 0xff, 0xff, 0, 0, 0xff, 0xff]);
    let checksum = crc32fast::hash(&huge[12..29]);
    huge[29..33].copy_from_slice(&checksum.to_be_bytes());
    huge.extend_from_slice(&good[33..]);
    complaint(&file(&dir, "a.png", &huge), None);
}

type Channel = AnyChannel<FlatSamples>;

fn floats(name: &str, value: f32) -> Channel {
    AnyChannel::new(name, FlatSamples::F32((0..6).map(|i| value + i as f32).collect()))
}

/// One part of 3 × 2 pixels.
fn part(name: Option<&str>, channels: Vec<Channel>) -> Layer<AnyChannels<FlatSamples>> {
    let attributes = LayerAttributes { layer_name: name.map(Text::from), ..LayerAttributes::default() };
    let channels = AnyChannels::sort(channels.into_iter().collect());
    Layer::new((3, 2), attributes, Encoding::FAST_LOSSLESS, channels)
}

fn colours(prefix: &str, value: f32) -> Vec<Channel> {
    (0..3).map(|c| floats(&format!("{prefix}{}", ["R", "G", "B"][c]), value + 10.0 * c as f32)).collect()
}

fn write_parts(dir: &TempDir, parts: Vec<Layer<AnyChannels<FlatSamples>>>) -> PathBuf {
    let path = dir.path().join("a.exr");
    let attributes = ImageAttributes::new(IntegerBounds::from_dimensions((3, 2)));
    Image { attributes, layer_data: parts.into_iter().collect::<Layers<_>>() }.write().to_file(&path).unwrap();
    path
}

/// The first pixel and what was read.
fn first(path: &Path, layer: Option<&str>) -> ([f32; 3], Found) {
    let found = read(path, layer).unwrap();
    (found.colours[0], found)
}

#[test]
fn colours_are_found_under_everybodys_names() {
    let dir = directory();
    // Blender, with passes before and after by name.
    let passes = |layer: &str| {
        let mut channels = colours(&format!("{layer}.Combined."), 1.0);
        channels.extend(colours(&format!("{layer}.DiffCol."), 100.0));
        channels.extend(colours(&format!("{layer}.AO."), 200.0));
        channels.extend([floats(&format!("{layer}.Combined.A"), 1.0), floats(&format!("{layer}.Depth.Z"), 7.0)]);
        channels
    };
    for layer in ["ViewLayer", "RenderLayer", "View.Layer.001"] {
        let path = write_parts(&dir, vec![part(None, passes(layer))]);
        let (pixel, found) = first(&path, None);
        assert_eq!(pixel, [1.0, 11.0, 21.0]);
        assert!(found.what.contains(&format!("{layer}.Combined.R")), "{}", found.what);
        assert_eq!(first(&path, Some("DiffCol")).0, [100.0, 110.0, 120.0]);
        assert_eq!(first(&path, Some(&format!("{layer}.AO"))).0, [200.0, 210.0, 220.0]);
        let (depth, found) = first(&path, Some(&format!("{layer}.Depth.Z")));
        assert!(depth == [7.0; 3] && found.grey);
        assert!(complaint(&path, Some("Mist")).contains("no layer or channel 'Mist', but"));
    }
    // pbrt-v4 and Mitsuba: bare names beside others. A variance of someone else's is not ours.
    let mut channels = colours("", 1.0);
    channels.extend(colours("Albedo.", 100.0).into_iter().chain(colours("Variance.", 300.0)));
    let path = write_parts(&dir, vec![part(None, channels)]);
    let (pixel, found) = first(&path, None);
    assert!(pixel == [1.0, 11.0, 21.0] && found.variance.is_none());
    assert!(found.notes[0].text.contains("Variance is not used"), "{:?}", found.notes);
    // Several parts: the first that has a colour.
    let depth = || part(Some("depth"), vec![floats("Z", 9.0)]);
    let path =
        write_parts(&dir, vec![depth(), part(Some("beauty"), colours("", 4.0)), part(Some("light"), colours("", 5.0))]);
    assert_eq!(first(&path, None).0, [4.0, 14.0, 24.0]);
    assert_eq!(first(&path, Some("light")).0, [5.0, 15.0, 25.0]);
    // Half floats, whole numbers; luminance alone; the only layer there is.
    let half = |name| AnyChannel::new(name, FlatSamples::F16(vec![f16::from_f32(0.5); 6]));
    let whole = |name| AnyChannel::new(name, FlatSamples::U32(vec![7; 6]));
    let path = write_parts(&dir, vec![part(None, vec![half("R"), whole("G"), half("B"), half("A")])]);
    assert_eq!(first(&path, None).0, [0.5, 7.0, 0.5]);
    let path = write_parts(&dir, vec![part(None, vec![half("Y")])]);
    assert!(first(&path, None).1.grey);
    let path = write_parts(&dir, vec![part(None, colours("denoised.", 3.0))]);
    assert_eq!(first(&path, None).0, [3.0, 13.0, 23.0]);
}

#[test]
fn no_colour_or_too_many_are_errors() {
    let dir = directory();
    let path = write_parts(&dir, vec![part(None, vec![floats("Z", 1.0)])]);
    assert!(complaint(&path, None).contains("no channels R, G and B, nor Y"));
    let both = colours("left.", 1.0).into_iter().chain(colours("right.", 2.0)).collect();
    let path = write_parts(&dir, vec![part(None, both)]);
    let message = complaint(&path, None);
    assert!(message.contains("left, right") && message.contains("--layer"), "{message}");
}

#[test]
fn windows_are_placed_in_their_frame() {
    let dir = directory();
    let path = dir.path().join("a.exr");
    let write = |frame: (i32, i32, usize, usize), at: (i32, i32)| {
        let attributes = LayerAttributes::default().with_position(Vec2(at.0, at.1));
        let channels = AnyChannels::sort(colours("", 1.0).into_iter().collect());
        let layer = Layer::new((3, 2), attributes, Encoding::FAST_LOSSLESS, channels);
        let bounds = IntegerBounds::new((frame.0, frame.1), (frame.2, frame.3));
        Image::new(ImageAttributes::new(bounds), layer).write().to_file(&path).unwrap();
    };
    write((10, 20, 8, 8), (12, 21));
    let found = read(&path, None).unwrap();
    assert_eq!((found.x, found.y, found.width, found.height, found.full), (2, 1, 3, 2, (8, 8)));
    // Overscan is cut.
    write((0, 0, 2, 1), (-1, -1));
    let (pixel, found) = first(&path, None);
    assert_eq!((found.x, found.y, found.width, found.height, found.full), (0, 0, 2, 1, (2, 1)));
    assert!(pixel[0] == 5.0 && found.notes[0].text.contains("outside of the frame"));
    write((0, 0, 4, 4), (4, 0));
    assert!(complaint(&path, None).contains("data window lies outside"));
}

#[test]
fn broken_exr_files_are_errors_not_panics() {
    let dir = directory();
    let good =
        fs::read(write_parts(&dir, vec![part(Some("a"), colours("", 1.0)), part(Some("b"), colours("b.", 2.0))]))
            .unwrap();
    for percent in 0..100 {
        let path = file(&dir, "b.exr", &good[..good.len() * percent / 100]);
        assert!(catch_unwind(|| read(&path, None)).expect("no panic").is_err(), "cut at {percent} %");
    }
    for at in 0..good.len() {
        for flip in [0x01, 0x80, 0xff] {
            let mut bytes = good.clone();
            bytes[at] ^= flip;
            let path = file(&dir, "b.exr", &bytes);
            let _ = catch_unwind(|| read(&path, None)).expect("no panic");
        }
    }
}
