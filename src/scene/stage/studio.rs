//! A photographer's studio: a backdrop that curves up without a seam, and three soft lights.
//!
//! The mesh is scaled to a largest side of 1 and stands on y = 0; the studio is laid out about the camera's azimuth.

use super::{diffuse, drop_lights, put, radiance_for, softbox};
use crate::scene::camera::Camera;
use crate::scene::description::{MeshDescription, SceneDescription};
use crate::scene::viewpoint::frame_box;
use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::FRAC_PI_2;

/// Full vertical angle in a 4:3 frame, in degrees: a short telephoto lens.
const YFOV: f64 = 26.0;
/// How far around from −z, where the Cornell stage's camera stands, in degrees: the mesh seen from front and left.
const AZIMUTH: f64 = 32.0;
/// How far above the horizon it stands for a tall mesh and for a flat one, in degrees.
const ELEVATION: (f64, f64) = (9.0, 30.0);

/// The backdrop: half its width; where its floor begins, behind the camera; where it starts to rise; the radius of
/// its curve; its height. All in units of the mesh's largest side.
const HALF_WIDTH: f64 = 14.0;
const FLOOR_FRONT: f64 = 12.0;
const CURVE_START: f64 = -1.6;
const CURVE_RADIUS: f64 = 2.2;
const WALL_TOP: f64 = 12.0;
/// Steps along the curve, and columns across: a few hundred triangles, whose normals make the curve smooth.
const CURVE_STEPS: u32 = 32;
const COLUMNS: u32 = 6;

/// Builds the studio around the geometry in the box from `min` to `max`.
pub(super) fn build(description: &mut SceneDescription, min: DVec3, max: DVec3) -> Result<Camera, String> {
    drop_lights(description);
    // A hair above the floor, so that a flat base does not lie in it.
    let (min, max) = put(description, min, max, 1.0, DVec3::new(0.0, 1e-4, 0.0));
    let size = max - min;
    let flatness = 1.0 - (size.y / size.x.max(size.z).max(1e-9)).min(1.0);
    let elevation = (ELEVATION.0 + (ELEVATION.1 - ELEVATION.0) * flatness).to_radians();
    let (sin, cos) = AZIMUTH.to_radians().sin_cos();
    // The studio's own axes: to the camera's right, and towards the camera along the floor.
    let (right, front) = (DVec3::new(-cos, 0.0, sin), DVec3::new(-sin, 0.0, -cos));
    let view = -(front * elevation.cos() + DVec3::Y * elevation.sin());
    let camera = frame_box(min, max, view, DVec3::Y, YFOV)?;

    description.meshes.push(backdrop(right, front, description.materials.len() as u32));
    description.materials.push(diffuse("backdrop", Vec3::new(0.62, 0.61, 0.59)));
    let center = (min + max) * 0.5;
    let lamp = |name, place: DVec3, side: f64, exposure: f64, tint: Vec3| {
        let radiance = tint * radiance_for(exposure, side, place.length()) as f32;
        softbox(name, center + right * place.x + DVec3::Y * place.y + front * place.z, center, side, radiance)
    };
    description.area_lights.extend([
        lamp("key light", DVec3::new(-2.2, 2.6, 2.0), 2.2, 0.75, Vec3::new(1.0, 0.95, 0.88)),
        lamp("fill light", DVec3::new(3.4, 1.2, 2.4), 2.6, 0.16, Vec3::new(0.86, 0.93, 1.0)),
        lamp("rim light", DVec3::new(1.3, 3.0, -1.5), 1.2, 0.5, Vec3::ONE),
    ]);
    Ok(camera)
}

/// The sweep: floor, a quarter of a circle, wall; swept along `right`, facing `front` and up.
fn backdrop(right: DVec3, front: DVec3, material: u32) -> MeshDescription {
    // The profile as (towards the camera, up) with its normal.
    let mut profile = vec![(DVec2::new(FLOOR_FRONT, 0.0), DVec2::Y)];
    for step in 0..=CURVE_STEPS {
        let (sin, cos) = (FRAC_PI_2 * f64::from(step) / f64::from(CURVE_STEPS)).sin_cos();
        let normal = DVec2::new(sin, cos);
        profile.push((DVec2::new(CURVE_START, CURVE_RADIUS) - normal * CURVE_RADIUS, normal));
    }
    profile.push((DVec2::new(CURVE_START - CURVE_RADIUS, WALL_TOP), DVec2::X));

    let mut mesh = MeshDescription { name: "backdrop".into(), material, ..Default::default() };
    for (point, normal) in &profile {
        for column in 0..=COLUMNS {
            let aside = HALF_WIDTH * (2.0 * f64::from(column) / f64::from(COLUMNS) - 1.0);
            mesh.positions.push((right * aside + front * point.x + DVec3::Y * point.y).as_vec3());
            mesh.normals.push((front * normal.x + DVec3::Y * normal.y).as_vec3());
        }
    }
    let width = COLUMNS + 1;
    for row in 0..profile.len() as u32 - 1 {
        for column in 0..COLUMNS {
            let near = row * width + column;
            let far = near + width;
            mesh.triangles.extend([[near, near + 1, far + 1], [near, far + 1, far]]);
        }
    }
    mesh
}
