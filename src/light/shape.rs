//! The shapes that emit, and how points on them are drawn.

use super::corners::Corners;
use super::rectangle::SeenRectangle;
use super::triangle::SeenTriangle;
use super::{LightSample, towards};
use crate::options::LightSampling;
use crate::sampling::order::max;
use crate::sampling::v3::V3;
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

/// Solid angles (sr) below which points are drawn by area: a shape that small is seen under the same angle and from the same
/// distance everywhere, so that both densities are the same.
pub const SMALLEST_SOLID_ANGLE: f32 = 1e-4;

/// A parallelogram: the course's area light.
#[derive(Clone, Debug, PartialEq)]
pub struct Parallelogram {
    /// A corner.
    pub corner: Vec3,
    /// The corner in double precision.
    pub place: DVec3,
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
    /// The directions of its sides and their lengths if they are perpendicular. Only rectangles are drawn from by solid angle.
    pub rectangle: Option<[(Vec3, f32); 2]>,
}

impl Parallelogram {
    /// From a corner and two sides; emits towards `side_u × side_v`. `None` without area.
    pub fn new(corner: Vec3, side_u: Vec3, side_v: Vec3) -> Option<Self> {
        /// Sides that a file rotates by a matrix in single precision are no more perpendicular than that.
        const ASKEW: f64 = 1e-6;
        let (u, v) = (side_u.as_dvec3(), side_v.as_dvec3());
        let cross = u.cross(v);
        let normal = cross.try_normalize()?.as_vec3();
        let reach = corner.abs() + side_u.abs() + side_v.abs();
        let area = cross.length() as f32;
        let perpendicular = u.dot(v).abs() <= ASKEW * u.length() * v.length();
        let rectangle = perpendicular.then(|| [u, v].map(|side| (side.normalize().as_vec3(), side.length() as f32)));
        (area > 0.0 && area.is_finite()).then_some(Parallelogram {
            corner,
            place: corner.as_dvec3(),
            side_u,
            side_v,
            normal,
            area,
            offset: offset(reach.into()),
            rectangle,
        })
    }

    /// The same, its corner known better.
    pub fn placed(self, place: DVec3) -> Self {
        Parallelogram { place, ..self }
    }

    /// A point, uniform by area.
    #[inline(always)]
    pub fn sample_area(&self, from: V3, u: f32, v: f32) -> LightSample {
        let point = V3::from(self.corner) + V3::from(self.side_u) * u + V3::from(self.side_v) * v;
        towards(from, point, V3::from(self.normal), self.offset, self.area)
    }

    /// A point, uniform by solid angle where the rule of `seen` says so.
    #[inline(always)]
    pub fn sample_solid_angle(&self, from: V3, u: f32, v: f32) -> LightSample {
        match &self.rectangle {
            Some(sides) => self.sample_rectangle(sides, from, u, v),
            None => self.sample_area(from, u, v),
        }
    }

    /// The same of a rectangle with these `sides`, without branches.
    #[inline(always)]
    pub fn sample_rectangle(&self, sides: &[(Vec3, f32); 2], from: V3, u: f32, v: f32) -> LightSample {
        let (seen, by_solid_angle) = self.seen(sides, from);
        let (s, t) = seen.sample(u, v);
        let found = self.sample_area(from, if by_solid_angle { s } else { u }, if by_solid_angle { t } else { v });
        let reaches = by_solid_angle & (found.pdf > 0.0);
        let uniform = 0.5 / seen.half;
        let pdf = if reaches { uniform } else { found.pdf };
        LightSample { pdf, reckoned: pdf, ..found }
    }

    /// A point, more often where more light would come from to a surface with this unit `normal`. Weights reckon with its density by area.
    #[inline(always)]
    pub fn sample_corners(&self, from: V3, normal: V3, u: f32, v: f32) -> LightSample {
        let sides = [self.side_u.into(), self.side_v.into()];
        let drawn = Corners::new(V3::from(self.corner) - from, sides, normal).sample(u, v);
        let found = self.sample_area(from, drawn.s, drawn.t);
        LightSample { pdf: found.pdf * drawn.density, ..found }
    }

