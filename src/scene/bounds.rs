//! The box around what a description would render.

use crate::scene::description::SceneDescription;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Smallest and largest corner of the box around all meshes and spheres, world space; `None` if there are none.
///
/// Area lights do not count: the course's renderer asks only its objects for their boxes, and framing a lamp that
/// hangs far above a model would make the model small.
pub fn geometry_bounds(description: &SceneDescription) -> Option<(DVec3, DVec3)> {
    let empty = || (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let join = |a: (Vec3, Vec3), b: (Vec3, Vec3)| (a.0.min(b.0), a.1.max(b.1));
    let meshes = description
        .meshes
        .iter()
        .map(|mesh| mesh.positions.par_iter().fold(empty, |b, &p| join(b, (p, p))).reduce(empty, join))
        .fold(empty(), join);
    let (mut min, mut max) = (meshes.0.as_dvec3(), meshes.1.as_dvec3());
    for sphere in &description.spheres {
        min = min.min(sphere.center.as_dvec3() - f64::from(sphere.radius));
        max = max.max(sphere.center.as_dvec3() + f64::from(sphere.radius));
    }
    (min.cmple(max).all()).then_some((min, max))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::At;
    use crate::scene::description::{MeshDescription, SphereDescription};

    #[test]
    fn nothing_has_no_box() {
        assert_eq!(geometry_bounds(&SceneDescription::default()), None);
    }

    #[test]
    fn meshes_and_spheres_count() {
        let mesh = MeshDescription { positions: vec![Vec3::new(-1.0, 0.0, 2.0), Vec3::ZERO], ..Default::default() };
        let sphere = SphereDescription {
            name: String::new(),
            at: At::File,
            center: Vec3::X,
            radius: 0.5,
            double: None,
            material: 0,
        };
        let description = SceneDescription { meshes: vec![mesh], spheres: vec![sphere], ..Default::default() };
        let (min, max) = geometry_bounds(&description).unwrap();
        assert_eq!(min, DVec3::new(-1.0, -0.5, -0.5));
        assert_eq!(max, DVec3::new(1.5, 0.5, 2.0));
    }
}
