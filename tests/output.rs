//! Pictures survive being written and read, equal pictures are equal bytes, and broken files are errors.

use std::fs;
use std::panic::catch_unwind;
use std::path::Path;

use comber::film::picture::Picture;
use comber::film::{exr_output, output, png_output};
use serde_json::json;

/// Numbers without a pattern, the same in every run.
fn noise(seed: u32) -> impl FnMut() -> f32 {
    let mut state = u64::from(seed) * 2 + 1;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u64 << 24) as f32
    }
}

/// A cell of a frame with all layers, and infinity where a ray hit nothing.
fn cell(width: usize, height: usize) -> Picture {
    let n = width * height;
    let mut random = noise(7);
    let mut vectors = || (0..n).map(|_| [random(), random() * 100.0, -random()]).collect::<Vec<_>>();
    let (beauty, albedo, normal, variance) = (vectors(), vectors(), vectors(), vectors());
    Picture {
        width,
        height,
        x: 5,
        y: 9,
        full: (width + 12, height + 9),
        beauty,
        albedo: Some(albedo),
        normal: Some(normal),
        depth: Some((0..n).map(|i| if i % 3 == 0 { f32::INFINITY } else { i as f32 }).collect()),
        variance: Some(variance),
        sample_count: Some((0..n as u32).map(|i| i * 7919 % (1 << 24)).collect()),
        provenance: json!({"scene": "Möbius \"strip\" 😀.dae", "seed": 3, "options": {"samples": 64, "a": null}}),
    }
}

fn assert_same(a: &Picture, b: &Picture) {
    assert_eq!((a.width, a.height, a.x, a.y, a.full), (b.width, b.height, b.x, b.y, b.full));
    assert_eq!(a.beauty, b.beauty);
    assert_eq!(a.albedo, b.albedo);
    assert_eq!(a.normal, b.normal);
    assert_eq!(a.depth, b.depth);
    assert_eq!(a.variance, b.variance);
    assert_eq!(a.sample_count, b.sample_count);
    assert_eq!(a.provenance, b.provenance);
}

#[test]
fn exr_round_trip_of_all_layers() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    // Sizes around the 16 lines of a compressed block.
    for (width, height) in [(1, 1), (3, 16), (37, 33), (64, 1)] {
        let picture = cell(width, height);
        output::write(&path, &picture, 0.0).unwrap();
        assert_same(&exr_output::read(&path).unwrap(), &picture);
    }
}

#[test]
fn exr_round_trip_of_beauty_alone() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    let mut picture = Picture { width: 2, height: 2, full: (2, 2), ..Picture::default() };
    picture.beauty = vec![[0.0, -0.0, 1e-40], [f32::MAX, f32::INFINITY, -1.0], [1.5; 3], [2.5; 3]];
    exr_output::write(&path, &picture).unwrap();
    let back = exr_output::read(&path).unwrap();
    assert_same(&back, &picture);
    assert!(back.albedo.is_none() && back.depth.is_none() && back.provenance.is_null());
}

#[test]
fn exr_names_channels_as_other_tools_do() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    exr_output::write(&path, &cell(4, 4)).unwrap();
    let meta = exr::meta::MetaData::read_from_file(&path, true).unwrap();
    let header = &meta.headers[0];
    let names: Vec<String> = header.channels.list.iter().map(|c| c.name.to_string()).collect();
    let expected =
        "Albedo.B Albedo.G Albedo.R B Debug-Sample-Count.X G Ns.X Ns.Y Ns.Z R Variance.B Variance.G Variance.R Z";
    assert_eq!(names.join(" ").replace("Debug Sample Count", "Debug-Sample-Count"), expected);
    assert_eq!(header.own_attributes.other.len(), 1);
    let window = header.shared_attributes.display_window;
    assert_eq!((window.position.0, window.position.1, window.size.0, window.size.1), (0, 0, 16, 13));
    let exr::meta::attribute::AttributeValue::Text(text) = &header.own_attributes.other.values().next().unwrap() else {
        panic!("the provenance is a string")
    };
    assert!(text.as_slice().is_ascii());
}

#[test]
fn equal_pictures_are_equal_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let picture = cell(129, 130);
    for extension in ["exr", "png"] {
        let bytes = |name: &str| {
            let path = dir.path().join(name).with_extension(extension);
            output::write(&path, &picture, 0.0).unwrap();
            fs::read(path).unwrap()
        };
        let first = bytes("first");
        for round in 0..8 {
            assert_eq!(bytes("again"), first, "{extension}, round {round}");
        }
        for threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            assert_eq!(pool.install(|| bytes("pool")), first, "{extension}, {threads} threads");
        }
    }
}

#[test]
fn reads_files_of_other_programs() {
    use exr::prelude::*;
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("half.exr");
    // Half floats, tiles, run lengths, an alpha channel, no provenance.
    let colours = SpecificChannels::rgba(|Vec2(x, y)| {
        (f16::from_f32(x as f32), f16::from_f32(y as f32), f16::from_f32(0.5), f16::ONE)
    });
    Image::from_channels((70, 3), colours).write().to_file(&path).unwrap();
    let picture = exr_output::read(&path).unwrap();
    assert_eq!((picture.width, picture.height, picture.full), (70, 3, (70, 3)));
    assert_eq!(picture.beauty[70 + 69], [69.0, 1.0, 0.5]);

    let depth_only = AnyChannels::sort([AnyChannel::new("Z", FlatSamples::F32(vec![1.0; 4]))].into_iter().collect());
    Image::from_channels((2, 2), depth_only).write().to_file(&path).unwrap();
    let message = exr_output::read(&path).unwrap_err().to_string();
    assert!(message.contains("no channels R, G and B"), "{message}");
}

