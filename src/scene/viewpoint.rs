//! Chooses the camera: as the course's renderer places it, as the file has it, as the user says, or framed to a box.

use crate::scene::camera::Camera;
use crate::scene::description::CameraDescription;
use glam::{DMat3, DVec3};

/// Where the camera of a file with a camera node is placed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CameraChoice {
    /// As the course's renderer shows it at 480×360, whatever the resolution: see [`course`].
    #[default]
    Course,
    /// As the course's renderer shows it at this very resolution: see [`course_pixels`].
    CoursePixels,
    /// Where the node stands and looks, as COLLADA defines it: see [`from_node`].
    File,
}

/// The size at which the course's renderer reads a camera's angles, in pixels.
const COURSE_WINDOW: (f64, f64) = (800.0, 600.0);
/// The size that the course's pictures are rendered at, in pixels.
const COURSE_PICTURE: (f64, f64) = (480.0, 360.0);
/// The angles, in degrees, of a camera whose file states none: the course's.
const DEFAULT_XFOV: f64 = 50.0;
const DEFAULT_YFOV: f64 = 35.0;

/// The camera that `choice` names, for a scene whose meshes and spheres fill the box from `min` to `max`.
///
/// `width` and `height` are the frame's, in pixels; only [`CameraChoice::CoursePixels`] depends on them.
pub fn choose(
    choice: CameraChoice,
    node: Option<&CameraDescription>,
    min: DVec3,
    max: DVec3,
    width: u32,
    height: u32,
) -> Result<Camera, String> {
    match (choice, node) {
        (CameraChoice::Course, _) => course(node, min, max),
        (CameraChoice::CoursePixels, _) => course_pixels(node, min, max, width, height),
        (CameraChoice::File, Some(node)) => from_node(node),
        (CameraChoice::File, None) => Err("the file has no camera; choose the course's placement instead".into()),
    }
}

/// The course's camera, showing at every size what the course's renderer shows at 480×360.
///
/// That renderer uses of the node's placement only a direction, that of (position + view direction) from the origin.
/// In this direction, from the centre of the box around all meshes and spheres (lights do not count) and 1.5 times
/// the box's diagonal away, the camera looks at the centre, +y up. For the course's boxes, [−1, 1] × [0, 1.5] ×
/// [−1, 1], that is 4.80234 away. Without a node, or with one whose sum is zero, the direction is +z.
///
/// Angles are read at 800×600, the smaller of the two widened to that shape, and the resulting focal length *in
/// pixels* is kept when the size changes; so 480×360 shows the middle three fifths. Without `xfov` 50° count, without
/// `yfov` what `aspect_ratio` makes of the horizontal angle, and without that 35°.
pub fn course(node: Option<&CameraDescription>, min: DVec3, max: DVec3) -> Result<Camera, String> {
    course_shown(node, min, max, COURSE_PICTURE)
}

/// As [`course`], with the focal length in pixels that the course's renderer would have: other sizes crop or extend.
pub fn course_pixels(
    node: Option<&CameraDescription>,
    min: DVec3,
    max: DVec3,
    width: u32,
    height: u32,
) -> Result<Camera, String> {
    course_shown(node, min, max, (f64::from(width), f64::from(height)))
}

fn course_shown(
    node: Option<&CameraDescription>,
    min: DVec3,
    max: DVec3,
    (width, height): (f64, f64),
) -> Result<Camera, String> {
    let focal = course_focal_length(node)?;
    let toward_camera = course_direction(node);
    let center = (min + max) * 0.5;
    let position = center + toward_camera * (1.5 * (max - min).length());
    let camera = Camera::look(position, -toward_camera, DVec3::Y, width / 2.0 / focal, height / 2.0 / focal)?;
    if min == max { Err("the scene is a single point: there is nothing to look at".into()) } else { Ok(camera) }
}

