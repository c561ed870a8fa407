//! The blocks of a leaf against one ray.

use crate::bvh::closest::Closest;
use crate::bvh::columns::TraversalCounts;
use crate::bvh::intersect::{Crossing, Intersect};
use crate::bvh::ray::{Hit, MISS, Ray};
use crate::bvh::sphere;
use crate::bvh::sphere4::Sphere4;
use crate::bvh::tri4::Tri4;
use crate::simd::wide::{Quad, Wide, Words};

/// Calls `hit` with the lanes of a block of triangles that the ray crosses, until it answers true, and tells whether it did.
#[inline(always)]
fn crossings<I: Intersect>(ray: &[Words; 2], block: &Tri4, mut hit: impl FnMut(usize, Crossing) -> bool) -> bool {
    let mut rest = Quad.bits(I::candidates(Quad, |_| ray, |_| block));
    while rest != 0 {
        // The mask spares a bounds check.
        let lane = rest.trailing_zeros() as usize & 3;
        rest &= rest - 1;
        if I::crossing(ray, block, lane).is_some_and(|crossing| hit(lane, crossing)) {
            return true;
        }
    }
    false
}

/// Offers the hits of a ray in a block of triangles.
#[inline(always)]
pub fn test_triangles<I: Intersect>(ray: &mut [Words; 2], block: &Tri4, closest: &mut Closest) {
    crossings::<I>(ray, block, |lane, Crossing { t, u, v }| {
        closest.offer(Hit { t, u, v, prim: block.prim[lane], geom: block.geom[lane] });
        false
    });
    ray[1][3] = closest.t_max().to_bits();
}

/// Whether a ray hits a block of triangles up to `t_max`.
#[inline(always)]
pub fn hits_triangles<I: Intersect>(ray: &[Words; 2], block: &Tri4, t_min: f32, t_max: f32) -> bool {
    crossings::<I>(ray, block, |_, crossing| crossing.t > t_min && crossing.t <= t_max)
}

/// Offers the hits of a ray in a block of spheres. Out of line, to keep the loop over triangles small.
#[inline(never)]
pub fn test_spheres(ray: &Ray, block: &Sphere4, closest: &mut Closest) {
    for lane in (0..4).filter(|&lane| block.prim[lane] != MISS) {
        if let Some(t) = sphere::intersect(ray, block.center(lane), block.radius[lane], closest.t_max()) {
            closest.offer(Hit { t, u: 0.0, v: 0.0, prim: block.prim[lane], geom: block.geom[lane] });
        }
    }
}

/// Whether a ray hits a block of spheres up to `t_max`.
#[inline(never)]
pub fn hits_spheres(ray: &Ray, block: &Sphere4, t_max: f32) -> bool {
    let hits = |lane| sphere::intersect(ray, block.center(lane), block.radius[lane], t_max).is_some();
    (0..4).any(|lane| block.prim[lane] != MISS && hits(lane))
}

/// Counts one leaf block.
#[inline(always)]
pub fn count_block(counts: &mut TraversalCounts, prims: &[u32; 4]) {
    counts.leaf_visits += 1;
    counts.primitive_tests += prims.iter().filter(|&&prim| prim != MISS).count() as u64;
}
