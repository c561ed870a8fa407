//! The standard sets of rays of a scene.
//!
//! | set | rays | asked |
//! |---|---|---|
//! | P | from the camera through the middle of each pixel, row by row | closest |
//! | Pt | the same, in tiles of 8 × 8 pixels, Morton order within | closest |
//! | PH | those of Pt that hit | closest |
//! | S | from where PH hits to a point on a light, as the renderer draws it | any |
//! | D | from where PH hits in a cosine-distributed direction | closest |
//! | D2 | from where D hits, likewise | closest |
//!
//! Rays leave surfaces as those of the renderer do ([`crate::scene::surface`]). A scene without lights gets a square one
//! above it, for S alone.

use super::kernels::{self, Kernel};
use super::rays::{RaySet, Rays};
use crate::bvh::ray::{Hit, Ray};
use crate::bvh::{Accel, Query, Traversal};
use crate::light::Light;
use crate::light::shape::{LightShape, Parallelogram};
use crate::options::RenderOptions;
use crate::sampling::random::uniform4;
use crate::sampling::v3::V3;
use crate::sampling::warp;
use crate::scene::Scene;
use crate::scene::camera::Camera;
use crate::simd::Tier;
use crate::transport::{self, Asked, Transport};
use glam::Vec3;

/// What sets are made from.
pub struct Source<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Finds the hits that later sets start from.
    pub accel: &'a Accel,
    /// The camera.
    pub camera: &'a Camera,
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Rays a batch.
    pub wave: usize,
    /// Instruction set.
    pub tier: Tier,
}

/// Names of the sets that [`make`] knows.
pub const NAMES: [&str; 6] = ["P", "Pt", "PH", "S", "D", "D2"];

/// The sets of which `wanted` says so, in the order of [`NAMES`]. Sets that others start from are made along the way.
pub fn make(source: &Source, wanted: impl Fn(&str) -> bool) -> Vec<RaySet> {
    let set = |name, query, rays, coherent| RaySet::in_waves(name, query, rays, source.wave, coherent);
    let mut sets = Vec::new();
    let mut keep = |set: RaySet| {
        if wanted(&set.name) {
            sets.push(set);
        }
    };
    let [width, height] = source.size;
    keep(set(
        "P",
        Query::Closest,
        camera_rays(source, (0..height).flat_map(|y| (0..width).map(move |x| (x, y)))),
        true,
    ));
    let tiled = set("Pt", Query::Closest, camera_rays(source, tiles(width, height)), true);
    let hits = hits(source, &tiled);
    let mut hitting = Rays::default();
    for (row, _) in hits.iter().enumerate().filter(|(_, hit)| hit.is_some()) {
        hitting.push(tiled.rays.all().ray(row));
    }
    let hits: Vec<Hit> = hits.into_iter().filter(Hit::is_some).collect();
    keep(tiled);
    let hitting = set("PH", Query::Closest, hitting, true);
    keep(set("S", Query::Any, shadow_rays(source, &hitting.rays, &hits), false));
    let first = set("D", Query::Closest, bounces(source, &hitting.rays, &hits, 1), false);
    keep(hitting);
    let hits = self::hits(source, &first);
    let second = bounces(source, &first.rays, &hits, 2);
    keep(first);
    keep(set("D2", Query::Closest, second, false));
    let rank = |set: &RaySet| NAMES.iter().position(|name| *name == set.name);
    sets.sort_by_key(rank);
    sets
}

fn camera_rays(source: &Source, pixels: impl Iterator<Item = (u32, u32)>) -> Rays {
    let lens = source.camera.lens(source.size[0], source.size[1]);
    let mut rays = Rays::default();
    for (x, y) in pixels {
        let direction: V3 = lens.direction(x as f32 + 0.5, y as f32 + 0.5);
        rays.push(Ray::new(lens.origin, direction.into()));
    }
    rays
}

