//! Whether one ray hits anything: the plain kernel.

use super::leaf::{count_block, hits_spheres, hits_triangles};
use super::slab::SlabRay;
use super::stack::{Entry, Stack};
use crate::bvh::Bvh4;
use crate::bvh::child::Child;
use crate::bvh::columns::TraversalCounts;
use crate::bvh::ray::Ray;
use crate::bvh::triangle::ShearedRay;

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
            let met = slabs.enter(node, t_max).1.bitmask();
            if met != 0 {
                let mut rest = met & (met - 1);
                while rest != 0 {
                    let lane = 31 - rest.leading_zeros();
                    rest ^= 1 << lane;
                    stack.push_one(Entry::new(0.0, node.children[lane as usize & 3]));
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
        child = stack.pop().child();
        if child == Child::EMPTY {
            return false;
        }
    }
}
