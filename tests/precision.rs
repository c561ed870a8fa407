//! `--precision f64`: scenes that are both huge and fine, which no choice of origin mends, look as they do where single precision holds them.

mod common;

use comber::film::picture::Picture;
use comber::import;
use comber::options::{AccelOptions, Integrator, Normals, Precision, RenderOptions};
use comber::scene::camera::Camera;
use comber::scene::description::SceneDescription;
use comber::scene::stage::{Stage, UpAxis, place};
use comber::scene::{procedural, viewpoint};
use common::command::{expect, number, stderr, with_scene};
use common::statistics::{Estimate, Family, regions};
use common::{Ready, own};
use glam::DVec3;
use std::path::Path;

/// How far the thing that is looked at stands from the middle of its scene, in sizes of it.
const FAR: f64 = 1e7;

/// Where it stands: a direction with no zeros in it, and nothing that single precision holds.
fn away() -> DVec3 {
    DVec3::new(0.6, -0.64, 0.48) * FAR + DVec3::splat(0.123)
}

/// A closed knot of 2000 triangles on a floor below a lamp, all of it at `at`; and a triangle elsewhere, so that the middle of the scene is 10⁷ away and
/// stays there.
fn obj(at: DVec3) -> String {
    let mesh = procedural::generate("proc:knot,tris=2000").expect("a knot").meshes.remove(0);
    let mut text = String::from("mtllib scene.mtl\n");
    let mut count = 0;
    let mut add = |text: &mut String, material: &str, points: Vec<DVec3>, faces: &[[u32; 3]]| {
        *text += &format!("usemtl {material}\n");
        points.iter().for_each(|&p| *text += &format!("v {} {} {}\n", p.x, p.y, p.z));
        faces.iter().for_each(|face| {
            let [a, b, c] = face.map(|vertex| vertex + count + 1);
            *text += &format!("f {a} {b} {c}\n");
        });
        count += points.len() as u32;
    };
    let quad = |y: f64, half: f64| {
        [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)].map(|(x, z)| DVec3::new(x * half, y, z * half))
    };
    let moved = |points: &[DVec3]| points.iter().map(|&p| p + at).collect::<Vec<_>>();
    let knot: Vec<DVec3> = mesh.positions.iter().map(|p| p.as_dvec3() * 0.5).collect();
    add(&mut text, "grey", moved(&knot), &mesh.triangles);
    add(&mut text, "grey", moved(&quad(-0.6, 1.5)), &[[0, 1, 2], [0, 2, 3]]);
    add(&mut text, "glow", moved(&quad(1.6, 0.4)), &[[0, 2, 1], [0, 3, 2]]);
    let elsewhere = at - away() * 2.0;
    add(&mut text, "grey", vec![elsewhere, elsewhere + DVec3::X * 5.0, elsewhere + DVec3::Y * 5.0], &[[0, 1, 2]]);
    text
}

fn camera(at: DVec3) -> Camera {
    let from = DVec3::new(0.9, 1.1, 2.4);
    Camera::look(at + from, -from, DVec3::Y, 0.32, 0.24).expect("a camera")
}

fn load(name: &str, bytes: &[u8], precision: Precision) -> SceneDescription {
    let folder = tempfile::tempdir().expect("a folder");
    let materials = "newmtl grey\nKd 0.6 0.5 0.4\nnewmtl glow\nKd 0 0 0\nKe 9 9 8\n";
    std::fs::write(folder.path().join("scene.mtl"), materials).expect("a file");
    let file = folder.path().join(name);
    std::fs::write(&file, bytes).expect("a file");
    import::load_in(&file, precision).expect("a readable scene")
}

fn options(precision: Precision, seed: u32) -> RenderOptions {
    let accel = AccelOptions { precision, ..AccelOptions::default() };
    RenderOptions { width: 80, height: 60, samples: 64, seed, aovs: true, accel, ..RenderOptions::default() }
}

/// With cameras given around the file's origin.
fn picture(scene: &SceneDescription, camera: Camera, options: &RenderOptions) -> Picture {
    let camera = camera.at(camera.place() - scene.origin);
    Ready::of(scene.clone(), camera, Normals::Smooth, options.accel).render(options).picture
}

/// z-tests of regions and channels of two pictures with seeds of their own; and of what is no random number, depths, the share that differs.
fn compare(a: &Picture, b: &Picture) -> (Family, f64) {
    let mut family = Family::new("far and near");
    for cell in regions(a.width as u32, a.height as u32, 8, 6) {
        for channel in 0..3 {
            let [a, b] = [a, b].map(|picture| Estimate::of_pixels(picture, cell, channel));
            family.add(a.z_from(b), format!("{cell:?}, channel {channel}"));
        }
    }
    let depths = [a, b].map(|picture| picture.depth.as_ref().expect("depth"));
    let differ = depths[0].iter().zip(depths[1]).filter(|(x, y)| (*x - *y).abs() > 0.05 * x.abs().max(y.abs())).count();
    (family, differ as f64 / depths[0].len() as f64)
}

