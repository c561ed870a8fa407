//! Lights: points and directions on them, and the densities of those – pure functions of values.
//!
//! Every light emits from one side. A light is one emitting thing of the scene: a parallelogram, all triangles of an
//! emissive mesh together, or a sphere. Its *parts* are what points are drawn from: the triangles of a mesh, or the light
//! itself.

pub mod around;
pub mod corners;
pub mod in_view;
pub mod near;
pub mod rectangle;
pub mod selection;
pub mod shape;
pub mod tree;
pub mod triangle;

use crate::options::LightSampling;
use crate::sampling::v3::V3;
use crate::scene::origin::Origin;
use glam::Vec3;
use shape::{EmissiveMesh, EmissiveSphere, LightShape};

/// A light.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// For messages and reports.
    pub name: String,
    /// Where light leaves it.
    pub shape: LightShape,
    /// Emitted radiance, the same in all directions of its front side.
    pub radiance: Vec3,
}

impl Light {
    /// Surface area.
    pub fn area(&self) -> f32 {
        match &self.shape {
            LightShape::Parallelogram(p) => p.area,
            LightShape::Mesh(m) => m.area,
            LightShape::Sphere(s) => 4.0 * std::f32::consts::PI * s.radius * s.radius,
        }
    }

    /// A quantity proportional to emitted power: for choosing among lights.
    pub fn power(&self) -> f32 {
        self.area() * luminance(self.radiance)
    }

    /// How many parts it has: triangles of a mesh. Everything else is one.
    pub fn parts(&self) -> u32 {
        match &self.shape {
            LightShape::Mesh(mesh) => mesh.triangles.len() as u32,
            _ => 1,
        }
    }

    /// The part that a number in [0, 1) picks, in proportion to area.
    #[inline(always)]
    pub fn pick(&self, u: f32) -> u32 {
        match &self.shape {
            LightShape::Mesh(mesh) => mesh.pick(u),
            _ => 0,
        }
    }

    /// The probability with which [`Light::pick`] picks a part.
    #[inline(always)]
    pub fn share(&self, part: u32) -> f32 {
        match &self.shape {
            LightShape::Mesh(mesh) => mesh.share(part),
            _ => 1.0,
        }
    }

    /// A point of a part seen from `from`, where a surface has this unit `normal`: two numbers in [0, 1) choose it.
    #[inline(always)]
    pub fn sample(
        &self,
        part: u32,
        from: impl Into<Origin>,
        normal: V3,
        [u, v]: [f32; 2],
        how: LightSampling,
    ) -> LightSample {
        let from: Origin = from.into();
        if from.low.is_some() {
            return self.near(part, from.wide()).sample(normal, [u, v], how);
        }
        let from = from.high;
        match (&self.shape, how) {
            (LightShape::Parallelogram(p), LightSampling::Corners) => p.sample_corners(from, normal, u, v),
            (LightShape::Parallelogram(p), LightSampling::Area) => p.sample_area(from, u, v),
            (LightShape::Parallelogram(p), LightSampling::SolidAngle) => p.sample_solid_angle(from, u, v),
            (LightShape::Mesh(mesh), _) => mesh.triangles[part as usize].sample(from, u, v, how),
            (LightShape::Sphere(s), _) => s.sample(from, u, v),
        }
    }

    /// [`LightSample::reckoned`] of the point of the part that a ray of unit direction from `from` hits at `distance` under
    /// cosine `cos_light` (> 0) to the light's normal.
    #[inline(always)]
    pub fn pdf(&self, part: u32, from: impl Into<Origin>, distance: f32, cos_light: f32, how: LightSampling) -> f32 {
        let from: Origin = from.into();
        if from.low.is_some() {
            return self.near(part, from.wide()).pdf(distance, cos_light, how);
        }
        let from = from.high;
        match &self.shape {
            LightShape::Parallelogram(p) => p.pdf(from, distance, cos_light, how),
            LightShape::Mesh(mesh) => mesh.triangles[part as usize].pdf(from, distance, cos_light, how),
            LightShape::Sphere(EmissiveSphere { center, radius, .. }) => {
                shape::cone_pdf(shape::cone_height(from, (*center).into(), *radius))
            }
        }
    }

    /// Bytes that its shape keeps apart.
    pub fn bytes(&self) -> usize {
        match &self.shape {
            LightShape::Mesh(EmissiveMesh { triangles, cdf, double, .. }) => {
                size_of_val(&triangles[..]) + size_of_val(&cdf[..]) + size_of_val(&double[..])
            }
            _ => 0,
        }
    }
}

/// Luminance of linear Rec. 709.
pub fn luminance(color: Vec3) -> f32 {
    color.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// A direction towards a light.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit direction, world space.
    pub direction: V3,
    /// Distance up to which the way must be free.
    pub distance: f32,
    /// Solid-angle density; 0 where the light does not emit towards `from`.
    pub pdf: f32,
    /// The density that MIS weights reckon with: `pdf`, or what stands for it where that depends on the surface that asks, of which a ray that
    /// finds the light knows nothing any more. Weights may be any, so long as they add up to 1.
    pub reckoned: f32,
}

/// The sample that a point on a light makes: `point` is moved off the surface along the unit `normal` by `offset`,
/// more than rounding can move it, so that a shadow ray never hits the light it was aimed at.
#[inline(always)]
fn towards(from: V3, point: V3, normal: V3, offset: f32, area: f32) -> LightSample {
    let way = point + normal * offset - from;
    let squared = way.dot(way);
    let distance = squared.sqrt();
    let direction = way * (1.0 / distance);
    let cos_light = -direction.dot(normal);
    let pdf = squared / (cos_light * area);
    let pdf = if cos_light > 0.0 { pdf } else { 0.0 };
    LightSample { direction, distance, pdf, reckoned: pdf }
}
