//! Whether one ray hits anything.

use super::closest_hit::count_block;
use super::slab::SlabRay;
use super::stack::{Entry, Stack};
use crate::bvh::Bvh4;
use crate::bvh::child::Child;
use crate::bvh::columns::TraversalCounts;
use crate::bvh::ray::Ray;
use crate::bvh::sphere4::Sphere4;
use crate::bvh::tri4::Tri4;
use crate::bvh::triangle::ShearedRay;
use crate::bvh::{sphere, triangle};

/// Traverses the largest child first, as the nodes store them; distances need no sorting.
#[inline(always)]
pub fn any_hit<const SPHERES: bool, const COUNT: bool>(
    bvh: &Bvh4,
    ray: &Ray,
    stack: &mut Stack,
    counts: &mut TraversalCounts,
) -> bool {
    if !ray.is_traceable() || bvh.nodes.is_empty() {
        return false;
    }
    let slabs = SlabRay::new(ray);
    let sheared = ShearedRay::new(ray);
    let t_max = ray.t_max.min(f32::MAX);
    let mut child = Child::ROOT;
    stack.clear();
    loop {
        if !child.is_leaf() {
            let node = &bvh.nodes[child.node()];
            if COUNT {
                counts.node_visits += 1;
            }
            let (_, met) = slabs.enter(node, t_max);
            if met != 0 {
                let mut rest = met & (met - 1);
                while rest != 0 {
                    let lane = 31 - rest.leading_zeros();
                    rest ^= 1 << lane;
                    stack.push(Entry::new(0.0, node.children[lane as usize & 3]));
                }
                child = node.children[met.trailing_zeros() as usize & 3];
                continue;
            }
        } else if SPHERES && child.is_spheres() {
            for block in &bvh.spheres[child.blocks()] {
                if COUNT {
                    count_block(counts, &block.prim);
                }
                if hits_spheres(ray, block, t_max) {
                    return true;
                }
            }
        } else {
            for block in &bvh.triangles[child.blocks()] {
                if COUNT {
                    count_block(counts, &block.prim);
                }
                if hits_triangles(&sheared, block, t_max) {
                    return true;
                }
            }
        }
        let Some(entry) = stack.pop() else {
            return false;
        };
        child = entry.child();
    }
}

#[inline(always)]
fn hits_triangles(ray: &ShearedRay, block: &Tri4, t_max: f32) -> bool {
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

/// Out of line, to keep the loop over triangles small.
#[inline(never)]
fn hits_spheres(ray: &Ray, block: &Sphere4, t_max: f32) -> bool {
    (0..4).any(|lane| sphere::intersect(ray, block.center(lane), block.radius[lane], t_max).is_some())
}