/// The claim; and that its test can fail: single precision does not pass it.
#[test]
fn what_stands_far_away_looks_as_it_does_nearby() {
    let near = load("near.obj", obj(DVec3::ZERO).as_bytes(), Precision::F32);
    let expected = picture(&near, camera(DVec3::ZERO), &options(Precision::F32, 1));
    for precision in [Precision::F64, Precision::F32] {
        let far = load("far.obj", obj(away()).as_bytes(), precision);
        assert!(far.origin.length() < 1e3, "the scene's middle is its origin");
        assert_eq!(far.meshes[0].double.is_empty(), precision == Precision::F32);
        let (family, differ) = compare(&picture(&far, camera(away()), &options(precision, 2)), &expected);
        println!("{precision:?}: depth differs in {:.2} % of the pixels", 100.0 * differ);
        match precision {
            Precision::F64 => {
                assert!(differ < 0.02, "{differ}");
                family.check();
            }
            Precision::F32 => {
                assert!(differ > 0.2, "{differ}");
                assert!(std::panic::catch_unwind(|| family.check()).is_err(), "the test tells the two apart");
            }
        }
    }
    // Where single precision is enough, both show the same.
    let near = load("near.obj", obj(DVec3::ZERO).as_bytes(), Precision::F64);
    let (family, differ) = compare(&picture(&near, camera(DVec3::ZERO), &options(Precision::F64, 3)), &expected);
    assert!(differ < 0.02, "{differ}");
    family.check();
}

/// A COLLADA scene of the project – rooms, spheres, an area light and a camera – moved, and a wall elsewhere.
fn dae(name: &str, at: DVec3) -> Vec<u8> {
    let text = std::fs::read_to_string(own(name)).expect("a scene of the project");
    let moved = |p: DVec3| format!("<translate>{} {} {}</translate>", p.x, p.y, p.z);
    let open = "<visual_scene id=\"scene\">";
    let start = text.find("<instance_geometry url=\"#floor-geometry\">").expect("a floor");
    let end = start + text[start..].find("</instance_geometry>").expect("its end") + "</instance_geometry>".len();
    let elsewhere = format!("<node id=\"elsewhere\">{}{}</node>", moved(at - away() * 2.0), &text[start..end]);
    text.replace(open, &format!("{open}{elsewhere}<node id=\"all\">{}", moved(at)))
        .replace("</visual_scene>", "</node></visual_scene>")
        .into_bytes()
}

#[test]
fn spheres_lights_and_cameras_are_in_double_precision_too() {
    for name in ["cornell_spheres.dae", "cornell_mesh.dae"] {
        let render = |at: DVec3, precision, seed| {
            let scene = load(name, &dae(name, at), precision);
            let camera = viewpoint::from_node(scene.camera.as_ref().expect("a camera")).expect("a camera");
            Ready::of(scene, camera, Normals::Smooth, options(precision, 0).accel)
                .render(&options(precision, seed))
                .picture
        };
        let expected = render(DVec3::ZERO, Precision::F32, 1);
        let (family, differ) = compare(&render(away(), Precision::F64, 2), &expected);
        println!("{name}: depth differs in {:.2} % of the pixels", 100.0 * differ);
        assert!(differ < 0.02, "{name}: {differ}");
        family.check();
    }
}

/// The knot and a triangle elsewhere, as PLY.
fn ply(at: DVec3, format: &str) -> Vec<u8> {
    let mesh = procedural::generate("proc:knot,tris=2000").expect("a knot").meshes.remove(0);
    let mut positions: Vec<DVec3> = mesh.positions.iter().map(|p| p.as_dvec3() * 0.5 + at).collect();
    let elsewhere = at - away() * 2.0;
    positions.extend([elsewhere, elsewhere + DVec3::X, elsewhere + DVec3::Y]);
    let mut triangles = mesh.triangles;
    let last = positions.len() as u32;
    triangles.push([last - 3, last - 2, last - 1]);
    let mut bytes = format!(
        "ply\nformat {format} 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        positions.len(),
        triangles.len()
    )
    .into_bytes();
    if format == "ascii" {
        positions.iter().for_each(|p| bytes.extend(format!("{} {} {}\n", p.x, p.y, p.z).bytes()));
        triangles.iter().for_each(|[a, b, c]| bytes.extend(format!("3 {a} {b} {c}\n").bytes()));
        return bytes;
    }
    let big = format.contains("big");
    for coordinate in positions.iter().flat_map(|p| p.to_array()) {
        bytes.extend(if big { coordinate.to_be_bytes() } else { coordinate.to_le_bytes() });
    }
    for triangle in &triangles {
        bytes.push(3);
        triangle.iter().for_each(|index| bytes.extend(if big { index.to_be_bytes() } else { index.to_le_bytes() }));
    }
    bytes
}

