//! Coherent rays in packets of 64.
//!
//! Neighbours that start and go nearly alike visit nearly the same nodes, so a packet visits each once, with a bit for
//! each ray that does. The intervals of its origins and directions tell for the four children of a node at once which of
//! them no ray can meet and in which order the others come ([`interval`]); these are tested a ray a lane, in those vectors
//! alone of which a ray came this far ([`nodes`]). Leaves are tested as for rays in flight, a block against as many rays
//! as a vector has quads ([`leaves`]): for triangles the size of pixels, of which a packet meets many and each ray few.
//!
//! Rays wait for others of their octant and their main axis ([`super::bins`]). So nothing needs a sign asked in the loop, all rays
//! read the same rows of a block, and rays unlike their neighbours do not make these go alone. Four packets take turns, so
//! that what one reads next is fetched while the others go on.
//!
//! What each step of the way took, camera rays that hit: AVX2 instructions a ray of a picture of 512 × 512 (callgrind), and with
//! AVX-512 million rays a second of one of 1024 × 1024 (on a shared machine, give or take a tenth):
//!
//! | | lucy100k: instructions | Mray/s | dragon: instructions | Mray/s |
//! |---|--:|--:|--:|--:|
//! | in flight | 1607 | 7.5 | 1666 | 7.0 |
//! | packets of as many rays as lanes, triangles a ray a lane | | 5.4 | | 4.1 |
//! | 64 rays, a mask an entry, triangles by quads | | 10.5 | | 7.9 |
//! | children sorted before they are tested | | 11.1 | | 8.3 |
//! | four packets in turn, all children of a vector while its rays are in registers | 853 | 11.2 | 1140 | 8.7 |
//!
//! Shadow rays to a lamp as wide as the scene are no faster than in flight (lucy100k 0.8, dragon 0.65): six of 64 rays meet a
//! node, and an interval that reaches to 0 culls little.
//!
//! Tried without gain: eight packets in turn instead of four. Triangles a ray a lane, with intervals against the boxes of a
//! block's triangles before: finding the boxes took what it saved (packets of eight on lucy100k: 1540 instructions a ray, 1417
//! without).
//!
//! Sixteen packets of 16 rays in flight, without branches, leaves as dense pairs of a ray and a block, and the exact distance once a
//! ray at its end, 16 rays at a time: with AVX-512, Mray/s of camera rays 8.54 instead of 8.39 on lucy100k and 7.70 instead of 7.14 on the
//! dragon, of shadow rays 6.98 instead of 6.86 (packets) and 6.42 instead of 6.05 (in flight), each the best of many turns; with AVX2,
//! 2200 instructions a camera ray instead of 1935. Two to eight per cent on one tier were not worth a second kind of packet. What it
//! showed: of the cycles of a camera ray, nodes take 21 %, leaf tests 30 %, exact crossings 26 %, loading 10 %; of a shadow ray, nodes 43 %,
//! leaf tests 24 %, parting 9 %, setting up 8 %.

mod interval;
mod leaves;
mod nodes;
mod rays;
mod stack;

use super::Tree;
use super::bins::{Bins, RAYS};
use super::leaf::{count_block, count_vectors};
use super::single::alone;
use crate::bvh::block::TriangleBlock;
use crate::bvh::child::Child;
use crate::bvh::columns::{RayColumns, TraversalCounts};
use crate::bvh::intersect::Intersect;
use crate::bvh::node::Node;
use crate::bvh::ray::Hit;
use crate::measure::lanes::Lanes;
use crate::simd::wide::Wide;
use crate::simd::{Address, prefetch_line};
use rays::Packet;

/// Packets that take turns.
const IN_FLIGHT: usize = 4;

