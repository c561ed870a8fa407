//! The scene that is rendered when none is named: the project's own Cornell box.
//!
//! A room 2.4 × 1.8 × 2.4 around the origin with a teal and an ochre wall; in it a trefoil of over a million
//! triangles, and a sphere.

use crate::error::{At, Error, Note, Result};
use crate::scene::camera::Camera;
use crate::scene::description::{AreaLightDescription, MaterialDescription, SphereDescription, Surface};
use crate::scene::procedural::generate;
use crate::scene::stage::{Room, Staged, add_room};
use glam::{DQuat, DVec3, EulerRot, Vec3};
use rayon::prelude::*;

const ROOM: Room = Room {
    min: Vec3::new(-1.2, -0.9, -1.2),
    max: Vec3::new(1.2, 0.9, 1.2),
    neutral: [Vec3::new(0.62, 0.6, 0.57), Vec3::splat(0.72), Vec3::new(0.7, 0.69, 0.66)],
    left: Vec3::new(0.68, 0.36, 0.13),
    right: Vec3::new(0.1, 0.42, 0.45),
};

/// The trefoil, its colour, and its pose: scale, then turns about x and y, then the place of its middle.
const KNOT: &str = "proc:knot,tris=1.2M,seed=1";
const KNOT_ALBEDO: Vec3 = Vec3::new(0.78, 0.74, 0.66);
const KNOT_SCALE: f64 = 0.4;
const KNOT_TURN: (f64, f64) = (0.35, 0.5);
const KNOT_PLACE: DVec3 = DVec3::new(0.33, -0.232, 0.25);

const BALL_ALBEDO: Vec3 = Vec3::new(0.55, 0.16, 0.12);
const BALL_RADIUS: f32 = 0.32;
const BALL_PLACE: Vec3 = Vec3::new(-0.55, -0.9 + BALL_RADIUS + 1e-4, -0.35);

/// The default scene and its camera, which looks in along +z.
///
/// The errors are those of the parts it is made of; none is expected.
pub fn description() -> Result<Staged> {
    let mut scene = generate(KNOT)?;
    scene.name = "default".into();
    scene.notes = vec![Note::info("the default scene: a trefoil and a sphere in a box of comber's own")];
    let pose = DQuat::from_euler(EulerRot::YXZ, KNOT_TURN.1, KNOT_TURN.0, 0.0);
    for mesh in &mut scene.meshes {
        let place = |p: Vec3| (pose * (p.as_dvec3() * KNOT_SCALE) + KNOT_PLACE).as_vec3();
        mesh.positions.par_iter_mut().for_each(|p| *p = place(*p));
        mesh.normals.par_iter_mut().for_each(|n| *n = (pose * n.as_dvec3()).as_vec3());
    }
    scene.materials = vec![diffuse("plaster", KNOT_ALBEDO), diffuse("brick", BALL_ALBEDO)];
    scene.spheres.push(SphereDescription {
        name: "ball".into(),
        at: At::File,
        center: BALL_PLACE,
        radius: BALL_RADIUS,
        double: None,
        material: 1,
    });
    add_room(&mut scene, &ROOM);
    scene.area_lights.push(AreaLightDescription {
        name: "ceiling light".into(),
        at: At::File,
        center: Vec3::new(0.0, 0.895, 0.0),
        double: None,
        side_u: Vec3::new(0.9, 0.0, 0.0),
        side_v: Vec3::new(0.0, 0.0, 0.7),
        direction: Vec3::NEG_Y,
        radiance: Vec3::new(9.5, 8.7, 7.6),
    });
    let camera = Camera::look(DVec3::new(0.0, 0.0, -5.6), DVec3::Z, DVec3::Y, 0.2722, 0.2041).map_err(Error::Scene)?;
    Ok(Staged { description: scene, camera })
}

fn diffuse(name: &str, albedo: Vec3) -> MaterialDescription {
    MaterialDescription { name: name.into(), at: At::File, surface: Surface::Diffuse { albedo }, emission: Vec3::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::bounds::geometry_bounds;

    #[test]
    fn it_has_what_it_promises() {
        let scene = description().unwrap().description;
        assert!(scene.meshes[0].triangles.len() > 1_000_000);
        assert_eq!((scene.spheres.len(), scene.area_lights.len()), (1, 1));
        assert!(scene.meshes.iter().all(|mesh| (mesh.material as usize) < scene.materials.len()));
    }

    #[test]
    fn everything_is_inside_the_room_and_apart() {
        let scene = description().unwrap().description;
        let (min, max) = geometry_bounds(&scene).unwrap();
        assert_eq!((min.as_vec3(), max.as_vec3()), (ROOM.min, ROOM.max));
        let knot = &scene.meshes[0];
        assert!(knot.positions.iter().all(|p| p.cmpgt(ROOM.min).all() && p.cmplt(ROOM.max).all()));
        assert!(knot.positions.iter().all(|p| p.distance(BALL_PLACE) > BALL_RADIUS));
    }
}
