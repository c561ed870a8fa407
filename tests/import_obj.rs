//! OBJ files: what is read, what is told, and that no bytes whatsoever bring the reader down.

use comber::error::{At, Error};
use comber::import::obj;
use comber::scene::description::{MeshDescription, SceneDescription, Surface};
use glam::Vec3;
use proptest::prelude::*;
use proptest::sample::Index;
use std::path::Path;

fn parse(text: impl AsRef<[u8]>) -> Result<SceneDescription, Error> {
    obj::parse(Path::new("models/mesh.obj"), text.as_ref())
}

#[track_caller]
fn good(text: impl AsRef<[u8]>) -> SceneDescription {
    parse(text).unwrap_or_else(|error| panic!("{error}"))
}

#[track_caller]
fn refuses(text: impl AsRef<[u8]>, line: u64, words: &str) {
    located(parse(text).expect_err("must be refused"), At::Line(line), words);
}

#[track_caller]
fn located(error: Error, place: At, words: &str) {
    let message = error.to_string();
    assert!(message.contains(words), "{message}");
    match error {
        Error::Import { at, expected: Some(_), .. } => assert_eq!(at, place, "{message}"),
        other => panic!("neither located nor explained: {other:?}"),
    }
}

fn warnings(scene: &SceneDescription) -> Vec<&str> {
    assert!(scene.notes.iter().all(|note| note.warning));
    scene.notes.iter().map(|note| note.text.as_str()).collect()
}

/// The positions of all triangles' corners: what a mesh is, whatever its vertices are numbered.
fn corners(mesh: &MeshDescription) -> Vec<Vec3> {
    mesh.triangles.iter().flatten().map(|&index| mesh.positions[index as usize]).collect()
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn a_small_file() {
    let scene = good(format!("# a square\n{SQUARE}f 1 2 3\nf 1 3 4\n"));
    assert_eq!(scene.name, "mesh.obj");
    assert_eq!(scene.meshes.len(), 1);
    assert_eq!(scene.meshes[0].name, "default");
    assert_eq!(scene.meshes[0].at, At::Line(6));
    assert_eq!(scene.meshes[0].positions.len(), 4);
    assert_eq!(scene.meshes[0].triangles, [[0, 1, 2], [0, 2, 3]]);
    assert!(scene.meshes[0].normals.is_empty());
    assert_eq!(scene.materials[0].name, "default");
    assert_eq!(scene.materials[0].surface, Surface::Diffuse { albedo: Vec3::splat(0.5) });
    assert!(scene.notes.is_empty());
}

#[test]
fn every_form_of_corner() {
    let data = format!("{SQUARE}vt 0 0\nvt 1 1\nvn 0 0 2\nvn 0 nan 0\n");
    for face in ["1 2 3", "1/1 2/2 3/1", "-4 -3 -2", "-4/-1 -3/-2 -2/1", "+1 2 -2"] {
        let scene = good(format!("{data}f {face}\n"));
        assert_eq!(scene.meshes[0].triangles, [[0, 1, 2]], "{face}");
        assert!(scene.meshes[0].normals.is_empty());
    }
    for face in ["1//1 2//1 3//2", "1/1/1 2/2/1 3/1/2", "-4//-2 -3//-2 -2//-1", "1/-1/-2 2/-1/1 3/1/-1"] {
        let scene = good(format!("{data}f {face}\n"));
        assert_eq!(corners(&scene.meshes[0]), [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0)], "{face}");
        assert_eq!(scene.meshes[0].normals, [Vec3::Z, Vec3::Z, Vec3::ZERO]);
    }
    // Definitions may follow their use, as long as they come at all.
    assert_eq!(good(format!("f 1 2 3\n{SQUARE}")).meshes[0].triangles, [[0, 1, 2]]);
}

#[test]
fn positions_and_normals_share_vertices_where_both_agree() {
    let data = format!("{SQUARE}vn 0 0 1\nvn 0 1 0\n");
    let scene = good(format!("{data}f 1//1 2//1 3//1\nf 1//1 3//1 4//1\nf 1//2 3//1 4\nf 3//1 4 1//2\n"));
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [4, 2, 5], [2, 5, 4]]);
    assert_eq!(mesh.positions[4], mesh.positions[0]);
    assert_eq!(mesh.normals, [Vec3::Z, Vec3::Z, Vec3::Z, Vec3::Z, Vec3::Y, Vec3::ZERO]);
}

