//! Scenes far from the origin look as they do at the origin, to the precision of their files.

mod common;

use comber::bvh::Accel;
use comber::film::picture::Picture;
use comber::options::{AccelOptions, RenderOptions};
use comber::scene::description::SceneDescription;
use comber::scene::stage::{Stage, UpAxis, place};
use comber::scene::{Scene, SceneOptions, procedural, viewpoint};
use common::Ready;
use glam::{DVec3, Vec3};
use std::path::Path;
use std::process::Command;

/// How far scenes of a size of about 2 are moved.
const OFFSETS: [f64; 3] = [1e3, 1e5, 1e7];

/// A direction with no zeros in it, of about unit length.
fn offset(far: f64) -> DVec3 {
    DVec3::new(0.6, -0.64, 0.48) * far
}

/// A knot of 600 triangles, in f64 and not exactly in f32.
fn knot() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mesh = procedural::generate("proc:knot,tris=600").expect("a knot").meshes.remove(0);
    (mesh.positions.iter().map(|p| p.as_dvec3() * 1.1).collect(), mesh.triangles)
}

fn obj(at: DVec3) -> Vec<u8> {
    let (positions, triangles) = knot();
    let vertices = positions.iter().map(|&p| {
        let DVec3 { x, y, z } = p + at;
        format!("v {x} {y} {z}\n")
    });
    let faces = triangles.iter().map(|[a, b, c]| format!("f {} {} {}\n", a + 1, b + 1, c + 1));
    vertices.chain(faces).collect::<String>().into_bytes()
}

fn ply(at: DVec3, number: &str, big: bool) -> Vec<u8> {
    let (positions, triangles) = knot();
    let format = if big { "binary_big_endian" } else { "binary_little_endian" };
    let mut bytes = format!(
        "ply\nformat {format} 1.0\nelement vertex {}\nproperty {number} x\nproperty {number} y\nproperty {number} z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        positions.len(),
        triangles.len()
    )
    .into_bytes();
    let mut add = |word: &mut [u8]| {
        if big {
            word.reverse();
        }
        bytes.extend_from_slice(word);
    };
    for coordinate in positions.iter().flat_map(|&p| (p + at).to_array()) {
        match number {
            "double" => add(&mut coordinate.to_le_bytes()),
            _ => add(&mut (coordinate as f32).to_le_bytes()),
        }
    }
    for triangle in &triangles {
        add(&mut [3]);
        triangle.iter().for_each(|index| add(&mut index.to_le_bytes()));
    }
    bytes
}

fn ascii_ply(at: DVec3) -> Vec<u8> {
    let (positions, triangles) = knot();
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        positions.len(),
        triangles.len()
    );
    for &p in &positions {
        let DVec3 { x, y, z } = p + at;
        text += &format!("{x} {y} {z}\n");
    }
    triangles.iter().for_each(|[a, b, c]| text += &format!("3 {a} {b} {c}\n"));
    text.into_bytes()
}

/// A COLLADA scene of the project, all of it moved: geometry, light and camera. Its axes are z up.
fn dae(at: DVec3) -> Vec<u8> {
    let text = std::fs::read_to_string(common::own("cornell_spheres.dae")).expect("a scene of the project");
    let DVec3 { x, y, z } = at;
    let open = "<visual_scene id=\"scene\">";
    assert!(text.contains(open));
    text.replace(open, &format!("{open}<node id=\"all\"><translate>{x} {y} {z}</translate>"))
        .replace("</visual_scene>", "</node></visual_scene>")
        .into_bytes()
}

fn load(name: &str, bytes: &[u8]) -> SceneDescription {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join(name);
    std::fs::write(&file, bytes).expect("a file");
    comber::import::load(&file).expect("a readable scene")
}

/// Its picture: with its own camera, as its node says, or on the Cornell stage.
fn picture(description: SceneDescription) -> Picture {
    let (description, camera) = match &description.camera {
        Some(node) => {
            let camera = viewpoint::from_node(node).expect("a camera");
            (description, camera)
        }
        None => {
            let staged = place(description, Stage::Cornell, UpAxis::Y).expect("a stage");
            (staged.description, staged.camera)
        }
    };
    let scene = Scene::build(description, SceneOptions::default()).expect("a scene");
    let accel = Accel::build(&scene.shapes, &AccelOptions::default()).expect("a tree");
    let options = RenderOptions { width: 96, height: 72, samples: 16, seed: 7, aovs: true, ..RenderOptions::default() };
    Ready { name: String::new(), scene, accel, camera }.render(&options).picture
}

