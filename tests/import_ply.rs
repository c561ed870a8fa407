//! PLY files: every layout gives the same mesh, and no bytes whatsoever bring the reader down.

use comber::error::{At, Error};
use comber::import::ply;
use comber::scene::description::{SceneDescription, Surface};
use glam::Vec3;
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};
use proptest::prelude::*;
use proptest::sample::Index;
use std::path::Path;

fn parse(bytes: &[u8]) -> Result<SceneDescription, Error> {
    ply::parse(Path::new("models/mesh.ply"), bytes)
}

fn good(bytes: &[u8]) -> SceneDescription {
    parse(bytes).unwrap_or_else(|error| panic!("{error}"))
}

/// The place and the whole message.
#[track_caller]
fn bad(bytes: &[u8]) -> (At, String) {
    let error = parse(bytes).expect_err("must be refused");
    let message = error.to_string();
    match error {
        Error::Import { at, expected: Some(_), .. } => (at, message),
        other => panic!("neither located nor explained: {other:?}"),
    }
}

#[track_caller]
fn refuses(bytes: &[u8], at: At, words: &str) {
    let (found, message) = bad(bytes);
    assert!(message.contains(words), "{message}");
    assert_eq!(found, at, "{message}");
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Encoding {
    Ascii,
    Little,
    Big,
}

const ENCODINGS: [Encoding; 3] = [Encoding::Ascii, Encoding::Little, Encoding::Big];
const TYPES: [&str; 16] = [
    "char", "uchar", "short", "ushort", "int", "uint", "float", "double", "int8", "uint8", "int16", "uint16", "int32",
    "uint32", "float32", "float64",
];

/// Writes the body of a file, a value at a time.
struct Writer {
    encoding: Encoding,
    eol: &'static str,
    bytes: Vec<u8>,
}

impl Writer {
    fn new(encoding: Encoding, eol: &'static str) -> Self {
        let name = match encoding {
            Encoding::Ascii => "ascii",
            Encoding::Little => "binary_little_endian",
            Encoding::Big => "binary_big_endian",
        };
        let mut writer = Self { encoding, eol, bytes: Vec::new() };
        writer.header("ply");
        writer.header(&format!("format {name} 1.0"));
        writer
    }

    fn header(&mut self, line: &str) {
        self.bytes.extend(line.bytes());
        self.bytes.extend(self.eol.bytes());
    }

    fn value(&mut self, kind: &str, value: f64) {
        let mut bytes = match kind {
            _ if self.encoding == Encoding::Ascii => return self.bytes.extend(format!("{value} ").bytes()),
            "char" | "int8" => (value as i8).to_le_bytes().to_vec(),
            "uchar" | "uint8" => (value as u8).to_le_bytes().to_vec(),
            "short" | "int16" => (value as i16).to_le_bytes().to_vec(),
            "ushort" | "uint16" => (value as u16).to_le_bytes().to_vec(),
            "int" | "int32" => (value as i32).to_le_bytes().to_vec(),
            "uint" | "uint32" => (value as u32).to_le_bytes().to_vec(),
            "float" | "float32" => (value as f32).to_le_bytes().to_vec(),
            "double" | "float64" => value.to_le_bytes().to_vec(),
            _ => panic!("no type {kind}"),
        };
        if self.encoding == Encoding::Big {
            bytes.reverse();
        }
        self.bytes.extend(bytes);
    }

    fn list(&mut self, count: &str, item: &str, values: &[f64]) {
        self.value(count, values.len() as f64);
        values.iter().for_each(|value| self.value(item, *value));
    }

    fn end_record(&mut self) {
        if self.encoding == Encoding::Ascii {
            self.bytes.extend(self.eol.bytes());
        }
    }
}

/// Small whole coordinates and few vertices, so that every type holds every value.
#[derive(Clone, Debug)]
struct Mesh {
    vertices: Vec<[f64; 6]>,
    faces: Vec<Vec<usize>>,
}

fn meshes() -> impl Strategy<Value = Mesh> {
    (3usize..100).prop_flat_map(|count| {
        let vertices = proptest::collection::vec(proptest::array::uniform6((0..100).prop_map(f64::from)), count);
        let faces = proptest::collection::vec(proptest::collection::vec(0..count, 0..7), 1..80);
        (vertices, faces).prop_map(|(vertices, mut faces)| {
            faces.push(vec![0, 1, 2]);
            Mesh { vertices, faces }
        })
    })
}

/// How to write a mesh.
#[derive(Clone, Debug)]
struct Layout {
    encoding: Encoding,
    eol: &'static str,
    /// Positions in the record: x y z nx ny nz and two others.
    order: Vec<usize>,
    types: Vec<&'static str>,
    count: &'static str,
    item: &'static str,
    index_name: &'static str,
    faces_first: bool,
    /// A list among the vertices, scalars and lists around the indices, an element of its own.
    clutter: bool,
}

fn layouts() -> impl Strategy<Value = Layout> {
    let types = proptest::sample::select(TYPES.to_vec());
    (
        (proptest::sample::select(ENCODINGS.to_vec()), proptest::sample::select(vec!["\n", "\r\n", "\r"])),
        Just((0..8).collect::<Vec<usize>>()).prop_shuffle(),
        proptest::collection::vec(types.clone(), 8),
        (types.clone(), types),
        proptest::sample::select(vec!["vertex_indices", "vertex_index"]),
        any::<[bool; 2]>(),
    )
        .prop_map(|((encoding, eol), order, types, (count, item), index_name, [faces_first, clutter])| Layout {
            encoding,
            eol,
            order,
            types,
            count,
            item,
            index_name,
            faces_first,
            clutter,
        })
}

/// The layout that most files have.
fn usual(encoding: Encoding) -> Layout {
    Layout {
        encoding,
        eol: "\n",
        order: (0..8).collect(),
        types: vec!["float"; 8],
        count: "uchar",
        item: "int",
        index_name: "vertex_indices",
        faces_first: false,
        clutter: false,
    }
}

fn write(mesh: &Mesh, layout: &Layout) -> Vec<u8> {
    let mut w = Writer::new(layout.encoding, layout.eol);
    w.header("comment any text, 3 0 1 2");
    w.header("obj_info more");
    let sections: &[u8] = match (layout.faces_first, layout.clutter) {
        (false, false) => b"vf",
        (true, false) => b"fv",
        (false, true) => b"cvcfc",
        (true, true) => b"cfcvc",
    };
    for section in sections {
        match section {
            b'v' => {
                w.header(&format!("element vertex {}", mesh.vertices.len()));
                for &slot in &layout.order {
                    let name = ["x", "y", "z", "nx", "ny", "nz", "quality", "red"][slot];
                    if layout.clutter && slot == 6 {
                        w.header("property list uchar short weights");
                    }
                    w.header(&format!("property {} {name}", layout.types[slot]));
                }
            }
            b'f' => {
                w.header(&format!("element face {}", mesh.faces.len()));
                if layout.clutter {
                    w.header("property double area");
                    w.header("property list int double texcoord");
                }
                w.header(&format!("property list {} {} {}", layout.count, layout.item, layout.index_name));
                if layout.clutter {
                    w.header("property uchar flags");
                }
            }
            _ => {
                w.header("element extra 5");
                w.header("property list ushort float values");
                w.header("property int number");
            }
        }
    }
    w.header("end_header");
    for section in sections {
        match section {
            b'v' => {
                for vertex in &mesh.vertices {
                    for &slot in &layout.order {
                        if layout.clutter && slot == 6 {
                            w.list("uchar", "short", &vertex[..slot % 4]);
                        }
                        w.value(layout.types[slot], vertex.get(slot).copied().unwrap_or(7.0));
                    }
                    w.end_record();
                }
            }
            b'f' => {
                for face in &mesh.faces {
                    let corners: Vec<f64> = face.iter().map(|&index| index as f64).collect();
                    if layout.clutter {
                        w.value("double", 0.5);
                        w.list("int", "double", &corners);
                    }
                    w.list(layout.count, layout.item, &corners);
                    if layout.clutter {
                        w.value("uchar", 1.0);
                    }
                    w.end_record();
                }
            }
            _ => {
                for number in 0..5 {
                    w.list("ushort", "float", &vec![0.25; number * 3]);
                    w.value("int", number as f64);
                    w.end_record();
                }
            }
        }
    }
    w.bytes
}

fn same(a: &SceneDescription, b: &SceneDescription) {
    let (a, b) = (&a.meshes[0], &b.meshes[0]);
    assert_eq!(a.positions, b.positions);
    assert_eq!(a.normals, b.normals);
    assert_eq!(a.triangles, b.triangles);
}

/// A wavy grid of triangles with normals.
fn grid(side: usize) -> Mesh {
    let vertex = |i: usize| {
        let (x, y) = ((i % side) as f64, (i / side) as f64);
        [x, y, ((x * 0.3).sin() * 100.0).round() / 100.0, 0.0, 0.0, 2.0]
    };
    let cell = |i: usize| {
        let a = i / (side - 1) * side + i % (side - 1);
        [vec![a, a + 1, a + side + 1], vec![a, a + side + 1, a + side]]
    };
    Mesh {
        vertices: (0..side * side).map(vertex).collect(),
        faces: (0..(side - 1) * (side - 1)).flat_map(cell).collect(),
    }
}

fn ascii(vertices: &str, faces: &str) -> String {
    let count = |text: &str| text.lines().count();
    format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n{vertices}{faces}",
        count(vertices),
        count(faces)
    )
}

