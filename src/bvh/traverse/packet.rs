//! Coherent rays in packets, a ray a lane.
//!
//! Neighbours that start and go nearly alike visit nearly the same nodes, so a packet visits each once. The intervals of
//! its origins and directions tell, for the four children of a node at once, which of them no ray can meet (interval
//! arithmetic, after Boulos, Wald and Shirley, "Geometric and Arithmetic Culling Methods for Entire Ray Packets", 2006);
//! only the others are tested ray by ray. Triangles are tested one after another, each against all rays.
//!
//! Tried: intervals also against the boxes of a block's triangles, before these are tested. Of 4.2 tests a ray 2.9 were left (camera
//! rays that hit lucy100k, packets of eight), and finding the boxes took what that saved: 1540 instructions a ray, 1417
//! without.

use glam::{Vec3, Vec4};

use super::leaf::count_block;
use super::single::trace_one;
use super::stack::{Entry, Stack};
use super::{Tree, child_of};
use crate::bvh::child::Child;
use crate::bvh::closest::closer;
use crate::bvh::columns::{RayColumns, TraversalCounts};
use crate::bvh::intersect::{Intersect, RayLanes};
use crate::bvh::node::{Node, SLACK};
use crate::bvh::ray::{Hit, MISS};
use crate::bvh::rays4::Rays4;
use crate::bvh::sphere;
use crate::simd::wide::{MOST_LANES, Wide, Words};
use crate::simd::{Address, prefetch_line};

/// One component of all rays of a packet.
type Column = [f32; MOST_LANES];

/// Traces all rays, and calls `finish` with the row and the hit of each. `ANY`: the first hit found ends a ray, rather than
/// the closest. `SPHERES`: the tree holds some. `COUNT`: count what is visited, once a packet.
#[inline(always)]
pub fn trace<W: Wide, N: Node, I: Intersect, const ANY: bool, const SPHERES: bool, const COUNT: bool>(
    wide: W,
    tree: &Tree<'_, N>,
    rays: RayColumns<'_>,
    mut finish: impl FnMut(usize, Hit),
) -> TraversalCounts {
    let mut counts = TraversalCounts { rays: rays.len() as u64, ..Default::default() };
    let mut stack = Stack::new();
    for first in (0..rays.len()).step_by(4 * W::RAYS) {
        let len = (rays.len() - first).min(4 * W::RAYS);
        let packet = (!tree.nodes.is_empty()).then(|| Packet::new::<W, N, I>(wide, tree, &rays, first)).flatten();
        if let Some(mut packet) = packet {
            packet.trace::<W, N, I, ANY, SPHERES, COUNT>(wide, tree, &rays, &mut stack, &mut counts);
            (0..len).for_each(|ray| finish(first + ray, packet.hit(ray)));
            continue;
        }
        for row in first..first + len {
            let hit = trace_one::<N, I, ANY, SPHERES, COUNT>(tree, &rays.ray(row), &mut stack, &mut counts);
            finish(row, hit);
        }
    }
    counts
}

/// Rays that start and go nearly alike.
struct Packet {
    /// What the box test takes, by word; the fourth is `t_max`, the closest hit so far, the eighth `t_min`.
    slab: [Column; 8],
    /// What the triangle test takes, by word; the eighth is `t_max`.
    triangle: [Column; 8],
    /// The rest of the closest hits so far.
    u: Column,
    v: Column,
    prim: [u32; MOST_LANES],
    geom: [u32; MOST_LANES],
    /// First row.
    first: usize,
    /// Bounds of what the rays have in common, in the space of the nodes.
    interval: Interval,
    /// The farthest of the closest hits.
    farthest: f32,
}

/// Bounds of origins and of reciprocal directions.
struct Interval {
    /// By axis: the origins from which the near planes are nearest, and from which the far planes are farthest.
    origin: [[Vec4; 3]; 2],
    /// By axis: reciprocals of the smallest and the largest direction.
    scale: [[Vec4; 3]; 2],
    /// By axis: which side of a box is near.
    near: [usize; 3],
    t_min: Vec4,
}

