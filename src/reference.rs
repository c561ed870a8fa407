//! The depth-first path tracer: one path at a time, from the camera to its end.
//!
//! It is the oracle (same random numbers, same pure functions, so the same picture to the bit) and the control that waves must beat. It shares
//! the scene, its acceleration structure and the pure functions of `sampling`, `material`, `light` and `transport`, nothing of waves and plans.

use crate::bvh::ray::{Hit, Ray};
use crate::bvh::{Accel, SingleRay};
use crate::error::Result;
use crate::explain::{Event, Witness};
use crate::film::develop::develop;
use crate::film::picture::Picture;
use crate::film::tile::{FilmLayout, Sample, Tile, tiles};
use crate::material::diffuse;
use crate::options::{Direct, Integrator, RenderOptions};
use crate::pilot;
use crate::sampling::random::Dimensions;
use crate::sampling::sampler::Sampler;
use crate::sampling::v3::V3;
use crate::scene::Scene;
use crate::scene::camera::{Camera, Lens};
use crate::scene::origin::Origin;
use crate::scene::surface::SurfacePoint;
use crate::simd::{Kernel, Tier};
use crate::transport::{self, Asked, Left, Transport, Vertex};
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
    let cell = options.rendered();
    let layout = FilmLayout::new(options);
    let tracer = Tracer::new(scene, accel, camera, options);
    let mut film = tiles(cell, layout);
    // The control runs on the waves' instruction set: what it is measured for is the order of work alone.
    let tier = Tier::detect(options.simd)?;
    let rays = film.par_iter_mut().map(|tile| tier.run(TileKernel { tracer: &tracer, tile })).sum();
    Ok(Reference { picture: develop(&film, cell, (options.width, options.height)), rays })
}

/// What renders sample `index` of the pixel at `x`, `y` and notes each step.
pub fn witness<'a>(
    (scene, accel, camera): (&'a Scene, &'a Accel, &'a Camera),
    options: &'a RenderOptions,
) -> impl Fn([u32; 3], &mut Vec<Event>) -> Sample + 'a {
    let tracer = Tracer::new(scene, accel, camera, options);
    move |[x, y, index], witness| {
        tracer.sample(x, y, index, &mut Rays { single: accel.single(), counts: RayCounts::default(), witness })
    }
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

/// Queries, their numbers, and who is told of them.
struct Rays<'a, W> {
    single: SingleRay<'a>,
    counts: RayCounts,
    witness: W,
}

struct Tracer<'a> {
    scene: &'a Scene,
    accel: &'a Accel,
    options: &'a RenderOptions,
    lens: Lens,
    transport: Transport,
    sampler: Sampler,
}

/// A path under way.
struct Path {
    pixel: u32,
    index: u32,
    origin: Origin,
    direction: V3,
    beta: V3,
    /// 1 / δ: what rays must be worth.
    rate: f32,
    /// Density with which `direction` was drawn.
    pdf: f32,
    /// Shading normal of the surface it left.
    normal: V3,
    radiance: V3,
}

impl<'a> Tracer<'a> {
    fn new(scene: &'a Scene, accel: &'a Accel, camera: &Camera, options: &'a RenderOptions) -> Tracer<'a> {
        let lens = camera.lens(options.width, options.height);
        let worth = pilot::measure(scene, accel, camera, options);
        let transport = Transport { worth, reuse: 1, ..Transport::new(options, &scene.lights) };
        Tracer { scene, accel, options, lens, transport, sampler: Sampler::new(options) }
    }

    /// All samples of a tile's pixels, one after another.
    #[inline(always)]
    fn render_tile(&self, tile: &mut Tile) -> RayCounts {
        let mut rays = Rays { single: self.accel.single(), counts: RayCounts::default(), witness: () };
        let mut first = 0;
        while first < self.options.samples && !tile.active.is_empty() {
            let (all, rule) = (self.options.samples, &self.options.adaptive);
            let step = rule.map_or(all, |rule| rule.step(first)).min(all - first);
            for local in tile.active.clone() {
                let local = local as usize;
                let (from, stride, count) = tile.wanted(local, first, step);
                for index in (0..count).map(|k| from + k * stride) {
                    let sample = self.sample(tile.x[local], tile.y[local], index, &mut rays);
                    tile.add(local, index, &sample);
                }
            }
            rule.iter().for_each(|rule| tile.retire(rule));
            first += step;
        }
        rays.counts
    }

    /// One sample of a pixel.
    #[inline(always)]
    fn sample(&self, x: u32, y: u32, index: u32, rays: &mut Rays<impl Witness>) -> Sample {
        let pixel = y * self.options.width + x;
        let [u, v, ..] = self.sampler.draw(pixel, index, Dimensions::CAMERA);
        let mut path = Path {
            pixel,
            index,
            origin: self.lens.origin(self.options.accel.precision),
            direction: self.lens.direction(x as f32 + u, y as f32 + v),
            beta: V3::new(1.0, 1.0, 1.0),
            rate: self.transport.worth.as_ref().map_or(0.0, |worth| worth.rate(x, y)),
            pdf: 0.0,
            normal: V3::new(0.0, 0.0, 0.0),
            radiance: V3::new(0.0, 0.0, 0.0),
        };
        let mut sample = Sample { depth: f32::INFINITY, ..Sample::default() };
        rays.counts.camera += 1;
        if self.options.integrator == Integrator::BvhCost {
            let visits = rays.single.cost(&Ray::leaving(path.origin, path.direction));
            sample.radiance = [visits as f32; 3];
            return sample;
        }
        // Vertex after vertex, until one ends the path.
        (0..).take_while(|&depth| self.vertex(depth, &mut path, &mut sample, rays)).count();
        if transport::simulates_light(self.options.integrator) {
            sample.radiance = [path.radiance.x, path.radiance.y, path.radiance.z];
        }
        sample
    }

    /// Traces the path's ray and shades what it hits; `true` if the path goes on.
    #[inline(always)]
    fn vertex(&self, depth: u32, path: &mut Path, sample: &mut Sample, rays: &mut Rays<impl Witness>) -> bool {
        let (scene, transport) = (self.scene, &self.transport);
        let hit = rays.single.closest_hit(&Ray::leaving(path.origin, path.direction));
        rays.witness.saw(|| Event::Ray { depth, origin: path.origin, direction: path.direction, beta: path.beta, hit });
        if !hit.is_some() {
            return false;
        }
        let material = scene.materials[scene.shapes.geometries[hit.geom as usize].material as usize];
        let surface = transport::surface_at(scene, &hit, path.origin, path.direction);
        rays.witness.saw(|| Event::Surface { at: surface, albedo: material.albedo });
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
            let value = self.emitted(depth, path, &hit);
            rays.witness.saw(|| Event::Emission { value });
            path.radiance = path.radiance + value;
        }
        if material.albedo == Vec3::ZERO {
            return false;
        }
        let albedo = V3::from(material.albedo);
        if transport.counts_direct(depth) {
            for k in 0..transport.shadow_samples {
                self.direct([depth, k], path, &surface, albedo, rays);
            }
        }
        transport.continues(depth) && self.scatter(depth, path, &surface, albedo, rays)
    }

