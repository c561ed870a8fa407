//! Stand-ins for parts that are still being written; every use of this module is to be replaced.
#![allow(missing_docs, unused_variables)]

use crate::bvh::Accel;
use crate::options;
use crate::scene::shapes::Shapes;
use glam::Vec3;
use serde::Serialize;

/// What a built tree looks like.
#[derive(Clone, Debug, Default, Serialize)]
pub struct BvhStats {
    pub primitives: usize,
    pub nodes: usize,
    pub leaf_blocks: usize,
    pub depth: u32,
    pub sah_cost: f64,
    pub bytes: usize,
    pub bytes_per_primitive: f64,
    pub build_seconds: f64,
}

pub struct Aabb {
    pub min: Vec3,
    pub max: Vec3,
}

impl Accel {
    pub fn build(shapes: &Shapes, kind: options::Accel) -> crate::error::Result<Accel> {
        todo!()
    }
    pub fn stats(&self) -> BvhStats {
        todo!()
    }
    pub fn boxes_at_depth(&self, depth: u32) -> Vec<Aabb> {
        todo!()
    }
}

pub mod import {
    use crate::error::Result;
    use crate::scene::description::SceneDescription;
    use std::path::Path;
    pub fn load(path: &Path) -> Result<SceneDescription> {
        todo!()
    }
}

pub mod procedural {
    use crate::error::Result;
    use crate::scene::description::SceneDescription;
    pub fn generate(spec: &str) -> Result<SceneDescription> {
        todo!()
    }
}

pub mod default {
    use super::stage::Staged;
    use crate::error::Result;
    pub fn description() -> Result<Staged> {
        todo!()
    }
}

pub mod stage {
    use crate::error::Result;
    use crate::scene::camera::Camera;
    use crate::scene::description::SceneDescription;
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum Stage {
        #[default]
        Cornell,
        Studio,
        None,
    }
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum UpAxis {
        X,
        #[default]
        Y,
        Z,
    }
    pub struct Staged {
        pub description: SceneDescription,
        pub camera: Camera,
    }
    pub fn place(description: SceneDescription, stage: Stage, up: UpAxis) -> Result<Staged> {
        todo!()
    }
}

pub mod bounds {
    use crate::scene::description::SceneDescription;
    use glam::DVec3;
    pub fn geometry_bounds(description: &SceneDescription) -> Option<(DVec3, DVec3)> {
        todo!()
    }
}

pub mod settings {
    use crate::error::{Note, Result};
    use crate::scene::camera::Camera;
    use std::path::Path;
    pub struct Settings {
        pub camera: Camera,
        pub width: u32,
        pub height: u32,
        pub notes: Vec<Note>,
    }
    pub fn settings_file(path: &Path) -> Result<Settings> {
        todo!()
    }
}

pub mod viewpoint {
    use crate::scene::camera::Camera;
    use crate::scene::description::CameraDescription;
    use glam::DVec3;
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum CameraChoice {
        #[default]
        Course,
        CoursePixels,
        File,
    }
    pub fn choose(
        choice: CameraChoice,
        node: Option<&CameraDescription>,
        min: DVec3,
        max: DVec3,
        width: u32,
        height: u32,
    ) -> Result<Camera, String> {
        todo!()
    }
    #[derive(Clone, Copy, Debug, Default, PartialEq)]
    pub struct Explicit {
        pub position: Option<DVec3>,
        pub target: Option<DVec3>,
        pub up: Option<DVec3>,
        pub xfov: Option<f64>,
        pub yfov: Option<f64>,
    }
    pub fn explicit(explicit: &Explicit, framing: &Camera, center: DVec3) -> Result<Camera, String> {
        todo!()
    }
}

pub mod output {
    use crate::error::{Error, Result};
    use crate::film::picture::Picture;
    use std::path::Path;
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Format {
        Exr,
        Png,
    }
    impl Format {
        pub fn of(path: &Path) -> Result<Self> {
            match path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).as_deref() {
                Some("exr") => Ok(Format::Exr),
                Some("png") => Ok(Format::Png),
                _ => Err(Error::Options(format!("{}: known: .exr, .png", path.display()))),
            }
        }
    }
    pub fn check(path: &Path) -> Result<()> {
        todo!()
    }
    pub fn write(path: &Path, picture: &Picture, exposure: f32) -> Result<()> {
        todo!()
    }
}

pub mod heatmap {
    use crate::error::Result;
    use std::path::Path;
    pub enum Scale {
        Linear,
    }
    pub struct HeatMap<'a> {
        pub width: usize,
        pub height: usize,
        pub values: &'a [f32],
        pub title: &'a str,
        pub unit: &'a str,
        pub scale: Scale,
    }
    pub fn write(path: &Path, map: &HeatMap) -> Result<()> {
        todo!()
    }
}

pub mod memory {
    /// Peak resident bytes.
    pub fn peak_resident() -> Option<u64> {
        todo!()
    }
}

pub mod progress {
    pub struct Progress;
    impl Progress {
        pub fn new(label: &str, total: u64, enabled: bool) -> Self {
            Progress
        }
        pub fn set(&self, done: u64) {}
        pub fn finish(&self) {}
    }
}

pub mod units {
    use std::time::Duration;
    pub fn count(number: u64) -> String {
        todo!()
    }
    pub fn bytes(number: u64) -> String {
        todo!()
    }
    pub fn rate(number: f64, time: Duration, unit: &str) -> String {
        todo!()
    }
    pub fn duration(time: Duration) -> String {
        todo!()
    }
}
