//! Lambertian reflection: f = albedo / π, on whichever side the light arrives.

use crate::sampling::v3::V3;
use crate::sampling::warp;
use std::f32::consts::PI;

/// A direction drawn by [`sample`].
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Unit direction, world space.
    pub direction: V3,
    /// Solid-angle density.
    pub pdf: f32,
    /// What multiplies the throughput: f·cos θ / pdf, which is the albedo.
    pub weight: V3,
}

/// The BSDF.
#[inline(always)]
pub fn evaluate(albedo: V3) -> V3 {
    albedo * (1.0 / PI)
}

/// Solid-angle density of [`sample`] for a direction at cosine `cos_theta` to the shading normal.
#[inline(always)]
pub fn pdf(cos_theta: f32) -> f32 {
    warp::cosine_hemisphere_pdf(cos_theta)
}

/// A cosine-weighted direction around `normal`; its weight is zero where it would pass below the
/// surface whose unit geometric normal (same side as `normal`) is `geometric`.
#[inline(always)]
pub fn sample(albedo: V3, normal: V3, geometric: V3, u: f32, v: f32) -> Sample {
    let local = warp::cosine_hemisphere(u, v);
    let direction = warp::to_world(local, normal);
    let above = (direction.dot(geometric) > 0.0) & (local.z > 0.0);
    let nothing = V3::new(0.0, 0.0, 0.0);
    Sample { direction, pdf: pdf(local.z), weight: V3::select(above, albedo, nothing) }
}