/// Of two pictures with the same random numbers: the difference of their means, and the share of pixels of which the depth or the radiance differs by more
/// than a thousandth, which edges and forked paths cause.
fn difference(a: &Picture, b: &Picture) -> (f64, f64) {
    let mean = |p: &Picture| p.beauty.iter().flatten().map(|&c| f64::from(c)).sum::<f64>();
    let differs = |x: f32, y: f32| (x - y).abs() > 1e-3 * x.abs().max(y.abs());
    let depths = [a, b].map(|p| p.depth.as_ref().expect("depth"));
    let pixels = a.beauty.len();
    let different = (0..pixels)
        .filter(|&i| differs(depths[0][i], depths[1][i]) || (0..3).any(|c| differs(a.beauty[i][c], b.beauty[i][c])))
        .count();
    ((mean(a) / mean(b) - 1.0).abs(), different as f64 / pixels as f64)
}

/// The picture of a scene that was moved is that of the scene at the origin.
fn assert_unmoved(name: &str, make: impl Fn(DVec3) -> Vec<u8>) {
    let here = load(name, &make(DVec3::ZERO));
    assert_eq!(here.origin, DVec3::ZERO, "{name} lies at the origin");
    let size = extent(&here);
    let here_positions: Vec<DVec3> = positions(&here);
    let expected = picture(here);
    for far in OFFSETS {
        let moved = load(name, &make(offset(far)));
        assert!(moved.origin.distance(moved_by(name, far)) < size, "{name} at {far:e}: {}", moved.origin);
        assert!(moved.notes.iter().any(|note| !note.warning && note.text.contains("times its size")), "{name}");
        let steps = far * f64::EPSILON;
        for (p, q) in positions(&moved).into_iter().zip(&here_positions) {
            let error = (p + moved.origin - moved_by(name, far)).distance(*q);
            // Single precision around the centre, and what f64 leaves of the file.
            assert!(error <= 2.0 * f64::from(f32::EPSILON) * size + 8.0 * steps, "{name} at {far:e}: {error:e}");
        }
        let (mean, pixels) = difference(&picture(moved), &expected);
        println!("{name} at {far:e}: mean differs by {mean:.1e}, {:.2} % of the pixels", 100.0 * pixels);
        assert!(mean < 2e-3 && pixels < 0.05, "{name} at {far:e}: mean {mean:e}, pixels {pixels}");
    }
}

/// Where the offset of a file leads, in the axes of its description.
fn moved_by(name: &str, far: f64) -> DVec3 {
    let DVec3 { x, y, z } = offset(far);
    if name.ends_with(".dae") { DVec3::new(-x, z, y) } else { DVec3::new(x, y, z) }
}

fn positions(scene: &SceneDescription) -> Vec<DVec3> {
    scene.meshes.iter().flat_map(|mesh| &mesh.positions).map(|p| p.as_dvec3()).collect()
}

fn extent(scene: &SceneDescription) -> f64 {
    let all = positions(scene);
    let (low, high) = all.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(a, b), p| (a.min(*p), b.max(*p)));
    (high - low).max_element()
}

#[test]
fn text_and_doubles_keep_their_precision_far_away() {
    assert_unmoved("knot.obj", obj);
    assert_unmoved("knot.ply", |at| ply(at, "double", false));
    assert_unmoved("big.ply", |at| ply(at, "double", true));
    assert_unmoved("ascii.ply", ascii_ply);
}

#[test]
fn light_and_camera_move_with_their_scene() {
    assert_unmoved("room.dae", dae);
}

