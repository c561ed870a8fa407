//! No stage: the scene where and as large as it is, framed.
//!
//! A scene that emits nothing gets two square lamps behind the camera, a warm one high to the left and a weaker cool
//! one to the right; they are far larger than they are intense, so shadows are soft. The background stays black.

use super::{radiance_for, softbox};
use crate::scene::camera::Camera;
use crate::scene::description::SceneDescription;
use crate::scene::viewpoint::frame_box;
use glam::{DVec3, Vec3};

/// Full vertical angle in a 4:3 frame, in degrees.
const YFOV: f64 = 30.0;
/// Into the picture: from −z as on the Cornell stage, a little from the side and above.
const VIEW: DVec3 = DVec3::new(0.35, -0.25, 1.0);

/// Frames the geometry in the box from `min` to `max` and lights it if it is dark.
pub(super) fn build(description: &mut SceneDescription, min: DVec3, max: DVec3) -> Result<Camera, String> {
    let camera = frame_box(min, max, VIEW, DVec3::Y, YFOV)?;
    if !emits(description) {
        let center = (min + max) * 0.5;
        let radius = (max - min).length() * 0.5;
        let (right, up, back) = (camera.right.as_dvec3(), camera.up.as_dvec3(), -camera.forward.as_dvec3());
        // Behind the camera, which stands about four radii away.
        let reach = camera.position.as_dvec3().distance(center) + radius;
        let lamp = |name, direction: DVec3, exposure: f64, tint: Vec3| {
            let radiance = tint * radiance_for(exposure, reach, 1.5 * reach) as f32;
            softbox(name, center + direction.normalize() * (1.5 * reach), center, reach, radiance)
        };
        let key = lamp("key light", back - right * 0.7 + up * 0.9, 0.8, Vec3::new(1.0, 0.96, 0.9));
        let fill = lamp("fill light", back + right * 1.1 + up * 0.1, 0.25, Vec3::new(0.9, 0.95, 1.0));
        description.area_lights.extend([key, fill]);
    }
    Ok(camera)
}

/// Whether any light comes from the scene itself: from a light, or a mesh or sphere whose material emits.
fn emits(description: &SceneDescription) -> bool {
    let meshes = description.meshes.iter().map(|mesh| mesh.material);
    let mut used = meshes.chain(description.spheres.iter().map(|sphere| sphere.material));
    let glows = |material: u32| description.materials.get(material as usize).is_some_and(|m| m.emission != Vec3::ZERO);
    !description.area_lights.is_empty() || used.any(glows)
}
