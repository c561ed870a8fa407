//! Scenes made of a few parts.

use comber::scene::camera::Camera;
use comber::scene::description::{
    AreaLightDescription, MaterialDescription, MeshDescription, SceneDescription, SphereDescription, Surface,
};
use glam::{DVec3, Vec3};

/// A grey material; returns its index.
pub fn grey(scene: &mut SceneDescription, albedo: f32, emission: f32) -> u32 {
    scene.materials.push(MaterialDescription {
        name: String::new(),
        at: Default::default(),
        surface: Surface::Diffuse { albedo: Vec3::splat(albedo) },
        emission: Vec3::splat(emission),
    });
    scene.materials.len() as u32 - 1
}

/// Parallelograms in one mesh, each from a corner and two sides, with their front at `u × v`.
pub fn quads(scene: &mut SceneDescription, parts: &[[Vec3; 3]], material: u32) {
    let positions = parts.iter().flat_map(|&[corner, u, v]| [corner, corner + u, corner + u + v, corner + v]);
    let triangles = (0..parts.len() as u32).flat_map(|i| [[0, 1, 2], [0, 2, 3]].map(|t| t.map(|k: u32| 4 * i + k)));
    let (positions, triangles) = (positions.collect(), triangles.collect());
    scene.meshes.push(MeshDescription { positions, triangles, material, ..Default::default() });
}

/// The box of half-width `half` around `center`, one mesh of 8 vertices, fronts inwards.
pub fn inward_box(scene: &mut SceneDescription, center: Vec3, half: f32, material: u32) {
    let corner = |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * 2.0 - 1.0;
    let faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let positions = (0..8).map(|i| center + corner(i) * half).collect();
    scene.meshes.push(MeshDescription { positions, triangles, material, ..Default::default() });
}

/// A sphere.
pub fn sphere(scene: &mut SceneDescription, center: Vec3, radius: f32, material: u32) {
    scene.spheres.push(SphereDescription {
        name: String::new(),
        at: Default::default(),
        center,
        radius,
        double: None,
        material,
    });
}

/// A parallelogram light from a corner and two sides, which emits towards `u × v`.
pub fn light(scene: &mut SceneDescription, [corner, side_u, side_v]: [Vec3; 3], radiance: f32) {
    scene.area_lights.push(AreaLightDescription {
        name: String::new(),
        at: Default::default(),
        center: corner + (side_u + side_v) * 0.5,
        double: None,
        side_u,
        side_v,
        direction: side_u.cross(side_v),
        radiance: Vec3::splat(radiance),
    });
}

/// A camera that looks from one point at another, +y or nearly so being up.
pub fn camera(from: Vec3, at: Vec3, tan_half_x: f64, tan_half_y: f64) -> Camera {
    let up = DVec3::new(0.01, 1.0, 0.02);
    Camera::look(from.as_dvec3(), (at - from).as_dvec3(), up, tan_half_x, tan_half_y).expect("camera")
}