impl Packet {
    /// The rows from `first` on, or `None` if they do not all go towards the same octant, along the same axis mostly, and
    /// from where the box test suits them.
    #[inline(always)]
    fn new<W: Wide, N: Node, I: Intersect>(
        wide: W,
        tree: &Tree<'_, N>,
        rays: &RayColumns<'_>,
        first: usize,
    ) -> Option<Packet> {
        let mut packet = Packet {
            slab: [[0.0; MOST_LANES]; 8],
            triangle: [[0.0; MOST_LANES]; 8],
            u: [0.0; MOST_LANES],
            v: [0.0; MOST_LANES],
            prim: [MISS; MOST_LANES],
            geom: [MISS; MOST_LANES],
            first,
            interval: Interval {
                origin: [[Vec4::ZERO; 3]; 2],
                scale: [[Vec4::ZERO; 3]; 2],
                near: [0; 3],
                t_min: Vec4::ZERO,
            },
            farthest: f32::NEG_INFINITY,
        };
        let inward = [Vec4::INFINITY; 3];
        let (mut origins, mut directions) = ((inward, inward.map(|v| -v)), (inward, inward.map(|v| -v)));
        let mut t_min = Vec4::INFINITY;
        for quad in 0..W::RAYS {
            let four = Rays4::load(rays, first + 4 * quad);
            let ([a, b], suits) = N::slab(wide, &tree.frame, &four);
            let [c, d] = I::prepare4(&four);
            if suits != 0b1111 || four.t_max.min_element() < 0.0 {
                return None;
            }
            for (column, words) in packet.slab.iter_mut().zip(a.into_iter().chain(b)) {
                words.write_to_slice(&mut column[4 * quad..]);
            }
            for (column, words) in packet.triangle.iter_mut().zip(c.into_iter().chain(d)) {
                words.write_to_slice(&mut column[4 * quad..]);
            }
            for axis in 0..3 {
                origins.0[axis] = origins.0[axis].min(four.origin[axis]);
                origins.1[axis] = origins.1[axis].max(four.origin[axis]);
                directions.0[axis] = directions.0[axis].min(four.direction[axis]);
                directions.1[axis] = directions.1[axis].max(four.direction[axis]);
            }
            t_min = t_min.min(four.t_min);
            packet.farthest = packet.farthest.max(four.t_max.max_element());
        }
        let least = |v: [Vec4; 3]| Vec3::from_array(v.map(Vec4::min_element));
        let most = |v: [Vec4; 3]| Vec3::from_array(v.map(Vec4::max_element));
        let (low, high) = (least(directions.0), most(directions.1));
        // Far enough from 0 that no reciprocal was limited.
        let flattest = low.abs().max(high.abs()).max_element() * 1e-6;
        let octant = low.cmpgt(Vec3::splat(flattest)) | high.cmplt(Vec3::splat(-flattest));
        let axes = packet.triangle[3].map(f32::to_bits);
        if !octant.all() || axes[..4 * W::RAYS].iter().any(|&axis| axis != axes[0]) {
            return None;
        }
        let (from, to) = (N::point(&tree.frame, least(origins.0)), N::point(&tree.frame, most(origins.1)));
        let scales = [N::scale(&tree.frame, low.recip()), N::scale(&tree.frame, high.recip())];
        for axis in 0..3 {
            let backwards = low[axis] < 0.0;
            let (nearest, farthest) = if backwards { (from[axis], to[axis]) } else { (to[axis], from[axis]) };
            packet.interval.origin[0][axis] = Vec4::splat(nearest);
            packet.interval.origin[1][axis] = Vec4::splat(farthest);
            packet.interval.scale[0][axis] = Vec4::splat(scales[0][axis]);
            packet.interval.scale[1][axis] = Vec4::splat(scales[1][axis]);
            packet.interval.near[axis] = usize::from(backwards);
        }
        packet.interval.t_min = Vec4::splat(t_min.min_element());
        Some(packet)
    }

