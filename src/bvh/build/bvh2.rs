//! The binary tree, top-down.

use glam::Vec3;

use super::binning::{Bins, Split};
use super::fragment::{Extent, Fragment};
use crate::bvh::aabb::Aabb;
use crate::bvh::traverse::stack::MAX_DEPTH;

/// A node of the binary tree, 32 bytes. Depth-first: the left child of node `i` is `i + 1`.
#[derive(Clone, Copy, Debug)]
pub struct Node2 {
    min: Vec3,
    /// Distance from this node to its right child in the array; 0 for leaves.
    right: u32,
    max: Vec3,
    /// Fragments below. They are consecutive, the left child's first.
    pub count: u32,
}

const _: () = assert!(size_of::<Node2>() == 32);

impl Node2 {
    fn new(extent: &Extent, count: usize) -> Node2 {
        let Aabb { min, max } = extent.bounds.aabb();
        Node2 { min, right: 0, max, count: count as u32 }
    }

    /// The box.
    pub fn aabb(&self) -> Aabb {
        Aabb { min: self.min, max: self.max }
    }

    /// The children of this node, which is number `index`; `None` for leaves.
    #[inline(always)]
    pub fn children(&self, index: usize) -> Option<(usize, usize)> {
        (self.right != 0).then(|| (index + 1, index + self.right as usize))
    }
}

/// Sets this large are built in two parallel halves.
const PARALLEL: usize = 1 << 13;
/// A set of one kind of primitive and of one block at most is a leaf: no split could be cheaper.
const BLOCK: usize = 4;
/// From here down, splits halve the set: at most 30 more levels, and so never more than [`MAX_DEPTH`].
const MEDIAN_FROM: u32 = MAX_DEPTH - 32;

/// What all subtrees share.
#[derive(Clone, Copy, Debug)]
pub struct Builder {
    /// Primitives below this are triangles, others spheres.
    pub triangles: u32,
    /// Scales boxes so that their areas neither overflow nor vanish.
    pub scale: f32,
}

impl Builder {
    /// Builds the tree over `fragments` (at least one), sorting them into the order of its leaves.
    pub fn build(&self, fragments: &mut [Fragment]) -> Vec<Node2> {
        let extent = Extent::of(fragments);
        self.parallel(fragments, extent, 0)
    }

    fn parallel(&self, fragments: &mut [Fragment], extent: Extent, depth: u32) -> Vec<Node2> {
        if fragments.len() < PARALLEL {
            let mut nodes = Vec::with_capacity(fragments.len());
            self.serial(fragments, extent, depth, &mut Bins::new(), &mut nodes);
            return nodes;
        }
        let mut nodes = vec![Node2::new(&extent, fragments.len())];
        let middle = self.split(fragments, &extent, depth, &mut Bins::new());
        let (left, right) = fragments.split_at_mut(middle);
        let (left, right) = rayon::join(
            || self.parallel(left, Extent::of(left), depth + 1),
            || self.parallel(right, Extent::of(right), depth + 1),
        );
        nodes[0].right = 1 + left.len() as u32;
        nodes.reserve_exact(left.len() + right.len());
        nodes.extend_from_slice(&left);
        drop(left);
        nodes.extend_from_slice(&right);
        nodes
    }

    /// Recursion is as deep as the tree, and so bounded.
    fn serial(&self, fragments: &mut [Fragment], extent: Extent, depth: u32, bins: &mut Bins, nodes: &mut Vec<Node2>) {
        let index = nodes.len();
        nodes.push(Node2::new(&extent, fragments.len()));
        if fragments.len() <= BLOCK && self.is_pure(fragments) {
            return;
        }
        let middle = self.split(fragments, &extent, depth, bins);
        let (left, right) = fragments.split_at_mut(middle);
        self.serial(left, Extent::of(left), depth + 1, bins, nodes);
        nodes[index].right = (nodes.len() - index) as u32;
        self.serial(right, Extent::of(right), depth + 1, bins, nodes);
    }

    /// Whether all are triangles or all are spheres.
    fn is_pure(&self, fragments: &[Fragment]) -> bool {
        let spheres = fragments.iter().filter(|fragment| fragment.prim >= self.triangles).count();
        spheres == 0 || spheres == fragments.len()
    }

    /// Orders the fragments so that the left child's come first, and says how many they are: neither none nor all.
    fn split(&self, fragments: &mut [Fragment], extent: &Extent, depth: u32, bins: &mut Bins) -> usize {
        if fragments.len() <= BLOCK {
            let triangles = self.triangles;
            return partition(fragments, |fragment| fragment.prim < triangles);
        }
        let split = if depth < MEDIAN_FROM { bins.best_split(fragments, extent, self.scale) } else { None };
        match split {
            Some(split) => partition_by(fragments, &split),
            None => halve(fragments, extent),
        }
    }
}

fn partition_by(fragments: &mut [Fragment], split: &Split) -> usize {
    partition(fragments, |fragment| split.is_left(fragment))
}

/// Moves those for which `is_left` holds to the front, and says how many they are.
#[inline(always)]
fn partition(fragments: &mut [Fragment], is_left: impl Fn(&Fragment) -> bool) -> usize {
    let (mut low, mut high) = (0, fragments.len());
    loop {
        while low < high && is_left(&fragments[low]) {
            low += 1;
        }
        while low < high && !is_left(&fragments[high - 1]) {
            high -= 1;
        }
        if low >= high {
            return low;
        }
        fragments.swap(low, high - 1);
        low += 1;
        high -= 1;
    }
}

/// The median split along the widest axis, in whole blocks; any half will do if all centres coincide.
fn halve(fragments: &mut [Fragment], extent: &Extent) -> usize {
    let middle = fragments.len().div_ceil(2 * BLOCK) * BLOCK;
    let size = extent.centers.max - extent.centers.min;
    let axis = size.truncate().max_position();
    if size[axis] > 0.0 {
        fragments.select_nth_unstable_by(middle, |a, b| {
            a.center()[axis].total_cmp(&b.center()[axis]).then(a.prim.cmp(&b.prim))
        });
    }
    middle
}
