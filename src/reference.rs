//! The depth-first path tracer: one path at a time, from the camera to its end.
//!
//! It is the oracle (same random numbers, same pure functions, so the same picture to the bit) and the control that waves
//! must beat. It shares the scene, its acceleration structure and the pure functions of `sampling`, `material`, `light`
//! and `transport`, and nothing of waves, stages or plans.

use crate::bvh::ray::{Hit, Ray};
use crate::bvh::{Accel, SingleRay};
use crate::error::Result;
use crate::film::develop::develop;
use crate::film::picture::Picture;
use crate::film::tile::{FilmLayout, Sample, Tile, tiles};
use crate::material::diffuse;
use crate::options::{Cell, Direct, Integrator, RenderOptions};
use crate::sampling::lanes::V3;
use crate::sampling::random::{Dimensions, uniform4};
use crate::scene::Scene;
use crate::scene::camera::{Camera, Lens};
use crate::scene::surface::SurfacePoint;
use crate::simd::{Kernel, Tier};
use crate::transport::{self, Sampled, Transport, Vertex};
use glam::Vec3;
use rayon::prelude::*;

/// Rays that were traced, by kind.
pub use crate::drive::RayCounts;

/// A picture and what it took.
#[derive(Clone, Debug)]
pub struct Reference {
    /// All layers.
    pub picture: Picture,
    /// Rays by kind.
    pub rays: RayCounts,
}

/// Renders `scene` depth first, on the threads of the rayon pool that it is called in.
///
/// # Errors
/// A cell that is not part of the frame is not checked here: [`crate::plan::Plan`] does.
pub fn render(scene: &Scene, accel: &Accel, camera: &Camera, options: &RenderOptions) -> Result<Reference> {
    let whole = Cell { x: 0, y: 0, width: options.width, height: options.height };
    let cell = options.cell.unwrap_or(whole);
    let layout = FilmLayout::new(options);
    let tracer = Tracer {
        scene,
        accel,
        options,
        lens: camera.lens(options.width, options.height),
        transport: Transport::new(options, &scene.lights),
    };
    let mut film = tiles(cell, layout);
    // The control runs on the waves' instruction set: what it is measured for is the order of work alone.
    let tier = Tier::detect(options.simd)?;
    let rays = film.par_iter_mut().map(|tile| tier.run(TileKernel { tracer: &tracer, tile })).reduce(
        RayCounts::default,
        |a, b| RayCounts { camera: a.camera + b.camera, bounce: a.bounce + b.bounce, shadow: a.shadow + b.shadow },
    );
    Ok(Reference { picture: develop(&film, cell, (options.width, options.height)), rays })
}

struct TileKernel<'a> {
    tracer: &'a Tracer<'a>,
    tile: &'a mut Tile,
}

impl Kernel for TileKernel<'_> {
    type Output = RayCounts;

    #[inline(always)]
    fn run(self) -> RayCounts {
        self.tracer.render_tile(self.tile)
    }
}

/// Queries and their numbers.
struct Rays<'a> {
    single: SingleRay<'a>,
    counts: RayCounts,
}

struct Tracer<'a> {
    scene: &'a Scene,
    accel: &'a Accel,
    options: &'a RenderOptions,
    lens: Lens,
    transport: Transport,
}

/// A path under way.
struct Path {
    pixel: u32,
    index: u32,
    origin: V3<f32>,
    direction: V3<f32>,
    beta: V3<f32>,
    /// Density with which `direction` was drawn.
    pdf: f32,
    radiance: V3<f32>,
}

