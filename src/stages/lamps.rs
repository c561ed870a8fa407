//! # lamps: the light that the camera sees directly
//!
//! | | |
//! |---|---|
//! | reads | `sample.pixel/index/r/g/b` |
//! | writes | `sample.r/g/b` |
//! | consumes | the samples of a wave |
//! | produces | the emission that their pixels show |
//! | cost | for samples of pixels in which a light may be seen, so many camera rays |
//!
//! A lamp is much brighter than what it lights, so a pixel that its edge crosses has more noise than a thousand others. All that a camera ray
//! must know there is whether it meets the lamp: many of them cost less than one path. Emission at the first
//! vertex is theirs then, and paths leave it out.

use super::aim::aim;
use super::{Context, Stage};
use crate::bvh::{Accel, HitColumnsMut, Query, RayColumns, TraversalCounts};
use crate::sampling::random::Dimensions;
use crate::sampling::v3::V3;
use crate::simd::Kernel;
use crate::transport::emission;
use crate::wave::features::Features;
use crate::wave::samples::Samples;
use bumpalo::Bump;

/// Its facts.
pub const STAGE: Stage = Stage {
    name: "lamps",
    reads: &[
        ("sample.pixel", Features::ALWAYS),
        ("sample.index", Features::ALWAYS),
        ("sample.r", Features::ALWAYS),
        ("sample.g", Features::ALWAYS),
        ("sample.b", Features::ALWAYS),
    ],
    writes: &[("sample.r", Features::ALWAYS), ("sample.g", Features::ALWAYS), ("sample.b", Features::ALWAYS)],
    requires: Features::LAMPS,
};

/// Rays that are traced at once.
const ROWS: usize = 2048;

/// Adds to the first `n` samples what lights show in their pixels; returns how many rays that took, and what they visited.
pub fn run(context: &Context, n: usize, samples: &mut Samples, scratch: &Bump) -> (usize, TraversalCounts) {
    let width = context.width;
    let queue = scratch.alloc_slice_fill_copy(n, 0u32);
    let mut len = 0;
    for (slot, &pixel) in samples.pixel[..n].iter().enumerate() {
        queue[len] = slot as u32;
        len += usize::from(context.in_view.has(pixel % width, pixel / width));
    }
    let rays = context.lamp_rays as usize;
    let column = || scratch.alloc_slice_fill_copy(ROWS, 0.0f32);
    let number = || scratch.alloc_slice_fill_copy(ROWS, 0u32);
    let [slot, pixel, index, prim, geom] = std::array::from_fn(|_| number());
    let [dx, dy, dz, t, u, v] = std::array::from_fn(|_| column());
    let origin = [context.lens.origin.x, context.lens.origin.y, context.lens.origin.z];
    let [ox, oy, oz] = origin.map(|coordinate| &*scratch.alloc_slice_fill_copy(ROWS, coordinate));
    let trace = if context.counts { Accel::closest_hits_counted } else { Accel::closest_hits };
    let way = context.accel.suited(Query::Closest, true);
    let mut counts = TraversalCounts::default();
    let mut all = queue[..len].iter().flat_map(|&slot| (0..rays as u32).map(move |ray| (slot, ray)));
    loop {
        let mut rows = 0;
        for (row, (sample, ray)) in all.by_ref().take(ROWS).enumerate() {
            let own = samples.index[sample as usize];
            (slot[row], pixel[row]) = (sample, samples.pixel[sample as usize]);
            index[row] = context.sampler.part(own, context.lamp_rays, ray);
            (dx[row], dy[row]) = ((pixel[row] % width) as f32, (pixel[row] / width) as f32);
            rows = row + 1;
        }
        if rows == 0 {
            return (len * rays, counts);
        }
        context.tier.run(Aim { context, pixel: &pixel[..rows], index: &index[..rows], direction: [dx, dy, dz] });
        let columns = RayColumns { ox, oy, oz, dx, dy, dz, t_min: None, t_max: None, low: None }.rows(0..rows);
        let hits = HitColumnsMut { t, u, v, prim, geom };
        counts += trace(context.accel, way, context.tier, columns, hits);
        for row in 0..rows {
            let hit = crate::bvh::ray::Hit { t: t[row], u: u[row], v: v[row], prim: prim[row], geom: geom[row] };
            let direction = V3::new(dx[row], dy[row], dz[row]);
            if let Some(found) = emission(context.scene, &hit, V3::from(context.lens.origin).into(), direction) {
                let value = found.light.radiance / rays as f32;
                let slot = slot[row] as usize;
                samples.r[slot] += value.x;
                samples.g[slot] += value.y;
                samples.b[slot] += value.z;
            }
        }
    }
}