/// From the scene's centre to the course's camera, unit length.
fn course_direction(node: Option<&CameraDescription>) -> DVec3 {
    // Position + view direction: the node's matrix applied to (0, 0, −1) as a point, so its scale counts.
    let direction = node.map_or(DVec3::Z, |node| node.to_world.transform_point3(DVec3::NEG_Z) + node.origin);
    let direction = direction.try_normalize().unwrap_or(DVec3::Z);
    if direction.x == 0.0 && direction.z == 0.0 {
        // Straight above or below, "up" has no meaning; the course, too, tilts by a hair towards +z.
        return (direction + DVec3::Z * 1e-5).normalize();
    }
    direction
}

/// The course's focal length in pixels.
fn course_focal_length(node: Option<&CameraDescription>) -> Result<f64, String> {
    let given = |angle: fn(&CameraDescription) -> Option<f64>| node.and_then(angle);
    let tan_x = tan_half(given(|node| node.xfov).unwrap_or(DEFAULT_XFOV))?;
    let tan_y = match (given(|node| node.yfov), given(|node| node.aspect_ratio)) {
        (Some(yfov), _) => tan_half(yfov)?,
        (None, Some(aspect)) => tan_x / positive_aspect(aspect)?,
        (None, None) => tan_half(DEFAULT_YFOV)?,
    };
    let (width, height) = COURSE_WINDOW;
    Ok((width / 2.0) / tan_x.max(tan_y * width / height))
}

/// The camera where its node stands, looking along −z of the node's frame with +y up, as COLLADA 1.4 defines it.
///
/// `xfov` and `yfov` are full angles; with one of them, `aspect_ratio` gives the other, and without one the frame's
/// shape does. A node without angles gets 50°×35°. A node that mirrors is looked through as if it did not.
pub fn from_node(node: &CameraDescription) -> Result<Camera, String> {
    let position = node.to_world.w_axis.truncate();
    let axes = DMat3::from_mat4(node.to_world);
    let tan_x = node.xfov.map(tan_half).transpose()?;
    let tan_y = node.yfov.map(tan_half).transpose()?;
    let aspect = node.aspect_ratio.map(positive_aspect).transpose()?;
    let (tan_x, tan_y) = match (tan_x, tan_y, aspect) {
        (Some(x), Some(y), _) => (x, y),
        (Some(x), None, Some(aspect)) => (x, x / aspect),
        (None, Some(y), Some(aspect)) => (y * aspect, y),
        (Some(x), None, None) => (x, 0.0),
        (None, Some(y), None) => (0.0, y),
        (None, None, _) => (tan_half(DEFAULT_XFOV)?, tan_half(DEFAULT_YFOV)?),
    };
    Camera::look(position, -axes.z_axis, axes.y_axis, tan_x, tan_y)
}

/// What a user says about the camera; what is left out comes from the scene's framing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Explicit {
    /// Position.
    pub position: Option<DVec3>,
    /// A point to look at.
    pub target: Option<DVec3>,
    /// A direction that is roughly up.
    pub up: Option<DVec3>,
    /// Full horizontal angle in degrees.
    pub xfov: Option<f64>,
    /// Full vertical angle in degrees.
    pub yfov: Option<f64>,
}

/// The camera that `explicit` describes, for a scene that would be framed by `framing`, looking at `center`.
///
/// Without a position the camera stands as far from the target as `framing` does from `center`, and on the same side;
/// without a target it looks at `center` from a given position; without an up vector +y is up, or −z when looking
/// along y; without angles those of `framing` hold.
pub fn explicit(explicit: &Explicit, framing: &Camera, center: DVec3) -> Result<Camera, String> {
    let target = explicit.target.unwrap_or(center);
    let offset = framing.position.as_dvec3() - center;
    let position = explicit.position.unwrap_or(target + offset);
    let direction = match (explicit.position, explicit.target) {
        (None, None) => framing.forward.as_dvec3(),
        _ => target - position,
    };
    let along_y = direction.x == 0.0 && direction.z == 0.0;
    let up = explicit.up.unwrap_or(if along_y { DVec3::NEG_Z } else { DVec3::Y });
    let (tan_x, tan_y) = match (explicit.xfov, explicit.yfov) {
        (None, None) => (f64::from(framing.tan_half_x), f64::from(framing.tan_half_y)),
        (x, y) => (x.map_or(Ok(0.0), tan_half)?, y.map_or(Ok(0.0), tan_half)?),
    };
    Camera::look(position, direction, up, tan_x, tan_y)
}

