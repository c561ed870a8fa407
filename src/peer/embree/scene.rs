//! Embree's tree of a scene.

use super::denormals::AsZero;
use super::ffi::{self, Handle};
use super::library::Device;
use crate::error::{Error, Result};
use crate::scene::shapes::Shapes;
use serde::Serialize;
use std::sync::Arc;
use std::time::Instant;

/// How well Embree builds. For watertight tests it builds the same tree either way: spatial splits are for fast tests alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Quality {
    /// `RTC_BUILD_QUALITY_MEDIUM`, its default.
    Medium,
    /// `RTC_BUILD_QUALITY_HIGH`: with spatial splits.
    High,
}

impl Quality {
    /// For reports.
    pub fn name(self) -> &'static str {
        match self {
            Quality::Medium => "medium",
            Quality::High => "high",
        }
    }
}

/// A committed scene.
pub struct Tree {
    device: Arc<Device>,
    handle: Handle,
    /// How it was built.
    pub quality: Quality,
    /// Whether it was built for watertight tests.
    pub robust: bool,
    /// Wall time of the commit.
    pub build_seconds: f64,
    /// Bytes that the tree and the copies of the geometry take, by Embree's account.
    pub bytes: u64,
    /// The first primitive of each geometry.
    pub(super) first: Vec<u32>,
}

// SAFETY: Embree's scenes may be asked from all threads once committed, and this one is never changed after.
unsafe impl Send for Tree {}
// SAFETY: as above.
unsafe impl Sync for Tree {}

impl Tree {
    /// Builds the tree of `shapes`: all triangles as one mesh, so that Embree numbers primitives as comber does, and all
    /// spheres as one geometry.
    ///
    /// # Errors
    /// What Embree reports, such as that memory is short.
    pub fn build(device: &Arc<Device>, shapes: &Shapes, quality: Quality, robust: bool) -> Result<Tree> {
        let _zero = AsZero::new();
        let api = device.api();
        let before = device.bytes();
        // SAFETY: the device is alive.
        let handle = unsafe { (api.new_scene)(device.handle()) };
        let mut tree =
            Tree { device: device.clone(), handle, quality, robust, build_seconds: 0.0, bytes: 0, first: Vec::new() };
        tree.check()?;
        // SAFETY: the scene is alive, and the numbers are those of the headers.
        unsafe {
            (api.set_scene_flags)(handle, if robust { ffi::ROBUST } else { 0 });
            (api.set_scene_build_quality)(handle, if quality == Quality::High { 2 } else { 1 });
        }
        if !shapes.triangles.is_empty() {
            let vertices = shapes.positions.iter().map(|p| p.to_array());
            tree.attach(
                ffi::TRIANGLES,
                &[
                    (ffi::INDICES, ffi::UINT3, words(shapes.triangles.iter().copied())),
                    (ffi::VERTICES, ffi::FLOAT3, words(vertices.map(|p| p.map(f32::to_bits)))),
                ],
                0,
            )?;
        }
        if !shapes.spheres.is_empty() {
            let spheres = shapes.spheres.iter().map(|s| [s.center.x, s.center.y, s.center.z, s.radius]);
            let spheres = words(spheres.map(|s| s.map(f32::to_bits)));
            tree.attach(ffi::SPHERES, &[(ffi::VERTICES, ffi::FLOAT4, spheres)], shapes.triangles.len() as u32)?;
        }
        let start = Instant::now();
        // SAFETY: the scene is alive.
        unsafe { (api.commit_scene)(handle) };
        tree.build_seconds = start.elapsed().as_secs_f64();
        tree.check()?;
        tree.bytes = device.bytes().saturating_sub(before);
        Ok(tree)
    }

    /// Adds a geometry with these buffers: type, format, and items of some words each.
    fn attach(&mut self, kind: i32, buffers: &[(i32, i32, Items<'_>)], first: u32) -> Result<()> {
        let api = self.device.api();
        // SAFETY: the device is alive.
        let geometry = unsafe { (api.new_geometry)(self.device.handle(), kind) };
        self.check()?;
        for (kind, format, items) in buffers {
            let (words, count) = (items.words, items.count);
            // SAFETY: the geometry is alive; Embree makes a buffer of `count` items and pads it as it needs.
            let buffer = unsafe { (api.new_buffer)(geometry, *kind, 0, *format, words * 4, count) };
            self.check()?;
            if buffer.is_null() {
                return Err(Error::Scene(format!("Embree {} makes no buffer", self.device.version)));
            }
            // SAFETY: Embree just allocated `count · words` words there, 16-byte aligned, and nobody else has them yet.
            let buffer = unsafe { std::slice::from_raw_parts_mut(buffer.cast::<u32>(), count * words) };
            (items.copy)(buffer);
        }
        // SAFETY: geometry and scene are alive; the scene keeps a reference of its own.
        unsafe {
            (api.commit_geometry)(geometry);
            (api.attach_geometry)(self.handle, geometry);
            (api.release_geometry)(geometry);
        }
        self.first.push(first);
        self.check()
    }

    fn check(&self) -> Result<()> {
        self.device.error().map_err(Error::Scene)
    }

    /// Which library built it.
    pub fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// For the functions.
    pub(super) fn handle(&self) -> Handle {
        self.handle
    }

    /// What to call it: "Embree 4.4.0 medium".
    pub fn name(&self) -> String {
        format!("Embree {} {}", self.device.version, self.quality.name())
    }
}

impl Drop for Tree {
    fn drop(&mut self) {
        // SAFETY: made by `new_scene`, released once; nothing traces any more, as that borrows the tree.
        unsafe { (self.device.api().release_scene)(self.handle) };
    }
}

/// Items for a buffer.
struct Items<'a> {
    words: usize,
    count: usize,
    copy: Copy<'a>,
}

/// Fills a buffer.
type Copy<'a> = Box<dyn Fn(&mut [u32]) + 'a>;

/// `items`, each `N` words.
fn words<'a, const N: usize>(items: impl ExactSizeIterator<Item = [u32; N]> + Clone + 'a) -> Items<'a> {
    let count = items.len();
    let copy = move |buffer: &mut [u32]| {
        for (to, from) in buffer.chunks_exact_mut(N).zip(items.clone()) {
            to.copy_from_slice(&from);
        }
    };
    Items { words: N, count, copy: Box::new(copy) }
}