impl Tracer<'_> {
    /// All samples of a tile's pixels, one after another.
    #[inline(always)]
    fn render_tile(&self, tile: &mut Tile) -> RayCounts {
        let mut rays = Rays { single: self.accel.single(), counts: RayCounts::default() };
        let batch = self.options.adaptive.map_or(self.options.samples, |a| a.batch);
        let mut first = 0;
        while first < self.options.samples && !tile.active.is_empty() {
            let end = first.saturating_add(batch).min(self.options.samples);
            for local in tile.active.clone() {
                let local = local as usize;
                for index in first..end {
                    let sample = self.sample(tile.x[local], tile.y[local], index, &mut rays);
                    tile.add(local, &sample);
                }
            }
            if let Some(rule) = &self.options.adaptive {
                tile.retire(rule);
            }
            first = end;
        }
        rays.counts
    }

    /// One sample of a pixel.
    #[inline(always)]
    fn sample(&self, x: u32, y: u32, index: u32, rays: &mut Rays) -> Sample {
        let pixel = y * self.options.width + x;
        let [u, v, ..] = uniform4(pixel, index, Dimensions::CAMERA, self.options.seed);
        let zero = V3::new(0.0, 0.0, 0.0);
        let mut path = Path {
            pixel,
            index,
            origin: self.lens.origin.into(),
            direction: self.lens.direction(x as f32 + u, y as f32 + v),
            beta: V3::new(1.0, 1.0, 1.0),
            pdf: 0.0,
            radiance: zero,
        };
        let mut sample = Sample { depth: f32::INFINITY, ..Sample::default() };
        rays.counts.camera += 1;
        if self.options.integrator == Integrator::BvhCost {
            let visits = rays.single.cost(&ray(path.origin, path.direction, f32::INFINITY));
            sample.radiance = [visits as f32; 3];
            return sample;
        }
        for depth in 0.. {
            if !self.vertex(depth, &mut path, &mut sample, rays) {
                break;
            }
        }
        if transport::simulates_light(self.options.integrator) {
            sample.radiance = [path.radiance.x, path.radiance.y, path.radiance.z];
        }
        sample
    }

    /// Traces the path's ray and shades what it hits; `true` if the path goes on.
    #[inline(always)]
    fn vertex(&self, depth: u32, path: &mut Path, sample: &mut Sample, rays: &mut Rays) -> bool {
        let (scene, transport) = (self.scene, &self.transport);
        let hit = rays.single.closest_hit(&ray(path.origin, path.direction, f32::INFINITY));
        if !hit.is_some() {
            return false;
        }
        let material = scene.materials[scene.shapes.geometries[hit.geom as usize].material as usize];
        let surface = transport::surface_at(scene, &hit, path.origin, path.direction);
        if depth == 0 {
            sample.albedo = material.albedo.to_array();
            sample.normal = Vec3::from(surface.normal).to_array();
            sample.depth = hit.t;
            if self.options.integrator == Integrator::Normals {
                sample.radiance = transport::normal_color(surface.normal).to_array();
            }
        }
        if !transport::simulates_light(self.options.integrator) {
            return false;
        }
        if transport.counts_emission(depth) {
            path.radiance = path.radiance + self.emitted(depth, path, &hit);
        }
        if material.albedo == Vec3::ZERO {
            return false;
        }
        let albedo = V3::from(material.albedo);
        if transport.counts_direct(depth) {
            for k in 0..transport.shadow_samples {
                self.direct(depth, k, path, &surface, albedo, rays);
            }
        }
        transport.continues(depth) && self.scatter(depth, path, &surface, albedo, rays)
    }

    /// Emission that the path has found.
    #[inline(always)]
    fn emitted(&self, depth: u32, path: &Path, hit: &Hit) -> V3<f32> {
        let Some((id, light, cos)) = transport::emission(self.scene, hit, path.origin, path.direction) else {
            return V3::new(0.0, 0.0, 0.0);
        };
        let weight = if depth > 0 && self.transport.mis() {
            let rate = self.transport.rates[id];
            transport::emission_weight(light, rate, path.origin, hit.t, cos, path.pdf)
        } else {
            1.0
        };
        path.beta.times(light.radiance.into()) * weight
    }

    /// Direct-light sample `k`.
    #[inline(always)]
    fn direct(&self, depth: u32, k: u32, path: &mut Path, at: &SurfacePoint<f32>, albedo: V3<f32>, rays: &mut Rays) {
        let (scene, transport) = (self.scene, &self.transport);
        let random = uniform4(path.pixel, path.index, transport.dimensions.light(depth, k), self.options.seed);
        let vertex = Vertex { beta: path.beta, albedo, normal: at.normal, geometric: at.geometric };
        if transport.direct == Direct::Hemisphere {
            let uv = [random[0], random[1]];
            let (direction, value) = transport::hemisphere_sample(vertex, uv, transport.shadow_samples);
            if is_zero(value) {
                return;
            }
            rays.counts.shadow += 1;
            let hit = rays.single.closest_hit(&ray(at.origin, direction, f32::INFINITY));
            if let Some((_, light, _)) = transport::emission(scene, &hit, at.origin, direction) {
                path.radiance = path.radiance + value.times(light.radiance.into());
            }
            return;
        }
        let id = transport.light_of(k, random[3]);
        let light = &scene.lights[id];
        let found = light.sample(at.origin, [random[0], random[1], random[2]]);
        let sampled = Sampled { radiance: light.radiance.into(), rate: transport.rates[id] };
        let value = transport::light_contribution(vertex, sampled, found, transport.mis());
        if is_zero(value) {
            return;
        }
        rays.counts.shadow += 1;
        if !rays.single.any_hit(&ray(at.origin, found.direction, found.distance)) {
            path.radiance = path.radiance + value;
        }
    }

    /// Draws the continuing ray; `false` if the path ends here.
    #[inline(always)]
    fn scatter(&self, depth: u32, path: &mut Path, at: &SurfacePoint<f32>, albedo: V3<f32>, rays: &mut Rays) -> bool {
        let random = uniform4(path.pixel, path.index, self.transport.dimensions.bounce(depth), self.options.seed);
        let drawn = diffuse::sample(albedo, at.normal, at.geometric, random[0], random[1]);
        let beta = path.beta.times(drawn.weight);
        let survival = self.transport.survival(depth, beta);
        let carries = beta.max_component() > 0.0;
        if !carries || random[2] >= survival {
            return false;
        }
        rays.counts.bounce += 1;
        path.origin = at.origin;
        path.direction = drawn.direction;
        path.beta = beta * (1.0 / survival);
        path.pdf = drawn.pdf;
        true
    }
}

fn ray(origin: V3<f32>, direction: V3<f32>, t_max: f32) -> Ray {
    Ray { origin: origin.into(), direction: direction.into(), t_min: 0.0, t_max }
}

fn is_zero(v: V3<f32>) -> bool {
    v.x == 0.0 && v.y == 0.0 && v.z == 0.0
}
