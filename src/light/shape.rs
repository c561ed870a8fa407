//! The shapes that emit, and how points on them are drawn.

use super::{LightSample, towards};
use crate::sampling::lanes::{Lanes, V3};
use crate::sampling::warp;
use crate::scene::surface::offset;
use glam::{DVec3, Vec3};
use std::f32::consts::PI;

/// Where light leaves a light.
#[derive(Clone, Debug, PartialEq)]
pub enum LightShape {
    /// A parallelogram.
    Parallelogram(Parallelogram),
    /// Triangles.
    Mesh(EmissiveMesh),
    /// A sphere, emitting outwards.
    Sphere(EmissiveSphere),
}

impl LightShape {
    /// The word for it in reports.
    pub fn kind(&self) -> &'static str {
        match self {
            LightShape::Parallelogram(_) => "parallelogram",
            LightShape::Mesh(_) => "mesh",
            LightShape::Sphere(_) => "sphere",
        }
    }
}

/// A parallelogram: the course's area light.
#[derive(Clone, Debug, PartialEq)]
pub struct Parallelogram {
    /// A corner.
    pub corner: Vec3,
    /// From the corner to the next.
    pub side_u: Vec3,
    /// From the corner to the other next.
    pub side_v: Vec3,
    /// Unit; the side that emits.
    pub normal: Vec3,
    /// Area.
    pub area: f32,
    /// How far off the surface shadow rays end.
    pub offset: f32,
}

impl Parallelogram {
    /// From a corner and two sides; emits towards `side_u × side_v`. `None` without area.
    pub fn new(corner: Vec3, side_u: Vec3, side_v: Vec3) -> Option<Self> {
        let cross = side_u.as_dvec3().cross(side_v.as_dvec3());
        let normal = cross.try_normalize()?.as_vec3();
        let reach = corner.abs() + side_u.abs() + side_v.abs();
        let area = cross.length() as f32;
        (area > 0.0 && area.is_finite()).then_some(Parallelogram {
            corner,
            side_u,
            side_v,
            normal,
            area,
            offset: offset(reach.into()),
        })
    }

    /// A point, uniform by area.
    #[inline(always)]
    pub fn sample<F: Lanes>(&self, from: V3<F>, u: F, v: F) -> LightSample<F> {
        let point = V3::splat(self.corner) + V3::splat(self.side_u) * u + V3::splat(self.side_v) * v;
        towards(from, point, V3::splat(self.normal), F::splat(self.offset), F::splat(self.area))
    }
}

/// The triangles of an emissive mesh. It keeps its own corners, so that a sample touches one row.
#[derive(Clone, Debug, PartialEq)]
pub struct EmissiveMesh {
    /// Corners and unit normal of each triangle that has an area.
    pub triangles: Vec<[Vec3; 4]>,
    /// Running sums of area fractions; the last is 1.
    pub cdf: Vec<f32>,
    /// Total area.
    pub area: f32,
    /// How far off the surface shadow rays end.
    pub offset: f32,
}

impl EmissiveMesh {
    /// From triangles that wind counter-clockwise seen from the emitting side. `None` without area.
    pub fn new(corners: impl Iterator<Item = [Vec3; 3]>) -> Option<Self> {
        let mut triangles = Vec::new();
        let mut sums = Vec::new();
        let mut area = 0.0f64;
        let mut reach = Vec3::ZERO;
        for [a, b, c] in corners {
            let [da, db, dc]: [DVec3; 3] = [a, b, c].map(|p| p.as_dvec3());
            let cross = (db - da).cross(dc - da);
            let Some(normal) = cross.try_normalize() else { continue };
            area += cross.length() * 0.5;
            triangles.push([a, b, c, normal.as_vec3()]);
            sums.push(area);
            reach = reach.max(a.abs()).max(b.abs()).max(c.abs());
        }
        let total = area as f32;
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let cdf = sums.iter().map(|&s| (s / area) as f32).collect();
        Some(EmissiveMesh { triangles, cdf, area: total, offset: offset(reach.into()) })
    }

    /// A point, uniform by area: the third number picks the triangle, the others a point of it
    /// (Osada et al. 2002, §4.2).
    #[inline(always)]
    pub fn sample(&self, from: V3<f32>, random: [f32; 3]) -> LightSample<f32> {
        let i = self.cdf.partition_point(|&sum| sum <= random[2]).min(self.triangles.len() - 1);
        let [a, b, c, normal] = self.triangles[i].map(V3::from);
        let root = random[0].sqrt();
        let point = a * (1.0 - root) + b * (root * (1.0 - random[1])) + c * (root * random[1]);
        towards(from, point, normal, self.offset, self.area)
    }
}

/// A sphere that emits outwards.
#[derive(Clone, Debug, PartialEq)]
pub struct EmissiveSphere {
    /// Centre.
    pub center: Vec3,
    /// Radius.
    pub radius: f32,
    /// How far off the surface shadow rays end.
    pub offset: f32,
}

impl EmissiveSphere {
    /// A sphere; `None` if its area is not a positive number.
    pub fn new(center: Vec3, radius: f32) -> Option<Self> {
        let area = 4.0 * PI * radius * radius;
        let reach = center.abs();
        (area > 0.0 && area.is_finite()).then_some(EmissiveSphere {
            center,
            radius,
            offset: offset((reach + Vec3::splat(radius)).into()),
        })
    }

    /// A direction, uniform over the cone that the sphere fills (Shirley, Wang & Zimmerman 1996, §3.2).
    #[inline(always)]
    pub fn sample<F: Lanes>(&self, from: V3<F>, u: F, v: F) -> LightSample<F> {
        let zero = F::splat(0.0);
        let radius = F::splat(self.radius);
        let to_center = V3::splat(self.center) - from;
        let squared = to_center.dot(to_center);
        let axis = to_center * (F::splat(1.0) / squared.sqrt());
        let height = cone_height(from, V3::splat(self.center), self.radius);
        let direction = warp::to_world(warp::uniform_cap(u, v, height), axis);
        // Distance to the nearer intersection; the foot of the perpendicular stands in for a direction that
        // rounding has pushed past the rim.
        let along = direction.dot(to_center);
        let foot = to_center - direction * along;
        let half_chord = (radius * radius - foot.dot(foot)).max(zero).sqrt();
        let distance = (along - half_chord - F::splat(self.offset)).max(zero);
        LightSample { direction, distance, pdf: cone_pdf(height) }
    }
}

/// `1 − cos θ_max` of the cone that a sphere fills seen from `from`; 0 from inside it, where no light is emitted.
#[inline(always)]
pub fn cone_height<F: Lanes>(from: V3<F>, center: V3<F>, radius: f32) -> F {
    let to_center = center - from;
    let sin2 = F::splat(radius * radius) / to_center.dot(to_center);
    let one = F::splat(1.0);
    let zero = F::splat(0.0);
    // sin² / (1 + cos) does not cancel when the sphere is far away, 1 − cos would.
    let height = sin2 / (one + (one - sin2).max(zero).sqrt());
    F::select(sin2.lt(one), height, zero)
}

/// Density of a uniform direction within a cone, 0 for an empty one.
#[inline(always)]
pub fn cone_pdf<F: Lanes>(height: F) -> F {
    let zero = F::splat(0.0);
    F::select(height.gt(zero), F::splat(1.0 / (2.0 * PI)) / height, zero)
}