#[test]
fn polygons_are_split() {
    assert_eq!(good(format!("{SQUARE}f 1 2 3 4\n")).meshes[0].triangles, [[0, 1, 2], [0, 2, 3]]);
    let arrow = good("v 2 -1 0\nv 0 3 0\nv -2 -1 0\nv 0 0 0\nf 1 2 3 4\n");
    for triangle in corners(&arrow.meshes[0]).chunks(3) {
        assert!((triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).z > 0.0);
    }
}

#[test]
fn the_rest_of_the_format_does_not_disturb() {
    let text = "mtllib\nvp 1 2\no thing\ng a b\ns off\nv 0 0 0 1.0\nv 1 0 0 0.5 0.5 0.5\n  v\t1 1 0\nvt 0\nl 1 2\np 1\ng\nf 1 2 \\\n 3 # no comment\n";
    let error = parse(text).expect_err("a comment is no corner");
    located(error, At::Line(14), "“#” is no corner");
    let text = text.replace(" # no comment", "\n# a comment \\\nf 1 2 3");
    for text in [text.clone(), text.replace('\n', "\r\n"), text.replace('\n', "\r")] {
        let scene = good(&text);
        assert_eq!(scene.meshes[0].triangles, [[0, 1, 2], [0, 1, 2]]);
        let notes = warnings(&scene);
        assert_eq!(notes.len(), 3, "{notes:?}");
        assert!(notes[0].contains("models/mesh.obj:1: material library"));
        assert!(notes[1].contains("2 lines and points"));
        assert_eq!(notes[2], "models/mesh.obj:2: “vp” is no known keyword; 1 such lines are ignored");
    }
}

#[test]
fn materials_come_from_libraries_beside_the_file() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("scene.obj");
    let put = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("write");
    put(
        "my colours.mtl",
        "# comment \\\nnewmtl red\r\nKa 1 1 1\nKd 0.8 0.1 0.1\nillum 2\nmap_Kd red.png\n\nnewmtl red hot\nKe 5 4 3\n",
    );
    put("b.mtl", "newmtl unused\nmap_Kd x.png\nnewmtl grey\nKd 0.25\n");
    let text = format!(
        "mtllib my colours.mtl\nmtllib b.mtl missing.mtl\nmtllib b.mtl\n{SQUARE}f 1 2 3\no first\nusemtl red\nf 1 2 3\n\
         usemtl grey\nf 1 3 4\no second\nusemtl red\nf 1 3 4\nusemtl red hot\nf 2 3 4\nusemtl none\nf 2 3 4\nusemtl empty\n"
    );
    let scene = obj::parse(&path, text.as_bytes()).expect("readable");
    let materials: Vec<_> = scene.materials.iter().map(|m| (m.name.as_str(), m.surface.clone(), m.emission)).collect();
    let diffuse = |r, g, b| Surface::Diffuse { albedo: Vec3::new(r, g, b) };
    let expected = [
        ("default", diffuse(0.5, 0.5, 0.5), Vec3::ZERO),
        ("red", diffuse(0.8, 0.1, 0.1), Vec3::ZERO),
        ("grey", diffuse(0.25, 0.25, 0.25), Vec3::ZERO),
        ("red hot", diffuse(0.5, 0.5, 0.5), Vec3::new(5.0, 4.0, 3.0)),
        ("none", diffuse(0.5, 0.5, 0.5), Vec3::ZERO),
    ];
    assert_eq!(materials, expected);
    assert_eq!(scene.materials[3].at, At::Line(8));
    let meshes: Vec<_> = scene.meshes.iter().map(|m| (m.name.as_str(), m.at, m.triangles.len(), m.material)).collect();
    let expected = [
        ("default", At::Line(8), 1, 0),
        ("first+second (red)", At::Line(10), 2, 1),
        ("first (grey)", At::Line(12), 1, 2),
        ("second (red hot)", At::Line(17), 1, 3),
        ("second (none)", At::Line(19), 1, 4),
    ];
    assert_eq!(meshes, expected);
    // Each mesh holds only the vertices it uses.
    assert_eq!(scene.meshes.iter().map(|mesh| mesh.positions.len()).collect::<Vec<_>>(), [3, 4, 3, 3, 3]);
    let notes = warnings(&scene);
    assert_eq!(notes.len(), 3, "{notes:?}");
    assert!(notes[0].contains("scene.obj:2: material library") && notes[0].ends_with("missing.mtl is missing"));
    assert!(notes[1].contains("my colours.mtl:6: material red has a map_Kd"));
    assert!(notes[2].contains("scene.obj:19: material none is not defined"));
}