    /// What one ray hit.
    #[inline(always)]
    fn hit(&self, ray: usize) -> Hit {
        let ray = ray % MOST_LANES;
        if self.prim[ray] == MISS { Hit::NONE } else { self.closest(ray) }
    }

    #[inline(always)]
    fn closest(&self, ray: usize) -> Hit {
        Hit { t: self.slab[3][ray], u: self.u[ray], v: self.v[ray], prim: self.prim[ray], geom: self.geom[ray] }
    }

    /// Traverses nearest child first.
    #[inline(always)]
    fn trace<W: Wide, N: Node, I: Intersect, const ANY: bool, const SPHERES: bool, const COUNT: bool>(
        &mut self,
        wide: W,
        tree: &Tree<'_, N>,
        rays: &RayColumns<'_>,
        stack: &mut Stack,
        counts: &mut TraversalCounts,
    ) {
        let mut child = Child::ROOT;
        stack.clear();
        loop {
            if !child.is_leaf() {
                if COUNT {
                    counts.node_visits += 1;
                }
                self.visit_node(wide, tree, &tree.nodes[child.node()], stack);
            } else if SPHERES && child.is_spheres() {
                for block in &tree.spheres[child.blocks()] {
                    if COUNT {
                        count_block(counts, &block.prim);
                    }
                    for ray in 0..4 * W::RAYS {
                        let one = rays.ray((self.first + ray).min(rays.len() - 1));
                        for lane in (0..4).filter(|&lane| block.prim[lane] != MISS) {
                            let (center, radius) = (block.center(lane), block.radius[lane]);
                            if let Some(t) = sphere::intersect(&one, center, radius, self.slab[3][ray]) {
                                let hit = Hit { t, u: 0.0, v: 0.0, prim: block.prim[lane], geom: block.geom[lane] };
                                self.offer::<ANY>(ray, hit);
                            }
                        }
                    }
                }
                self.shorten::<W>();
            } else {
                for block in child.blocks() {
                    if COUNT {
                        count_block(counts, &tree.triangles[block].prim);
                    }
                    self.visit_block::<W, N, I, ANY>(wide, tree, block);
                }
            }
            child = loop {
                let entry = stack.pop();
                if entry.child() == Child::EMPTY {
                    return;
                }
                // Equal distances may still win by primitive, so they are visited.
                if entry.distance() <= self.farthest {
                    break entry.child();
                }
            };
        }
    }

