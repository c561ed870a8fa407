//! The estimator: what each vertex of a path adds, and with which weight. Pure functions that the stages and the
//! reference integrator share, over single numbers, and without branches where stages call them in loops that are to become vectors.
//!
//! The path integral is summed by bounce. Bounce `b` is light that was scattered `b` times on its way from a light to the
//! camera; vertex `d` of a path (0 is what the camera sees) shows bounce `d` by its emission and estimates bounce `d + 1` by
//! direct light.

mod double;
pub mod reuse;

use crate::bvh::ray::Hit;
use crate::light::around::Around;
use crate::light::selection::{Chosen, Selection};
use crate::light::{Light, LightSample};
use crate::material::diffuse;
use crate::options::{Direct, Integrator, LightSampling, Precision, RenderOptions, Roulette};
use crate::sampling::random::Dimensions;
use crate::sampling::sampler::Sampler;
use crate::sampling::v3::V3;
use crate::sampling::warp;
use crate::scene::Scene;
use crate::scene::origin::Origin;
use crate::scene::shapes::NO_LIGHT;
use crate::scene::surface::{self, SurfacePoint};
use crate::worth::{self, Worth};
use glam::Vec3;
use std::f32::consts::PI;

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
    /// What rays must be worth, for roulette by efficiency: [`crate::pilot`] measures it.
    pub worth: Option<Worth>,
    /// The most radiance that a light may add at once from bounce 2 on.
    pub clamp_indirect: f32,
    /// Where random numbers belong.
    pub dimensions: Dimensions,
    /// Shadow rays a vertex.
    pub shadow_samples: u32,
    /// Which lights they ask.
    pub selection: Selection,
    /// How points on lights are drawn.
    pub light_sampling: LightSampling,
    /// Where a ray may find a light, if that is soon said; not in double precision.
    pub around: Option<Around>,
    /// Pixels that share what their second vertices scatter; 1: none do, or no second vertex scatters anything.
    pub reuse: u32,
}

/// What a shadow sample asks.
#[derive(Clone, Copy, Debug)]
pub struct Asked {
    /// Number of the light.
    pub id: usize,
    /// The part of it, as the estimator sees it.
    pub light: Sampled,
    /// A point of that.
    pub found: LightSample,
}

/// Where a ray came from.
#[derive(Clone, Copy, Debug)]
pub struct Left {
    /// Where it starts.
    pub origin: Origin,
    /// Unit shading normal of the surface there. Without meaning unless the estimator looks back.
    pub normal: V3,
    /// Density with which its direction was drawn; without meaning unless that is shared with light samples.
    pub pdf: f32,
}