/// The shape of frame, width by height, that automatic framing composes for; others show more, never less.
const FRAMED_ASPECT: f64 = 4.0 / 3.0;
/// How much of the half angle the box may fill.
const FRAMED_FRACTION: f64 = 0.9;

/// A camera that looks along `direction` at the centre of the box from `min` to `max`, as near as it can be with the
/// whole box in a 4:3 frame and a margin around it. `yfov` is the full vertical angle in degrees.
pub fn frame_box(min: DVec3, max: DVec3, direction: DVec3, up: DVec3, yfov: f64) -> Result<Camera, String> {
    let tan_y = tan_half(yfov)?;
    let tan_x = tan_y * FRAMED_ASPECT;
    let center = (min + max) * 0.5;
    let camera = Camera::look(center, direction, up, tan_x, tan_y)?;
    let (right, upward, forward) = (camera.right.as_dvec3(), camera.up.as_dvec3(), camera.forward.as_dvec3());
    let half = (max - min) * 0.5;
    let distance = (0..8)
        .map(|corner: u32| {
            let sign = |bit: u32| if corner & bit == 0 { -1.0 } else { 1.0 };
            let offset = half * DVec3::new(sign(1), sign(2), sign(4));
            let across = (offset.dot(right).abs() / tan_x).max(offset.dot(upward).abs() / tan_y);
            across / FRAMED_FRACTION - offset.dot(forward)
        })
        .fold(0.0, f64::max);
    if !(distance > 0.0 && distance.is_finite()) {
        return Err("the scene has no extent that a camera could be framed to".into());
    }
    Camera::look(center - forward * distance, direction, up, tan_x, tan_y)
}

/// tan of half of a full angle in degrees.
pub(crate) fn tan_half(degrees: f64) -> Result<f64, String> {
    if degrees > 0.0 && degrees < 180.0 {
        Ok((degrees.to_radians() / 2.0).tan())
    } else {
        Err(format!("a field of view of {degrees}° is impossible; expected above 0 and below 180"))
    }
}

