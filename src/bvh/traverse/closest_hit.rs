//! The closest hit of one ray.

use glam::Vec4;

use super::slab::SlabRay;
use super::stack::{Entry, Stack};
use crate::bvh::Bvh4;
use crate::bvh::child::Child;
use crate::bvh::closest::Closest;
use crate::bvh::columns::TraversalCounts;
use crate::bvh::node4::Node4;
use crate::bvh::ray::{Hit, MISS, Ray};
use crate::bvh::sphere4::Sphere4;
use crate::bvh::tri4::Tri4;
use crate::bvh::triangle::ShearedRay;
use crate::bvh::{sphere, triangle};

/// Traverses nearest child first. `SPHERES`: the tree holds some. `COUNT`: fill in `counts`.
#[inline(always)]
pub fn closest_hit<const SPHERES: bool, const COUNT: bool>(
    bvh: &Bvh4,
    ray: &Ray,
    stack: &mut Stack,
    counts: &mut TraversalCounts,
) -> Hit {
    if !ray.is_traceable() || bvh.nodes.is_empty() {
        return Hit::NONE;
    }
    let slabs = SlabRay::new(ray);
    let sheared = ShearedRay::new(ray);
    let mut closest = Closest::new(ray.t_max);
    let mut child = Child::ROOT;
    stack.clear();
    loop {
        if !child.is_leaf() {
            let node = &bvh.nodes[child.node()];
            if COUNT {
                counts.node_visits += 1;
            }
            let (entry, met) = slabs.enter(node, closest.t_max());
            if met != 0 {
                child = descend(node, entry, met, stack);
                continue;
            }
        } else if SPHERES && child.is_spheres() {
            for block in &bvh.spheres[child.blocks()] {
                if COUNT {
                    count_block(counts, &block.prim);
                }
                test_spheres(ray, block, &mut closest);
            }
        } else {
            for block in &bvh.triangles[child.blocks()] {
                if COUNT {
                    count_block(counts, &block.prim);
                }
                test_triangles(&sheared, block, &mut closest);
            }
        }
        child = loop {
            let Some(entry) = stack.pop() else {
                return closest.hit();
            };
            // Equal distances may still win by primitive, so they are visited.
            if entry.distance() <= closest.t_max() {
                break entry.child();
            }
        };
    }
}

/// Pushes the children that the ray meets, farthest first, and gives the nearest.
#[inline(always)]
fn descend(node: &Node4, entry: Vec4, met: u32, stack: &mut Stack) -> Child {
    let distances = entry.to_array();
    let mut rest = met;
    let mut next = || {
        // The mask spares a bounds check.
        let lane = rest.trailing_zeros() as usize & 3;
        rest &= rest - 1;
        Entry::new(distances[lane], node.children[lane])
    };
    let order = |a: Entry, b: Entry| (a.min(b), a.max(b));
    match met.count_ones() {
        1 => next().child(),
        2 => {
            let (a, b) = order(next(), next());
            stack.push(b);
            a.child()
        }
        3 => {
            let (a, b) = order(next(), next());
            let (b, c) = order(b, next());
            let (a, b) = order(a, b);
            stack.push(c);
            stack.push(b);
            a.child()
        }
        _ => {
            let (a, b) = order(next(), next());
            let (c, d) = order(next(), next());
            let (a, c) = order(a, c);
            let (b, d) = order(b, d);
            let (b, c) = order(b, c);
            stack.push(d);
            stack.push(c);
            stack.push(b);
            a.child()
        }
    }
}

#[inline(always)]
fn test_triangles(ray: &ShearedRay, block: &Tri4, closest: &mut Closest) {
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

/// Out of line, to keep the loop over triangles small.
#[inline(never)]
fn test_spheres(ray: &Ray, block: &Sphere4, closest: &mut Closest) {
    for lane in 0..4 {
        if let Some(t) = sphere::intersect(ray, block.center(lane), block.radius[lane], closest.t_max()) {
            closest.offer(Hit { t, u: 0.0, v: 0.0, prim: block.prim[lane], geom: block.geom[lane] });
        }
    }
}

/// Counts one leaf block.
#[inline(always)]
pub(super) fn count_block(counts: &mut TraversalCounts, prims: &[u32; 4]) {
    counts.leaf_visits += 1;
    counts.primitive_tests += prims.iter().filter(|&&prim| prim != MISS).count() as u64;
}