#[test]
fn faults_in_libraries_are_located_there() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("scene.obj");
    let text = format!("mtllib C:\\export\\a.mtl\n{SQUARE}usemtl a\nf 1 2 3\n");
    for (library, line, words) in [
        ("newmtl a\nKd 1 2\n", 2, "the line ends too early; expected a value for blue"),
        ("newmtl a\n\nKd 1 2 x\n", 3, "“x” is no value for blue"),
        ("newmtl a\nKd -1 0 0\n", 2, "the colour is (-1, 0, 0); expected finite channels"),
        ("newmtl a\nKe nan 0 0\n", 2, "the colour is (NaN, 0, 0)"),
        ("newmtl a\nKd spectral a.rfl\n", 2, "“spectral” is no value"),
        ("Kd 1 1 1\n", 1, "“Kd” belongs to no material"),
    ] {
        std::fs::write(folder.path().join("a.mtl"), library).expect("write");
        let error = obj::parse(&path, text.as_bytes()).expect_err("must be refused");
        assert!(error.to_string().contains("a.mtl:"), "{error}");
        located(error, At::Line(line), words);
    }
    for garbage in [&b""[..], b"\xff\0\xfe\nnewmtl\nnewmtl \xff\n"] {
        std::fs::write(folder.path().join("a.mtl"), garbage).expect("write");
        assert_eq!(warnings(&obj::parse(&path, text.as_bytes()).expect("readable")).len(), 1);
    }
}

#[cfg(unix)]
#[test]
fn devices_and_floods_are_no_libraries() {
    let mut text = format!("mtllib ../../../../../../../../dev/zero\n{SQUARE}f 1 2 3\n");
    assert_eq!(warnings(&obj::parse(Path::new("/tmp/mesh.obj"), text.as_bytes()).expect("readable")).len(), 1);
    (0..1000).for_each(|number| text += &format!("mtllib {number}.mtl\n"));
    refuses(&text, 6 + 256, "more than 256 material libraries");
    let names: String = (0..100_000).map(|number| format!(" {number}.mtl")).collect();
    refuses(format!("mtllib {names}"), 1, "more than 256 material libraries");
}

#[test]
fn faults_are_located() {
    for (line, words) in [
        ("f 1 2 5", "vertex index 5 is out of range; expected 1 to 4"),
        ("f 1 2 0", "vertex index 0 is out of range; expected 1 to 4"),
        ("f 1 2 -5", "vertex index -5 is out of range; expected -4 to -1"),
        ("f 1 2 999999999999999999", "out of range"),
        ("f 1 2 99999999999999999999", "“99999999999999999999” is no corner"),
        ("f 1/1 2 3", "texture coordinate index 1 is out of range; expected a texture coordinate to be defined"),
        ("f 1//2 2 3", "normal index 2 is out of range"),
        ("f 1 2 3x", "“3x” is no corner of a face; expected a, a/b, a//c or a/b/c"),
        ("f 1/ 2 3", "“1/” is no corner"),
        ("f 1/// 2 3", "“1///” is no corner"),
        ("f 1//1/1 2 3", "“1//1/1” is no corner"),
        ("f /1 2 3", "“/1” is no corner"),
        ("f 1.5 2 3", "“1.5” is no corner"),
        ("v 1 2", "the line ends too early; expected a value for z"),
        ("v 1 2 z", "“z” is no value for z"),
        ("v nan 0 0", "the vertex is at (NaN, 0, 0); expected finite"),
        ("v 0 inf 0", "the vertex is at (0, inf, 0)"),
        ("v 0 0 1e39", "the vertex is at (0, 0, inf)"),
        ("vn 1 2", "the line ends too early"),
    ] {
        let text = format!("\n{SQUARE}f 1 2 3\n{line}\nf 1 3 4\n");
        refuses(&text, 7, words);
        refuses(text.replace('\n', "\r\n"), 7, words);
        refuses(text.replace('\n', "\r"), 7, words);
    }
    refuses("f -1 -2 -3\nv 0 0 0\n", 1, "expected a vertex to be defined before it");
    refuses(format!("{SQUARE}f 1 2 \\\n\\\n9\n"), 7, "vertex index 9");
}

