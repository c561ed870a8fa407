//! The closest hit of one ray: the plain kernel. Camera rays, whose neighbours take the same way, and trees that fit the
//! second-level cache are traced by it; it is also what many rays in flight are measured against.

use glam::Vec4;

use super::leaf::{count_block, count_node, count_vectors, test_spheres, test_triangles};
use super::slab::SlabRay;
use super::stack::{Entry, Stack};
use super::{Tree, child_of};
use crate::bvh::block::TriangleBlock;
use crate::bvh::child::Child;
use crate::bvh::closest::Closest;
use crate::bvh::columns::TraversalCounts;
use crate::bvh::intersect::Intersect;
use crate::bvh::node::Node;
use crate::bvh::ray::{Hit, Ray};

/// Traverses nearest child first. `SPHERES`: the tree holds some. `COUNT`: fill in `counts`.
#[inline(always)]
pub fn closest_hit<N: Node, I: Intersect, const SPHERES: bool, const COUNT: bool>(
    tree: &Tree<'_, N, impl TriangleBlock>,
    ray: &Ray,
    stack: &mut Stack,
    counts: &mut TraversalCounts,
) -> Hit {
    if !ray.is_traceable() || tree.nodes.is_empty() {
        return Hit::NONE;
    }
    let slabs = SlabRay::new::<N>(&tree.frame, ray);
    let mut prepared = I::prepare(ray);
    let mut closest = Closest::new(ray);
    let mut child = Child::ROOT;
    stack.clear();
    loop {
        if !child.is_leaf() {
            let node = &tree.nodes[child.node()];
            if COUNT {
                count_node(counts, node);
                count_vectors(&mut counts.box_lanes, 1, 1);
            }
            let (entry, met) = slabs.enter(node, closest.t_max());
            let met = met.bitmask();
            if met != 0 {
                child = descend(node, entry, met, stack);
                continue;
            }
        } else if SPHERES && child.is_spheres() {
            for block in &tree.spheres[child.blocks()] {
                if COUNT {
                    count_block(counts, &block.prim, 1);
                    count_vectors(&mut counts.primitive_lanes, 1, 1);
                }
                test_spheres(ray, block, &mut closest);
            }
        } else {
            for block in &tree.triangles[child.blocks()] {
                if COUNT {
                    count_block(counts, block.prims(), 1);
                    count_vectors(&mut counts.primitive_lanes, 1, 1);
                }
                test_triangles::<I>(&mut prepared, block, &mut closest);
            }
        }
        child = loop {
            let entry = stack.pop();
            if entry.child() == Child::EMPTY {
                return closest.hit();
            }
            // Equal distances may still win by primitive, so they are visited.
            if entry.distance() <= closest.t_max() {
                break entry.child();
            }
        };
    }
}

/// Pushes the children that the ray meets, farthest first, and gives the nearest.
#[inline(always)]
fn descend<N: Node>(node: &N, entry: Vec4, met: u32, stack: &mut Stack) -> Child {
    let distances = entry.to_array();
    let mut rest = met;
    let mut next = || {
        // The mask spares a bounds check.
        let lane = rest.trailing_zeros() as usize & 3;
        rest &= rest - 1;
        Entry::new(distances[lane], child_of(node, lane))
    };
    let order = |a: Entry, b: Entry| (a.min(b), a.max(b));
    match met.count_ones() {
        1 => next().child(),
        2 => {
            let (a, b) = order(next(), next());
            stack.push_one(b);
            a.child()
        }
        3 => {
            let (a, b) = order(next(), next());
            let (b, c) = order(b, next());
            let (a, b) = order(a, b);
            stack.push_one(c);
            stack.push_one(b);
            a.child()
        }
        _ => {
            let (a, b) = order(next(), next());
            let (c, d) = order(next(), next());
            let (a, c) = order(a, c);
            let (b, d) = order(b, d);
            let (b, c) = order(b, c);
            stack.push_one(d);
            stack.push_one(c);
            stack.push_one(b);
            a.child()
        }
    }
}
