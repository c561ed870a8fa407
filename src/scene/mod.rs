//! The scene as component tables: shapes, materials, lights, a camera.

pub mod camera;
pub mod description;
pub mod shapes;
