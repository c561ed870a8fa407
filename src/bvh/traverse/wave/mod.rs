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
//!
//! Since then the tops of stacks go along with the steps, candidates are bits of words, and rays go from registers to their slots: 1877 instead of 2024
//! (rays of 256 × 256 pixels). With AVX-512, where one port moves lanes and is busy all the time, that alone gave a twentieth. The whole, with grids around trees and nodes of
//! eight for any hit, Mray/s on lucy100k beside its lamps: D 4.58 → 6.34, D2 5.25 → 7.19, S 4.77 → 7.78.
//!
//! Tried without gain there: counting the children met by one `popcnt` a ray (5.75 instead of 6.12 Mray/s of D), quads to memory by way of one store of all (5.79 instead of
//! 6.20), fetching what comes next in a loop of its own behind the nodes, which is too late (5.47 instead of 5.87).

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
use queue::{Steps, Which};
use setup::{AT_ONCE, prepare};
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
    let widened = ANY && N::WIDENED && !tree.wide.is_empty();
    let mut slots = [Slot::IDLE; IN_FLIGHT];
    let mut next_row = 0;
    let (mut nodes, mut leaves) = (Steps::NONE, Steps::NONE);
    let (mut done, mut spheres) = (Steps::NONE, Steps::NONE);
    let (mut at_nodes, mut at_leaves) = (0, 0);
    let mut idle: [u8; IN_FLIGHT] = std::array::from_fn(|slot| slot as u8);
    let mut idles = IN_FLIGHT;
    loop {
        while next_row < rays.len() && idles >= AT_ONCE {
            let (prepared, suits) = prepare::<W, N, I>(wide, &tree.frame, &rays, next_row);
            for (ray, prepared) in prepared.iter().enumerate() {
                let row = next_row + ray;
                if row >= rays.len() {
                    break;
                }
                if suits >> ray & 1 == 1 {
                    idles -= 1;
                    let slot = idle[idles % IN_FLIGHT] as usize;
                    let top = slots[slot % IN_FLIGHT].launch(row as u32, prepared);
                    nodes.push(&mut at_nodes, slot, top, Child::ROOT);
                } else {
                    finish(row, alone::<N, I, ANY, COUNT>(tree, &rays.ray(row), &mut counts));
                }
            }
            next_row += AT_ONCE;
        }
        let in_flight = IN_FLIGHT - idles;
        if in_flight == 0 {
            return counts;
        }
        // Nodes, until half of the rays wait for something else.
        loop {
            if COUNT {
                count_nodes::<W, N>(&mut counts, tree, nodes.children(0..at_nodes), widened);
            }
            if widened {
                nodes::visit_widened(wide, tree, &mut nodes, at_nodes, &mut slots);
            } else {
                nodes::visit::<W, N, ANY>(wide, tree, &mut nodes, at_nodes, &mut slots);
            }
            at_nodes = nodes.part(wide, at_nodes, Which::AtLeaves, &mut leaves, &mut at_leaves);
            if 2 * at_nodes <= in_flight {
                break;
            }
        }
        // Of those that wait for leaves, some are done.
        let mut at_done = 0;
        let mut at_blocks = leaves.part(wide, at_leaves, Which::Done, &mut done, &mut at_done);
        for step in 0..at_done.min(IN_FLIGHT) {
            let slot = done.slot(step);
            finish(slots[slot].row as usize, slots[slot].hit());
            idle[idles % IN_FLIGHT] = slot as u8;
            idles += 1;
        }
        let mut at_spheres = 0;
        if SPHERES {
            at_blocks = leaves.part(wide, at_blocks, Which::AtSpheres, &mut spheres, &mut at_spheres);
        }
        for child in leaves.children(0..at_blocks) {
            // What was fetched when the ray came to the leaf is its first line, or two.
            let block = Address::of(tree.triangles, child.first_block());
            prefetch_line(block.plus(64));
            if size_of::<B>() > 128 {
                prefetch_line(block.plus(128));
            }
        }
        if COUNT {
            count_vectors(&mut counts.primitive_lanes, at_blocks, W::RAYS);
            // Spheres are tested one by one, a block's four at most.
            count_vectors(&mut counts.primitive_lanes, at_spheres, 1);
            for child in leaves.children(0..at_blocks) {
                count_block(&mut counts, tree.triangles[child.first_block()].prims(), 1);
            }
            for child in spheres.children(0..at_spheres) {
                count_block(&mut counts, &tree.spheres[child.first_block()].prim, 1);
            }
        }
        let candidates = leaves::visit::<W, I>(wide, tree.triangles, &mut leaves, at_blocks, &mut slots);
        candidates.each(|step, lane| {
            let block = &tree.triangles[leaves.child(step).first_block()];
            let slot = &mut slots[leaves.slot(step)];
            let top = candidates::settle::<I, ANY>(block, lane, slot, leaves.top(step));
            leaves.set_top(step, top);
        });
        // What each visits next.
        for step in 0..at_blocks.min(IN_FLIGHT) {
            let child = slots[leaves.slot(step)].child(leaves.top(step));
            fetch(tree, child, widened);
            leaves.set_child(step, child);
        }
        at_leaves = leaves.part(wide, at_blocks, Which::AtNodes, &mut nodes, &mut at_nodes);
        if SPHERES {
            spheres.leave_blocks(at_spheres, |slot, top, rest| slots[slot].set_child(top, rest));
            for step in 0..at_spheres.min(IN_FLIGHT) {
                let (slot, block) = (&mut slots[spheres.slot(step)], &tree.spheres[spheres.child(step).first_block()]);
                let top = spheres::visit::<ANY>(block, &rays.ray(slot.row as usize), slot, spheres.top(step));
                let child = slot.child(top);
                fetch(tree, child, widened);
                spheres.set_top(step, top);
                spheres.set_child(step, child);
            }
            let left = spheres.part(wide, at_spheres, Which::AtNodes, &mut nodes, &mut at_nodes);
            spheres.part(wide, left, Which::All, &mut leaves, &mut at_leaves);
        }
    }
}

/// Counts nodes that are visited.
fn count_nodes<W: Wide, N: Node>(
    counts: &mut TraversalCounts,
    tree: &Tree<'_, N, impl TriangleBlock>,
    children: impl ExactSizeIterator<Item = Child>,
    widened: bool,
) {
    let len = children.len();
    for child in children {
        if widened {
            counts.node_visits += 1;
            counts.box_lanes.active += tree.wide[child.node()].count() as u64;
        } else {
            count_node(counts, &tree.nodes[child.node()]);
        }
    }
    // A vector has the children of one node, or of as many as it has quads.
    let (quads, to_a_vector) = if widened { (2 * len, 2) } else { (len, W::RAYS) };
    count_vectors(&mut counts.box_lanes, quads, to_a_vector);
}

/// Fetches what a ray visits next: now, so that it is there when all others have taken their turns.
#[inline(always)]
fn fetch<N: Node>(tree: &Tree<'_, N, impl TriangleBlock>, child: Child, widened: bool) {
    // Both addresses, so that the choice is no branch. (Leaves of spheres fetch in vain.)
    let node = if widened { Address::of(tree.wide, child.node()) } else { Address::of(tree.nodes, child.node()) };
    let leaf = Address::of(tree.triangles, child.first_block());
    let next = if child.is_leaf() { leaf } else { node };
    prefetch_line(next);
    if size_of::<N>() > 64 || widened {
        prefetch_line(next.plus(64));
    }
}