/// Directions through the pixels of some rows.
struct Aim<'a, 'c> {
    context: &'a Context<'c>,
    pixel: &'a [u32],
    index: &'a [u32],
    direction: [&'a mut [f32]; 3],
}

impl Kernel for Aim<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        aim(self.context, Dimensions::LAMPS, self.pixel, self.index, self.direction);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::ray::Ray;
    use crate::light::in_view::InView;
    use crate::options::{RenderOptions, Sampler};
    use crate::sampling::sampler;
    use crate::stages::tests::Fixture;

    /// The scalar twin: ray after ray, to the bit.
    #[test]
    fn pixels_show_the_mean_of_their_rays() {
        let fixture = Fixture::new();
        for mut context in fixture.contexts() {
            for (rays, replicates) in [(1, 1), (5, 1), (64, 4)] {
                let options = RenderOptions { replicates, sampler: Sampler::Sobol, ..RenderOptions::default() };
                context.sampler = sampler::Sampler::new(&options);
                context.lamp_rays = rays;
                context.in_view = InView::new(context.scene, &context.lens, [32, 24]);
                let n = 32 * 24;
                let mut samples = Samples::allocate(n, Features::ALWAYS);
                for slot in 0..n {
                    (samples.pixel[slot], samples.index[slot]) = (slot as u32, slot as u32 % 3);
                }
                let (traced, _) = run(&context, n, &mut samples, &Bump::new());
                let (mut looked, mut lit) = (0, 0);
                for slot in 0..n {
                    let (pixel, index) = (samples.pixel[slot], samples.index[slot]);
                    let (x, y) = (pixel % 32, pixel / 32);
                    let mut expected = 0.0;
                    for ray in 0..rays {
                        let [u, v, ..] =
                            context.sampler.draw(pixel, context.sampler.part(index, rays, ray), Dimensions::LAMPS);
                        let direction: V3 = context.lens.direction(x as f32 + u, y as f32 + v);
                        let hit = context.accel.single().closest_hit(&Ray::new(context.lens.origin, direction.into()));
                        let origin = V3::from(context.lens.origin).into();
                        let found = emission(context.scene, &hit, origin, direction);
                        expected += found.map_or(0.0, |found| found.light.radiance.x / rays as f32);
                    }
                    assert_eq!(samples.r[slot], expected, "pixel {x}, {y}, {rays} rays");
                    looked += usize::from(context.in_view.has(x, y));
                    lit += usize::from(expected > 0.0);
                }
                assert_eq!(traced, looked * rays as usize);
                assert!(lit > 8 && looked < n / 4, "{lit} lit, {looked} looked at");
            }
        }
    }

    /// Draws of a replicate stay its own, and no two are the same.
    #[test]
    fn parts_of_samples_are_samples_of_their_replicate() {
        let options = RenderOptions { replicates: 8, ..RenderOptions::default() };
        let sampler = sampler::Sampler::new(&options);
        let mut seen = std::collections::HashSet::new();
        for (index, part) in (0..64).flat_map(|index| (0..5).map(move |part| (index, part))) {
            let draw = sampler.part(index, 5, part);
            assert_eq!(draw % 8, index % 8);
            assert!(seen.insert(draw));
        }
        assert_eq!(seen.into_iter().max(), Some(64 * 5 - 1));
    }
}