    /// Emission that the path has found.
    #[inline(always)]
    fn emitted(&self, depth: u32, path: &Path, hit: &Hit) -> V3 {
        let Some(found) = transport::emission(self.scene, hit, path.origin, path.direction) else {
            return V3::new(0.0, 0.0, 0.0);
        };
        let left = Left { origin: path.origin, normal: path.normal, pdf: path.pdf };
        let weight = self.transport.emission_weight(depth, &found, left, hit.t);
        self.transport.clamped(depth, path.beta.times(found.light.radiance.into()) * weight)
    }

    /// Direct-light sample `k`.
    #[inline(always)]
    fn direct<W: Witness>(
        &self,
        [depth, k]: [u32; 2],
        path: &mut Path,
        at: &SurfacePoint<Origin>,
        albedo: V3,
        rays: &mut Rays<W>,
    ) {
        let (scene, transport) = (self.scene, &self.transport);
        let place = [path.pixel, path.index, transport.dimensions.light(depth, k)];
        let random = self.sampler.draw(place[0], place[1], place[2]);
        let vertex = Vertex { beta: path.beta, albedo, normal: at.normal, geometric: at.geometric };
        if transport.direct == Direct::Hemisphere {
            let uv = [random[0], random[1]];
            let (direction, value) = transport::hemisphere_sample(vertex, uv, transport.shadow_samples);
            if value.is_zero() {
                return;
            }
            rays.counts.shadow += 1;
            let hit = rays.single.closest_hit(&Ray::leaving(at.origin, direction));
            let light = transport::emission(scene, &hit, at.origin, direction);
            let value = light.map(|found| transport.clamped(depth + 1, value.times(found.light.radiance.into())));
            rays.witness.saw(|| Event::Hemisphere { direction, hit, value });
            path.radiance = value.map_or(path.radiance, |value| path.radiance + value);
            return;
        }
        let Some(Asked { id, light, found }) = transport.ask(&scene.lights, k, random, at.origin, at.normal) else {
            return rays.witness.saw(|| Event::NoLight);
        };
        let value = transport::light_contribution(vertex, light, found, transport.mis());
        if value.is_zero() {
            return rays.witness.saw(|| Event::FacesAway { id });
        }
        let value = transport.by_lot(&self.sampler, place, path.rate, transport.clamped(depth + 1, value));
        if value.is_zero() {
            return rays.witness.saw(|| Event::NotAsked { id });
        }
        rays.counts.shadow += 1;
        let free = !rays.single.any_hit(&Ray { t_max: found.distance, ..Ray::leaving(at.origin, found.direction) });
        rays.witness.saw(|| Event::Light { id, found, value, free });
        if free {
            path.radiance = path.radiance + value;
        }
    }

    /// Draws the continuing ray; `false` if the path ends here.
    #[inline(always)]
    fn scatter<W: Witness>(
        &self,
        depth: u32,
        path: &mut Path,
        at: &SurfacePoint<Origin>,
        albedo: V3,
        rays: &mut Rays<W>,
    ) -> bool {
        let random = self.sampler.draw(path.pixel, path.index, self.transport.dimensions.bounce(depth));
        let drawn = diffuse::sample(albedo, at.normal, at.geometric, random[0], random[1]);
        let beta = path.beta.times(drawn.weight);
        let survival = self.transport.survival(depth, path.rate, beta);
        let in_vain = self.transport.in_vain(depth, at.origin.high, drawn.direction);
        let carries = beta.max_component() > 0.0 && !in_vain;
        rays.witness.saw(|| Event::Bounce { pdf: drawn.pdf, beta, survival, lot: random[2], in_vain });
        if !carries || random[2] >= survival {
            return false;
        }
        rays.counts.bounce += 1;
        path.origin = at.origin;
        path.direction = drawn.direction;
        path.beta = beta * (1.0 / survival);
        path.pdf = drawn.pdf;
        path.normal = at.normal;
        true
    }
}