    /// Pushes the children that any ray meets, the nearest last.
    #[inline(always)]
    fn visit_node<W: Wide, N: Node>(&self, wide: W, tree: &Tree<'_, N>, node: &N, stack: &mut Stack) {
        let (entry, met) = self.interval.enter(node, self.farthest);
        let mut rest = met;
        if rest == 0 {
            return;
        }
        let slab = self.slab_lanes(wide);
        let entries = entry.to_array();
        let mut sorted = [Entry::NONE; 4];
        let mut count = 0;
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize & 3;
            rest &= rest - 1;
            let (enter, leave) = node.enter_child(wide, lane, &slab);
            if wide.bits(wide.at_most(enter, leave)) == 0 {
                continue;
            }
            let child = child_of(node, lane);
            let leaf = Address::of(tree.triangles, child.first_block());
            prefetch_line(if child.is_leaf() { leaf } else { Address::of(tree.nodes, child.node()) });
            // Insertion sort: the nearest last.
            let mut at = count & 3;
            sorted[at] = Entry::new(entries[lane], child);
            while at > 0 && sorted[at - 1] < sorted[at] {
                sorted.swap(at - 1, at);
                at -= 1;
            }
            count += 1;
        }
        stack.push(sorted, count as u32);
    }

    /// Tests the triangles of a block.
    #[inline(always)]
    fn visit_block<W: Wide, N: Node, I: Intersect, const ANY: bool>(
        &mut self,
        wide: W,
        tree: &Tree<'_, N>,
        block: usize,
    ) {
        let block = &tree.triangles[block];
        let [ox, oy, oz, axes, dx, dy, dz, _] = &self.triangle;
        let axes = axes.map(f32::to_bits)[0];
        let words: Words = [0, 0, 0, axes];
        let rows = [0, 1, 2].map(|axis| I::first_row(&words, axis));
        let (origin, direction) =
            ([wide.load(ox), wide.load(oy), wide.load(oz)], [wide.load(dx), wide.load(dy), wide.load(dz)]);
        let mut changed = false;
        for lane in 0..4 {
            if block.prim[lane] == MISS {
                break;
            }
            let rays = RayLanes { origin, direction, t_max: wide.load(&self.triangle[7]) };
            let at = |row: usize| f32::from_bits(block.rows()[row][lane]);
            let corners = [
                [wide.splat(at(rows[0])), wide.splat(at(rows[1])), wide.splat(at(rows[2]))],
                [wide.splat(at(rows[0] + 1)), wide.splat(at(rows[1] + 1)), wide.splat(at(rows[2] + 1))],
                [wide.splat(at(rows[0] + 2)), wide.splat(at(rows[1] + 2)), wide.splat(at(rows[2] + 2))],
            ];
            let mut rest = wide.bits(I::test(wide, &rays, corners));
            while rest != 0 {
                let ray = rest.trailing_zeros() as usize % MOST_LANES;
                rest &= rest - 1;
                let words = [0, 4].map(|first| [0, 1, 2, 3].map(|word| self.triangle[first + word][ray].to_bits()));
                if let Some(crossing) = I::crossing(&words, block, lane) {
                    let (prim, geom) = (block.prim[lane], block.geom[lane]);
                    let hit = Hit { t: crossing.t, u: crossing.u, v: crossing.v, prim, geom };
                    changed |= self.offer::<ANY>(ray, hit);
                }
            }
        }
        if changed {
            self.shorten::<W>();
        }
    }

    /// Takes the hit if it comes before the closest so far. A ray that asks for any hit then ends before it starts.
    #[inline(always)]
    fn offer<const ANY: bool>(&mut self, ray: usize, hit: Hit) -> bool {
        let closer = closer(&hit, self.slab[7][ray], &self.closest(ray));
        if closer {
            let t = if ANY { -1.0 } else { hit.t };
            (self.slab[3][ray], self.triangle[7][ray]) = (t, t);
            (self.u[ray], self.v[ray], self.prim[ray], self.geom[ray]) = (hit.u, hit.v, hit.prim, hit.geom);
        }
        closer
    }

    /// After hits.
    #[inline(always)]
    fn shorten<W: Wide>(&mut self) {
        let quads = self.slab[3][..4 * W::RAYS].chunks_exact(4).map(Vec4::from_slice);
        self.farthest = quads.fold(Vec4::NEG_INFINITY, Vec4::max).max_element();
    }

    #[inline(always)]
    fn slab_lanes<W: Wide>(&self, wide: W) -> [W::Lanes; 8] {
        let [a, b, c, d, e, f, g, h] = &self.slab;
        [wide.load(a), wide.load(b), wide.load(c), wide.load(d), wide.load(e), wide.load(f), wide.load(g), wide.load(h)]
    }
}

impl Interval {
    /// No ray enters the children of a node earlier than this; and which of them rays may meet.
    #[inline(always)]
    fn enter<N: Node>(&self, node: &N, t_max: f32) -> (Vec4, u32) {
        let planes = node.planes();
        let near = |axis: usize| {
            let offset = planes[self.near[axis] & 1][axis] - self.origin[0][axis];
            (offset * self.scale[0][axis]).min(offset * self.scale[1][axis])
        };
        let far = |axis: usize| {
            let offset = planes[1 - (self.near[axis] & 1)][axis] - self.origin[1][axis];
            (offset * self.scale[0][axis]).max(offset * self.scale[1][axis])
        };
        let entry = near(0).max(near(1)).max(near(2).max(self.t_min)) * (1.0 - SLACK);
        let exit = far(0).min(far(1)).min(far(2).min(Vec4::splat(t_max)));
        (entry, entry.cmple(exit).bitmask())
    }
}
