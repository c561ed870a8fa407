//! The binary tree, top-down: binned SAH.

use super::binning::{Bins, Split};
use super::bvh2::{Forest, Node2};
use super::course::{Course, Step};
use super::fragment::{self, CHUNK, Extent, Fragment};
use super::morton::Stretch;
use super::partition::{halve, partition, partition_many};
use crate::bvh::traverse::stack::MAX_DEPTH;
use crate::simd::{Kernel, Tier};

/// Sets this large are built in two parallel halves.
const PARALLEL: usize = 1 << 13;
/// A set of one kind of primitive and of one block at most is a leaf: no split could be cheaper.
const BLOCK: usize = 4;
/// Larger sets are cut by the curve, if there is one.
const BY_CURVE: usize = 32;
/// From here down, splits halve the set: at most 30 more levels, and so never more than [`MAX_DEPTH`].
const MEDIAN_FROM: u32 = MAX_DEPTH - 32;

/// What all subtrees share.
#[derive(Clone, Copy)]
pub struct TopDown<'a> {
    /// Primitives below this are triangles, others spheres.
    pub triangles: u32,
    /// Scales boxes so that their areas neither overflow nor vanish.
    pub scale: f32,
    /// Instruction set; changes nothing but the time.
    pub tier: Tier,
    /// Is told what is done.
    pub course: &'a Course<'a>,
}

impl TopDown<'_> {
    /// Builds the tree over `fragments` (at least one), sorting them into the order of its leaves.
    ///
    /// Without a `curve`, all splits are the cheapest. With one, in whose order the fragments are, sets are cut where
    /// its cells end as long as they are large.
    pub fn build(&self, fragments: &mut [Fragment], curve: Option<Stretch>) -> Vec<Node2> {
        // Where the curve decides, boxes are only known when everything below is done.
        let extent = if curve.is_some() { Extent::EMPTY } else { Extent::of(fragments) };
        self.parallel(fragments, curve, extent, 0).flatten()
    }

    fn parallel(&self, fragments: &mut [Fragment], curve: Option<Stretch>, extent: Extent, depth: u32) -> Forest {
        let count = fragments.len();
        if count < PARALLEL {
            let nodes = self.tier.run(Subtree { builder: self, fragments, curve, extent, depth });
            self.course.add(Step::Binary, count);
            return Forest::Piece(nodes);
        }
        if let Some(curve) = curve {
            let Some(middle) = curve.border() else {
                return self.parallel(fragments, None, Extent::of(fragments), depth);
            };
            let (left, right) = fragments.split_at_mut(middle);
            let (left, right) = rayon::join(
                || self.parallel(left, Some(curve.part(0..middle)), extent, depth + 1),
                || self.parallel(right, Some(curve.part(middle..count)), extent, depth + 1),
            );
            return Forest::join(count, left, right);
        }
        let best = match depth {
            MEDIAN_FROM.. => None,
            _ if count <= CHUNK => Bins::new().best_split(fragments, &extent, self.scale),
            _ => Bins::best_split_of_many(fragments, &extent, self.scale),
        };
        let middle = match &best {
            Some(split) => partition_many(fragments, |fragment| split.is_left(fragment)),
            None => halve(fragments, &extent),
        };
        let (left, right) = fragments.split_at_mut(middle);
        let (left, right) = rayon::join(
            || self.parallel(left, None, half(left, &best, 0), depth + 1),
            || self.parallel(right, None, half(right, &best, 1), depth + 1),
        );
        Forest::join(count, left, right)
    }

    /// Whether all are triangles or all are spheres.
    #[inline(always)]
    fn is_pure(&self, fragments: &[Fragment]) -> bool {
        let spheres = fragments.iter().filter(|fragment| fragment.prim() >= self.triangles).count();
        spheres == 0 || spheres == fragments.len()
    }
}

/// The extent of the fragments on one side of a split.
#[inline(always)]
fn half(fragments: &[Fragment], split: &Option<Split>, side: usize) -> Extent {
    match split {
        Some(split) => Extent { bounds: split.bounds[side], centers: fragment::centers(fragments) },
        None => Extent::of(fragments),
    }
}