/// Traces all rays, and calls `finish` with the row and the hit of each, in no particular order. `ANY`: the first hit found
/// ends a ray, rather than the closest. `SPHERES`: the tree holds some. `COUNT`: count what is visited, once a packet.
#[inline(always)]
pub fn trace<W: Wide, N: Node, I: Intersect, const ANY: bool, const SPHERES: bool, const COUNT: bool>(
    wide: W,
    tree: &Tree<'_, N, impl TriangleBlock>,
    rays: RayColumns<'_>,
    mut finish: impl FnMut(usize, Hit),
) -> TraversalCounts {
    let mut counts = TraversalCounts { rays: rays.len() as u64, ..Default::default() };
    if tree.nodes.is_empty() || rays.is_empty() {
        (0..rays.len()).for_each(|row| finish(row, Hit::NONE));
        return counts;
    }
    let mut bins = Bins::new();
    let mut packets: [Packet; IN_FLIGHT] = std::array::from_fn(|_| Packet::new());
    let mut turn = 0;
    // Turns in a row in which there was nothing to do.
    let mut idle = 0;
    loop {
        let packet = &mut packets[turn % IN_FLIGHT];
        turn += 1;
        if packet.next.0 != Child::EMPTY {
            idle = 0;
            packet.step::<W, N, _, I, ANY, SPHERES, COUNT>(wide, tree, &rays, &mut counts);
            continue;
        }
        for ray in 0..packet.len {
            let row = packet.rows[ray % RAYS] as usize;
            if packet.unsuited >> ray & 1 == 0 {
                finish(row, packet.hit(ray));
            } else {
                finish(row, alone::<N, I, ANY, COUNT>(tree, &rays.ray(row), &mut counts));
            }
        }
        packet.len = 0;
        if let Some((rows, len)) = bins.next::<I>(&rays) {
            packet.load::<W, N, I>(wide, tree, &rays, &rows, len);
        } else {
            idle += 1;
            if idle == IN_FLIGHT {
                return counts;
            }
        }
    }
}

/// Counts the vectors, of a ray a lane, in which any ray of `mask` stands.
fn count_rays<W: Wide>(lanes: &mut Lanes, mask: u64) {
    let width = 4 * W::RAYS;
    let vectors = (0..RAYS).step_by(width).filter(|first| mask >> first & ((1 << width) - 1) != 0).count() as u64;
    *lanes += Lanes { reached: vectors, active: mask.count_ones().into(), total: vectors * width as u64 };
}

impl Packet {
    /// Visits one child, and finds the next. Nearest child first.
    #[inline(always)]
    fn step<
        W: Wide,
        N: Node,
        B: TriangleBlock,
        I: Intersect,
        const ANY: bool,
        const SPHERES: bool,
        const COUNT: bool,
    >(
        &mut self,
        wide: W,
        tree: &Tree<'_, N, B>,
        rays: &RayColumns<'_>,
        counts: &mut TraversalCounts,
    ) {
        let (child, mask) = self.next;
        let mut fresh = 0;
        if !child.is_leaf() {
            if COUNT {
                counts.node_visits += 1;
                count_rays::<W>(&mut counts.box_lanes, mask);
            }
            fresh = self.visit_node(wide, &tree.nodes[child.node()], mask);
        } else if SPHERES && child.is_spheres() {
            for block in &tree.spheres[child.blocks()] {
                if COUNT {
                    count_block(counts, &block.prim, mask.count_ones());
                    count_vectors(&mut counts.primitive_lanes, mask.count_ones() as usize, 1);
                }
                self.visit_spheres::<ANY>(block, rays, mask);
            }
        } else {
            for block in &tree.triangles[child.blocks()] {
                if COUNT {
                    count_block(counts, block.prims(), mask.count_ones());
                    count_vectors(&mut counts.primitive_lanes, mask.count_ones() as usize, W::RAYS);
                }
                self.visit_block::<W, I, ANY>(wide, block, mask);
            }
        }
        let (child, mask) = loop {
            let (entry, mask) = self.stack.pop();
            let child = entry.child();
            if fresh > 0 || child == Child::EMPTY {
                break (child, mask);
            }
            let mask = if ANY { mask & self.alive } else { self.reaching(wide, mask, entry.distance()) };
            if mask != 0 {
                break (child, mask);
            }
        };
        let node = Address::of(tree.nodes, child.node());
        let leaf = Address::of(tree.triangles, child.first_block());
        let next = if child.is_leaf() { leaf } else { node };
        prefetch_line(next);
        prefetch_line(next.plus(64));
        if size_of::<B>() > 128 && child.is_leaf() {
            prefetch_line(next.plus(128));
        }
        self.next = (child, mask);
    }
}