    /// The rectangle as a point sees it, and whether points are drawn by solid angle there. Samples and densities follow the same
    /// rule.
    #[inline(always)]
    fn seen(&self, &[(x, width), (y, height)]: &[(Vec3, f32); 2], from: V3) -> (SeenRectangle, bool) {
        let way = V3::from(self.corner) - from;
        let h = -way.dot(V3::from(self.normal));
        let near = [way.dot(V3::from(x)), way.dot(V3::from(y))];
        let seen = SeenRectangle::new(near, [width, height], h);
        (seen, seen.is_wide(SMALLEST_SOLID_ANGLE))
    }

    /// [`LightSample::reckoned`] of a point at `distance`, seen under `cos` (> 0) to the normal.
    #[inline(always)]
    pub fn pdf(&self, from: V3, distance: f32, cos: f32, how: LightSampling) -> f32 {
        let sides = self.rectangle.as_ref().filter(|_| how == LightSampling::SolidAngle);
        match sides.map(|sides| self.seen(sides, from)) {
            Some((seen, true)) => 0.5 / seen.half,
            _ => distance * distance / (cos * self.area),
        }
    }
}

/// The triangles of an emissive mesh, in the order of its primitives. They keep their own corners, so that a sample touches one row.
#[derive(Clone, Debug, PartialEq)]
pub struct EmissiveMesh {
    /// The triangles.
    pub triangles: Vec<EmissiveTriangle>,
    /// Their corners in double precision, if any is not exact in single precision; else empty.
    pub double: Vec<[DVec3; 3]>,
    /// Running sums of area fractions; the last is 1.
    pub cdf: Vec<f32>,
    /// Total area.
    pub area: f32,
}

/// A triangle that emits.
#[derive(Clone, Debug, PartialEq)]
pub struct EmissiveTriangle {
    /// Corners.
    pub corners: [Vec3; 3],
    /// Unit; the side that emits. Zero for a triangle without area.
    pub normal: Vec3,
    /// Area.
    pub area: f32,
    /// How far off the surface shadow rays end.
    pub offset: f32,
}

impl EmissiveMesh {
    /// From triangles that wind counter-clockwise seen from the emitting side. `None` without area.
    pub fn new(corners: impl Iterator<Item = [Vec3; 3]>) -> Option<Self> {
        EmissiveMesh::in_double(corners.map(|corners| corners.map(Vec3::as_dvec3)), false)
    }

    /// As [`EmissiveMesh::new`], of corners that are known better, and kept so if that is wanted.
    pub fn in_double(corners: impl Iterator<Item = [DVec3; 3]>, keep: bool) -> Option<Self> {
        let mut double = Vec::new();
        let mut triangles = Vec::new();
        let mut sums = Vec::new();
        let mut area = 0.0f64;
        for corners in corners {
            double.extend(keep.then_some(corners));
            let [a, b, c] = corners;
            let cross = (b - a).cross(c - a);
            let corners = corners.map(|p| p.as_vec3());
            let [a, b, c] = corners.map(Vec3::abs);
            let (normal, own) = match cross.try_normalize() {
                Some(normal) => (normal.as_vec3(), cross.length() * 0.5),
                None => (Vec3::ZERO, 0.0),
            };
            area += own;
            triangles.push(EmissiveTriangle {
                corners,
                normal,
                area: own as f32,
                offset: offset(a.max(b).max(c).into()),
            });
            sums.push(area);
        }
        let total = area as f32;
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let cdf = sums.iter().map(|&s| (s / area) as f32).collect();
        Some(EmissiveMesh { triangles, double, cdf, area: total })
    }

    /// The corners of a triangle, as exactly as they are known.
    pub fn corners_in_double(&self, triangle: u32) -> [DVec3; 3] {
        let known = self.double.get(triangle as usize).copied();
        known.unwrap_or_else(|| self.triangles[triangle as usize].corners.map(Vec3::as_dvec3))
    }

    /// The triangle that a number picks, in proportion to area (Osada et al. 2002, §4.2).
    #[inline(always)]
    pub fn pick(&self, u: f32) -> u32 {
        self.cdf.partition_point(|&sum| sum <= u).min(self.triangles.len() - 1) as u32
    }

    /// The probability of that: the width of the interval of numbers that pick it, so that they agree to the bit.
    #[inline(always)]
    pub fn share(&self, triangle: u32) -> f32 {
        let i = triangle as usize;
        self.cdf[i] - if i == 0 { 0.0 } else { self.cdf[i - 1] }
    }
}