#[test]
fn nothing_to_render_is_an_error() {
    let error = parse("").expect_err("must be refused");
    located(error, At::File, "there are no faces");
    refuses(SQUARE, 4, "there are no faces");
    refuses(format!("{SQUARE}f 1 1 2\nf 1 2\nf\n"), 7, "there are no faces");
    refuses(b"\x7fELF\0\xff\xfe\n\0\n", 2, "there are no faces");
}

#[test]
fn collapsed_and_short_faces_are_left_out_with_one_note_each() {
    let scene = good(format!("{SQUARE}f 1 2 3\nf 1 1 2\nf 1 2 3\nf 2 3 2\nf 1 2\nf 1 2 2 3\n"));
    assert_eq!(scene.meshes[0].triangles, [[0, 1, 2]; 3]);
    let notes = warnings(&scene);
    assert_eq!(notes.len(), 2);
    assert!(notes[0].contains("1 faces with fewer than three corners"));
    assert!(notes[1].contains("3 triangles that use a vertex twice"));
}

/// Rows of quads with normals, in several materials: longer than one thread takes at a time.
fn large(relative: bool) -> String {
    let side = 100;
    let mut text = String::from("mtllib none.mtl\n");
    for y in 0..side {
        for x in 0..side {
            let z = (x as f32 * 0.37).sin() * 1e-2;
            text += &format!("v {x} {y} {z}\nvn {z} 0 1\n");
        }
        if y == 0 {
            continue;
        }
        text += &format!("usemtl m{}\ng row{y}\n", y % 3);
        for x in 1..side {
            let corner = |x: usize, y: usize| (y * side + x + 1) as i64;
            let corners = [corner(x - 1, y - 1), corner(x, y - 1), corner(x, y), corner(x - 1, y)];
            let back = if relative { ((y + 1) * side + 1) as i64 } else { 0 };
            let corner = |index: i64| format!("{}//{}", index - back, index - back);
            text += &format!("f {}\n", corners.map(corner).join(if x == 50 { " \\\n" } else { " " }));
        }
    }
    text
}

#[test]
fn names_that_end_in_a_backslash_take_the_next_line_with_them() {
    for eol in ["\n", "\r\n", "\r"] {
        let text = format!("{SQUARE}usemtl a\\\nv 9 9 9\nf 1 2 3\n# \\\nf -1 -2 -3\n").replace('\n', eol);
        let scene = good(&text);
        assert_eq!(scene.meshes[0].positions.len(), 4);
        assert_eq!(scene.meshes[0].triangles, [[0, 1, 2], [3, 2, 1]]);
    }
}

#[test]
fn many_pieces_make_the_same_meshes() {
    let (absolute, relative) = (large(false), large(true));
    assert!(absolute.len() > 3 << 18);
    let (absolute, relative) = (good(&absolute), good(&relative));
    assert_eq!(absolute.meshes.len(), 3);
    assert_eq!(absolute.meshes.iter().map(|mesh| mesh.triangles.len()).sum::<usize>(), 99 * 99 * 2);
    assert_eq!(absolute.meshes[0].name, "row1+row4+row7+row10+… (m1)");
    for (a, b) in absolute.meshes.iter().zip(&relative.meshes) {
        assert_eq!((&a.triangles, &a.positions, &a.normals), (&b.triangles, &b.positions, &b.normals));
    }
}

#[test]
fn errors_far_into_a_file_name_their_line() {
    let mut text = large(false);
    let line = text.lines().count() as u64 + 1;
    text += "f 1 2 10001\n";
    refuses(text, line, "vertex index 10001 is out of range; expected 1 to 10000");
}

