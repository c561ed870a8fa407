//! Lambertian reflection: f = albedo / π, on whichever side the light arrives.

use crate::sampling::lanes::{Lanes, V3};
use crate::sampling::warp;
use std::f32::consts::PI;

/// A direction drawn by [`sample`].
#[derive(Clone, Copy, Debug)]
pub struct Sample<F> {
    /// Unit direction, world space.
    pub direction: V3<F>,
    /// Solid-angle density.
    pub pdf: F,
    /// What multiplies the throughput: f·cos θ / pdf, which is the albedo.
    pub weight: V3<F>,
}

/// The BSDF.
#[inline(always)]
pub fn evaluate<F: Lanes>(albedo: V3<F>) -> V3<F> {
    albedo * F::splat(1.0 / PI)
}

/// Solid-angle density of [`sample`] for a direction at cosine `cos_theta` to the shading normal.
#[inline(always)]
pub fn pdf<F: Lanes>(cos_theta: F) -> F {
    warp::cosine_hemisphere_pdf(cos_theta)
}

/// A cosine-weighted direction around `normal`; its weight is zero where it would pass below the
/// surface whose unit geometric normal (same side as `normal`) is `geometric`.
#[inline(always)]
pub fn sample<F: Lanes>(albedo: V3<F>, normal: V3<F>, geometric: V3<F>, u: F, v: F) -> Sample<F> {
    let local = warp::cosine_hemisphere(u, v);
    let direction = warp::to_world(local, normal);
    let zero = F::splat(0.0);
    let above = direction.dot(geometric).gt(zero) & local.z.gt(zero);
    let nothing = V3::new(zero, zero, zero);
    Sample { direction, pdf: pdf(local.z), weight: V3::select(above, albedo, nothing) }
}
