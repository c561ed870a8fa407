//! Lights in double precision: a part of a light as a point sees it, in coordinates around that point.
//!
//! What is drawn on a light, and with which density, depends on nothing but where it lies as seen from the point. So positions are subtracted in
//! `f64` and rounded then, and the functions of [`super::shape`] do the rest, as seen from zero.

use super::shape::{EmissiveSphere, EmissiveTriangle, LightShape, Parallelogram, cone_height, cone_pdf};
use super::{Light, LightSample};
use crate::options::LightSampling;
use crate::sampling::v3::V3;
use crate::scene::double::ROUNDING;
use crate::scene::surface::offset;
use glam::{DVec3, Vec3};

/// A part of a light, the point that sees it at zero.
#[derive(Clone, Debug)]
pub enum Near {
    /// All of a parallelogram.
    Parallelogram(Parallelogram),
    /// A triangle of a mesh.
    Triangle(EmissiveTriangle),
    /// All of a sphere.
    Sphere(EmissiveSphere),
}

const ZERO: V3 = V3 { x: 0.0, y: 0.0, z: 0.0 };

/// How far off a surface shadow rays end: by what single precision errs of its place as seen from the point, and double precision of its own.
fn clearance(seen: Vec3, place: DVec3) -> f32 {
    offset(seen.abs().into()) + (place.abs().element_sum() * ROUNDING) as f32
}

impl Light {
    /// A part as seen from a point.
    pub fn near(&self, part: u32, from: DVec3) -> Near {
        match &self.shape {
            LightShape::Parallelogram(p) => {
                let corner = (p.place - from).as_vec3();
                let seen = corner.abs() + p.side_u.abs() + p.side_v.abs();
                Near::Parallelogram(Parallelogram { corner, offset: clearance(seen, p.place), ..p.clone() })
            }
            LightShape::Mesh(mesh) => {
                let places = mesh.corners_in_double(part);
                let corners = places.map(|place| (place - from).as_vec3());
                let [a, b, c] = corners.map(Vec3::abs);
                let offset = clearance(a.max(b).max(c), places[0]);
                Near::Triangle(EmissiveTriangle { corners, offset, ..mesh.triangles[part as usize].clone() })
            }
            LightShape::Sphere(sphere) => {
                let center = (sphere.place - from).as_vec3();
                let offset = clearance(center.abs() + sphere.radius, sphere.place);
                Near::Sphere(EmissiveSphere { center, offset, ..sphere.clone() })
            }
        }
    }
}

impl Near {
    /// As [`Light::sample`].
    pub fn sample(&self, normal: V3, [u, v]: [f32; 2], how: LightSampling) -> LightSample {
        match (self, how) {
            (Near::Parallelogram(p), LightSampling::Corners) => p.sample_corners(ZERO, normal, u, v),
            (Near::Parallelogram(p), LightSampling::Area) => p.sample_area(ZERO, u, v),
            (Near::Parallelogram(p), LightSampling::SolidAngle) => p.sample_solid_angle(ZERO, u, v),
            (Near::Triangle(triangle), _) => triangle.sample(ZERO, u, v, how),
            (Near::Sphere(sphere), _) => sphere.sample(ZERO, u, v),
        }
    }

    /// As [`Light::pdf`].
    pub fn pdf(&self, distance: f32, cos: f32, how: LightSampling) -> f32 {
        match self {
            Near::Parallelogram(p) => p.pdf(ZERO, distance, cos, how),
            Near::Triangle(triangle) => triangle.pdf(ZERO, distance, cos, how),
            Near::Sphere(sphere) => cone_pdf(cone_height(ZERO, sphere.center.into(), sphere.radius)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::shape::EmissiveMesh;
    use crate::scene::origin::Origin;

    fn lights(at: DVec3) -> Vec<Light> {
        let corners = [DVec3::new(-1.0, 2.0, 0.5), DVec3::new(0.3, 2.2, -0.5), DVec3::new(0.7, 1.9, 0.8)];
        let (corner, center) = (at + DVec3::new(-0.5, 2.0, -0.5), at + DVec3::new(0.3, 1.5, -0.2));
        let parallelogram = Parallelogram::new(corner.as_vec3(), Vec3::X, Vec3::new(0.0, 0.2, 1.0)).unwrap();
        let sphere = EmissiveSphere::new(center.as_vec3(), 0.25).unwrap();
        let mesh = EmissiveMesh::in_double(std::iter::once(corners.map(|corner| at + corner)), true).unwrap();
        let shapes = [
            LightShape::Parallelogram(parallelogram.placed(corner)),
            LightShape::Sphere(sphere.placed(center)),
            LightShape::Mesh(mesh),
        ];
        shapes.map(|shape| Light { name: String::new(), shape, radiance: Vec3::ONE }).into()
    }

    /// What is drawn far from the origin in double precision is what is drawn at the origin in single precision, and has its density.
    #[test]
    fn lights_look_the_same_far_away() {
        let far = DVec3::new(3e7, -5e7, 1e7);
        let point = DVec3::new(0.2, 0.1, 0.4);
        let normal = V3::from(Vec3::new(0.6, 0.8, 0.0));
        for (here, there) in lights(DVec3::ZERO).iter().zip(&lights(far)) {
            for how in [LightSampling::Corners, LightSampling::Area, LightSampling::SolidAngle] {
                for k in 0..50 {
                    let uv = [(k as f32 * 0.618_034).fract(), (k as f32 * 0.414_214).fract()];
                    let single = here.sample(0, V3::from(point.as_vec3()), normal, uv, how);
                    let from = Origin::double(far + point);
                    let double = there.sample(0, from, normal, uv, how);
                    let apart = Vec3::from(single.direction - double.direction).length();
                    assert!(apart < 1e-5, "{:?} {how:?}: {apart:e}", here.shape.kind());
                    assert!((single.distance - double.distance).abs() < 1e-4);
                    assert!((single.pdf - double.pdf).abs() <= 1e-3 * single.pdf, "{} {}", single.pdf, double.pdf);
                    if double.pdf > 0.0 {
                        let cos = match &there.shape {
                            LightShape::Parallelogram(p) => -double.direction.dot(p.normal.into()),
                            LightShape::Mesh(mesh) => -double.direction.dot(mesh.triangles[0].normal.into()),
                            LightShape::Sphere(_) => 1.0,
                        };
                        let pdf = there.pdf(0, from, double.distance, cos, how);
                        assert!((pdf - double.reckoned).abs() <= 1e-3 * pdf, "{pdf} {}", double.reckoned);
                    }
                }
            }
        }
    }
}
