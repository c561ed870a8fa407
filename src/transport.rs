//! The estimator: what each vertex of a path adds, and with which weight. Pure functions that the stages and the
//! reference integrator share; written over [`Lanes`] where the stages use them four at a time.
//!
//! The path integral is summed by bounce. Bounce `b` is light that was scattered `b` times on its way from a light to the
//! camera; vertex `d` of a path (0 is what the camera sees) shows bounce `d` by its emission and estimates bounce `d + 1` by
//! direct light.

use crate::bvh::ray::Hit;
use crate::light::{Light, LightSample};
use crate::material::diffuse;
use crate::options::{Direct, Integrator, RenderOptions, Roulette};
use crate::sampling::lanes::{Lanes, V3};
use crate::sampling::random::Dimensions;
use crate::sampling::warp;
use crate::scene::Scene;
use crate::scene::shapes::NO_LIGHT;
use crate::scene::surface;
use glam::Vec3;
use std::f32::consts::PI;

/// Scenes with more lights than this draw lights by power instead of asking each of them.
pub const MOST_LIGHTS_EACH: usize = 16;

/// Options and lights, resolved to what the estimator needs.
#[derive(Clone, Debug)]
pub struct Transport {
    /// First bounce that counts.
    pub min_bounce: u32,
    /// Last bounce that counts.
    pub max_bounce: u32,
    /// How direct light is estimated.
    pub direct: Direct,
    /// When paths end early.
    pub roulette: Roulette,
    /// Where random numbers belong.
    pub dimensions: Dimensions,
    /// Shadow rays a vertex.
    pub shadow_samples: u32,
    /// Rays for each light; `None` if lights are drawn by power.
    pub samples_per_light: Option<u32>,
    /// Running sums of the lights' powers as fractions, for drawing by power.
    power_cdf: Vec<f32>,
    /// Expected number of samples of each light: multiplies its density.
    pub rates: Vec<f32>,
}

impl Transport {
    /// Resolves `options` for the lights of a scene. Integrators that simulate no light get bounces 0 to 0.
    pub fn new(options: &RenderOptions, lights: &[Light]) -> Transport {
        let (min_bounce, max_bounce) = options.integrator.bounces(options.max_depth).unwrap_or((0, 0));
        let each = lights.len() <= MOST_LIGHTS_EACH;
        let asked = options.light_samples * lights.len().min(MOST_LIGHTS_EACH) as u32;
        let shadow_samples = if options.direct == Direct::Bsdf { 0 } else { asked };
        let total: f64 = lights.iter().map(|l| f64::from(l.power())).sum();
        let fraction = |light: &Light| {
            if total > 0.0 { f64::from(light.power()) / total } else { 1.0 / lights.len() as f64 }
        };
        let mut sum = 0.0;
        let power_cdf = lights
            .iter()
            .map(|l| {
                sum += fraction(l);
                sum as f32
            })
            .collect();
        let rate = |light: &Light| {
            if each { options.light_samples as f32 } else { (f64::from(shadow_samples) * fraction(light)) as f32 }
        };
        Transport {
            min_bounce,
            max_bounce,
            direct: options.direct,
            roulette: options.roulette,
            dimensions: Dimensions { light_samples: shadow_samples },
            shadow_samples,
            samples_per_light: each.then_some(options.light_samples),
            power_cdf,
            rates: lights.iter().map(rate).collect(),
        }
    }

    /// Whether emission found at vertex `depth` counts: always for the camera's own view, later only where
    /// continuing rays take part in the estimate of direct light.
    pub fn counts_emission(&self, depth: u32) -> bool {
        let found_by_rays = depth == 0 || matches!(self.direct, Direct::Bsdf | Direct::Mis);
        found_by_rays && (self.min_bounce..=self.max_bounce).contains(&depth)
    }

    /// Whether shadow rays leave vertex `depth`.
    pub fn counts_direct(&self, depth: u32) -> bool {
        self.shadow_samples > 0 && (self.min_bounce..=self.max_bounce).contains(&(depth + 1))
    }

    /// Whether paths go on from vertex `depth`.
    pub fn continues(&self, depth: u32) -> bool {
        let last = match self.direct {
            // The continuing ray itself finds the light of the next bounce.
            Direct::Bsdf | Direct::Mis => depth + 1,
            Direct::Light | Direct::Hemisphere => depth + 2,
        };
        last <= self.max_bounce
    }

    /// Whether light and continuing rays share the estimate of direct light.
    pub fn mis(&self) -> bool {
        self.direct == Direct::Mis
    }

    /// The light that shadow sample `k` asks: fixed, or drawn by the number `u`.
    #[inline(always)]
    pub fn light_of(&self, k: u32, u: f32) -> usize {
        match self.samples_per_light {
            Some(per_light) => (k / per_light) as usize,
            None => self.power_cdf.partition_point(|&sum| sum <= u).min(self.power_cdf.len() - 1),
        }
    }

    /// Probability that a path goes on from vertex `depth` with throughput `beta`.
    #[inline(always)]
    pub fn survival(&self, depth: u32, beta: V3<f32>) -> f32 {
        match self.roulette {
            Roulette::Fixed(p) if depth >= 1 => p,
            Roulette::Throughput { start } if depth >= start => beta.max_component().min(0.95),
            _ => 1.0,
        }
    }
}

