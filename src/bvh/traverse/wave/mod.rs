//! Many rays in flight at once.
//!
//! A ray alone waits: for the node it is at, for the comparison that says where to go next. With many rays in flight
//! there is always another to step, and what a ray will read next is fetched while the others take their turns
//! (asynchronous memory access chaining: Kocberber, Falsafi and Grot 2015). Rays at nodes and rays at leaves stand in
//! two queues, so that each loop does one kind of work, for as many rays at once as the vectors have quads, and no
//! branch depends on where a ray goes.
//!
//! ```text
//!    launch ─→ nodes ⇄ partition ─→ leaves ─→ candidates ─→ finish
//!                ↑                     │
//!                └───── partition ─────┘
//! ```
//!
//! What each step of the way took, in instructions a first diffuse ray on lucy100k (AVX2, callgrind; one ray alone takes 1527):
//!
//! | | |
//! |---|--:|
//! | a ray after the other in flight, keys and children sorted in general registers | 2643 |
//! | two rays a vector, sorting network, compact nodes, four rays set up at once | 2202 |
//! | lengths of queues in registers, one word a step, one prefetch a node | 2026 |
//! | the ray behind its slot in one line, leaves fetched when their turn comes | 1926 |
//! | rays parted between nodes and leaves a vector at a time | 1783 |
//!
//! Of these a node takes 67 with parting, a leaf block 125, setting up and writing back 140. Dropping candidates that lie beyond
//! the ray's ends ([`crate::bvh::intersect::beyond_ends`]) left 0.21 of 1.23 a ray to be settled one by one. AVX-512 steps four rays with
//! as many instructions as AVX2 two.

mod candidates;
mod leaves;
mod nodes;
mod queue;
mod setup;
mod slot;
mod spheres;

use super::Tree;
use super::leaf::{count_block, count_node, count_vectors};
use super::single::alone;
use crate::bvh::block::TriangleBlock;
use crate::bvh::child::Child;
use crate::bvh::columns::{RayColumns, TraversalCounts};
use crate::bvh::intersect::Intersect;
use crate::bvh::node::Node;
use crate::bvh::ray::Hit;
use crate::simd::wide::Wide;
use crate::simd::{Address, prefetch_line};
use leaves::NO_CANDIDATES;
use queue::Steps;
use setup::Setup;
use slot::Slot;

/// Rays in flight.
const IN_FLIGHT: usize = 64;

/// Traces all rays, and calls `finish` with the row and the hit of each, in no particular order. `ANY`: the first hit found
/// ends a ray, rather than the closest. `SPHERES`: the tree holds some. `COUNT`: count what
/// is visited.
#[inline(always)]
pub fn trace<
    W: Wide,
    N: Node,
    B: TriangleBlock,
    I: Intersect,
    const ANY: bool,
    const SPHERES: bool,
    const COUNT: bool,