#[test]
fn another_reader_agrees() {
    // The other reader knows no continued lines.
    let text = large(true).replace(" \\\n", " ");
    let options = tobj::LoadOptions { triangulate: true, ..tobj::LoadOptions::default() };
    let no_library = |_: &Path| Err(tobj::LoadError::OpenFileFailed);
    let (models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &options, no_library).expect("the oracle reads it");
    // The other reader makes a model a group; here all rows of one material are one mesh. Compare as sets.
    let mut theirs = Vec::new();
    for model in &models {
        let mesh = &model.mesh;
        let position = |&index: &u32| {
            let at = index as usize * 3;
            [mesh.positions[at], mesh.positions[at + 1], mesh.positions[at + 2]].map(f32::to_bits)
        };
        theirs.extend(mesh.indices.iter().map(position).collect::<Vec<_>>().chunks(3).map(<[_]>::to_vec));
    }
    let scene = good(&text);
    let bits = |triangle: &[Vec3]| triangle.iter().map(|p| p.to_array().map(f32::to_bits)).collect::<Vec<_>>();
    let mut ours: Vec<_> =
        scene.meshes.iter().flat_map(|mesh| corners(mesh).chunks(3).map(bits).collect::<Vec<_>>()).collect();
    ours.sort_unstable();
    theirs.sort_unstable();
    assert!(ours == theirs);
}

#[test]
fn lucy() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/models/lucy100k.obj");
    if !path.exists() {
        println!("skipped: ../shared not present");
        return;
    }
    let scene = comber::import::load(&path).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(scene.name, "lucy100k.obj");
    assert!(scene.notes.is_empty() && scene.meshes.len() == 1);
    let mesh = &scene.meshes[0];
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (49_987, 99_970));
    assert!(mesh.normals.is_empty());
    assert_eq!(mesh.triangles[0], [49_494, 29_144, 49_518]);
    let lowest = mesh.positions.iter().copied().reduce(Vec3::min).expect("vertices");
    let highest = mesh.positions.iter().copied().reduce(Vec3::max).expect("vertices");
    assert_eq!(lowest, Vec3::new(225.906, -605.89, -145.348));
    assert_eq!(highest, Vec3::new(1156.03, 991.332, 388.421));
    let (models, _) = tobj::load_obj(&path, &tobj::LoadOptions::default()).expect("the oracle reads it");
    // The other reader numbers vertices in order of use.
    let place = |&index: &u32| Vec3::from_slice(&models[0].mesh.positions[index as usize * 3..][..3]);
    assert!(corners(mesh) == models[0].mesh.indices.iter().map(place).collect::<Vec<_>>());
}

#[test]
fn endless_lines_and_floods_end() {
    for byte in [b'1', b' ', b'/', b'\\', b'x', 0] {
        let long = vec![byte; 8 << 20];
        for start in ["", "v ", "f 1 2 3", "f 1 2 ", "usemtl ", "mtllib ", "# "] {
            if let Err(error) = parse([SQUARE.as_bytes(), start.as_bytes(), &long].concat()) {
                assert!(error.to_string().len() < 400);
            }
        }
    }
    let _ = parse("\\\n".repeat(1 << 20));
    let _ = parse("mtllib a\n".repeat(1 << 18));
    assert!(parse(format!("{SQUARE}f{}\n", " 1 2 3 4".repeat(1 << 17))).is_ok());
    let materials: String = (0..100_000).map(|number| format!("usemtl {number}\nf 1 2 3\n")).collect();
    assert_eq!(good(format!("{SQUARE}{materials}")).meshes.len(), 100_000);
    // One position with ever so many normals.
    let normals: String = (0..200_000).map(|number| format!("vn {number} 1 1\nf 1//-1 2//-1 3//-1\n")).collect();
    assert_eq!(good(format!("{SQUARE}{normals}")).meshes[0].positions.len(), 600_000);
}

#[test]
fn truncation_at_every_percent_is_survived() {
    for text in [large(false), large(true)] {
        let whole = 99 * 99 * 2;
        for percent in 0..100 {
            if let Ok(scene) = parse(&text.as_bytes()[..text.len() * percent / 100]) {
                sound(&scene);
                assert!(scene.meshes.iter().map(|mesh| mesh.triangles.len()).sum::<usize>() < whole);
            }
        }
    }
}