#[test]
fn a_window_outside_of_the_frame_is_an_error() {
    use exr::prelude::*;
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    for position in [(-1, 0), (0, 3), (i32::MAX / 4, 0)] {
        let channels = SpecificChannels::rgb(|_| (0.0f32, 0.0f32, 0.0f32));
        let attributes = LayerAttributes::default().with_position(Vec2(position.0, position.1));
        let layer = Layer::new((2, 2), attributes, Encoding::UNCOMPRESSED, channels);
        let image = Image::new(ImageAttributes::with_size((4, 4)), layer);
        image.write().to_file(&path).unwrap();
        let message = exr_output::read(&path).unwrap_err().to_string();
        assert!(message.contains("data window"), "{message}");
    }
}

#[test]
fn hostile_exr_files_are_errors_not_panics() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    exr_output::write(&path, &cell(7, 20)).unwrap();
    let good = fs::read(&path).unwrap();
    let try_read = |bytes: &[u8], what: &str| {
        fs::write(&path, bytes).unwrap();
        catch_unwind(|| exr_output::read(&path)).unwrap_or_else(|_| panic!("panicked: {what}"))
    };

    for percent in 0..100 {
        let length = good.len() * percent / 100;
        assert!(try_read(&good[..length], &format!("cut at {percent} %")).is_err(), "cut at {percent} %");
    }
    // Every byte of the header and the tables, then some of the pixels; the picture may be wrong, or an error.
    let header = good.len().min(1600);
    let mut random = noise(1);
    let later = (0..200).map(|_| header + (random() * (good.len() - header) as f32) as usize);
    for at in (0..header).chain(later.filter(|&at| at < good.len())) {
        for flip in [0x01, 0x80, 0xff] {
            let mut bytes = good.clone();
            bytes[at] ^= flip;
            let _ = try_read(&bytes, &format!("byte {at} ^ {flip:#x}"));
        }
    }
    for junk in [&b""[..], b"v/1\x01", b"not an image at all", &[0u8; 4096]] {
        assert!(try_read(junk, "junk").is_err());
    }
}

#[test]
fn a_small_file_that_claims_a_huge_picture_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    exr_output::write(&path, &cell(16, 16)).unwrap();
    let mut bytes = fs::read(&path).unwrap();
    // The attribute's name and type, each ended by a zero, and its size come before the four corners.
    let name = b"dataWindow\0box2i\0";
    let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4;
    bytes[at + 8..at + 12].copy_from_slice(&500_000_000i32.to_le_bytes());
    fs::write(&path, bytes).unwrap();
    let message = exr_output::read(&path).unwrap_err().to_string();
    assert!(message.contains("claims"), "{message}");
}

#[test]
fn pictures_that_do_not_fit_are_errors_and_leave_the_old_file() {
    let dir = tempfile::tempdir().unwrap();
    let good = cell(4, 4);
    let short = Picture { depth: Some(vec![0.0; 3]), ..good.clone() };
    let outside = Picture { full: (6, 13), ..good.clone() };
    let empty = Picture::default();
    let path = dir.path().join("a.exr");
    exr_output::write(&path, &good).unwrap();
    for bad in [&short, &outside, &empty] {
        assert!(exr_output::write(&path, bad).is_err());
        assert_same(&exr_output::read(&path).unwrap(), &good);
    }
    let png = dir.path().join("a.png");
    output::write(&png, &good, 0.0).unwrap();
    let before = fs::read(&png).unwrap();
    let short = Picture { beauty: vec![[0.0; 3]; 3], ..good };
    for bad in [&short, &empty] {
        assert!(output::write(&png, bad, 0.0).is_err());
        assert_eq!(fs::read(&png).unwrap(), before);
    }
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 2);
}

#[test]
fn png_decodes_to_the_curve_and_the_exposure() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.png");
    let values = [0.0, 0.001, 0.003, 0.02, 0.18, 0.5, 0.9, 1.0, 7.0, f32::NAN, f32::INFINITY, -2.0];
    let mut picture = Picture { width: 2, height: 2, full: (2, 2), ..Picture::default() };
    picture.beauty = values.chunks(3).map(|v| [v[0], v[1], v[2]]).collect();
    for exposure in [0.0, 1.0, -2.5] {
        output::write(&path, &picture, exposure).unwrap();
        let decoded = image::open(&path).unwrap();
        assert_eq!(decoded.color(), image::ColorType::Rgb8);
        let expected: Vec<u8> = values.iter().map(|v| png_output::srgb(v * exposure.exp2())).collect();
        assert_eq!(decoded.into_rgb8().into_raw(), expected);
    }
}

#[test]
fn outputs_are_checked_before_a_render() {
    let dir = tempfile::tempdir().unwrap();
    output::check(&dir.path().join("a.exr")).unwrap();
    assert!(output::check(&dir.path().join("a.bmp")).is_err());
    assert!(output::check(&dir.path().join("missing/a.exr")).is_err());
    assert!(output::check(Path::new("a.tiff")).is_err());
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
}
