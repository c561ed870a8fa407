//! Improving the binary tree: subtrees move to where they make the boxes above them smaller (Meister and Bittner,
//! "Parallel Reinsertion for Bounding Volume Hierarchy Optimization", 2018).
//!
//! In each round, all nodes that take part search the tree, in parallel, for the place that gains most. Then moves are made one
//! after another, the most gainful first, those left out that touch a node of an earlier one.

use rayon::prelude::*;

use super::bvh2::Binary;
use super::course::{Course, Step};
use super::linked::{Linked, NONE};
use crate::simd::{Kernel, Tier};

/// How much to do.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Nodes that take part: those of the largest boxes. Subtrees below them stay as they are.
    pub nodes: usize,
    /// Rounds at most.
    pub rounds: u32,
    /// A round that shrinks the tree by less than this share is the last.
    pub least_gain: f64,
}

/// What pays in every scene: a few large primitives around a mesh, such as the walls of a room, end up in their own part
/// of the tree. In the Cornell box, reinserting all nodes takes the cost of lucy100k from 8.78 to 6.03; of the dragon there,
/// 64 nodes give 8.62, 1024 give 8.58 and all 8.49. Meshes alone gain 0.1 to 1 %.
pub const LITTLE: Effort = Effort { nodes: 1 << 10, rounds: 4, least_gain: 0.01 };
/// What the last percents take.
pub const MUCH: Effort = Effort { nodes: usize::MAX, rounds: 20, least_gain: 0.002 };

/// Nodes that one search looks at, at most. Only where many boxes are the same does any search get that far.
const MOST_STEPS: u32 = 1 << 12;
/// Searches a task.
const CHUNK: usize = 64;

/// Gives a tree of the same leaves and a smaller sum of areas; or the same tree, if the better one would be too deep.
pub fn improve(binary: Binary, effort: &Effort, scale: f32, tier: Tier, course: &Course) -> Binary {
    let mut linked = Linked::of_largest(&binary.nodes, effort.nodes, scale);
    let mut area = linked.area(scale);
    for round in 1..=u64::from(effort.rounds) {
        let candidates: Vec<u32> = (0..linked.len() as u32).collect();
        let mut moves: Vec<Move> = candidates
            .par_chunks(CHUNK)
            .flat_map_iter(|candidates| tier.run(Searches { linked: &linked, candidates, scale }))
            .collect();
        moves.par_sort_unstable_by(|a, b| b.gain.total_cmp(&a.gain).then(a.node.cmp(&b.node)));
        make(&mut linked, &moves);
        course.add_parts(Step::Reinsertion, round - 1..round, effort.rounds.into());
        let new_area = linked.area(scale);
        let gain = area - new_area;
        area = new_area;
        if gain < effort.least_gain * area {
            course.add_parts(Step::Reinsertion, round..effort.rounds.into(), effort.rounds.into());
            break;
        }
    }
    linked.unlink(&binary).unwrap_or(binary)
}

/// A subtree, and the node whose sibling it should become.
#[derive(Clone, Copy, Debug)]
struct Move {
    gain: f32,
    node: u32,
    to: u32,
}

/// Makes moves that do not touch each other. What an earlier one changed above or below does no harm but to the gain,
/// as long as nothing moves below itself.
fn make(linked: &mut Linked, moves: &[Move]) {
    let mut touched = vec![false; linked.len()];
    for &Move { node, to, .. } in moves {
        let around = [node, linked.parent(node), linked.sibling(node), to, linked.parent(to)];
        if around.iter().any(|&n| touched[n as usize]) || linked.is_below(to, node) {
            continue;
        }
        around.into_iter().for_each(|n| touched[n as usize] = true);
        linked.reinsert(node, to);
    }
}

/// The best moves of some nodes.
struct Searches<'a> {
    linked: &'a Linked,
    candidates: &'a [u32],
    scale: f32,
}

impl Kernel for Searches<'_> {
    type Output = Vec<Move>;

    #[inline(always)]
    fn run(self) -> Vec<Move> {
        let Searches { linked, candidates, scale } = self;
        let mut moves = Vec::with_capacity(candidates.len());
        let mut stack = Vec::with_capacity(256);
        for &node in candidates {
            if let Some(found) = search(linked, node, scale, &mut stack) {
                moves.push(found);
            }
        }
        moves
    }
}

/// Branch and bound, from the node's place upwards, and from every ancestor down the other side.
///
/// Gains are what the sum of all areas would lose. Going down, the area that boxes would grow by only adds up, so that
/// the gain so far bounds what can be had below.
#[inline(always)]
fn search(linked: &Linked, node: u32, scale: f32, stack: &mut Vec<(f32, u32)>) -> Option<Move> {
    let own = linked.bounds(node);
    let own_area = own.half_area(scale);
    let parent = linked.parent(node);
    // Children of the root stay: who would be the root?
    if parent == NONE || linked.parent(parent) == NONE {
        return None;
    }
    let old_sibling = linked.sibling(node);
    let mut best = Move { gain: 0.0, node, to: NONE };
    let mut pivot = parent;
    let mut sibling = old_sibling;
    // The box of the pivot without the node, and what is gained up to the pivot by taking the node out.
    let mut rest = linked.bounds(sibling);
    let mut gain = linked.bounds(parent).half_area(scale);
    let mut steps = 0;
    loop {
        stack.push((gain, sibling));
        while let Some((gain, there)) = stack.pop() {
            if gain - own_area <= best.gain || steps >= MOST_STEPS {
                continue;
            }
            steps += 1;
            let bounds = linked.bounds(there);
            let gain_here = gain - bounds.union(own).half_area(scale);
            if gain_here > best.gain && there != old_sibling {
                best = Move { gain: gain_here, node, to: there };
            }
            if let Some([left, right]) = linked.children(there) {
                let gain_below = gain_here + bounds.half_area(scale);
                stack.push((gain_below, left));
                stack.push((gain_below, right));
            }
        }
        let above = linked.parent(pivot);
        if pivot != parent {
            rest = rest.union(linked.bounds(sibling));
            let area = linked.bounds(pivot).half_area(scale);
            gain += area - rest.half_area(scale);
            // Beside the pivot itself; the box around both is the one that the pivot has now.
            if above != NONE && gain - area > best.gain {
                best = Move { gain: gain - area, node, to: pivot };
            }
        }
        if above == NONE {
            break;
        }
        sibling = linked.sibling(pivot);
        pivot = above;
    }
    (best.to != NONE).then_some(best)
}

/// Where [`search`] would move a node.
#[cfg(test)]
pub fn best_move(linked: &Linked, node: u32, scale: f32) -> Option<u32> {
    search(linked, node, scale, &mut Vec::new()).map(|found| found.to)
}