/// As [`half`], on this thread.
#[inline(always)]
fn half_here(fragments: &[Fragment], split: &Option<Split>, side: usize) -> Extent {
    let bounds = match split {
        Some(split) => split.bounds[side],
        None => fragment::bounds(fragments),
    };
    Extent { bounds, centers: fragment::centers_of_chunk(fragments) }
}

/// A subtree that one thread builds.
struct Subtree<'a> {
    builder: &'a TopDown<'a>,
    fragments: &'a mut [Fragment],
    curve: Option<Stretch<'a>>,
    extent: Extent,
    depth: u32,
}

/// Fragments that still need a node.
#[derive(Clone, Copy)]
struct Job {
    first: usize,
    count: usize,
    extent: Extent,
    depth: u32,
    /// Whether the curve decides; the extent is not known then.
    by_curve: bool,
    /// The node whose right child this will be; of left children, nothing needs to be noted.
    right_of: Option<usize>,
}

impl Kernel for Subtree<'_> {
    type Output = Vec<Node2>;

    #[inline(always)]
    fn run(self) -> Vec<Node2> {
        let Subtree { builder, fragments, curve, extent, depth } = self;
        let mut nodes: Vec<Node2> = Vec::with_capacity(fragments.len());
        let mut bins = Bins::new();
        // Right children wait here until their sibling is done: one a level.
        let mut waiting = Vec::with_capacity(MAX_DEPTH as usize);
        let by_curve = curve.is_some();
        let mut next = Some(Job { first: 0, count: fragments.len(), extent, depth, by_curve, right_of: None });
        while let Some(mut job) = next {
            let index = nodes.len();
            if let Some(parent) = job.right_of {
                nodes[parent].set_right(index - parent);
            }
            let rows = job.first..job.first + job.count;
            if job.by_curve {
                let curve = curve.filter(|_| job.count > BY_CURVE).map(|curve| curve.part(rows.clone()));
                if let Some(middle) = curve.and_then(|curve| curve.border()) {
                    nodes.push(Node2::leaf(&job.extent.bounds, job.count));
                    let (depth, right_of) = (job.depth + 1, Some(index));
                    waiting.push(Job { first: job.first + middle, count: job.count - middle, depth, right_of, ..job });
                    next = Some(Job { count: middle, depth, right_of: None, ..job });
                    continue;
                }
                job.extent = half_here(&fragments[rows.clone()], &None, 0);
                job.by_curve = false;
            }
            nodes.push(Node2::leaf(&job.extent.bounds, job.count));
            let fragments = &mut fragments[rows];
            let small = job.count <= BLOCK;
            if small && builder.is_pure(fragments) {
                next = waiting.pop();
                continue;
            }
            let split = match small || job.depth >= MEDIAN_FROM {
                true => None,
                false => bins.best_split(fragments, &job.extent, builder.scale),
            };
            let middle = match &split {
                Some(split) => partition(fragments, |fragment| split.is_left(fragment)),
                None if small => partition(fragments, |fragment| fragment.prim() < builder.triangles),
                None => halve(fragments, &job.extent),
            };
            let (left, right) = fragments.split_at(middle);
            waiting.push(Job {
                first: job.first + middle,
                count: right.len(),
                extent: half_here(right, &split, 1),
                depth: job.depth + 1,
                by_curve: false,
                right_of: Some(index),
            });
            next = Some(Job {
                count: left.len(),
                extent: half_here(left, &split, 0),
                depth: job.depth + 1,
                right_of: None,
                ..job
            });
        }
        if curve.is_some() {
            for index in (0..nodes.len()).rev() {
                if let Some((left, right)) = nodes[index].children(index) {
                    let (left, right) = (nodes[left], nodes[right]);
                    nodes[index].refit(&left, &right);
                }
            }
        }
        nodes.shrink_to_fit();
        nodes
    }
}
