//! The blocks of a leaf against a ray.

use crate::bvh::closest::Closest;
use crate::bvh::columns::TraversalCounts;
use crate::bvh::ray::{Hit, MISS, Ray};
use crate::bvh::sphere4::Sphere4;
use crate::bvh::tri4::Tri4;
use crate::bvh::triangle::ShearedRay;
use crate::bvh::{sphere, triangle};

/// Offers the hits of a ray in a block of triangles.
#[inline(always)]
pub fn test_triangles(ray: &ShearedRay, block: &Tri4, closest: &mut Closest) {
    let candidates = triangle::block(ray, block);
    let mut rest = candidates.mask;
    if rest == 0 {
        return;
    }
    let lanes = candidates.lanes();
    while rest != 0 {
        // The mask spares a bounds check.
        let lane = rest.trailing_zeros() as usize & 3;
        rest &= rest - 1;
        if let Some(crossing) = lanes.crossing(ray, lane) {
            let (prim, geom) = (block.prim[lane], block.geom[lane]);
            closest.offer(Hit { t: crossing.t, u: crossing.u, v: crossing.v, prim, geom });
        }
    }
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

/// Counts one leaf block.
#[inline(always)]
pub fn count_block(counts: &mut TraversalCounts, prims: &[u32; 4]) {
    counts.leaf_visits += 1;
    counts.primitive_tests += prims.iter().filter(|&&prim| prim != MISS).count() as u64;
}

/// Whether a ray hits a block of triangles up to `t_max`.
#[inline(always)]
pub fn hits_triangles(ray: &ShearedRay, block: &Tri4, t_max: f32) -> bool {
    let candidates = triangle::block(ray, block);
    let mut rest = candidates.mask;
    if rest == 0 {
        return false;
    }
    let lanes = candidates.lanes();
    while rest != 0 {
        // The mask spares a bounds check.
        let lane = rest.trailing_zeros() as usize & 3;
        rest &= rest - 1;
        if lanes.crossing(ray, lane).is_some_and(|crossing| crossing.t > 0.0 && crossing.t <= t_max) {
            return true;
        }
    }
    false
}

/// Whether a ray hits a block of spheres up to `t_max`.
#[inline(never)]
pub fn hits_spheres(ray: &Ray, block: &Sphere4, t_max: f32) -> bool {
    let hits = |lane| sphere::intersect(ray, block.center(lane), block.radius[lane], t_max).is_some();
    (0..4).any(|lane| block.prim[lane] != MISS && hits(lane))
}
