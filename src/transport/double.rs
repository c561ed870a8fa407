//! Surfaces in double precision: what [`super::surface_at`] and [`super::outward_normal`] say of rays that start there.
//!
//! A hit's columns are single precision. That is enough to say what was hit; where, the test tells anew, by the same operations as in the
//! tree.

use crate::bvh::double::triangle;
use crate::bvh::ray::Hit;
use crate::bvh::{first_root, sphere_roots};
use crate::sampling::v3::V3;
use crate::scene::double::{on_sphere, on_triangle, triangle_normal};
use crate::scene::origin::Origin;
use crate::scene::shapes::Shapes;
use crate::scene::surface::{SurfacePoint, shading_normal};
use glam::{DVec3, Vec3};

/// The surface at a hit of a ray from `origin`.
pub fn surface_at(shapes: &Shapes, hit: &Hit, origin: DVec3, direction: Vec3) -> SurfacePoint<Origin> {
    let Some((center, radius)) = sphere(shapes, hit.prim) else {
        let corners = shapes.corners_in_double(hit.prim);
        let crossing = triangle::cross(&triangle::Sheared::new(origin, direction.as_dvec3()), corners);
        let (u, v) = crossing.map_or((hit.u.into(), hit.v.into()), |crossing| (crossing.u, crossing.v));
        let mut point = on_triangle(corners, u, v, direction);
        if !shapes.normals.is_empty() {
            let normals = shapes.triangles[hit.prim as usize].map(|i| V3::from(shapes.normals[i as usize]));
            point.normal = shading_normal(normals, hit.u, hit.v, point.geometric);
        }
        return point;
    };
    on_sphere(center, radius, from_center(center, radius, hit, origin, direction), direction)
}

/// Unit normal of the front side at a hit.
pub fn outward_normal(shapes: &Shapes, hit: &Hit, origin: DVec3, direction: Vec3) -> V3 {
    let normal = match sphere(shapes, hit.prim) {
        None => triangle_normal(shapes.corners_in_double(hit.prim)),
        Some((center, radius)) => {
            from_center(center, radius, hit, origin, direction).try_normalize().unwrap_or(-direction.as_dvec3())
        }
    };
    normal.as_vec3().into()
}

fn sphere(shapes: &Shapes, prim: u32) -> Option<(DVec3, f64)> {
    let number = (prim as usize).checked_sub(shapes.triangles.len())?;
    Some(shapes.sphere_in_double(number))
}

/// Where a ray hits a sphere, as seen from its centre.
fn from_center(center: DVec3, radius: f64, hit: &Hit, origin: DVec3, direction: Vec3) -> DVec3 {
    let (from, along) = (origin - center, direction.as_dvec3());
    let t = sphere_roots(from, along, radius).and_then(|roots| first_root(roots, 0.0, f32::MAX.into()));
    from + along * t.unwrap_or(hit.t.into())
}