/// Pixels in tiles of 8 × 8, tiles row by row, pixels of a tile in Morton order.
fn tiles(width: u32, height: u32) -> impl Iterator<Item = (u32, u32)> {
    const SIDE: u32 = 8;
    let corners =
        (0..height.div_ceil(SIDE)).flat_map(move |y| (0..width.div_ceil(SIDE)).map(move |x| (x * SIDE, y * SIDE)));
    let every_other = |bits: u32| (bits & 1) | (bits >> 1 & 2) | (bits >> 2 & 4);
    let pixels = move |(x, y)| (0..SIDE * SIDE).map(move |code| (x + every_other(code), y + every_other(code >> 1)));
    corners.flat_map(pixels).filter(move |&(x, y)| x < width && y < height)
}

fn hits(source: &Source, set: &RaySet) -> Vec<Hit> {
    kernels::closest_hits(source.accel, Kernel::Way(Traversal::Single), source.tier, set)
}

/// Rays towards the lights, from where `rays` have hit.
fn shadow_rays(source: &Source, rays: &Rays, hits: &[Hit]) -> Rays {
    let lamp = square_above(source);
    let lights = if source.scene.lights.is_empty() { &lamp } else { &source.scene.lights };
    let transport = Transport::new(&RenderOptions::default(), lights);
    let mut shadow_rays = Rays { t_max: Some(Vec::new()), ..Rays::default() };
    for (row, hit) in hits.iter().enumerate() {
        let ray = rays.all().ray(row);
        let at = transport::surface_at(source.scene, hit, ray.origin.into(), ray.direction.into());
        let random = uniform4(row as u32, 0, 0, 0);
        let Some(Asked { found, .. }) = transport.ask(lights, 0, random, at.origin, at.normal) else { continue };
        // The renderer asks no question whose answer is worth nothing.
        if found.pdf > 0.0 && found.direction.dot(at.geometric) > 0.0 && found.direction.dot(at.normal) > 0.0 {
            shadow_rays.push(Ray { t_max: found.distance, ..Ray::leaving(at.origin, found.direction) });
        }
    }
    shadow_rays
}

/// A lamp above the scene, as wide as it.
fn square_above(source: &Source) -> Vec<Light> {
    let (low, high) = source.scene.bounds();
    let size = (high - low).max_element();
    let corner = Vec3::new((low.x + high.x - size) / 2.0, high.y + size / 2.0, (low.z + high.z - size) / 2.0);
    let shape = Parallelogram::new(corner, Vec3::X * size, Vec3::Z * size).map(LightShape::Parallelogram);
    shape.into_iter().map(|shape| Light { name: "lamp".into(), shape, radiance: Vec3::ONE }).collect()
}

/// Diffuse rays from where `rays` have hit.
fn bounces(source: &Source, rays: &Rays, hits: &[Hit], bounce: u32) -> Rays {
    let mut bounced = Rays::default();
    for (row, hit) in hits.iter().enumerate().filter(|(_, hit)| hit.is_some()) {
        let ray = rays.all().ray(row);
        let at = transport::surface_at(source.scene, hit, ray.origin.into(), ray.direction.into());
        let [u, v, ..] = uniform4(row as u32, 0, bounce, 0);
        let direction = warp::to_world(warp::cosine_hemisphere(u, v), at.geometric);
        bounced.push(Ray::leaving(at.origin, direction));
    }
    bounced
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_have_every_pixel_once_and_neighbours_together() {
        for (width, height) in [(16, 8), (13, 21), (1, 1)] {
            let all: Vec<(u32, u32)> = tiles(width, height).collect();
            let mut sorted = all.clone();
            sorted.sort_by_key(|&(x, y)| (y, x));
            let rows: Vec<(u32, u32)> = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).collect();
            assert_eq!(sorted, rows);
        }
        let first: Vec<(u32, u32)> = tiles(16, 16).take(8).collect();
        assert_eq!(first, [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (3, 0), (2, 1), (3, 1)]);
        assert!(tiles(16, 16).take(64).all(|(x, y)| x < 8 && y < 8));
    }
}
