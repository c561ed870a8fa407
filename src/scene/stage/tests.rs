//! The stage's numbers, against those that the reference pictures were made with.

use super::*;
use crate::scene::description::SphereDescription;
use crate::scene::procedural::generate;

/// A box of 2 × 4 × 1 around (5, 6, 7), as eight points.
fn box_mesh() -> SceneDescription {
    let corner = |i: u32| Vec3::new((i & 1) as f32 * 2.0, (i >> 1 & 1) as f32 * 4.0, (i >> 2 & 1) as f32);
    let positions = (0..8).map(|i| corner(i) + Vec3::new(4.0, 4.0, 6.5)).collect();
    let mesh = MeshDescription { positions, triangles: vec![[0, 1, 2], [5, 6, 7]], ..Default::default() };
    SceneDescription { meshes: vec![mesh], ..Default::default() }
}

fn room_mesh<'a>(staged: &'a Staged, name: &str) -> (&'a MeshDescription, Vec3, Vec3) {
    let mesh = staged.description.meshes.iter().find(|mesh| mesh.name == name).unwrap();
    let [a, b, c] = mesh.triangles[0].map(|i| mesh.positions[i as usize]);
    let Surface::Diffuse { albedo } = staged.description.materials[mesh.material as usize].surface else { panic!() };
    (mesh, (b - a).cross(c - a).normalize(), albedo)
}

#[test]
fn the_cornell_room_is_the_course_room() {
    let staged = place(box_mesh(), Stage::Cornell, UpAxis::Y).unwrap();
    let grey = Vec3::splat(0.6);
    let walls = [
        ("floor", Vec3::Y, 0.0, grey),
        ("ceiling", Vec3::NEG_Y, -1.5, grey),
        ("back wall", Vec3::NEG_Z, -1.0, grey),
        ("left wall", Vec3::NEG_X, -1.0, Vec3::new(0.6, 0.2, 0.2)),
        ("right wall", Vec3::X, -1.0, Vec3::new(0.2, 0.2, 0.6)),
    ];
    assert_eq!(staged.description.meshes.len(), 1 + walls.len());
    for (name, inwards, offset, wanted) in walls {
        let (mesh, normal, albedo) = room_mesh(&staged, name);
        assert_eq!((normal, albedo), (inwards, wanted), "{name}");
        assert!(mesh.positions.iter().all(|p| p.dot(inwards) == offset), "{name}");
        let area: f32 = mesh
            .triangles
            .iter()
            .map(|t| t.map(|i| mesh.positions[i as usize]))
            .map(|[a, b, c]| (b - a).cross(c - a).dot(inwards) / 2.0)
            .sum();
        assert_eq!(area, if inwards.y == 0.0 { 3.0 } else { 4.0 }, "{name}");
    }
    let [light] = &staged.description.area_lights[..] else { panic!("one light") };
    assert_eq!(light.center, Vec3::new(0.0, 1.49, 0.0));
    assert_eq!((light.side_u, light.side_v), (Vec3::new(0.6, 0.0, 0.0), Vec3::new(0.0, 0.0, 0.8)));
    assert_eq!((light.direction, light.radiance), (Vec3::NEG_Y, Vec3::splat(10.0)));
}

#[test]
fn the_cornell_camera_is_the_reference_camera() {
    let camera = place(box_mesh(), Stage::Cornell, UpAxis::Y).unwrap().camera;
    assert!(camera.position.distance(Vec3::new(0.0, 0.75, -4.80234)) < 1e-5);
    assert_eq!((camera.forward, camera.right, camera.up), (Vec3::Z, Vec3::NEG_X, Vec3::Y));
    let (x, y) = camera.shown(480, 360);
    assert!((2.0 * x.atan().to_degrees() - 30.6764).abs() < 1e-4);
    assert!((x / y - 4.0 / 3.0).abs() < 1e-6);
}

#[test]
fn cornell_meshes_stand_on_the_floor_in_the_middle() {
    let staged = place(box_mesh(), Stage::Cornell, UpAxis::Y).unwrap();
    let mesh = SceneDescription { meshes: vec![staged.description.meshes[0].clone()], ..Default::default() };
    let (min, max) = geometry_bounds(&mesh).unwrap();
    assert!(min.distance(DVec3::new(-0.3, 0.001, -0.15)) < 1e-6, "{min}");
    assert!(max.distance(DVec3::new(0.3, 1.201, 0.15)) < 1e-6, "{max}");
    let material = &staged.description.materials[0];
    assert_eq!(material.surface, Surface::Diffuse { albedo: Vec3::splat(0.5) });
}

