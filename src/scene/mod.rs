//! The scene as component tables: shapes, materials, lights, a camera.

pub mod camera;
pub mod description;
pub mod shapes;

use crate::error::{Note, Result};
use crate::options::Normals;
use description::SceneDescription;
use shapes::Shapes;

/// How a description becomes a scene.
#[derive(Clone, Copy, Debug, Default)]
pub struct SceneOptions {
    /// Normals used for shading.
    pub normals: Normals,
    /// Replace materials that cannot be rendered by a diffuse stand-in, with a warning, instead of failing.
    pub substitute_materials: bool,
}

/// A scene ready to be rendered, apart from its acceleration structure.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Everything a ray can hit.
    pub shapes: Shapes,
    /// What the user should know, from import and build.
    pub notes: Vec<Note>,
}

impl Scene {
    /// Checks a description and lays it out in tables.
    pub fn build(description: SceneDescription, options: SceneOptions) -> Result<Scene> {
        let _ = (description, options);
        todo!()
    }

    /// Bytes of all tables.
    pub fn bytes(&self) -> usize {
        todo!()
    }

    /// Bounding box of all shapes: minimum and maximum corner.
    pub fn bounds(&self) -> (glam::Vec3, glam::Vec3) {
        todo!()
    }
}
