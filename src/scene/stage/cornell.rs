//! The course's Cornell box, as its `CBbunny.dae` has it, with its light and camera.

use super::{Room, add_room, drop_lights, put};
use crate::error::At;
use crate::scene::camera::Camera;
use crate::scene::description::{AreaLightDescription, SceneDescription};
use glam::{DVec3, Vec3};

/// The file's rooms are Z_UP; here after (x, y, z) → (−x, z, y).
const GREY: Vec3 = Vec3::splat(0.6);
const ROOM: Room = Room {
    min: Vec3::new(-1.0, 0.0, -1.0),
    max: Vec3::new(1.0, 1.5, 1.0),
    neutral: [GREY; 3],
    left: Vec3::new(0.6, 0.2, 0.2),
    right: Vec3::new(0.2, 0.2, 0.6),
};

/// Where the middle of the mesh's base goes: a hair above the floor, so that a flat base does not lie in it.
const FOOT: DVec3 = DVec3::new(0.0, 0.001, 0.0);
/// The largest side of the mesh's box.
const SIZE: f64 = 1.2;

/// From the room's centre to the camera: 1.5 × the diagonal of the room, √(2² + 1.5² + 2²).
const CAMERA_POSITION: DVec3 = DVec3::new(0.0, 0.75, -4.802_343_178_074_635);
/// tan of half the angles: 480 × 360 pixels with a focal length of 875 pixels.
const TAN_HALF: (f64, f64) = (240.0 / 875.0, 180.0 / 875.0);

/// Builds the room around the geometry in the box from `min` to `max`.
pub(super) fn build(description: &mut SceneDescription, min: DVec3, max: DVec3) -> Result<Camera, String> {
    drop_lights(description);
    put(description, min, max, SIZE, FOOT);
    add_room(description, &ROOM);
    description.area_lights.push(AreaLightDescription {
        name: "ceiling light".into(),
        at: At::File,
        center: Vec3::new(0.0, 1.49, 0.0),
        double: None,
        side_u: Vec3::new(0.6, 0.0, 0.0),
        side_v: Vec3::new(0.0, 0.0, 0.8),
        direction: Vec3::NEG_Y,
        radiance: Vec3::splat(10.0),
    });
    Camera::look(CAMERA_POSITION, DVec3::Z, DVec3::Y, TAN_HALF.0, TAN_HALF.1)
}