const CORNERS: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

#[test]
fn a_small_file() {
    let scene = good(ascii(CORNERS, "3 0 1 2\n4 0 1 2 3\n").as_bytes());
    assert_eq!(scene.name, "mesh.ply");
    assert_eq!(scene.meshes.len(), 1);
    assert_eq!(scene.meshes[0].name, "mesh");
    assert_eq!(scene.meshes[0].positions[2], Vec3::new(1.0, 1.0, 0.0));
    assert_eq!(scene.meshes[0].triangles, [[0, 1, 2], [0, 1, 2], [0, 2, 3]]);
    assert!(scene.meshes[0].normals.is_empty());
    assert_eq!(scene.materials.len(), 1);
    assert_eq!(scene.materials[0].name, "default");
    assert_eq!(scene.materials[0].surface, Surface::Diffuse { albedo: Vec3::splat(0.5) });
    assert!(scene.notes.is_empty() && scene.camera.is_none());
}

#[test]
fn concave_polygons_are_split_inside() {
    let scene = good(ascii("2 -1 0\n0 3 0\n-2 -1 0\n0 0 0\n", "4 0 1 2 3\n").as_bytes());
    for triangle in &scene.meshes[0].triangles {
        let [a, b, c] = triangle.map(|index| scene.meshes[0].positions[index as usize]);
        assert!((b - a).cross(c - a).z > 0.0);
    }
}

