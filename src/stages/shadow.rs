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
use crate::bvh::{Accel, Query, TraversalCounts};
use crate::sampling::v3::V3;
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

/// Settles the first `n` shadow rays, which left vertex `depth`.
pub fn run(context: &Context, depth: u32, n: usize, shadows: &Shadows, out: Out, scratch: &Bump) -> TraversalCounts {
    if context.features.has(Features::HEMISPHERE) {
        probe(context, depth, n, shadows, out)
    } else {
        occlude(context, n, shadows, out.samples, scratch)
    }
}

/// Any hit before `t_max`: the light does not arrive.
fn occlude(context: &Context, n: usize, shadows: &Shadows, samples: &mut Samples, scratch: &Bump) -> TraversalCounts {
    let occluded = scratch.alloc_slice_fill_copy(n, false);
    let trace = if context.counts { Accel::any_hits_counted } else { Accel::any_hits };
    let counts = trace(context.accel, context.accel.suited(Query::Any, false), context.tier, shadows.rays(n), occluded);
    for (row, &occluded) in occluded.iter().enumerate() {
        if !occluded {
            let slot = shadows.slot[row] as usize;
            samples.r[slot] += shadows.direct_r[row];
            samples.g[slot] += shadows.direct_g[row];
            samples.b[slot] += shadows.direct_b[row];
        }
    }
    counts
}

/// Closest hit: whatever it emits arrives.
fn probe(context: &Context, depth: u32, n: usize, shadows: &Shadows, out: Out) -> TraversalCounts {
    let Out { samples, hits } = out;
    let way = context.accel.suited(Query::Closest, false);
    let trace = if context.counts { Accel::closest_hits_counted } else { Accel::closest_hits };
    let counts = trace(context.accel, way, context.tier, shadows.rays(n), hits.columns_mut(n));
    for row in 0..n {
        let direction = V3::new(shadows.dx[row], shadows.dy[row], shadows.dz[row]);
        if let Some(found) = emission(context.scene, &hits.hit(row), shadows.origin(row), direction) {
            let slot = shadows.slot[row] as usize;
            let weight = V3::load([&shadows.direct_r, &shadows.direct_g, &shadows.direct_b], row);
            let value = context.transport.clamped(depth + 1, weight.times(found.light.radiance.into()));
            samples.r[slot] += value.x;
            samples.g[slot] += value.y;
            samples.b[slot] += value.z;
        }
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::tests::Fixture;
    use crate::wave::Wave;

    /// Rays from the middle of the box: up to the lamp, which counts as free until the lamp itself, and down to the floor.
    #[test]
    fn light_arrives_where_nothing_is_in_the_way() {
        let fixture = Fixture::new();
        for context in fixture.contexts() {
            let mut wave = Wave::allocate(16, 1, context.features);
            let hemisphere = context.features.has(Features::HEMISPHERE);
            for (row, (dy, t_max)) in [(1.0, 0.5), (-1.0, 100.0), (1.0, 100.0)].into_iter().enumerate() {
                let s = &mut wave.shadows;
                (s.ox[row], s.oy[row], s.oz[row]) = (0.0, 0.75, -0.9);
                (s.dx[row], s.dy[row], s.dz[row]) = (0.0, dy, 0.0);
                s.t_max[row] = if hemisphere { f32::INFINITY } else { t_max };
                s.slot[row] = row as u32;
                (s.direct_r[row], s.direct_g[row], s.direct_b[row]) = (1.0, 2.0, 3.0);
            }
            let Wave { samples, shadows, shadow_hits, scratch, .. } = &mut wave;
            run(&context, 0, 3, shadows, Out { samples, hits: shadow_hits }, scratch);
            // Above is the ceiling, not the lamp: a hemisphere ray finds nothing there.
            let expected = if hemisphere { [0.0; 3] } else { [2.0, 0.0, 0.0] };
            assert_eq!(samples.g[..3], expected);
        }
    }
}
