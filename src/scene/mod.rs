//! The scene as component tables: shapes, materials, lights, a camera.

pub mod bounds;
pub mod camera;
pub mod default;
pub mod description;
pub mod procedural;
pub mod settings;
pub mod shapes;
pub mod stage;
pub mod viewpoint;