#[test]
fn empty_lines_and_odd_spaces_do_not_count() {
    let text = ascii("\n \t\n0 0 0\n\n1 0\t0 \n  1 1 0\n", "\n3 0 1 2\n\n");
    let text = text.replace("vertex 6", "vertex 3").replace("face 3", "face 1");
    let scene = good(text.as_bytes());
    assert_eq!(scene.meshes[0].positions.len(), 3);
    assert!(scene.notes.is_empty());
    // No line end after the last line.
    good(text.trim_end().as_bytes());
}

#[test]
fn normals_are_made_unit_or_zero() {
    let header = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float nx\nproperty float ny\nproperty float nz\n\
                  property float x\nproperty float y\nproperty float z\nelement face 1\n\
                  property list uchar int vertex_index\nend_header\n";
    let scene = good(
        format!("{header}0 0 5 0 0 0\nnan 0 1 1 0 0\n0 3e38 0 1 1 0\n3e-43 0 0 1 1 1\n0 0 0 2 2 2\n3 0 1 2\n")
            .as_bytes(),
    );
    assert_eq!(scene.meshes[0].normals, [Vec3::Z, Vec3::ZERO, Vec3::Y, Vec3::X, Vec3::ZERO]);
    let partial = header.replace("property float nz\n", "").replace("vertex 5", "vertex 3");
    assert!(
        good(format!("{partial}0 0 0 0 0\n0 0 1 0 0\n0 0 1 1 0\n3 0 1 2\n").as_bytes()).meshes[0].normals.is_empty()
    );
}

