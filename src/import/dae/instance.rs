//! A primitive put into the world: transformed, cleaned of triangles without area, wound to its front.

use super::geometry::Primitive;
use super::placement::Placement;
use glam::{DVec3, Vec3};

/// A primitive in world space.
pub(super) struct Instance {
    /// Finite positions.
    pub positions: Vec<Vec3>,
    /// The same in double precision, if that is wanted.
    pub double: Vec<DVec3>,
    /// Unit normals, or zero for "flat here"; one a position, or empty.
    pub normals: Vec<Vec3>,
    /// Triangles that have an area.
    pub triangles: Vec<[u32; 3]>,
    /// Triangles that were left out for want of one.
    pub left_out: usize,
    /// The winding was reversed because the vertex normals said so.
    pub turned: bool,
}

impl Instance {
    /// Places a primitive; nothing if a position is beyond the range of `f32`.
    ///
    /// Emissive meshes shine from their front only, so for them vertex normals overrule a contrary winding.
    pub fn new(primitive: &Primitive<'_>, placement: &Placement, emissive: bool, in_double: bool) -> Option<Instance> {
        let positions: Vec<Vec3> =
            primitive.positions.iter().map(|position| placement.position(*position)).collect::<Option<_>>()?;
        let double: Vec<DVec3> = match in_double {
            true => primitive.positions.iter().map(|position| placement.in_double(*position)).collect(),
            false => Vec::new(),
        };
        let corner = |index: u32| match double.get(index as usize) {
            Some(position) => *position,
            None => positions[index as usize].as_dvec3(),
        };
        let normals: Vec<Vec3> = primitive.normals.iter().map(|normal| placement.normal(*normal)).collect();
        let mut triangles = primitive.triangles.clone();
        triangles.retain(|triangle| area_vector(corner, *triangle) != DVec3::ZERO);
        let left_out = primitive.degenerate + primitive.triangles.len() - triangles.len();
        // A mirror turns the winding around, but not the transformed normals.
        let side = if placement.mirrored { -1.0 } else { 1.0 };
        let turned = emissive && side * agreement(corner, &normals, &triangles) < 0.0;
        if turned != placement.mirrored {
            triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
        Some(Instance { positions, double, normals, triangles, left_out, turned })
    }
}

/// Twice the area of a triangle along its geometric normal, in `f64`.
fn area_vector(corner: impl Fn(u32) -> DVec3, triangle: [u32; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(corner);
    (b - a).cross(c - a)
}

/// How well vertex normals agree with the winding, on average by area: below 0 if they point to the back.
fn agreement(corner: impl Fn(u32) -> DVec3, normals: &[Vec3], triangles: &[[u32; 3]]) -> f64 {
    if normals.is_empty() {
        return 0.0;
    }
    let of_triangle = |triangle: &[u32; 3]| {
        let sum: Vec3 = triangle.iter().map(|index| normals[*index as usize]).sum();
        area_vector(&corner, *triangle).dot(sum.as_dvec3())
    };
    triangles.iter().map(of_triangle).sum()
}
