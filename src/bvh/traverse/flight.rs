//! A ray on its way through the tree, in steps: one node or one leaf at a time.
//!
//! Steps through nodes have no branch that depends on the data: such a branch is mispredicted every other time, and
//! costs more than sorting four children of which one is met.

use glam::{BVec4A, Vec3, Vec4};

use super::leaf::{count_block, test_spheres, test_triangles};
use super::slab::SlabRay;
use super::stack::{Entry, Stack};
use crate::bvh::Bvh4;
use crate::bvh::child::Child;
use crate::bvh::closest::Closest;
use crate::bvh::columns::TraversalCounts;
use crate::bvh::node4::Node4;
use crate::bvh::ray::{Hit, Ray};
use crate::bvh::triangle::ShearedRay;
use crate::simd;

/// A ray and where it is.
///
/// The const parameters of its methods: `ANY`: the first hit found ends it, rather than the closest. `SPHERES`: the
/// tree holds some. `COUNT`: fill in `counts`.
#[derive(Clone, Debug)]
pub struct Flight {
    ray: Ray,
    slabs: SlabRay,
    sheared: ShearedRay,
    closest: Closest,
    child: Child,
    stack: Stack,
}

impl Flight {
    /// No ray yet.
    pub fn new() -> Flight {
        let ray = Ray { origin: Vec3::ZERO, direction: Vec3::Z, t_max: 0.0 };
        Flight {
            ray,
            slabs: SlabRay::new(&ray),
            sheared: ShearedRay::new(&ray),
            closest: Closest::new(ray.t_max),
            child: Child::EMPTY,
            stack: Stack::new(),
        }
    }

    /// Puts a traceable ray at the root.
    #[inline(always)]
    pub fn launch(&mut self, ray: &Ray) {
        self.ray = *ray;
        self.slabs = SlabRay::new(ray);
        self.sheared = ShearedRay::new(ray);
        self.closest = Closest::new(ray.t_max);
        self.child = Child::ROOT;
        self.stack.clear();
    }

    /// The hit so far.
    #[inline(always)]
    pub fn hit(&self) -> Hit {
        self.closest.hit()
    }

    /// What to visit next; [`Child::EMPTY`] when the ray is done.
    #[inline(always)]
    pub fn child(&self) -> Child {
        self.child
    }

    /// Visits the node where the ray is.
    #[inline(always)]
    pub fn visit_node<const ANY: bool, const COUNT: bool>(&mut self, bvh: &Bvh4, counts: &mut TraversalCounts) {
        if COUNT {
            counts.node_visits += 1;
        }
        let node = &bvh.nodes[self.child.node()];
        let (entry, met) = self.slabs.enter(node, self.closest.t_max());
        if ANY {
            // The largest box, which is first, on top.
            let met = met.bitmask();
            for lane in (0..4).rev() {
                self.stack.push_if(node.children[lane], met >> lane & 1 == 1);
            }
        } else {
            self.stack.push(far_to_near(entries(node, entry, met)), met.bitmask().count_ones());
        }
        self.child = self.stack.pop().child();
    }

    /// Visits the leaf where the ray is.
    #[inline(always)]
    pub fn visit_leaf<const ANY: bool, const SPHERES: bool, const COUNT: bool>(
        &mut self,
        bvh: &Bvh4,
        counts: &mut TraversalCounts,
    ) {
        let before = self.closest.t_max();
        if SPHERES && self.child.is_spheres() {
            for block in &bvh.spheres[self.child.blocks()] {
                if COUNT {
                    count_block(counts, &block.prim);
                }
                test_spheres(&self.ray, block, &mut self.closest);
            }
        } else {
            for block in &bvh.triangles[self.child.blocks()] {
                if COUNT {
                    count_block(counts, &block.prim);
                }
                test_triangles(&self.sheared, block, &mut self.closest);
            }
        }
        if ANY {
            if self.closest.hit().is_some() {
                self.child = Child::EMPTY;
                return;
            }
        } else if self.closest.t_max() < before {
            self.stack.cull(self.closest.t_max());
        }
        self.child = self.stack.pop().child();
    }
}

/// The children that the ray meets, and [`Entry::NONE`] for the others.
#[inline(always)]
fn entries(node: &Node4, entry: Vec4, met: BVec4A) -> [Entry; 4] {
    let children = Vec4::from_array(node.children.map(|child| f32::from_bits(child.bits())));
    let only_met = |v: Vec4| Vec4::select(met, v, Vec4::ZERO);
    simd::interleave(only_met(children), only_met(entry)).map(Entry::from_bits)
}

/// Sorts, farthest first: then those that the ray does not meet are last.
#[inline(always)]
fn far_to_near([a, b, c, d]: [Entry; 4]) -> [Entry; 4] {
    let order = |a: Entry, b: Entry| (a.max(b), a.min(b));
    let (a, b) = order(a, b);
    let (c, d) = order(c, d);
    let (a, c) = order(a, c);
    let (b, d) = order(b, d);
    let (b, c) = order(b, c);
    [a, b, c, d]
}
