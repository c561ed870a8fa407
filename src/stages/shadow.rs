//! # shadow: does direct light arrive?
//!
//! | | |
//! |---|---|
//! | reads | `shadow.*`, `sample.r/g/b` |
//! | writes | `sample.r/g/b` (through `shadow.slot`) |
//! | consumes | one row a shadow ray |
//! | produces | nothing |
//! | cost | 44 bytes read a row, 12 read and written through the slot; nodes and leaves besides |
//!
//! Light sampling asks for any hit before the light. Hemisphere sampling asks for the closest hit and whether it emits.

use super::{Context, Stage};
use crate::sampling::lanes::V3;
use crate::transport::emission;
use crate::wave::features::Features;
use crate::wave::hits::Hits;
use crate::wave::samples::Samples;
use crate::wave::shadows::Shadows;
use bumpalo::Bump;

/// Its facts.
pub const STAGE: Stage = Stage {
    name: "shadow",
    reads: &[
        ("shadow.*", Features::ALWAYS),
        ("shadow_hit.*", Features::HEMISPHERE),
        ("sample.r", Features::ALWAYS),
        ("sample.g", Features::ALWAYS),
        ("sample.b", Features::ALWAYS),
    ],
    writes: &[
        ("sample.r", Features::ALWAYS),
        ("sample.g", Features::ALWAYS),
        ("sample.b", Features::ALWAYS),
        ("shadow_hit.*", Features::HEMISPHERE),
    ],
    requires: Features::SHADOW,
};

/// What it changes.
pub struct Out<'a> {
    /// Radiance is added here.
    pub samples: &'a mut Samples,
    /// Hits of the hemisphere's rays.
    pub hits: &'a mut Hits,
}

/// Settles the first `n` shadow rays.
pub fn run(context: &Context, n: usize, shadows: &Shadows, out: Out, scratch: &Bump) {
    if context.features.has(Features::HEMISPHERE) {
        probe(context, n, shadows, out);
    } else {
        occlude(context, n, shadows, out.samples, scratch);
    }
}

/// Any hit before `t_max`: the light does not arrive.
fn occlude(context: &Context, n: usize, shadows: &Shadows, samples: &mut Samples, scratch: &Bump) {
    let occluded = scratch.alloc_slice_fill_copy(n, false);
    context.accel.any_hits(context.accel.suited(false), context.tier, shadows.rays(n), occluded);
    for (row, &occluded) in occluded.iter().enumerate() {
        if !occluded {
            let slot = shadows.slot[row] as usize;
            samples.r[slot] += shadows.direct_r[row];
            samples.g[slot] += shadows.direct_g[row];
            samples.b[slot] += shadows.direct_b[row];
        }
    }
}

/// Closest hit: whatever it emits arrives.
fn probe(context: &Context, n: usize, shadows: &Shadows, out: Out) {
    let Out { samples, hits } = out;
    context.accel.closest_hits(context.accel.suited(false), context.tier, shadows.rays(n), hits.columns_mut(n));
    for row in 0..n {
        let origin = V3::new(shadows.ox[row], shadows.oy[row], shadows.oz[row]);
        let direction = V3::new(shadows.dx[row], shadows.dy[row], shadows.dz[row]);
        if let Some((_, light, _)) = emission(context.scene, &hits.hit(row), origin, direction) {
            let slot = shadows.slot[row] as usize;
            samples.r[slot] += shadows.direct_r[row] * light.radiance.x;
            samples.g[slot] += shadows.direct_g[row] * light.radiance.y;
            samples.b[slot] += shadows.direct_b[row] * light.radiance.z;
        }
    }
}
