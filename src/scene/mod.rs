//! The scene as component tables: shapes, materials, lights, a camera.

pub mod bounds;
pub mod build;
pub mod camera;
pub mod default;
pub mod description;
pub mod double;
pub mod origin;
pub mod procedural;
pub mod settings;
pub mod shapes;
pub mod stage;
pub mod surface;
pub mod viewpoint;

use crate::error::Note;
use crate::light::Light;
use crate::material::Material;
use crate::options::Normals;
use glam::{DVec3, Vec3};
use shapes::Shapes;
use std::mem::size_of;

/// How a description becomes a scene.
#[derive(Clone, Copy, Debug, Default)]
pub struct SceneOptions {
    /// Normals used for shading.
    pub normals: Normals,
    /// Replace materials that cannot be rendered by a diffuse stand-in, with a warning, instead of failing.
    pub substitute_materials: bool,
}

/// A scene ready to be rendered, apart from its acceleration structure.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Everything a ray can hit.
    pub shapes: Shapes,
    /// What it is made of.
    pub materials: Vec<Material>,
    /// What emits.
    pub lights: Vec<Light>,
    /// What was subtracted from every position: [`description::SceneDescription::origin`].
    pub origin: DVec3,
    /// What the user should know, from import and build.
    pub notes: Vec<Note>,
}

impl Scene {
    /// Bytes of all tables.
    pub fn bytes(&self) -> usize {
        let s = &self.shapes;
        s.positions.len() * size_of::<Vec3>()
            + s.normals.len() * size_of::<Vec3>()
            + s.triangles.len() * size_of::<[u32; 3]>()
            + s.spheres.len() * size_of::<shapes::Sphere>()
            + s.double.len() * size_of::<DVec3>()
            + s.spheres_double.len() * size_of::<shapes::SphereInDouble>()
            + s.geometries.len() * size_of::<shapes::Geometry>()
            + self.materials.len() * size_of::<Material>()
            + self.lights.len() * size_of::<Light>()
            + self.lights.iter().map(Light::bytes).sum::<usize>()
    }

    /// Bounding box of all shapes: minimum and maximum corner.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let corners = self.shapes.triangles.iter().flatten().map(|&i| self.shapes.positions[i as usize]);
        let (low, high) = corners.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(a, b), p| (a.min(p), b.max(p)));
        self.shapes
            .spheres
            .iter()
            .fold((low, high), |(a, b), s| (a.min(s.center - s.radius), b.max(s.center + s.radius)))
    }
}
