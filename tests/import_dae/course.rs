//! The course's own files, where they are at hand.

use super::*;
use comber::scene::description::Surface;
use glam::{DVec3, Vec3};
use std::path::PathBuf;

/// The scenes folder, or nothing, with a line that says so.
fn scenes() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes");
    if folder.join("cs184").is_dir() {
        return Some(folder);
    }
    println!("skipped: ../shared not present");
    None
}

fn read(folder: &Path, name: &str) -> SceneDescription {
    let path = folder.join("cs184").join(name);
    comber::import::dae::parse(&path, &std::fs::read(&path).unwrap()).unwrap()
}

fn triangles(scene: &SceneDescription) -> usize {
    scene.meshes.iter().map(|mesh| mesh.triangles.len()).sum()
}

fn assert_reference_light(scene: &SceneDescription) {
    let [light] = &scene.area_lights[..] else { panic!("{:?}", scene.area_lights) };
    assert_eq!(light.center, Vec3::new(0.0, 1.49, 0.0));
    assert_eq!((light.side_u, light.side_v), (Vec3::new(-0.6, 0.0, 0.0), Vec3::new(0.0, 0.0, 0.8)));
    assert_eq!((light.direction, light.radiance), (Vec3::NEG_Y, Vec3::splat(10.0)));
    assert!(scene.meshes.iter().all(|mesh| mesh.name != "light"));
    assert_note(scene, false, "the emissive quad light");
    assert_eq!(scene.notes.len(), 1);
}

#[test]
fn spheres() {
    let Some(folder) = scenes() else { return };
    for name in ["CBspheres.dae", "CBspheres_lambertian.dae"] {
        let scene = read(&folder, name);
        assert!(scene.course_profile);
        assert_reference_light(&scene);
        assert_eq!((scene.meshes.len(), triangles(&scene)), (5, 10));
        let spheres: Vec<_> = scene.spheres.iter().map(|sphere| (sphere.center, sphere.radius)).collect();
        assert_eq!(spheres, [(Vec3::new(0.4, 0.3, 0.3), 0.3), (Vec3::new(-0.4, 0.3, -0.3), 0.3)]);
        let camera = scene.camera.as_ref().unwrap();
        assert_eq!((camera.xfov, camera.aspect_ratio), (Some(49.13434), Some(1.333333)));
        assert_eq!(camera.to_world.transform_point3(DVec3::ZERO), DVec3::new(0.0, 0.0, 3.0));
        assert_eq!(camera.to_world.transform_vector3(DVec3::NEG_Z), DVec3::NEG_Z);
        let kinds: Vec<_> = scene.spheres.iter().map(|s| scene.materials[s.material as usize].surface.kind()).collect();
        let expected = if name == "CBspheres.dae" { ["glass", "mirror"] } else { ["diffuse", "diffuse"] };
        assert_eq!(kinds, expected);
        let wall = |name: &str| {
            let mesh = scene.meshes.iter().find(|mesh| mesh.name == name).unwrap();
            (scene.materials[mesh.material as usize].surface.clone(), mesh.positions[0].x.round())
        };
        assert_eq!(wall("leftWall"), (Surface::Diffuse { albedo: Vec3::new(0.6, 0.2, 0.2) }, -1.0));
        assert_eq!(wall("rightWall"), (Surface::Diffuse { albedo: Vec3::new(0.2, 0.2, 0.6) }, 1.0));
    }
}

#[test]
fn bunny() {
    let Some(folder) = scenes() else { return };
    for name in ["CBbunny.dae", "CBbunny_CGL.dae"] {
        let scene = read(&folder, name);
        assert!(scene.course_profile);
        assert_reference_light(&scene);
        assert_eq!((scene.meshes.len(), triangles(&scene), scene.spheres.len()), (6, 28_586, 0));
        let bunny = &scene.meshes[0];
        assert_eq!((bunny.name.as_str(), bunny.triangles.len()), ("Mesh", 28_576));
        assert!(bunny.normals.iter().all(|normal| (normal.length() - 1.0).abs() < 1e-5));
        let lowest = bunny.positions.iter().map(|position| position.y).fold(f32::INFINITY, f32::min);
        assert!(lowest.abs() < 0.01, "the bunny stands on the floor, not at {lowest}");
        let camera = scene.camera.as_ref().unwrap();
        assert_eq!(camera.to_world.transform_point3(DVec3::ZERO), DVec3::new(0.0, 0.0, -3.0));
        assert_eq!(camera.to_world.transform_vector3(DVec3::X), DVec3::NEG_X);
    }
}

#[test]
fn the_empty_boxes_have_the_same_lamp() {
    let Some(folder) = scenes() else { return };
    for name in ["CBempty.dae", "CBempty_CGL.dae"] {
        let scene = read(&folder, name);
        assert_eq!((scene.area_lights.len(), scene.meshes.len(), triangles(&scene)), (0, 6, 12));
        let emits = |mesh: &&comber::scene::description::MeshDescription| {
            scene.materials[mesh.material as usize].emission == Vec3::splat(10.0)
        };
        let lamps: Vec<_> = scene.meshes.iter().filter(emits).collect();
        let [lamp] = lamps[..] else { panic!("{} lamps", lamps.len()) };
        assert_eq!(lamp.name, "light");
        for triangle in &lamp.triangles {
            let [a, b, c] = triangle.map(|index| lamp.positions[index as usize]);
            assert!(((b - a).cross(c - a).normalize() - Vec3::NEG_Y).length() < 1e-5, "{name} faces down");
        }
        assert_note(&scene, false, "stands in the emissive quad light");
        assert_eq!(scene.notes.len(), 1);
    }
}

#[test]
fn hostile_files_are_refused_or_read() {
    let Some(folder) = scenes() else { return };
    let mut seen = 0;
    for entry in std::fs::read_dir(folder.join("hostile")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "dae") {
            refuse(&std::fs::read(&path).unwrap());
            seen += 1;
        }
    }
    assert!(seen > 0);
}

#[test]
fn truncated_course_files_are_refused() {
    let Some(folder) = scenes() else { return };
    for name in ["CBspheres.dae", "CBbunny.dae"] {
        let bytes = std::fs::read(folder.join("cs184").join(name)).unwrap();
        for percent in 0..100 {
            refuse(&bytes[..bytes.len() * percent / 100]);
        }
    }
}
