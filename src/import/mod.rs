//! Scene files in, [`SceneDescription`](crate::scene::description::SceneDescription)s out, or a located error.

pub mod dae;