#[test]
fn doubles_of_ply_files_arrive() {
    let geometry = |precision| RenderOptions { integrator: Integrator::Normals, samples: 1, ..options(precision, 0) };
    let near = load("near.ply", &ply(DVec3::ZERO, "binary_little_endian"), Precision::F32);
    let expected = picture(&near, camera(DVec3::ZERO), &geometry(Precision::F32));
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let far = load("far.ply", &ply(away(), format), Precision::F64);
        for (p, q) in far.meshes[0].double.iter().zip(&near.meshes[0].positions) {
            assert!((*p + far.origin - away()).distance(q.as_dvec3()) < 1e-8 || q.length() > 1e3, "{p} {q}");
        }
        let found = picture(&far, camera(away()), &geometry(Precision::F64));
        let depths = [&found, &expected].map(|picture| picture.depth.as_ref().expect("depth"));
        let differ = depths[0].iter().zip(depths[1]).filter(|(a, b)| (*a - *b).abs() > 1e-4).count();
        assert!(differ * 100 < depths[0].len(), "{format}: {differ} pixels");
    }
}

/// Scaled and moved onto a stage, what was fine stays so: all distances change by one factor.
#[test]
fn stages_keep_what_is_known() {
    let scene = load("far.obj", obj(away()).as_bytes(), Precision::F64);
    for (stage, up) in [(Stage::Cornell, UpAxis::Y), (Stage::Studio, UpAxis::Z), (Stage::None, UpAxis::X)] {
        let staged = place(scene.clone(), stage, up).expect("a stage").description;
        let factor = |a: u32, b: u32| {
            let [before, after] = [&scene, &staged].map(|s| s.meshes[0].position(a).distance(s.meshes[0].position(b)));
            after / before
        };
        let expected = factor(0, 7);
        for (a, b) in [(0, 500), (3, 4), (11, 600), (200, 900)] {
            assert!((factor(a, b) / expected - 1.0).abs() < 1e-5, "{stage:?}: {} {expected}", factor(a, b));
        }
        for (single, double) in staged.meshes[0].positions.iter().zip(&staged.meshes[0].double) {
            assert_eq!(*single, double.as_vec3());
        }
    }
}

fn refused(directory: &Path, line: &str, what: &str) {
    let output = expect(directory, line, 2);
    assert!(stderr(&output).contains(what), "{line}: {}", stderr(&output));
}

#[test]
fn the_command_line_takes_it_and_says_so() {
    let dir = with_scene();
    let json =
        |line: &str| serde_json::from_slice::<serde_json::Value>(&expect(dir.path(), line, 0).stdout).expect("JSON");
    let plan = json("info box.dae --precision f64 --json");
    assert!(plan.to_string().contains("double precision"), "{plan:#}");
    let bytes = |plan: &serde_json::Value| number(plan, "/plan/bytes_per_path");
    // Three columns each of path, next and shadow rays.
    assert_eq!(bytes(&plan) - bytes(&json("info box.dae --json")), 36.0);
    let render = |precision: &str, name: &str| {
        expect(dir.path(), &format!("render box.dae -r 24 18 -s 4 --precision {precision} -f {name}.exr -q"), 0);
        std::fs::read(dir.path().join(format!("{name}.exr"))).expect("a picture")
    };
    let holds = |bytes: &[u8], text: &str| bytes.windows(text.len()).any(|window| window == text.as_bytes());
    let (single, double) = (render("f32", "single"), render("f64", "double"));
    assert!(holds(&single, "\"precision\":\"f32\"") && holds(&double, "\"precision\":\"f64\""), "provenance");
    let help = expect(dir.path(), "render --help", 0).stdout;
    assert!(String::from_utf8_lossy(&help).contains("--precision"));

    refused(dir.path(), "render box.dae --precision f16", "f32");
    refused(dir.path(), "render box.dae --precision f64 --intersection fast", "intersection fast");
    refused(dir.path(), "render box.dae --precision f64 --nodes compact", "--nodes");
    refused(dir.path(), "render box.dae --precision f64 --bvh best", "--bvh");
    refused(dir.path(), "render box.dae --precision f64 --light-selection tree", "light-selection tree");
    refused(dir.path(), "bench box.dae --precision f64", "comber trade");
    refused(dir.path(), "trade box.dae --vary precision=f64 --vary bvh=fast,best", "precision f64");
}

/// Both in one run, on trees of their own; the picture is the same, and so is its error.
#[test]
fn trade_compares_both() {
    let dir = with_scene();
    let line = "trade box.dae -r 24 18 --vary precision=f32,f64 -s 4 --runs 3 --reference-error 0.2 --json";
    let report: serde_json::Value = serde_json::from_slice(&expect(dir.path(), line, 0).stdout).expect("JSON");
    let text = report.to_string();
    assert!(text.contains("f32") && text.contains("f64"), "{report:#}");
}
