//! Spheres around all that emits: rays that are of use only if they find a light need not be traced past them.

use super::Light;
use super::shape::LightShape;
use crate::sampling::v3::V3;
use glam::{DVec3, Vec3};
use smallvec::SmallVec;

/// Lights up to which each is looked at; of more, one is nearly always in the way.
const MOST: usize = 8;

/// A sphere around each light. Rays in single precision are held against it with room for what they are rounded by.
#[derive(Clone, Debug)]
pub struct Around {
    spheres: SmallVec<[(Vec3, f32); 2]>,
}

impl Around {
    /// Of these lights; `None` if they are many, or too large for their squares.
    pub fn new(lights: &[Light]) -> Option<Around> {
        if lights.len() > MOST {
            return None;
        }
        let spheres: SmallVec<_> = lights.iter().map(|light| sphere(&light.shape)).collect();
        spheres.iter().all(|&(_, squared)| squared < f32::MAX).then_some(Around { spheres })
    }

    /// Whether a ray of unit direction surely misses every light.
    #[inline(always)]
    pub fn misses(&self, origin: V3, direction: V3) -> bool {
        /// Square of what the arithmetic errs by, some ten times over, relative to the distance.
        const ROUNDING: f32 = 1e-10;
        let mut misses = true;
        for &(center, squared) in &self.spheres {
            let way = V3::from(center) - origin;
            let along = way.dot(direction);
            let beside = way - direction * along;
            let distance = way.dot(way);
            let reach = squared + distance * ROUNDING;
            // What is not a number misses nothing.
            misses &= (beside.dot(beside) > reach) | ((along < 0.0) & (distance > reach));
        }
        misses
    }
}

/// Centre, and square of a radius that is a little too large.
fn sphere(shape: &LightShape) -> (Vec3, f32) {
    /// Corners are rounded to single precision, and so is the centre.
    const ROOM: f64 = 1.01;
    let around = |corners: &mut dyn Iterator<Item = DVec3>| {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        corners.for_each(|corner| (low, high) = (low.min(corner), high.max(corner)));
        let center = (low * 0.5 + high * 0.5).as_vec3();
        let rounding = f64::from(f32::EPSILON) * low.abs().max(high.abs()).max_element();
        (center, (high - low).length() * 0.5 + 4.0 * rounding)
    };
    let (center, radius) = match shape {
        LightShape::Parallelogram(p) => {
            let [corner, u, v] = [p.corner, p.side_u, p.side_v].map(Vec3::as_dvec3);
            around(&mut [corner, corner + u, corner + v, corner + u + v].into_iter())
        }
        LightShape::Mesh(mesh) => around(&mut mesh.triangles.iter().flat_map(|t| t.corners).map(Vec3::as_dvec3)),
        LightShape::Sphere(s) => (s.center, f64::from(s.radius)),
    };
    (center, (radius * radius * ROOM) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::shape::{EmissiveMesh, EmissiveSphere, Parallelogram};
    use crate::sampling::random::{mix, to_unit};

    fn lights(at: Vec3, size: f32) -> Vec<Light> {
        let shapes = [
            Parallelogram::new(at, Vec3::X * size, Vec3::Z * size * 0.01).map(LightShape::Parallelogram),
            EmissiveSphere::new(at + 3.0 * size, size * 0.5).map(LightShape::Sphere),
            EmissiveMesh::new([[at - size, at - 2.0 * size * Vec3::X, at - size * Vec3::Z]].into_iter())
                .map(LightShape::Mesh),
        ];
        let light = |shape| Light { name: String::new(), shape, radiance: Vec3::ONE };
        shapes.into_iter().map(|shape| light(shape.expect("a shape with area"))).collect()
    }

    /// Points of each light, its rim among them.
    fn point(light: &Light, u: f64, v: f64) -> DVec3 {
        match &light.shape {
            LightShape::Parallelogram(p) => p.corner.as_dvec3() + p.side_u.as_dvec3() * u + p.side_v.as_dvec3() * v,
            LightShape::Mesh(mesh) => {
                let [a, b, c] = mesh.triangles[0].corners.map(Vec3::as_dvec3);
                a + (b - a) * u + (c - a) * (v * (1.0 - u))
            }
            LightShape::Sphere(s) => {
                s.center.as_dvec3() + DVec3::new(u - 0.5, v - 0.5, 0.1).normalize() * f64::from(s.radius)
            }
        }
    }

    #[test]
    fn rays_towards_lights_are_never_said_to_miss() {
        for (at, size) in [(Vec3::ZERO, 1.0), (Vec3::new(1e6, -3e5, 2e6), 0.5), (Vec3::splat(1e-9), 1e-10)] {
            let lights = lights(at, size);
            let around = Around::new(&lights).expect("few lights");
            for i in 0..20_000u32 {
                let number = |k: u32| to_unit(mix(i.wrapping_mul(8) + k));
                let corner = |k: u32| f64::from((number(k) * 3.0).floor()) / 2.0;
                let to = point(&lights[i as usize % 3], corner(0).min(1.0), corner(1).min(1.0));
                let far = size * 10f32.powf(8.0 * number(2) - 3.0);
                let from = to.as_vec3() + (Vec3::new(number(3), number(4), number(5)) - 0.5) * far;
                let Some(direction) = (to - from.as_dvec3()).try_normalize() else { continue };
                assert!(!around.misses(from.into(), direction.as_vec3().into()), "{from} to {to}");
            }
        }
    }

    #[test]
    fn most_other_rays_are_said_to() {
        let lights = lights(Vec3::ZERO, 0.1);
        let around = Around::new(&lights).expect("few lights");
        let mut missed = 0;
        for i in 0..1000u32 {
            let number = |k: u32| to_unit(mix(i * 8 + k)) - 0.5;
            let from = V3::new(number(0), number(1), number(2));
            let direction = Vec3::new(number(3), number(4), number(5)).normalize();
            missed += u32::from(around.misses(from, direction.into()));
        }
        assert!((700..1000).contains(&missed), "{missed} of 1000");
        assert!(!around.misses(V3::new(f32::NAN, 0.0, 0.0), Vec3::X.into()));
    }

    #[test]
    fn many_lights_and_none() {
        let many = (0..4).flat_map(|i| lights(Vec3::splat(i as f32), 0.1)).collect::<Vec<_>>();
        assert!(Around::new(&many).is_none());
        let none = Around::new(&[]).expect("few");
        assert!(none.misses(V3::new(0.0, 0.0, 0.0), Vec3::X.into()));
    }
}