fn positive_aspect(aspect: f64) -> Result<f64, String> {
    if aspect > 0.0 && aspect.is_finite() {
        Ok(aspect)
    } else {
        Err(format!("a camera with aspect ratio {aspect} is impossible; expected a number above 0"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat4, Vec3};

    /// A camera node of a Z_UP file, by the rows of its matrix, converted as (x, y, z) → (−x, z, y).
    fn z_up_node(
        rows: [f64; 16],
        xfov: Option<f64>,
        yfov: Option<f64>,
        aspect_ratio: Option<f64>,
    ) -> CameraDescription {
        let convert = DMat4::from_cols_array(&[-1., 0., 0., 0., 0., 0., 1., 0., 0., 1., 0., 0., 0., 0., 0., 1.]);
        let to_world = convert * DMat4::from_cols_array(&rows).transpose();
        CameraDescription { name: "Camera".into(), to_world, origin: DVec3::ZERO, xfov, yfov, aspect_ratio }
    }

    fn spheres_node() -> CameraDescription {
        let rows = [-1., 0., 0., 0., 0., 0., 1., 3., 0., 1., 0., 0., 0., 0., 0., 1.];
        z_up_node(rows, Some(49.13434), None, Some(1.333333))
    }

    fn bunny_node() -> CameraDescription {
        let rows = [1., 0., 0., 0., 0., 0., -1., -3., 0., 1., 0., 0., 0., 0., 0., 1.];
        z_up_node(rows, Some(49.13434), None, Some(1.777778))
    }

    const ROOM: (DVec3, DVec3) = (DVec3::new(-1.0, 0.0, -1.0), DVec3::new(1.0, 1.5, 1.0));

    #[track_caller]
    fn near(a: Vec3, b: Vec3) {
        assert!(a.distance(b) < 2e-5, "{a} is not {b}");
    }

    #[test]
    fn the_course_files_get_the_course_cameras() {
        let spheres = course(Some(&spheres_node()), ROOM.0, ROOM.1).unwrap();
        near(spheres.position, Vec3::new(0.0, 0.75, 4.80234));
        near(spheres.forward, Vec3::NEG_Z);
        near(spheres.right, Vec3::X);
        let bunny = course(Some(&bunny_node()), ROOM.0, ROOM.1).unwrap();
        near(bunny.position, Vec3::new(0.0, 0.75, -4.80234));
        near(bunny.forward, Vec3::Z);
        near(bunny.right, Vec3::NEG_X);
        near(bunny.up, Vec3::Y);
        for camera in [spheres, bunny] {
            for (width, height) in [(480, 360), (240, 180), (1920, 1440)] {
                let (x, y) = camera.shown(width, height);
                assert!((2.0 * x.atan().to_degrees() - 30.6764).abs() < 1e-4);
                assert!((x / y - 4.0 / 3.0).abs() < 1e-5);
            }
            assert!((240.0 / camera.tan_half_x - 875.0).abs() < 0.01);
        }
    }

    #[test]
    fn course_pixels_keep_the_focal_length_and_so_crop() {
        for (width, height) in [(480, 360), (800, 600), (100, 300), (1000, 10)] {
            let camera = course_pixels(Some(&bunny_node()), ROOM.0, ROOM.1, width, height).unwrap();
            let (x, y) = camera.shown(width, height);
            assert!((width as f32 / 2.0 / x - 875.0).abs() < 0.01);
            assert!((height as f32 / 2.0 / y - 875.0).abs() < 0.01);
        }
    }

    #[test]
    fn what_a_course_camera_lacks_has_the_course_defaults() {
        let focal = |xfov, yfov, aspect| {
            course_focal_length(Some(&CameraDescription { xfov, yfov, aspect_ratio: aspect, ..spheres_node() }))
                .unwrap()
        };
        let wide = 400.0 / 25f64.to_radians().tan();
        assert!((focal(None, None, None) - wide).abs() < 1e-9);
        assert!((course_focal_length(None).unwrap() - wide).abs() < 1e-9);
        assert!((focal(Some(50.0), None, Some(2.0)) - wide).abs() < 1e-9);
        // A tall angle wins over a narrow one: 300 pixels for tan 45°.
        assert!((focal(Some(20.0), Some(90.0), None) - 300.0).abs() < 1e-9);
        let lone = course(None, ROOM.0, ROOM.1).unwrap();
        near(lone.position, Vec3::new(0.0, 0.75, 4.80234));
    }

    #[test]
    fn course_cameras_that_the_sum_leaves_without_direction_still_look() {
        let mut node = spheres_node();
        node.to_world = DMat4::from_translation(DVec3::Z);
        near(course(Some(&node), ROOM.0, ROOM.1).unwrap().forward, Vec3::NEG_Z);
        node.to_world = DMat4::from_translation(DVec3::new(0.0, 5.0, 1.0));
        near(course(Some(&node), ROOM.0, ROOM.1).unwrap().forward, Vec3::NEG_Y);
        node.to_world = DMat4::from_translation(DVec3::new(0.0, -5.0, 1.0));
        near(course(Some(&node), ROOM.0, ROOM.1).unwrap().forward, Vec3::Y);
        assert!(course(Some(&node), DVec3::ZERO, DVec3::ZERO).is_err());
        node.xfov = Some(180.0);
        assert!(course(Some(&node), ROOM.0, ROOM.1).is_err());
    }

    #[test]
    fn nodes_are_read_as_collada_defines_them() {
        let camera = from_node(&spheres_node()).unwrap();
        near(camera.position, Vec3::new(0.0, 0.0, 3.0));
        near(camera.forward, Vec3::NEG_Z);
        near(camera.up, Vec3::Y);
        let tan = (49.13434f64 / 2.0).to_radians().tan() as f32;
        assert!((camera.tan_half_x - tan).abs() < 1e-6 && (camera.tan_half_y - tan / 1.333333).abs() < 1e-6);
        let angles = |xfov, yfov, aspect_ratio| {
            from_node(&CameraDescription { xfov, yfov, aspect_ratio, ..spheres_node() })
                .map(|camera| (camera.tan_half_x, camera.tan_half_y))
        };
        let close = |a: (f32, f32), b: (f32, f32)| (a.0 - b.0).abs() < 1e-6 && (a.1 - b.1).abs() < 1e-6;
        assert!(close(angles(Some(90.0), None, None).unwrap(), (1.0, 0.0)));
        assert!(close(angles(None, Some(90.0), None).unwrap(), (0.0, 1.0)));
        assert!(close(angles(None, Some(90.0), Some(2.0)).unwrap(), (2.0, 1.0)));
        assert!(close(angles(Some(90.0), Some(90.0), Some(2.0)).unwrap(), (1.0, 1.0)));
        for (x, y, aspect) in [(Some(0.0), None, None), (None, Some(f64::NAN), None), (Some(50.0), None, Some(-1.0))] {
            assert!(angles(x, y, aspect).is_err());
        }
    }

    #[test]
    fn explicit_cameras_fill_in_from_the_framing() {
        let center = DVec3::new(0.0, 0.75, 0.0);
        let framing = course(Some(&bunny_node()), ROOM.0, ROOM.1).unwrap();
        let same = explicit(&Explicit::default(), &framing, center).unwrap();
        near(same.position, framing.position);
        near(same.forward, framing.forward);
        let moved = Explicit { position: Some(DVec3::new(4.0, 0.75, 0.0)), ..Default::default() };
        near(explicit(&moved, &framing, center).unwrap().forward, Vec3::NEG_X);
        let aimed = Explicit { target: Some(DVec3::new(1.0, 0.0, 0.0)), ..Default::default() };
        let aimed = explicit(&aimed, &framing, center).unwrap();
        near(aimed.forward, framing.forward);
        near(aimed.position, Vec3::new(1.0, 0.0, -4.802343));
        let above = Explicit { position: Some(DVec3::new(0.0, 5.0, 0.0)), xfov: Some(90.0), ..Default::default() };
        let above = explicit(&above, &framing, center).unwrap();
        near(above.up, Vec3::NEG_Z);
        assert!((above.tan_half_x - 1.0).abs() < 1e-6 && above.tan_half_y == 0.0);
        let inside = Explicit { position: Some(center), ..Default::default() };
        assert!(explicit(&inside, &framing, center).is_err());
    }

    #[test]
    fn framed_boxes_are_wholly_shown_and_fill_the_frame() {
        let boxes = [DVec3::ONE, DVec3::new(0.4, 2.0, 0.5), DVec3::new(9.0, 0.1, 9.0), DVec3::new(0.0, 1e-3, 0.0)];
        for size in boxes {
            let (min, max) = (DVec3::new(3.0, -2.0, 7.0), DVec3::new(3.0, -2.0, 7.0) + size);
            let camera = frame_box(min, max, DVec3::new(-0.5, -0.4, -1.0), DVec3::Y, 30.0).unwrap();
            let mut fullest = 0.0f32;
            for corner in 0..8 {
                let pick = |bit: u32, axis: usize| if corner & bit == 0 { min[axis] } else { max[axis] };
                let p = DVec3::new(pick(1, 0), pick(2, 1), pick(4, 2)).as_vec3() - camera.position;
                let depth = p.dot(camera.forward);
                assert!(depth > 0.0);
                let x = (p.dot(camera.right) / depth / camera.tan_half_x).abs();
                let y = (p.dot(camera.up) / depth / camera.tan_half_y).abs();
                fullest = fullest.max(x).max(y);
            }
            assert!((0.85..0.92).contains(&fullest), "{size}: {fullest}");
        }
        assert!(frame_box(DVec3::ONE, DVec3::ONE, DVec3::NEG_Z, DVec3::Y, 30.0).is_err());
        assert!(frame_box(DVec3::NEG_ONE, DVec3::ONE, DVec3::Y, DVec3::Y, 30.0).is_err());
    }
}
