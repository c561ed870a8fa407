//! The blocks of a leaf against one ray.

use crate::bvh::block::TriangleBlock;
use crate::bvh::child::Child;
use crate::bvh::closest::Closest;
use crate::bvh::columns::TraversalCounts;
use crate::bvh::intersect::{Crossing, Intersect};
use crate::bvh::node::Node;
use crate::bvh::ray::{Hit, MISS, Ray};
use crate::bvh::sphere;
use crate::bvh::sphere4::Sphere4;
use crate::measure::lanes::Lanes;
use crate::simd::wide::{Quad, Wide, Words};

/// Calls `hit` with the lanes of a block of triangles that the ray crosses, until it answers true, and tells whether it did.
#[inline(always)]
fn crossings<I: Intersect>(
    ray: &[Words; 2],
    block: &impl TriangleBlock,
    mut hit: impl FnMut(usize, Crossing) -> bool,
) -> bool {
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
pub fn test_triangles<I: Intersect>(ray: &mut [Words; 2], block: &impl TriangleBlock, closest: &mut Closest) {
    crossings::<I>(ray, block, |lane, Crossing { t, u, v }| {
        closest.offer(Hit { t, u, v, prim: block.prims()[lane], geom: block.geom(lane) });
        false
    });
    ray[1][3] = closest.t_max().to_bits();
}

/// Whether a ray hits a block of triangles up to `t_max`.
#[inline(always)]
pub fn hits_triangles<I: Intersect>(ray: &[Words; 2], block: &impl TriangleBlock, t_min: f32, t_max: f32) -> bool {
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

/// Counts a node of which the children are tested.
pub fn count_node<N: Node>(counts: &mut TraversalCounts, node: &N) {
    counts.node_visits += 1;
    counts.box_lanes.active +=
        node.children().iter().filter(|&&child| Child::from_bits(child) != Child::EMPTY).count() as u64;
}

/// Counts a leaf block of which the primitives are tested, each against `rays` rays that visit it together.
pub fn count_block(counts: &mut TraversalCounts, prims: &[u32; 4], rays: u32) {
    let tests = u64::from(rays) * prims.iter().filter(|&&prim| prim != MISS).count() as u64;
    counts.leaf_visits += 1;
    counts.primitive_tests += tests;
    counts.primitive_lanes.active += tests;
}

/// Counts the vectors that `quads` nodes or blocks take, so many to a vector.
pub fn count_vectors(lanes: &mut Lanes, quads: usize, to_a_vector: usize) {
    let vectors = quads.div_ceil(to_a_vector) as u64;
    lanes.reached += vectors;
    lanes.total += vectors * 4 * to_a_vector as u64;
}
