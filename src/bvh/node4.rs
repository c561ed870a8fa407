//! The inner node of the four-wide tree.

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};

use super::aabb::Aabb;
use super::child::Child;

/// Four children and their boxes: two cache lines.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct Node4 {
    /// `planes[0]` the low, `planes[1]` the high planes of the boxes; then the axis; then the child.
    pub planes: [[Vec4; 3]; 2],
    /// What the boxes hold, largest box first; empty slots last.
    pub children: [Child; 4],
    /// Room for what later kernels keep here.
    spare: [u32; 4],
}

const _: () = assert!(size_of::<Node4>() == 128);

impl Node4 {
    /// A node of up to four children. The boxes of empty slots lie at infinity, where no ray arrives.
    pub fn new(children: &[(Child, Aabb)]) -> Node4 {
        let mut node = Node4 { planes: [[Vec4::INFINITY; 3]; 2], children: [Child::EMPTY; 4], spare: [0; 4] };
        for (lane, &(child, aabb)) in children.iter().enumerate() {
            node.children[lane] = child;
            for axis in 0..3 {
                node.planes[0][axis][lane] = aabb.min[axis];
                node.planes[1][axis][lane] = aabb.max[axis];
            }
        }
        node
    }

    /// The box of one child.
    pub fn child_box(&self, lane: usize) -> Aabb {
        let corner = |side: usize| Vec3::from_array(std::array::from_fn(|axis| self.planes[side][axis][lane]));
        Aabb { min: corner(0), max: corner(1) }
    }
}
