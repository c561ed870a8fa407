//! Lights: points and directions on them, and the densities of those – pure functions of values.
//!
//! Every light emits from one side. A light is one emitting thing of the scene: a parallelogram, all triangles of an
//! emissive mesh together, or a sphere.

pub mod shape;

use crate::sampling::lanes::{Lanes, V3};
use glam::Vec3;
use shape::{EmissiveMesh, EmissiveSphere, LightShape, Parallelogram};

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
        self.area() * (self.radiance.x * 0.2126 + self.radiance.y * 0.7152 + self.radiance.z * 0.0722)
    }

    /// A point seen from `from`: three numbers in [0, 1) choose it.
    #[inline(always)]
    pub fn sample(&self, from: V3<f32>, random: [f32; 3]) -> LightSample<f32> {
        match &self.shape {
            LightShape::Parallelogram(p) => p.sample(from, random[0], random[1]),
            LightShape::Mesh(m) => m.sample(from, random),
            LightShape::Sphere(s) => s.sample(from, random[0], random[1]),
        }
    }

    /// The solid-angle density with which [`Light::sample`] finds, from `from`, the point that a ray of unit
    /// direction hits at `distance` under cosine `cos_light` (> 0) to the light's normal.
    #[inline(always)]
    pub fn pdf(&self, from: V3<f32>, distance: f32, cos_light: f32) -> f32 {
        match &self.shape {
            LightShape::Parallelogram(Parallelogram { area, .. }) | LightShape::Mesh(EmissiveMesh { area, .. }) => {
                distance * distance / (cos_light * area)
            }
            LightShape::Sphere(EmissiveSphere { center, radius, .. }) => {
                shape::cone_pdf(shape::cone_height(from, (*center).into(), *radius))
            }
        }
    }
}

/// A direction towards a light.
#[derive(Clone, Copy, Debug)]
pub struct LightSample<F> {
    /// Unit direction, world space.
    pub direction: V3<F>,
    /// Distance up to which the way must be free.
    pub distance: F,
    /// Solid-angle density; 0 where the light does not emit towards `from`.
    pub pdf: F,
}

/// The sample that a point on a light makes: `point` is moved off the surface along the unit `normal` by `offset`,
/// more than rounding can move it, so that a shadow ray never hits the light it was aimed at.
#[inline(always)]
fn towards<F: Lanes>(from: V3<F>, point: V3<F>, normal: V3<F>, offset: F, area: F) -> LightSample<F> {
    let zero = F::splat(0.0);
    let way = point + normal * offset - from;
    let squared = way.dot(way);
    let distance = squared.sqrt();
    let direction = way * (F::splat(1.0) / distance);
    let cos_light = -direction.dot(normal);
    let pdf = F::select(cos_light.gt(zero), squared / (cos_light * area), zero);
    LightSample { direction, distance, pdf }
}
