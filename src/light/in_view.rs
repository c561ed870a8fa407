//! Where in the frame lights may be seen directly.

use crate::bvh::tight_bounds;
use crate::scene::Scene;
use crate::scene::camera::Lens;
use crate::scene::shapes::NO_LIGHT;
use glam::Vec3;

/// Rectangles of pixels that hold everything that emits, as the camera sees it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InView {
    /// First column and row, and those behind the last.
    boxes: Vec<[u32; 4]>,
}

impl InView {
    /// Of the lights of `scene`, in a frame of so many pixels: the box of each emitting geometry, projected. One that reaches behind the camera may
    /// be anywhere.
    pub fn new(scene: &Scene, lens: &Lens, [width, height]: [u32; 2]) -> InView {
        let shapes = &scene.shapes;
        let emitting = shapes.geometries.iter().filter(|geometry| geometry.light != NO_LIGHT);
        let boxes = emitting.map(|geometry| {
            let prims = geometry.first_prim..geometry.first_prim + geometry.prim_count;
            let around = tight_bounds(shapes, std::slice::from_ref(&prims));
            let corners = (0..8).map(|corner| {
                let axis = |axis: usize| if corner >> axis & 1 == 0 { around.min[axis] } else { around.max[axis] };
                lens.pixel(Vec3::new(axis(0), axis(1), axis(2)))
            });
            let Some(corners) = corners.collect::<Option<Vec<_>>>() else { return [0, 0, width, height] };
            let [mut low, mut high] = [corners[0]; 2];
            corners.iter().for_each(|&corner| (low, high) = (low.min(corner), high.max(corner)));
            // A pixel more on each side: rays of the next one, rounded, may meet an edge.
            let first = |low: f64| (low.floor() - 1.0).max(0.0) as u32;
            let end = |high: f64, size: u32| (high.ceil() + 1.0).clamp(0.0, f64::from(size)) as u32;
            [first(low.x), first(low.y), end(high.x, width), end(high.y, height)]
        });
        InView { boxes: boxes.filter(|[x0, y0, x1, y1]| x0 < x1 && y0 < y1).collect() }
    }

    /// Whether a light may be seen in the pixel at `x`, `y`.
    pub fn has(&self, x: u32, y: u32) -> bool {
        self.boxes.iter().any(|&[x0, y0, x1, y1]| (x0..x1).contains(&x) && (y0..y1).contains(&y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::camera::Camera;
    use crate::scene::{SceneOptions, procedural, stage};
    use glam::DVec3;

    fn cornell() -> (Scene, Camera) {
        let cubes = procedural::generate("proc:cubes,tris=12").expect("cubes");
        let staged = stage::place(cubes, stage::Stage::Cornell, stage::UpAxis::Y).expect("stage");
        (Scene::build(staged.description, SceneOptions::default()).expect("scene"), staged.camera)
    }

    /// Every camera ray that meets a light does so in a pixel that is listed, and few pixels are.
    #[test]
    fn lights_are_seen_where_they_are_said_to_be_and_hardly_elsewhere() {
        let (scene, camera) = cornell();
        let accel = crate::bvh::Accel::build(&scene.shapes, &Default::default()).expect("tree");
        let lens = camera.lens(160, 120);
        let view = InView::new(&scene, &lens, [160, 120]);
        let (mut seen, mut listed) = (0, 0);
        for (x, y) in (0..120).flat_map(|y| (0..160).map(move |x| (x, y))) {
            listed += u32::from(view.has(x, y));
            for (u, v) in (0..16).map(|i| ((i % 4) as f32 / 3.99, (i / 4) as f32 / 3.99)) {
                let direction = lens.direction(x as f32 + u, y as f32 + v);
                let ray = crate::bvh::ray::Ray::new(lens.origin, direction.into());
                let hit = accel.single().closest_hit(&ray);
                let emits = hit.is_some() && scene.shapes.geometries[hit.geom as usize].light != NO_LIGHT;
                assert!(view.has(x, y) || !emits, "({x}, {y})");
                seen += u32::from(emits);
            }
        }
        assert!(seen > 1000 && listed < seen / 16 * 3, "{seen} rays, {listed} pixels");
    }

    #[test]
    fn what_reaches_behind_the_camera_may_be_anywhere_and_what_is_beside_the_frame_nowhere() {
        let (scene, _) = cornell();
        let look = |from: [f64; 3], towards: DVec3| {
            let camera = Camera::look(from.into(), towards, DVec3::X, 0.2, 0.2).expect("camera");
            InView::new(&scene, &camera.lens(100, 100), [100, 100])
        };
        // The lamp hangs under the ceiling, above the middle of the floor.
        let lamp = &scene.lights[0];
        let crate::light::shape::LightShape::Parallelogram(p) = &lamp.shape else { panic!("{lamp:?}") };
        let middle = (p.corner + (p.side_u + p.side_v) * 0.5).as_dvec3();
        let within = look((middle - 1e-3 * DVec3::Y).into(), DVec3::Z);
        assert!(within.has(0, 0) && within.has(99, 99));
        assert_eq!(look((middle - DVec3::Y).into(), DVec3::NEG_Y), InView { boxes: vec![[0, 0, 100, 100]] });
        assert_eq!(look((middle - 10.0 * DVec3::Z).into(), DVec3::new(1.0, 0.0, 1.0)), InView::default());
    }
}