/// Whether an integrator simulates light.
pub fn simulates_light(integrator: Integrator) -> bool {
    integrator.bounces(1).is_some()
}

/// A vertex that scatters light: what the path carries to it, and the surface there.
#[derive(Clone, Copy, Debug)]
pub struct Vertex<F> {
    /// Throughput of the path up to here.
    pub beta: V3<F>,
    /// Albedo.
    pub albedo: V3<F>,
    /// Unit shading normal, on the side of the arriving ray.
    pub normal: V3<F>,
    /// Unit geometric normal, on the same side.
    pub geometric: V3<F>,
}

/// A light as the estimator sees it.
#[derive(Clone, Copy, Debug)]
pub struct Sampled<F> {
    /// Emitted radiance.
    pub radiance: V3<F>,
    /// Expected number of samples of it at each vertex.
    pub rate: F,
}

/// What a light sample adds if nothing is in its way: β·f·cos θ·L / density, times the MIS weight; zero where the surface or the
/// light faces away.
#[inline(always)]
pub fn light_contribution<F: Lanes>(at: Vertex<F>, light: Sampled<F>, sample: LightSample<F>, mis: bool) -> V3<F> {
    let zero = F::splat(0.0);
    let cos = sample.direction.dot(at.normal);
    let density = sample.pdf * light.rate;
    let reaches = cos.gt(zero) & sample.direction.dot(at.geometric).gt(zero) & density.gt(zero);
    let weight = if mis { warp::power_heuristic(density, diffuse::pdf(cos)) } else { F::splat(1.0) };
    let value = at.beta.times(diffuse::evaluate(at.albedo)).times(light.radiance) * (cos / density * weight);
    V3::select(reaches, value, V3::new(zero, zero, zero))
}

/// A uniform direction over the hemisphere and what multiplies the emission it finds, for one of `count` samples.
#[inline(always)]
pub fn hemisphere_sample<F: Lanes>(at: Vertex<F>, [u, v]: [F; 2], count: u32) -> (V3<F>, V3<F>) {
    let zero = F::splat(0.0);
    let local = warp::uniform_hemisphere(u, v);
    let direction = warp::to_world(local, at.normal);
    let value = at.beta.times(diffuse::evaluate(at.albedo)) * (local.z * F::splat(2.0 * PI / count as f32));
    let above = direction.dot(at.geometric).gt(zero) & local.z.gt(zero);
    (direction, V3::select(above, value, V3::new(zero, zero, zero)))
}

/// Emission towards a ray: the light that was hit and the cosine at it; `None` for surfaces that do not emit, or not on this side.
#[inline(always)]
pub fn emission<'a>(
    scene: &'a Scene,
    hit: &Hit,
    origin: V3<f32>,
    direction: V3<f32>,
) -> Option<(usize, &'a Light, f32)> {
    let geometry = scene.shapes.geometries.get(hit.geom as usize)?;
    if geometry.light == NO_LIGHT {
        return None;
    }
    let outward = outward_normal(scene, hit, origin, direction);
    let cos = -outward.dot(direction);
    let id = geometry.light as usize;
    (cos > 0.0).then(|| (id, &scene.lights[id], cos))
}

/// Unit normal of the front side at a hit: by winding for triangles, outwards for spheres.
#[inline(always)]
pub fn outward_normal(scene: &Scene, hit: &Hit, origin: V3<f32>, direction: V3<f32>) -> V3<f32> {
    let shapes = &scene.shapes;
    match shapes.spheres.get((hit.prim as usize).wrapping_sub(shapes.triangles.len())) {
        Some(sphere) => (origin + direction * hit.t - sphere.center.into()).normalize(),
        None => surface::triangle_normal(shapes.corners(hit.prim).map(V3::from)),
    }
}

/// MIS weight of emission found by a ray drawn with density `pdf` at `origin`, the light being sampled at rate `rate` there too.
#[inline(always)]
pub fn emission_weight(light: &Light, rate: f32, origin: V3<f32>, distance: f32, cos_light: f32, pdf: f32) -> f32 {
    warp::power_heuristic(pdf, light.pdf(origin, distance, cos_light) * rate)
}

/// The surface at a hit, of whichever kind: the scalar twin of the batch in `stages/shade`.
pub fn surface_at(scene: &Scene, hit: &Hit, origin: V3<f32>, direction: V3<f32>) -> surface::SurfacePoint<f32> {
    let shapes = &scene.shapes;
    match shapes.spheres.get((hit.prim as usize).wrapping_sub(shapes.triangles.len())) {
        Some(s) => surface::on_sphere(s.center.into(), s.radius, origin + direction * hit.t, direction),
        None => {
            let mut point = surface::on_triangle(shapes.corners(hit.prim).map(V3::from), hit.u, hit.v, direction);
            if !shapes.normals.is_empty() {
                let normals = shapes.triangles[hit.prim as usize].map(|i| V3::from(shapes.normals[i as usize]));
                point.normal = surface::shading_normal(normals, hit.u, hit.v, point.geometric);
            }
            point
        }
    }
}

/// Normal as a colour: (n + 1) / 2.
#[inline(always)]
pub fn normal_color(normal: V3<f32>) -> Vec3 {
    Vec3::from(normal) * 0.5 + Vec3::splat(0.5)
}