#[test]
fn what_single_precision_has_lost_is_said() {
    let near = load("near.ply", &ply(offset(10.0), "float", false));
    assert_eq!(near.origin, DVec3::ZERO);
    assert!(near.notes.is_empty());
    let far = load("far.ply", &ply(offset(1e5), "float", true));
    let text = far.notes.iter().find(|note| note.warning).map(|note| note.text.clone()).expect("a warning");
    // 64000 is 2⁻⁸ apart.
    assert!(text.contains("single precision") && text.contains("3.90625e-3"), "{text}");
    // Nothing more is lost: what the file holds is there, exactly.
    let (positions, _) = knot();
    for (p, q) in far.meshes[0].positions.iter().zip(&positions) {
        let stored = (*q + offset(1e5)).as_vec3().as_dvec3();
        assert_eq!(p.as_dvec3() + far.origin, stored);
    }
}

#[test]
fn a_normal_is_no_position() {
    let text = "v 1e6 1e6 1e6\nv 1000001 1e6 1e6\nv 1e6 1000001 1e6\nvn 0 0 1\nf 1//1 2//1 3//1\n";
    let scene = load("normal.obj", text.as_bytes());
    assert_ne!(scene.origin, DVec3::ZERO);
    assert_eq!(scene.meshes[0].normals, [Vec3::Z; 3]);
}

fn comber(folder: &Path, line: &str) -> (String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_comber"));
    command.current_dir(folder).env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR"));
    let output = command.args(line.split_whitespace()).output().expect("comber");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(output.status.success(), "{line}: {}", text(&output.stderr));
    (text(&output.stdout), text(&output.stderr))
}

#[test]
fn info_tells_and_cameras_are_given_in_the_files_coordinates() {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, at) in [("here.obj", DVec3::ZERO), ("far.obj", offset(1e7))] {
        std::fs::write(folder.path().join(name), obj(at)).expect("a file");
    }
    let (text, said) = comber(folder.path(), "info far.obj --stage none");
    assert!(text.contains("times its size from the file's"), "{text}");
    assert!(said.contains("times its size from the origin"), "{said}");
    assert!(!comber(folder.path(), "info here.obj --stage none").0.contains("times its size"));

    let camera = |at: DVec3| {
        let (from, to) = (at + DVec3::new(0.5, 1.5, 3.0), at);
        format!("--vp {} {} {} --vi {} {} {}", from.x, from.y, from.z, to.x, to.y, to.z)
    };
    let json = |name: &str, at: DVec3| {
        let line = format!("info {name} --stage none --json {}", camera(at));
        serde_json::from_str::<serde_json::Value>(&comber(folder.path(), &line).0).expect("JSON")
    };
    let (here, far) = (json("here.obj", DVec3::ZERO), json("far.obj", offset(1e7)));
    let vector = |value: &serde_json::Value| DVec3::from([0, 1, 2].map(|i| value[i].as_f64().expect("a number")));
    let position = |info: &serde_json::Value| vector(&info["camera"]["position"]) + vector(&info["scene"]["origin"]);
    assert_eq!(vector(&here["scene"]["origin"]), DVec3::ZERO);
    assert!(position(&far).distance(position(&here) + offset(1e7)) < 1e-6);
    let forward = |info: &serde_json::Value| vector(&info["camera"]["forward"]);
    assert!(forward(&far).distance(forward(&here)) < 1e-6);
}

/// So far away that single precision puts all of a scene into one point, the first reading knows where that is.
#[test]
fn scenes_that_single_precision_collapses_are_found_again() {
    type Make = fn(DVec3) -> Vec<u8>;
    let makes: [(&str, Make); 3] = [("knot.obj", obj), ("ascii.ply", ascii_ply), ("room.dae", dae)];
    for (name, make) in makes {
        let (here, moved) = (load(name, &make(DVec3::ZERO)), load(name, &make(offset(1e10))));
        assert!(moved.origin.distance(moved_by(name, 1e10)) <= extent(&here), "{name}: {}", moved.origin);
        let triangles = |scene: &SceneDescription| scene.meshes.iter().map(|m| m.triangles.len()).collect::<Vec<_>>();
        assert_eq!(triangles(&moved), triangles(&here), "{name}");
        for (p, q) in positions(&moved).into_iter().zip(positions(&here)) {
            let error = (p + moved.origin - moved_by(name, 1e10)).distance(q);
            assert!(error <= 2e-5, "{name}: {error:e}");
        }
    }
}
