//! Scenes far from the origin: read around their own centre.
//!
//! Single precision has 24 bits. A mesh that lies 10⁷ times its size from the origin would keep none of them, though its file may state them. Files
//! of which the geometry lies farther from the origin than [`FAR`] times its size are therefore read a second time: the centre of the
//! first reading is subtracted from every position – of vertices, lights and cameras – in `f64`, before it is rounded. (And a third time
//! if the first centre itself was off by many times the scene's size.) All others are read once, and rounded as they stand.

use crate::error::Note;
use crate::scene::bounds::geometry_bounds;
use crate::scene::description::SceneDescription;
use glam::DVec3;

/// How many times its size a scene's largest coordinate may be: up to here 20 of the 24 bits tell positions in it apart.
const FAR: f64 = 16.0;

/// The middle of the geometry, if it lies far from the origin.
pub(super) fn centre(scene: &SceneDescription) -> Option<DVec3> {
    let (min, max) = geometry_bounds(scene)?;
    let largest = min.abs().max(max.abs()).max_element();
    let far = largest.is_finite() && largest > FAR * (max - min).max_element();
    far.then_some((min + max) * 0.5)
}

/// What the user should know of a scene that was read around its own centre.
pub(super) fn note(scene: &SceneDescription) -> Note {
    let size = geometry_bounds(scene).map_or(0.0, |(min, max)| (max - min).max_element());
    let far = scene.origin.abs().max_element() / size;
    let DVec3 { x, y, z } = scene.origin;
    Note::info(format!(
        "{}: the scene lies {far:.0} times its size from the origin; positions are relative to ({x}, {y}, {z})",
        scene.name
    ))
}

/// What single precision has lost where a file holds no more of it; `size` is that of the scene around `origin`.
pub(super) fn lost(origin: DVec3, size: f64) -> String {
    let largest = origin.abs().max_element() as f32;
    let step = f64::from(largest.next_up() - largest);
    format!(
        "its positions are single precision, {step:e} apart so far from the origin: {:.0} steps across",
        size / step
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::description::MeshDescription;
    use glam::Vec3;

    fn between(a: Vec3, b: Vec3) -> SceneDescription {
        let mesh = MeshDescription { positions: vec![a, b], ..Default::default() };
        SceneDescription { meshes: vec![mesh], ..Default::default() }
    }

    #[test]
    fn only_what_is_far_for_its_size_is_moved() {
        let near = between(Vec3::new(15.0, 0.0, 0.0), Vec3::new(16.0, 1.0, 0.0));
        assert_eq!(centre(&near), None);
        let far = between(Vec3::new(15.5, 0.0, 0.0), Vec3::new(16.5, 1.0, 0.0));
        assert_eq!(centre(&far), Some(DVec3::new(16.0, 0.5, 0.0)));
        // Nothing of it was left by rounding.
        let lost = between(Vec3::splat(1e9), Vec3::splat(1e9));
        assert_eq!(centre(&lost), Some(DVec3::splat(1e9)));
        assert_eq!(centre(&between(Vec3::ZERO, Vec3::ZERO)), None);
        assert_eq!(centre(&between(Vec3::ZERO, Vec3::INFINITY)), None);
        assert_eq!(centre(&SceneDescription::default()), None);
    }
}