#[test]
fn strips_turn_every_other_triangle_and_restart() {
    for encoding in ENCODINGS {
        for item in ["int", "uint", "char", "double"] {
            let restart = if item == "uint" { f64::from(u32::MAX) } else { -1.0 };
            let mut w = Writer::new(encoding, "\n");
            w.header("element vertex 6\nproperty float x\nproperty float y\nproperty float z");
            w.header(&format!("element tristrips 1\nproperty list int {item} vertex_indices\nend_header"));
            for value in 0..6 {
                (0..3).for_each(|_| w.value("float", f64::from(value)));
                w.end_record();
            }
            w.list("int", item, &[0.0, 1.0, 2.0, 3.0, restart, 2.0, 3.0, 3.0, 4.0, 5.0, restart, restart, 1.0]);
            w.end_record();
            let scene = good(&w.bytes);
            assert_eq!(scene.meshes[0].triangles, [[0, 1, 2], [2, 1, 3], [3, 4, 5]], "{encoding:?} {item}");
            assert!(scene.notes.is_empty());
        }
    }
}

#[test]
fn many_pieces_make_one_mesh() {
    let mut mesh = grid(150);
    let plain: Vec<_> = ENCODINGS.iter().map(|&encoding| good(&write(&mesh, &usual(encoding)))).collect();
    assert_eq!(plain[0].meshes[0].triangles.len(), 149 * 149 * 2);
    same(&plain[0], &plain[1]);
    same(&plain[1], &plain[2]);
    // One polygon is enough to leave the fast path; it must not change the rest.
    for cluttered in [false, true] {
        mesh.faces.insert(1000, vec![0, 1, 151, 150]);
        for encoding in ENCODINGS {
            let scene = good(&write(&mesh, &Layout { clutter: cluttered, ..usual(encoding) }));
            let triangles = &scene.meshes[0].triangles;
            let added = if cluttered { 4 } else { 2 };
            assert_eq!(triangles[..1000], plain[0].meshes[0].triangles[..1000]);
            assert_eq!(triangles[1000..1002], [[0, 1, 151], [0, 151, 150]]);
            assert_eq!(triangles[1000 + added..], plain[0].meshes[0].triangles[1000..]);
        }
    }
}

#[test]
fn collapsed_and_short_faces_are_left_out_with_one_note_each() {
    let mut mesh = grid(20);
    let clean = mesh.faces.len();
    for _ in 0..5 {
        mesh.faces.insert(7, vec![3, 3, 4]);
        mesh.faces.insert(9, vec![3, 4, 5]); // twice the same triangle stays
    }
    for encoding in ENCODINGS {
        let scene = good(&write(&mesh, &usual(encoding)));
        assert_eq!(scene.meshes[0].triangles.len(), clean + 5);
        assert_eq!(scene.notes.len(), 1);
        assert!(scene.notes[0].warning && scene.notes[0].text.contains("5 triangles that use a vertex twice"));
    }
    mesh.faces.push(vec![1, 2]);
    mesh.faces.push(vec![]);
    for encoding in ENCODINGS {
        let scene = good(&write(&mesh, &usual(encoding)));
        assert_eq!(scene.meshes[0].triangles.len(), clean + 5);
        assert!(scene.notes[0].text.contains("2 faces with fewer than three corners"));
        assert_eq!(scene.notes.len(), 2);
    }
    refuses(ascii(CORNERS, "3 0 0 1\n").as_bytes(), At::Line(7), "no triangle is left");
}

