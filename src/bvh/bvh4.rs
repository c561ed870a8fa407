//! The four-wide tree itself. `build` makes it, `traverse` asks it.

use std::hash::{Hash, Hasher};

use super::aabb::Aabb;
use super::child::Child;
use super::node4::Node4;
use super::sphere4::Sphere4;
use super::stats::BvhStats;
use super::tri4::Tri4;
use crate::system::Buffer;

/// A four-wide BVH over triangles and spheres. It owns all it needs.
#[derive(Clone, Debug)]
pub struct Bvh4 {
    /// The root first, then depth-first; none if there are no primitives.
    pub(super) nodes: Buffer<Node4>,
    pub(super) triangles: Buffer<Tri4>,
    pub(super) spheres: Buffer<Sphere4>,
    pub(super) bounds: Aabb,
    pub(super) stats: BvhStats,
}

impl Default for Bvh4 {
    fn default() -> Self {
        Bvh4 {
            nodes: Buffer::default(),
            triangles: Buffer::default(),
            spheres: Buffer::default(),
            bounds: Aabb::EMPTY,
            stats: BvhStats::default(),
        }
    }
}

impl Bvh4 {
    /// The box of all primitives.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Figures.
    pub fn stats(&self) -> BvhStats {
        self.stats
    }

    /// Memory of nodes and blocks.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.triangles[..]) + size_of_val(&self.spheres[..])
    }

    /// The boxes of one level: 0 is the whole scene, 1 the root's children, and so on.
    pub fn boxes_at_depth(&self, depth: u32) -> Vec<Aabb> {
        if self.nodes.is_empty() {
            return Vec::new();
        }
        let mut level = vec![(Child::ROOT, self.bounds)];
        for _ in 0..depth {
            let inner = level.iter().filter(|(child, _)| !child.is_leaf());
            let nodes = inner.map(|(child, _)| &self.nodes[child.node()]);
            let children = nodes.flat_map(|node| (0..4).map(|lane| (node.children[lane], node.child_box(lane))));
            level = children.filter(|(child, _)| *child != Child::EMPTY).collect();
        }
        level.into_iter().map(|(_, aabb)| aabb).collect()
    }

    /// A hash of the whole tree, bit by bit: what tests compare.
    pub fn fingerprint(&self) -> u64 {
        let mut state = std::hash::DefaultHasher::new();
        for node in self.nodes.iter() {
            node.planes.map(|side| side.map(|plane| plane.to_array().map(f32::to_bits))).hash(&mut state);
            node.children.hash(&mut state);
        }
        for block in self.triangles.iter() {
            block.corners.map(|row| row.map(|corner| corner.to_array().map(f32::to_bits))).hash(&mut state);
            (block.prim, block.geom).hash(&mut state);
        }
        for block in self.spheres.iter() {
            (block.center.map(|row| row.map(f32::to_bits)), block.radius.map(f32::to_bits)).hash(&mut state);
            (block.prim, block.geom).hash(&mut state);
        }
        state.finish()
    }
}