/// What every caller relies on.
fn sound(scene: &SceneDescription) {
    assert!(!scene.meshes.is_empty());
    for mesh in &scene.meshes {
        assert!(!mesh.triangles.is_empty());
        assert!((mesh.material as usize) < scene.materials.len());
        assert!(mesh.normals.is_empty() || mesh.normals.len() == mesh.positions.len());
        assert!(mesh.positions.iter().all(|position| position.is_finite()));
        assert!(mesh.normals.iter().all(|normal| normal.is_normalized() || *normal == Vec3::ZERO));
        assert!(mesh.triangles.iter().flatten().all(|&index| (index as usize) < mesh.positions.len()));
    }
}

fn number() -> impl Strategy<Value = String> {
    let odd =
        vec!["0", "-1", "99999999999", "1e999", "nan", "-inf", "", "4294967295", "1/1/1", "-1//-1", "1/", "\\\n", "\r"];
    prop_oneof![
        3 => (-20i32..20).prop_map(|value| value.to_string()),
        3 => (1i32..20).prop_map(|value| format!("{value}//{value}")),
        1 => any::<f32>().prop_map(|value| value.to_string()),
        1 => proptest::sample::select(odd).prop_map(str::to_string),
    ]
}

fn line() -> impl Strategy<Value = String> {
    let words = vec!["v", "v", "v", "vn", "vt", "f", "f", "f", "o", "g", "s", "usemtl", "#", "l", "", "vv"];
    (proptest::sample::select(words), proptest::collection::vec(number(), 0..6))
        .prop_map(|(word, numbers)| format!("{word} {}\n", numbers.join(" ")))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn a_mesh_survives_the_round_trip(
        positions in proptest::collection::vec(proptest::array::uniform3(-1e30f32..1e30), 3..60),
        picks in proptest::collection::vec(any::<[Index; 3]>(), 1..60),
        relative: bool,
        eol in proptest::sample::select(vec!["\n", "\r\n", "\r", " \\\n\n"]),
    ) {
        let count = positions.len();
        let mut text: String = positions.iter().map(|[x, y, z]| format!("v {x} {y:e} {z}{eol}")).collect();
        let mut expected = vec![[0, 1, 2]];
        expected.extend(picks.iter().map(|pick| pick.map(|index| index.index(count) as u32)));
        expected.retain(|[a, b, c]| a != b && b != c && c != a);
        for triangle in &expected {
            let [a, b, c] = triangle.map(|index| i64::from(index) + if relative { -(count as i64) } else { 1 });
            text += &format!("f {a} {b}\t{c} {eol}");
        }
        let scene = good(&text);
        let positions: Vec<_> = positions.iter().map(|&position| Vec3::from_array(position)).collect();
        prop_assert_eq!(&scene.meshes[0].positions, &positions);
        prop_assert_eq!(&scene.meshes[0].triangles, &expected);
    }

    #[test]
    fn any_lines_are_read_or_refused(lines in proptest::collection::vec(line(), 0..40)) {
        if let Ok(scene) = parse(format!("{SQUARE}{}", lines.concat())) {
            sound(&scene);
        }
    }

    #[test]
    fn damaged_files_are_read_or_refused(
        lines in proptest::collection::vec((any::<[Index; 3]>(), any::<bool>()), 1..20),
        damages in proptest::collection::vec((any::<Index>(), 0usize..40, any::<u8>(), 0..4), 1..6),
    ) {
        let mut bytes = format!("{SQUARE}vn 0 0 1\nusemtl a\n").into_bytes();
        for (pick, normals) in lines {
            let suffix = if normals { "//1" } else { "" };
            let [a, b, c] = pick.map(|index| index.index(4) + 1);
            bytes.extend(format!("f {a}{suffix} {b}{suffix} {c}{suffix}\n").bytes());
        }
        for (at, count, byte, kind) in damages {
            if bytes.is_empty() {
                break;
            }
            let at = at.index(bytes.len());
            let range = at..(at + count).min(bytes.len());
            match kind {
                0 => bytes[at] ^= byte,
                1 => { bytes.drain(range); }
                2 => {
                    let copy = bytes[range].to_vec();
                    bytes.splice(at..at, copy);
                }
                _ => bytes.truncate(at),
            }
        }
        if let Ok(scene) = parse(&bytes) {
            sound(&scene);
        }
    }

    #[test]
    fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        if let Ok(scene) = parse(&bytes) {
            sound(&scene);
        }
    }
}