#[test]
fn headers_are_refused_where_they_go_wrong() {
    let text = ascii(CORNERS, "3 0 1 2\n");
    refuses(b"", At::Line(1), "the file is empty");
    refuses(b"\0\0\0\0", At::Line(1), "no PLY file");
    refuses(b"plyx\n", At::Line(1), "no PLY file");
    refuses(b"solid \xff\xfe", At::Line(1), "no PLY file");
    refuses(b"ply", At::Line(1), "header does not end");
    refuses(b"ply\nend_header\n", At::Line(2), "format is missing");
    let cases = [
        ("format ascii 1.0", "format ascii 1.1", 2, "“1.1” is no known version"),
        ("format ascii 1.0", "format utf8 1.0", 2, "“utf8” is no known format"),
        ("format ascii 1.0", "format ascii 1.0\nformat ascii 1.0", 3, "format is given twice"),
        ("element vertex 4", "element vertex four", 3, "“four” is no count"),
        ("element vertex 4", "element vertex -4", 3, "“-4” is no count"),
        ("element vertex 4", "element vertex", 3, "is no count"),
        ("element vertex 4", "element vertex 4 5", 3, "“5” follows a complete line"),
        ("element vertex 4", "element vertex 99999999999999999999999", 3, "is no count"),
        ("element vertex 4", "element vertex 4294967296", 3, "too many"),
        ("element vertex 4", "property float w", 3, "belongs to no element"),
        ("element vertex 4", "elephant vertex 4", 3, "“elephant” is no header keyword"),
        ("element vertex 4", "element vertices 4", 0, "declares no vertices"),
        ("property float x", "property float4 x", 4, "“float4” is no type"),
        ("property float x", "property float", 4, "no name"),
        ("property float x", "property float w", 3, "no x"),
        ("property float x", "property list int int x", 3, "no x"),
        ("property float x", "property float x\nproperty int x", 3, "x is declared twice"),
        ("element face 1", "element vertex 1", 7, "element vertex is declared twice"),
        ("element face 1", "element face 0", 7, "there are no faces"),
        ("element face 1", "element edge 1", 0, "there are no faces"),
        ("uchar int vertex_indices", "uchar int corners", 7, "no vertex indices"),
        ("property list uchar int", "property int", 7, "no vertex indices"),
        ("end_header", "end_heade", 9, "“end_heade” is no header keyword"),
        ("end_header", "comment", 13, "“0” is no header keyword"),
    ];
    for (old, new, line, words) in cases {
        let new = if words.starts_with("“0”") {
            text.replace("end_header\n0 0 0\n1 0 0\n1 1 0", "\n\n\n")
        } else {
            text.replace(old, new)
        };
        refuses(new.as_bytes(), if line == 0 { At::File } else { At::Line(line) }, words);
    }
}

#[test]
fn ascii_bodies_are_refused_where_they_go_wrong() {
    let cases = [
        (CORNERS, "3 0 1 4\n", 14, "vertex index 4 is out of range; expected 0 to 3"),
        (CORNERS, "3 0 1 -1\n", 14, "vertex index -1 is out of range"),
        (CORNERS, "3 0 1 99999999999999999999\n", 14, "no value for vertex_indices"),
        (CORNERS, "3 0 1 1.5\n", 14, "“1.5” is no value for vertex_indices; expected a whole number"),
        (CORNERS, "3 0 1\n", 14, "the line ends too early; expected a value for vertex_indices"),
        (CORNERS, "3 0 1 2 3\n", 14, "the line goes on"),
        (CORNERS, "-3 0 1 2\n", 14, "-3 is no length"),
        (CORNERS, "999999999999999999 0 1 2\n", 14, "the line ends too early"),
        (CORNERS, "3 0 1 2\n3 0 1 x\n", 15, "“x” is no value"),
        ("0 0 0\n0 0\n0 0 0\n", "3 0 1 2\n", 11, "the line ends too early; expected a value for z"),
        ("0 0 0\n0 0 0 0\n0 0 0\n", "3 0 1 2\n", 11, "the line goes on after a complete vertex record"),
        ("0 0 0\n0 0 0\n0 nan 0\n", "3 0 1 2\n", 12, "the vertex is at (0, NaN, 0); expected finite"),
        ("0 0 0\n0 0 0\n0 -inf 0\n", "3 0 1 2\n", 12, "the vertex is at (0, -inf, 0)"),
        ("0 0 0\n1e39 0 0\n0 0 0\n", "3 0 1 2\n", 11, "the vertex is at (inf, 0, 0)"),
        ("0 0 0\n0,5 0 0\n0 0 0\n", "3 0 1 2\n", 11, "“0,5” is no value for x; expected a number"),
    ];
    for (vertices, faces, line, words) in cases {
        refuses(ascii(vertices, faces).as_bytes(), At::Line(line), words);
        let crlf = ascii(vertices, faces).replace('\n', "\r\n");
        refuses(crlf.as_bytes(), At::Line(line), words);
        refuses(crlf.replace("\r\n", "\r").as_bytes(), At::Line(line), words);
    }
    let mut raw = ascii(CORNERS, "3 0 1 2\n").into_bytes();
    let at = raw.len() - 2;
    raw[at] = 0xff;
    refuses(&raw, At::Line(14), "“�” is no value");
}