impl EmissiveTriangle {
    /// A point, uniform by area or, where the rule of `seen` says so, by solid angle.
    #[inline(always)]
    pub fn sample(&self, from: V3, u: f32, v: f32, how: LightSampling) -> LightSample {
        let [a, b, c] = self.corners.map(V3::from);
        let seen = self.seen(from, how);
        let weights = match &seen {
            Some(seen) => seen.sample(u, v),
            None => {
                let root = u.sqrt();
                [1.0 - root, root * (1.0 - v), root * v]
            }
        };
        let point = a * weights[0] + b * weights[1] + c * weights[2];
        let found = towards(from, point, self.normal.into(), self.offset, self.area);
        match seen {
            Some(seen) if found.pdf > 0.0 => {
                let pdf = 0.5 / seen.half;
                LightSample { pdf, reckoned: pdf, ..found }
            }
            _ => found,
        }
    }

    /// The triangle as a point sees it if points are drawn by solid angle there. Samples and densities follow the same rule.
    #[inline(always)]
    fn seen(&self, from: V3, how: LightSampling) -> Option<SeenTriangle> {
        if how != LightSampling::SolidAngle {
            return None;
        }
        let ways = self.corners.map(|corner| V3::from(corner) - from);
        let height = -ways[0].dot(self.normal.into());
        let seen = SeenTriangle::new(ways, height, self.area);
        (height > 0.0 && seen.is_wide(SMALLEST_SOLID_ANGLE)).then_some(seen)
    }

    /// [`LightSample::reckoned`] of a point at `distance`, seen under `cos` (> 0) to the normal.
    #[inline(always)]
    pub fn pdf(&self, from: V3, distance: f32, cos: f32, how: LightSampling) -> f32 {
        match self.seen(from, how) {
            Some(seen) => 0.5 / seen.half,
            None => distance * distance / (cos * self.area),
        }
    }
}

/// A sphere that emits outwards.
#[derive(Clone, Debug, PartialEq)]
pub struct EmissiveSphere {
    /// Centre.
    pub center: Vec3,
    /// The centre in double precision.
    pub place: DVec3,
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
            place: center.as_dvec3(),
            radius,
            offset: offset((reach + Vec3::splat(radius)).into()),
        })
    }

    /// The same, its centre known better.
    pub fn placed(self, place: DVec3) -> Self {
        EmissiveSphere { place, ..self }
    }

    /// A direction, uniform over the cone that the sphere fills (Shirley, Wang & Zimmerman 1996, §3.2).
    #[inline(always)]
    pub fn sample(&self, from: V3, u: f32, v: f32) -> LightSample {
        let radius = self.radius;
        let to_center = V3::from(self.center) - from;
        let squared = to_center.dot(to_center);
        let axis = to_center * (1.0 / squared.sqrt());
        let height = cone_height(from, V3::from(self.center), self.radius);
        let direction = warp::to_world(warp::uniform_cap(u, v, height), axis);
        // Distance to the nearer intersection; the foot of the perpendicular stands in for a direction that
        // rounding has pushed past the rim.
        let along = direction.dot(to_center);
        let foot = to_center - direction * along;
        let half_chord = max(radius * radius - foot.dot(foot), 0.0).sqrt();
        let distance = max(along - half_chord - self.offset, 0.0);
        let pdf = cone_pdf(height);
        LightSample { direction, distance, pdf, reckoned: pdf }
    }
}

/// `1 − cos θ_max` of the cone that a sphere fills seen from `from`; 0 from inside it, where no light is emitted.
#[inline(always)]
pub fn cone_height(from: V3, center: V3, radius: f32) -> f32 {
    let to_center = center - from;
    let sin2 = radius * radius / to_center.dot(to_center);
    // sin² / (1 + cos) does not cancel when the sphere is far away, 1 − cos would.
    let height = sin2 / (1.0 + max(1.0 - sin2, 0.0).sqrt());
    if sin2 < 1.0 { height } else { 0.0 }
}

/// Density of a uniform direction within a cone, 0 for an empty one.
#[inline(always)]
pub fn cone_pdf(height: f32) -> f32 {
    let pdf = 1.0 / (2.0 * PI) / height;
    if height > 0.0 { pdf } else { 0.0 }
}
