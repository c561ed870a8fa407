//! How many bytes a second the importers read: a wavy grid of a quarter of a million triangles in every encoding.

use comber::import::{obj, ply};
use comber::scene::description::SceneDescription;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::fmt::Write;
use std::hint::black_box;
use std::path::Path;

const SIDE: u32 = 355;

fn vertices() -> impl Iterator<Item = [f32; 3]> {
    (0..SIDE * SIDE).map(|i| {
        let (x, y) = ((i % SIDE) as f32 * 0.01, (i / SIDE) as f32 * 0.01);
        [x, y, (x * 7.0).sin() * (y * 5.0).cos() * 0.1]
    })
}

fn triangles() -> impl Iterator<Item = [u32; 3]> {
    let cells = (0..SIDE - 1).flat_map(|y| (0..SIDE - 1).map(move |x| y * SIDE + x));
    cells.flat_map(|a| [[a, a + 1, a + SIDE + 1], [a, a + SIDE + 1, a + SIDE]])
}

fn header(format: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        vertices().count(),
        triangles().count()
    )
}

fn ascii() -> Vec<u8> {
    let mut text = header("ascii");
    vertices().for_each(|[x, y, z]| writeln!(text, "{x} {y} {z:.7}").expect("a string takes text"));
    triangles().for_each(|[a, b, c]| writeln!(text, "3 {a} {b} {c}").expect("a string takes text"));
    text.into_bytes()
}

fn wavefront() -> Vec<u8> {
    let mut text = String::new();
    vertices().for_each(|[x, y, z]| writeln!(text, "v {x} {y} {z:.7}").expect("a string takes text"));
    triangles().for_each(|t| writeln!(text, "f {} {} {}", t[0] + 1, t[1] + 1, t[2] + 1).expect("a string takes text"));
    text.into_bytes()
}

fn binary(format: &str, word: fn(u32) -> [u8; 4]) -> Vec<u8> {
    let mut bytes = header(format).into_bytes();
    vertices().flatten().for_each(|value| bytes.extend(word(value.to_bits())));
    for triangle in triangles() {
        bytes.push(3);
        triangle.into_iter().for_each(|index| bytes.extend(word(index)));
    }
    bytes
}

fn import(criterion: &mut Criterion) {
    type Parse = fn(&Path, &[u8]) -> comber::error::Result<SceneDescription>;
    let inputs: [(&str, Parse, Vec<u8>); 4] = [
        ("ply_ascii", ply::parse, ascii()),
        ("ply_little", ply::parse, binary("binary_little_endian", u32::to_le_bytes)),
        ("ply_big", ply::parse, binary("binary_big_endian", u32::to_be_bytes)),
        ("obj", obj::parse, wavefront()),
    ];
    let expected: Vec<_> = triangles().collect();
    let mut group = criterion.benchmark_group("import");
    group.sample_size(20);
    for (name, parse, bytes) in &inputs {
        let read = || parse(Path::new(name), bytes).expect("a readable mesh");
        assert!(read().meshes[0].triangles == expected, "{name} is read wrongly");
        group.throughput(Throughput::Bytes(bytes.len() as u64));
        group.bench_function(*name, |bencher| bencher.iter(|| black_box(read())));
    }
    group.finish();
}

criterion_group!(benches, import);
criterion_main!(benches);