#[test]
fn errors_far_into_a_file_name_their_line() {
    let mut mesh = grid(150);
    mesh.faces[40_000][1] = 22_500;
    let layout = usual(Encoding::Ascii);
    let header = write(&mesh, &layout).split(|&b| b == b'\n').position(|line| line == b"end_header").expect("header");
    let line = header + 1 + 22_500 + 40_001;
    refuses(&write(&mesh, &layout), At::Line(line as u64), "vertex index 22500 is out of range; expected 0 to 22499");
    for encoding in [Encoding::Little, Encoding::Big] {
        let bytes = write(&mesh, &usual(encoding));
        let place = bytes.len() - (mesh.faces.len() - 40_000) * 13 + 5;
        refuses(&bytes, At::Byte(place as u64), "vertex index 22500 is out of range; expected 0 to 22499");
        let mut bytes = write(&grid(150), &usual(encoding));
        let place = bytes.len() - mesh.faces.len() * 13 - 10 * 32;
        bytes[place + 4..place + 8].fill(0xff);
        refuses(&bytes, At::Byte(place as u64), "NaN");
    }
}

#[test]
fn wrong_counts_are_noticed() {
    let text = ascii(CORNERS, "3 0 1 2\n3 0 2 3\n");
    refuses(text.replace("face 2", "face 3").as_bytes(), At::Line(15), "ends after 2 of 3 face records");
    refuses(
        text.replace("vertex 4", "vertex 3").as_bytes(),
        At::Line(13),
        "the line goes on after a complete face record",
    );
}

#[test]
fn absurd_counts_are_not_believed() {
    for count in ["4294967295", "999999999"] {
        let text = ascii(CORNERS, "3 0 1 2\n");
        refuses(text.replace("face 1", &format!("face {count}")).as_bytes(), At::Line(14), "ends after 1 of");
        let text = text.replace("vertex 4", &format!("vertex {count}"));
        assert!(bad(text.as_bytes()).1.contains("mesh.ply:14: "));
        for format in ["binary_little_endian", "binary_big_endian"] {
            for element in ["vertex", "face", "extra"] {
                let text = ascii(CORNERS, "3 0 1 2\n").replace("ascii", format);
                let text = text.replace("end_header", "element extra 1\nproperty list int int a\nend_header");
                let old = if element == "vertex" { "vertex 4" } else { &format!("{element} 1") };
                let text = text.replace(old, &format!("{element} {count}"));
                let (at, message) = bad(text.as_bytes());
                assert!(matches!(at, At::Byte(_)) && !message.is_empty(), "{message}");
            }
        }
    }
    let many = "18446744073709551615";
    for element in ["face 1", "vertex 4"] {
        let name = element.split(' ').next().expect("a name");
        let text = ascii(CORNERS, "3 0 1 2\n").replace(element, &format!("{name} {many}"));
        bad(text.as_bytes());
        bad(text.replace("ascii", "binary_little_endian").as_bytes());
    }
    // An element without properties takes no room, however often.
    for format in ["ascii", "binary_little_endian"] {
        let text = ascii("", "").replace("ascii", format);
        let text = text.replace("element vertex 0", &format!("element nothing {many}\nelement vertex 0"));
        assert!(bad(text.as_bytes()).1.contains("there are no faces"));
    }
}

#[test]
fn absurd_list_lengths_are_not_believed() {
    for encoding in [Encoding::Little, Encoding::Big] {
        for (kind, value) in
            [("int", -1.0), ("int", 2e9), ("uint", 4e9), ("double", 1e300), ("float", 0.5), ("double", f64::NAN)]
        {
            let mut w = Writer::new(encoding, "\n");
            w.header("element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1");
            w.header(&format!(
                "property list {kind} double junk\nproperty list {kind} double vertex_indices\nend_header"
            ));
            let start = w.bytes.len() + 36;
            (0..9).for_each(|_| w.value("float", 0.0));
            w.value(kind, value);
            w.bytes.extend([0; 64]);
            let (at, message) = bad(&w.bytes);
            let cut = (1e9..1e10).contains(&value);
            assert_eq!(at, At::Byte(if cut { w.bytes.len() } else { start } as u64), "{message}");
        }
    }
}

