//! Whether one ray hits anything: the plain kernel.

use super::leaf::{count_block, count_node, count_vectors, hits_spheres, hits_triangles};
use super::slab::SlabRay;
use super::stack::{Entry, Stack};
use super::{Tree, child_of};
use crate::bvh::block::TriangleBlock;
use crate::bvh::child::Child;
use crate::bvh::columns::TraversalCounts;
use crate::bvh::intersect::Intersect;
use crate::bvh::node::Node;
use crate::bvh::ray::Ray;

/// Traverses the largest child first, as the nodes store them; distances need no sorting.
#[inline(always)]
pub fn any_hit<N: Node, I: Intersect, const SPHERES: bool, const COUNT: bool>(
    tree: &Tree<'_, N, impl TriangleBlock>,
    ray: &Ray,
    stack: &mut Stack,
    counts: &mut TraversalCounts,
) -> bool {
    if !ray.is_traceable() || tree.nodes.is_empty() {
        return false;
    }
    let slabs = SlabRay::new::<N>(&tree.frame, ray);
    let prepared = I::prepare(ray);
    let t_max = ray.t_max.min(f32::MAX);
    let mut child = Child::ROOT;
    stack.clear();
    loop {
        if !child.is_leaf() {
            let node = &tree.nodes[child.node()];
            if COUNT {
                count_node(counts, node);
                count_vectors(&mut counts.box_lanes, 1, 1);
            }
            let met = slabs.enter(node, t_max).1.bitmask();
            if met != 0 {
                let mut rest = met & (met - 1);
                while rest != 0 {
                    let lane = 31 - rest.leading_zeros();
                    rest ^= 1 << lane;
                    stack.push_one(Entry::new(0.0, child_of(node, lane as usize)));
                }
                child = child_of(node, met.trailing_zeros() as usize);
                continue;
            }
        } else if SPHERES && child.is_spheres() {
            for block in &tree.spheres[child.blocks()] {
                if COUNT {
                    count_block(counts, &block.prim, 1);
                    count_vectors(&mut counts.primitive_lanes, 1, 1);
                }
                if hits_spheres(ray, block, t_max) {
                    return true;
                }
            }
        } else {
            for block in &tree.triangles[child.blocks()] {
                if COUNT {
                    count_block(counts, block.prims(), 1);
                    count_vectors(&mut counts.primitive_lanes, 1, 1);
                }
                if hits_triangles::<I>(&prepared, block, ray.t_min.max(0.0), t_max) {
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