>(
    wide: W,
    tree: &Tree<'_, N, B>,
    rays: RayColumns<'_>,
    mut finish: impl FnMut(usize, Hit),
) -> TraversalCounts {
    let mut counts = TraversalCounts { rays: rays.len() as u64, ..Default::default() };
    if tree.nodes.is_empty() || rays.is_empty() {
        (0..rays.len()).for_each(|row| finish(row, Hit::NONE));
        return counts;
    }
    let mut slots = [Slot::IDLE; IN_FLIGHT];
    let mut next_row = 0;
    let mut setup = Setup::new::<W, N, I>(wide, &tree.frame, &rays, next_row);
    let (mut nodes, mut leaves) = (Steps::NONE, Steps::NONE);
    let (mut blocks, mut spheres) = (Steps::NONE, Steps::NONE);
    let (mut at_nodes, mut at_leaves) = (0, 0);
    let mut idle: [u8; IN_FLIGHT] = std::array::from_fn(|slot| slot as u8);
    let mut idles = IN_FLIGHT;
    let mut candidates = NO_CANDIDATES;
    loop {
        while next_row < rays.len() && idles > 0 {
            if next_row == setup.end() {
                setup = Setup::new::<W, N, I>(wide, &tree.frame, &rays, next_row);
            }
            if setup.suits(next_row) {
                idles -= 1;
                let slot = idle[idles % IN_FLIGHT] as usize;
                slots[slot % IN_FLIGHT].launch(next_row as u32, setup.ray(next_row));
                nodes.push_if(&mut at_nodes, slot, Child::ROOT, true);
            } else {
                finish(next_row, alone::<N, I, ANY, COUNT>(tree, &rays.ray(next_row), &mut counts));
            }
            next_row += 1;
        }
        let in_flight = IN_FLIGHT - idles;
        if in_flight == 0 {
            return counts;
        }
        // Nodes, until half of the rays wait for something else.
        loop {
            if COUNT {
                (0..at_nodes).for_each(|step| count_node(&mut counts, &tree.nodes[nodes.child(step).node()]));
                count_vectors(&mut counts.box_lanes, at_nodes, W::RAYS);
            }
            nodes::visit::<W, N, ANY>(wide, tree, &mut nodes, at_nodes, &mut slots);
            at_nodes = nodes.part(wide, at_nodes, &mut leaves, &mut at_leaves);
            if 2 * at_nodes <= in_flight {
                break;
            }
        }
        // Of those that wait for leaves, some are done.
        let (mut at_blocks, mut at_spheres, idle_before) = (0, 0, idles);
        for step in 0..at_leaves.min(IN_FLIGHT) {
            let (slot, child) = (leaves.slot(step), leaves.child(step));
            let done = child == Child::EMPTY;
            blocks.push_if(&mut at_blocks, slot, child, !(done || SPHERES && child.is_spheres()));
            // The first line was fetched when the ray came to the leaf.
            let block = Address::of(tree.triangles, child.first_block());
            prefetch_line(block.plus(64));
            if size_of::<B>() > 128 {
                prefetch_line(block.plus(128));
            }
            if SPHERES {
                spheres.push_if(&mut at_spheres, slot, child, !done && child.is_spheres());
            }
            idle[idles % IN_FLIGHT] = slot as u8;
            idles += usize::from(done);
        }
        at_leaves = 0;
        for &slot in &idle[idle_before..idles.min(IN_FLIGHT)] {
            let slot = &slots[slot as usize % IN_FLIGHT];
            finish(slot.row as usize, slot.hit());
        }
        if COUNT {
            count_vectors(&mut counts.primitive_lanes, at_blocks, W::RAYS);
            // Spheres are tested one by one, a block's four at most.
            count_vectors(&mut counts.primitive_lanes, at_spheres, 1);
            for step in 0..at_blocks {
                count_block(&mut counts, tree.triangles[blocks.child(step).first_block()].prims(), 1);
            }
            for step in 0..at_spheres {
                count_block(&mut counts, &tree.spheres[spheres.child(step).first_block()].prim, 1);
            }
        }
        let found = leaves::visit::<W, I>(wide, tree.triangles, &mut blocks, at_blocks, &mut slots, &mut candidates);
        for candidate in &candidates[..found.min(IN_FLIGHT)] {
            candidates::settle::<I, ANY>(tree.triangles, candidate, &mut slots[candidate.slot as usize % IN_FLIGHT]);
        }
        for step in 0..at_blocks.min(IN_FLIGHT) {
            blocks.set_child(step, next(tree, &slots[blocks.slot(step)]));
        }
        at_nodes = blocks.part_to(wide, at_blocks, &mut nodes, at_nodes, &mut leaves, &mut at_leaves);
        if SPHERES {
            for step in 0..at_spheres.min(IN_FLIGHT) {
                let slot = &mut slots[spheres.slot(step)];
                spheres::visit::<ANY>(tree.spheres, spheres.child(step), &rays.ray(slot.row as usize), slot);
                spheres.set_child(step, next(tree, slot));
            }
            at_nodes = spheres.part_to(wide, at_spheres, &mut nodes, at_nodes, &mut leaves, &mut at_leaves);
        }
    }
}

/// What the ray in a slot visits next. Fetches it.
#[inline(always)]
fn next<N: Node>(tree: &Tree<'_, N, impl TriangleBlock>, slot: &Slot) -> Child {
    let child = slot.next();
    // Both addresses, so that the choice is no branch. (Leaves of spheres fetch in vain.)
    let node = Address::of(tree.nodes, child.node());
    let leaf = Address::of(tree.triangles, child.first_block());
    prefetch_line(if child.is_leaf() { leaf } else { node });
    if size_of::<N>() > 64 {
        prefetch_line(if child.is_leaf() { leaf } else { node.plus(64) });
    }
    child
}