#[test]
fn leftovers_are_told() {
    let text = ascii(CORNERS, "3 0 1 2\n");
    let scene = good(format!("{text}\n \nmore 1 2\n3").as_bytes());
    assert!(scene.notes[0].warning);
    assert_eq!(scene.notes[0].text, "models/mesh.ply:17: 10 bytes follow the declared data; they are ignored");
    let mut bytes = write(&grid(3), &usual(Encoding::Big));
    let length = bytes.len();
    bytes.extend([0; 7]);
    let scene = good(&bytes);
    assert_eq!(
        scene.notes[0].text,
        format!("models/mesh.ply: byte {length}: 7 bytes follow the declared data; they are ignored")
    );
}

#[test]
fn endless_lines_end() {
    let text = ascii(CORNERS, "3 0 1 2\n");
    let long = |byte: u8| vec![byte; 8 << 20];
    for byte in [b'1', b' ', b'x', 0] {
        let mut bytes = text.clone().into_bytes();
        bytes.truncate(bytes.len() - 2);
        bytes.extend(long(byte));
        match parse(&bytes) {
            Ok(_) => assert_eq!(byte, b' '),
            Err(error) => assert!(error.to_string().len() < 300),
        }
        let _ = parse(&[b"ply\nformat ascii 1.0\ncomment ".as_slice(), &long(byte)].concat());
        let _ = parse(&long(byte));
    }
    // A polygon as long as its line.
    let count = 1 << 20;
    let spiral = |i: usize| format!(" {}", i * 7 % 4);
    let face: String = (0..count).map(spiral).collect();
    let scene = parse(ascii(CORNERS, &format!("{count}{face}\n")).as_bytes());
    assert!(scene.is_ok());
}

#[test]
fn truncation_is_an_error_at_every_percent() {
    let mesh = grid(30);
    for encoding in ENCODINGS {
        for clutter in [false, true] {
            let bytes = write(&mesh, &Layout { clutter, ..usual(encoding) });
            for percent in 0..100 {
                let (at, message) = bad(&bytes[..bytes.len() * percent / 100]);
                assert_ne!(at, At::File, "{message}");
            }
        }
    }
}

fn oracle(bytes: &[u8]) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let ply = Parser::<DefaultElement>::new().read_ply(&mut &bytes[..]).expect("the oracle reads it");
    let float = |element: &DefaultElement, name: &str| match element[name] {
        Property::Float(value) => value,
        ref other => panic!("{other:?}"),
    };
    let position = |element: &DefaultElement| ["x", "y", "z"].map(|name| float(element, name));
    let corners = |element: &DefaultElement| match &element["vertex_indices"] {
        Property::ListInt(list) => [list[0] as u32, list[1] as u32, list[2] as u32],
        other => panic!("{other:?}"),
    };
    (ply.payload["vertex"].iter().map(position).collect(), ply.payload["face"].iter().map(corners).collect())
}

#[test]
fn another_reader_agrees() {
    let mut mesh = grid(40);
    for (number, vertex) in mesh.vertices.iter_mut().enumerate() {
        vertex[2] = (number as f64 * 0.7).sin() * 1e-3;
    }
    for encoding in ENCODINGS {
        let bytes = write(&mesh, &usual(encoding));
        let scene = good(&bytes);
        let (positions, triangles) = oracle(&bytes);
        assert_eq!(scene.meshes[0].triangles, triangles);
        // The other reader may be an ulp off in text.
        for (ours, theirs) in scene.meshes[0].positions.iter().zip(&positions) {
            assert!(ours.abs_diff_eq(Vec3::from_array(*theirs), 1e-6));
        }
        assert_eq!(scene.meshes[0].positions.len(), positions.len());
    }
}

