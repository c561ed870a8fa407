//! Pinhole cameras: where they stand, and the ray through a point of the image.

use super::origin::{Origin, split};
use crate::options::Precision;
use crate::sampling::v3::V3;
use glam::{DMat3, DVec2, DVec3, Vec3};
use serde::Serialize;

/// A pinhole camera with square pixels, independent of resolution: it shows at least the angle `xfov` × `yfov`.
///
/// A frame wider than `tan(xfov/2) / tan(yfov/2)` shows more to the sides, a taller one more above and below.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Camera {
    /// Position, world space.
    pub position: Vec3,
    /// What single precision leaves of the position; reports have it where it is not zero.
    #[serde(skip_serializing_if = "is_zero")]
    pub low: Vec3,
    /// Unit, to the right of the image.
    pub right: Vec3,
    /// Unit, up in the image.
    pub up: Vec3,
    /// Unit, into the image.
    pub forward: Vec3,
    /// tan of half the horizontal angle that is surely shown; 0 if only the vertical one is prescribed.
    pub tan_half_x: f32,
    /// tan of half the vertical angle that is surely shown; 0 if only the horizontal one is prescribed.
    pub tan_half_y: f32,
}

fn is_zero(low: &Vec3) -> bool {
    *low == Vec3::ZERO
}

/// A camera made ready for one frame size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Ray origin.
    pub origin: Vec3,
    /// What single precision leaves of it.
    pub low: Vec3,
    /// Direction (not normalised) through the top left corner of the frame.
    pub corner: Vec3,
    /// Step a pixel to the right.
    pub dx: Vec3,
    /// Step a pixel down.
    pub dy: Vec3,
}

impl Camera {
    /// A camera at `position` looking along `direction`, `up` being roughly up. Errors are for the user.
    pub fn look(
        position: DVec3,
        direction: DVec3,
        up: DVec3,
        tan_half_x: f64,
        tan_half_y: f64,
    ) -> Result<Camera, String> {
        let forward = direction.try_normalize().ok_or("the camera's view direction is zero or not finite")?;
        let right = forward
            .cross(up)
            .try_normalize()
            .ok_or("the camera's up vector is zero or parallel to its view direction")?;
        if !position.is_finite() {
            return Err("the camera's position is not finite".into());
        }
        if !(tan_half_x >= 0.0
            && tan_half_y >= 0.0
            && tan_half_x + tan_half_y > 0.0
            && (tan_half_x + tan_half_y).is_finite())
        {
            return Err("the camera's field of view must be between 0 and 180 degrees".into());
        }
        let camera_up = right.cross(forward);
        let (high, low) = split(position);
        Ok(Camera {
            position: high,
            low,
            right: right.as_vec3(),
            up: camera_up.as_vec3(),
            forward: forward.as_vec3(),
            tan_half_x: tan_half_x as f32,
            tan_half_y: tan_half_y as f32,
        })
    }

    /// The same camera elsewhere.
    pub fn at(self, position: DVec3) -> Camera {
        let (position, low) = split(position);
        Camera { position, low, ..self }
    }

    /// Where it stands, as exactly as that is known.
    pub fn place(&self) -> DVec3 {
        self.position.as_dvec3() + self.low.as_dvec3()
    }

    /// tan of half the angles that a frame of `width` × `height` pixels shows.
    pub fn shown(&self, width: u32, height: u32) -> (f32, f32) {
        let aspect = width as f32 / height as f32;
        let y = self.tan_half_y.max(self.tan_half_x / aspect);
        (y * aspect, y)
    }

    /// Ready for a frame of `width` × `height` pixels.
    pub fn lens(&self, width: u32, height: u32) -> Lens {
        let (tan_x, tan_y) = self.shown(width, height);
        Lens {
            origin: self.position,
            low: self.low,
            corner: self.forward - self.right * tan_x + self.up * tan_y,
            dx: self.right * (2.0 * tan_x / width as f32),
            dy: self.up * (-2.0 * tan_y / height as f32),
        }
    }
}

impl Lens {
    /// Where rays start.
    #[inline(always)]
    pub fn origin(&self, precision: Precision) -> Origin {
        let low = (precision == Precision::F64).then_some(V3::from(self.low));
        Origin { high: self.origin.into(), low }
    }

    /// Where in the frame a point is seen, in pixels from the top left corner; `None` for what is not in front of the camera.
    pub fn pixel(&self, point: Vec3) -> Option<DVec2> {
        let seen = point.as_dvec3() - self.origin.as_dvec3();
        let frame = DMat3::from_cols(self.dx.as_dvec3(), self.dy.as_dvec3(), self.corner.as_dvec3());
        let at = frame.inverse() * seen;
        (at.z > 0.0).then(|| at.truncate() / at.z)
    }

    /// Unit direction through `(x, y)`, in pixels from the top left corner of the frame.
    #[inline(always)]
    pub fn direction(&self, x: f32, y: f32) -> V3 {
        let d = V3::from(self.corner) + V3::from(self.dx) * x + V3::from(self.dy) * y;
        d.normalize()
    }
}