#[test]
fn the_mesh_keeps_its_materials_and_loses_its_lights() {
    let mut description = box_mesh();
    description.materials.push(diffuse("own", Vec3::X));
    description.area_lights.push(softbox("own", DVec3::Y, DVec3::ZERO, 1.0, Vec3::ONE));
    let staged = place(description, Stage::Studio, UpAxis::Y).unwrap();
    assert_eq!(staged.description.materials[0].name, "own");
    assert!(staged.description.area_lights.iter().all(|light| light.name != "own"));
    assert!(staged.description.notes.iter().any(|note| note.warning));
}

#[test]
fn up_axes_become_y_without_mirroring() {
    for (up, axis) in [(UpAxis::X, Vec3::X), (UpAxis::Y, Vec3::Y), (UpAxis::Z, Vec3::Z)] {
        let mesh = MeshDescription { positions: vec![axis, Vec3::X, Vec3::Y, Vec3::Z], ..Default::default() };
        let mut description = SceneDescription { meshes: vec![mesh], ..Default::default() };
        turn_up(&mut description, up);
        let p = &description.meshes[0].positions;
        assert_eq!(p[0], Vec3::Y);
        assert_eq!(p[1].cross(p[2]).dot(p[3]), 1.0);
    }
}

#[test]
fn spheres_are_placed_too() {
    let ball = SphereDescription {
        name: String::new(),
        at: At::File,
        center: Vec3::splat(9.0),
        radius: 3.0,
        double: None,
        material: 0,
    };
    let description = SceneDescription { spheres: vec![ball], ..Default::default() };
    let staged = place(description, Stage::Cornell, UpAxis::Z).unwrap();
    let ball = &staged.description.spheres[0];
    assert!((ball.radius - 0.6).abs() < 1e-6 && ball.center.distance(Vec3::new(0.0, 0.601, 0.0)) < 1e-6);
}

/// Whether `p` is within the 4:3 frame.
fn shown(camera: &Camera, p: Vec3) -> bool {
    let offset = p - camera.position;
    let depth = offset.dot(camera.forward);
    let x = offset.dot(camera.right).abs() <= depth * camera.tan_half_x;
    depth > 0.0 && x && offset.dot(camera.up).abs() <= depth * camera.tan_half_y
}

#[test]
fn studio_and_none_show_the_mesh_and_hide_the_lamps() {
    let stretch = [Vec3::ONE, Vec3::new(1.0, 4.0, 1.0), Vec3::new(1.0, 0.01, 1.0), Vec3::splat(1e4)];
    for stage in [Stage::Studio, Stage::None] {
        for scale in stretch {
            let mut description = generate("proc:sphere,tris=1k").unwrap();
            description.meshes[0].positions.iter_mut().for_each(|p| *p *= scale);
            let staged = place(description, stage, UpAxis::Y).unwrap();
            assert!(staged.description.meshes[0].positions.iter().all(|&p| shown(&staged.camera, p)), "{scale}");
            assert!(!staged.description.area_lights.is_empty());
            for light in &staged.description.area_lights {
                let (u, v) = (light.side_u / 2.0, light.side_v / 2.0);
                let corners = [u + v, u - v, v - u, -u - v].map(|offset| light.center + offset);
                assert!(corners.iter().all(|&p| !shown(&staged.camera, p)), "{stage:?} {scale}: {}", light.name);
                assert!(light.radiance.is_finite() && light.radiance.min_element() > 0.0);
                assert!(light.direction.dot(-light.center) > 0.0 || stage == Stage::None);
            }
        }
    }
}

#[test]
fn the_backdrop_is_smooth_and_faces_the_camera() {
    let staged = place(box_mesh(), Stage::Studio, UpAxis::Y).unwrap();
    let backdrop = staged.description.meshes.last().unwrap();
    assert!((200..1000).contains(&backdrop.triangles.len()));
    for t in &backdrop.triangles {
        let [a, b, c] = t.map(|i| backdrop.positions[i as usize]);
        let face = (b - a).cross(c - a).normalize();
        assert!(t.iter().all(|&i| face.dot(backdrop.normals[i as usize]) > 0.99));
        assert!(face.dot(staged.camera.position - a) > 0.0);
    }
}

#[test]
fn scenes_that_shine_are_not_lit_again() {
    let mut description = generate("proc:cubes").unwrap();
    description.materials[0].emission = Vec3::ONE;
    assert!(place(description, Stage::None, UpAxis::Y).unwrap().description.area_lights.is_empty());
}

#[test]
fn nothing_cannot_be_staged() {
    for stage in [Stage::Cornell, Stage::Studio, Stage::None] {
        assert!(place(SceneDescription::default(), stage, UpAxis::Y).is_err());
        let point = MeshDescription { positions: vec![Vec3::ONE; 3], ..Default::default() };
        let description = SceneDescription { meshes: vec![point], ..Default::default() };
        assert!(place(description, stage, UpAxis::Y).is_err());
        let mut endless = box_mesh();
        endless.meshes[0].positions[0].x = f32::INFINITY;
        assert!(place(endless, stage, UpAxis::Y).is_err());
    }
}