/// Damage to a file.
#[derive(Clone, Debug)]
enum Damage {
    Flip(Index, u8),
    Delete(Index, usize),
    Repeat(Index, usize),
    Number(Index, &'static str),
    Truncate(Index),
}

fn damages() -> impl Strategy<Value = Vec<Damage>> {
    let numbers = vec!["-1", "0", "99999999999999", "1e999", "nan", "4294967295", "2147483648", "-0.0", "", "1e-50"];
    let damage = prop_oneof![
        (any::<Index>(), any::<u8>()).prop_map(|(at, byte)| Damage::Flip(at, byte)),
        (any::<Index>(), 1usize..64).prop_map(|(at, length)| Damage::Delete(at, length)),
        (any::<Index>(), 1usize..200).prop_map(|(at, length)| Damage::Repeat(at, length)),
        (any::<Index>(), proptest::sample::select(numbers)).prop_map(|(at, number)| Damage::Number(at, number)),
        any::<Index>().prop_map(Damage::Truncate),
    ];
    proptest::collection::vec(damage, 1..6)
}

fn harm(mut bytes: Vec<u8>, damages: &[Damage]) -> Vec<u8> {
    for damage in damages {
        if bytes.is_empty() {
            break;
        }
        let length = bytes.len();
        match damage {
            Damage::Flip(at, byte) => bytes[at.index(length)] ^= byte,
            Damage::Delete(at, count) => {
                let at = at.index(length);
                bytes.drain(at..(at + count).min(length));
            }
            Damage::Repeat(at, count) => {
                let at = at.index(length);
                let copy = bytes[at..(at + count).min(length)].to_vec();
                bytes.splice(at..at, copy);
            }
            Damage::Number(at, number) => {
                let at = at.index(length);
                let digit = |byte: &u8| byte.is_ascii_digit();
                let Some(start) = bytes[at..].iter().position(digit).map(|found| at + found) else { continue };
                let end = bytes[start..].iter().position(|byte| !digit(byte)).map_or(length, |found| start + found);
                bytes.splice(start..end, number.bytes());
            }
            Damage::Truncate(at) => bytes.truncate(at.index(length)),
        }
    }
    bytes
}

/// What every caller relies on.
fn sound(scene: &SceneDescription) {
    for mesh in &scene.meshes {
        assert!(!mesh.triangles.is_empty());
        assert!(mesh.normals.is_empty() || mesh.normals.len() == mesh.positions.len());
        assert!(mesh.positions.iter().all(|position| position.is_finite()));
        assert!(mesh.normals.iter().all(|normal| normal.is_normalized() || *normal == Vec3::ZERO));
        assert!(mesh.triangles.iter().flatten().all(|&index| (index as usize) < mesh.positions.len()));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn every_layout_gives_the_same_mesh(mesh in meshes(), layout in layouts()) {
        let plain = good(&write(&mesh, &usual(Encoding::Ascii)));
        let scene = good(&write(&mesh, &layout));
        same(&plain, &scene);
        sound(&scene);
        let corners: usize = mesh.faces.iter().map(|face| face.len().saturating_sub(2)).sum();
        prop_assert!(scene.meshes[0].triangles.len() <= corners);
        prop_assert_eq!(&scene.meshes[0].positions[0].to_array(), &[0, 1, 2].map(|axis| mesh.vertices[0][axis] as f32));
    }

    #[test]
    fn damaged_files_are_read_or_refused(mesh in meshes(), layout in layouts(), damages in damages()) {
        let bytes = harm(write(&mesh, &layout), &damages);
        if let Ok(scene) = parse(&bytes) {
            sound(&scene);
        }
    }

    #[test]
    fn any_bytes_after_a_header_are_read_or_refused(body in proptest::collection::vec(any::<u8>(), 0..400), layout in layouts()) {
        let mut bytes = write(&Mesh { vertices: vec![[0.0; 6]; 3], faces: vec![vec![0, 1, 2]; 3] }, &layout);
        let end = bytes.windows(10).position(|window| window == b"end_header").expect("a header");
        bytes.truncate(end + 10 + layout.eol.len());
        bytes.extend(body);
        if let Ok(scene) = parse(&bytes) {
            sound(&scene);
        }
    }
}