impl Transport {
    /// Resolves `options` for the lights of a scene. Integrators that simulate no light get bounces 0 to 0.
    pub fn new(options: &RenderOptions, lights: &[Light]) -> Transport {
        let (min_bounce, max_bounce) = options.integrator.bounces(options.max_depth).unwrap_or((0, 0));
        let selection = Selection::new(options, lights);
        let shadow_samples = selection.rays(options, lights);
        let mut transport = Transport {
            min_bounce,
            max_bounce,
            direct: options.direct,
            roulette: options.roulette,
            worth: None,
            clamp_indirect: options.clamp_indirect.unwrap_or(f32::INFINITY),
            dimensions: Dimensions { light_samples: shadow_samples },
            shadow_samples,
            selection,
            light_sampling: options.light_sampling,
            around: Around::new(lights).filter(|_| options.accel.precision == Precision::F32),
            reuse: 1,
        };
        if transport.continues(0) && (transport.counts_direct(1) || transport.continues(1)) {
            transport.reuse = options.reuse;
        }
        transport
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

    /// Where lights are, if a ray that leaves vertex `depth` is for nothing but to find one: the last of a path, which takes part in its last
    /// estimate of direct light.
    #[inline(always)]
    pub fn looks_for_lights(&self, depth: u32) -> Option<&Around> {
        let next = depth + 1;
        self.around.as_ref().filter(|_| !self.counts_direct(next) && !self.continues(next))
    }

    /// Whether a ray that leaves vertex `depth` from `origin` is of no use, as no light is in its way.
    #[inline(always)]
    pub fn in_vain(&self, depth: u32, origin: V3, direction: V3) -> bool {
        self.looks_for_lights(depth).is_some_and(|around| around.misses(origin, direction))
    }

    /// Whether light and continuing rays share the estimate of direct light.
    pub fn mis(&self) -> bool {
        self.direct == Direct::Mis
    }

    /// Whether a continuing ray that finds emission must know the surface that it left: the tree picks by it.
    pub fn looks_back(&self) -> bool {
        self.mis() && matches!(self.selection, Selection::Tree(_))
    }

    /// The light that shadow sample `k` asks at every vertex, and how often, if it is the same.
    #[inline(always)]
    pub fn same_light(&self, k: u32) -> Option<(usize, f32)> {
        match self.selection {
            Selection::Each(each) => Some(((k / each) as usize, each as f32)),
            _ => None,
        }
    }

    /// What shadow sample `k` asks from a point of a surface with unit `normal`; `None` where no light can arrive. The
    /// last two of the vertex's numbers choose the part of a light, the first two a point of it.
    #[inline(always)]
    pub fn ask(&self, lights: &[Light], k: u32, random: [f32; 4], from: Origin, normal: V3) -> Option<Asked> {
        let [u, v, choice @ ..] = random;
        let Chosen { id, part, rate } =
            self.selection.choose(lights, [k, self.shadow_samples], choice, from.high, normal)?;
        let light = &lights[id];
        let found = light.sample(part, from, normal, [u, v], self.light_sampling);
        Some(Asked { id, light: Sampled { radiance: light.radiance.into(), rate }, found })
    }

    /// MIS weight of emission found at vertex `depth`, at `distance` from where the ray left: 1 where light samples have no part in it.
    #[inline(always)]
    pub fn emission_weight(&self, depth: u32, found: &Emission, left: Left, distance: f32) -> f32 {
        if depth == 0 || !self.mis() {
            return 1.0;
        }
        let Emission { id, part, light, cos } = *found;
        let rate = self.selection.rate(light, [id as u32, part], self.shadow_samples, left.origin.high, left.normal);
        let density = light.pdf(part, left.origin, distance, cos, self.light_sampling) * rate;
        warp::power_heuristic(left.pdf, density)
    }

    /// Whether there is a bound on what a light may add after `bounce` bounces.
    pub fn clamps(&self, bounce: u32) -> bool {
        bounce >= 2 && self.clamp_indirect < f32::INFINITY
    }

    /// What a light may add, `value`, after `bounce` bounces. What is not a number stays as it is.
    #[inline(always)]
    pub fn clamped(&self, bounce: u32, value: V3) -> V3 {
        if !self.clamps(bounce) {
            return value;
        }
        let (most, brightest) = (self.clamp_indirect, value.max_component());
        let scale = most / brightest;
        value * if brightest > most { scale } else { 1.0 }
    }

    /// [`worth::thinned`] where roulette is by efficiency, with the lot of the decision at `place`: pixel, sample, dimension.
    #[inline(always)]
    pub fn by_lot(&self, sampler: &Sampler, [pixel, index, dimension]: [u32; 3], rate: f32, value: V3) -> V3 {
        match self.worth {
            Some(_) => worth::thinned(rate, sampler.lot(pixel, index, dimension), value),
            None => value,
        }
    }

    /// Probability that a path goes on from vertex `depth` with throughput `beta`, where 1 / δ is `rate` ([`Worth`]).
    #[inline(always)]
    pub fn survival(&self, depth: u32, rate: f32, beta: V3) -> f32 {
        if self.reuse > 1 && depth == 0 {
            // Second vertices serve all pixels of a block.
            return 1.0;
        }
        match self.roulette {
            Roulette::Efficiency { .. } => {
                self.worth.as_ref().map_or(1.0, |worth| worth.of_path(rate, beta.max_component()))
            }
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
pub struct Vertex {
    /// Throughput of the path up to here.
    pub beta: V3,
    /// Albedo.
    pub albedo: V3,
    /// Unit shading normal, on the side of the arriving ray.
    pub normal: V3,
    /// Unit geometric normal, on the same side.
    pub geometric: V3,
}

/// A light as the estimator sees it.
#[derive(Clone, Copy, Debug)]
pub struct Sampled {
    /// Emitted radiance.
    pub radiance: V3,
    /// Expected number of samples of it at each vertex.
    pub rate: f32,
}

/// What a light sample adds if nothing is in its way: β·f·cos θ·L / density, times the MIS weight; zero where the surface or the
/// light faces away.
#[inline(always)]
pub fn light_contribution(at: Vertex, light: Sampled, sample: LightSample, mis: bool) -> V3 {
    let cos = sample.direction.dot(at.normal);
    let density = sample.pdf * light.rate;
    let reaches = (cos > 0.0) & (sample.direction.dot(at.geometric) > 0.0) & (density > 0.0);
    let weight = if mis { warp::power_heuristic(sample.reckoned * light.rate, diffuse::pdf(cos)) } else { 1.0 };
    let value = at.beta.times(diffuse::evaluate(at.albedo)).times(light.radiance) * (cos / density * weight);
    V3::select(reaches, value, V3::new(0.0, 0.0, 0.0))
}

/// A uniform direction over the hemisphere and what multiplies the emission it finds, for one of `count` samples.
#[inline(always)]
pub fn hemisphere_sample(at: Vertex, [u, v]: [f32; 2], count: u32) -> (V3, V3) {
    let local = warp::uniform_hemisphere(u, v);
    let direction = warp::to_world(local, at.normal);
    let value = at.beta.times(diffuse::evaluate(at.albedo)) * (local.z * (2.0 * PI / count as f32));
    let above = (direction.dot(at.geometric) > 0.0) & (local.z > 0.0);
    (direction, V3::select(above, value, V3::new(0.0, 0.0, 0.0)))
}

/// Emission that a ray has found.
#[derive(Clone, Copy, Debug)]
pub struct Emission<'a> {
    /// Number of the light.
    pub id: usize,
    /// Which part of it.
    pub part: u32,
    /// The light.
    pub light: &'a Light,
    /// Cosine at it.
    pub cos: f32,
}

/// Emission towards a ray; `None` for surfaces that do not emit, or not on this side.
#[inline(always)]
pub fn emission<'a>(scene: &'a Scene, hit: &Hit, origin: Origin, direction: V3) -> Option<Emission<'a>> {
    let geometry = scene.shapes.geometries.get(hit.geom as usize)?;
    if geometry.light == NO_LIGHT {
        return None;
    }
    let outward = outward_normal(scene, hit, origin, direction);
    let cos = -outward.dot(direction);
    let id = geometry.light as usize;
    let light = &scene.lights[id];
    // The two triangles of a parallelogram are one part.
    let part = if light.parts() > 1 { hit.prim - geometry.first_prim } else { 0 };
    (cos > 0.0).then_some(Emission { id, part, light, cos })
}

/// Unit normal of the front side at a hit: by winding for triangles, outwards for spheres.
#[inline(always)]
pub fn outward_normal(scene: &Scene, hit: &Hit, origin: Origin, direction: V3) -> V3 {
    let shapes = &scene.shapes;
    if origin.low.is_some() {
        return double::outward_normal(shapes, hit, origin.wide(), direction.into());
    }
    match shapes.spheres.get((hit.prim as usize).wrapping_sub(shapes.triangles.len())) {
        Some(sphere) => (origin.high + direction * hit.t - sphere.center.into()).normalize(),
        None => surface::triangle_normal(shapes.corners(hit.prim).map(V3::from)),
    }
}

/// The surface at a hit, of whichever kind: the scalar twin of the batch in `stages/shade`.
pub fn surface_at(scene: &Scene, hit: &Hit, origin: Origin, direction: V3) -> SurfacePoint<Origin> {
    let shapes = &scene.shapes;
    if origin.low.is_some() {
        return double::surface_at(shapes, hit, origin.wide(), direction.into());
    }
    let point = match shapes.spheres.get((hit.prim as usize).wrapping_sub(shapes.triangles.len())) {
        Some(s) => surface::on_sphere(s.center.into(), s.radius, origin.high + direction * hit.t, direction),
        None => {
            let mut point = surface::on_triangle(shapes.corners(hit.prim).map(V3::from), hit.u, hit.v, direction);
            if !shapes.normals.is_empty() {
                let normals = shapes.triangles[hit.prim as usize].map(|i| V3::from(shapes.normals[i as usize]));
                point.normal = surface::shading_normal(normals, hit.u, hit.v, point.geometric);
            }
            point
        }
    };
    point.into()
}

/// Normal as a colour: (n + 1) / 2.
#[inline(always)]
pub fn normal_color(normal: V3) -> Vec3 {
    Vec3::from(normal) * 0.5 + Vec3::splat(0.5)
}
