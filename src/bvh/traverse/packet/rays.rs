//! The rays of a packet.

use super::interval::{Bounds, Interval};
use super::stack::PacketStack;
use crate::bvh::block::TriangleBlock;
use crate::bvh::child::Child;
use crate::bvh::closest::closer;
use crate::bvh::columns::RayColumns;
use crate::bvh::intersect::Intersect;
use crate::bvh::node::Node;
use crate::bvh::ray::{Hit, MISS};
use crate::bvh::rays4::{Rays4, transposed};
use crate::bvh::traverse::Tree;
use crate::bvh::traverse::bins::RAYS;
use crate::simd::wide::{MOST_LANES, Wide, Words};

/// One component of all rays, and room for the widest vector beyond the last.
type Column = [f32; RAYS + MOST_LANES];

/// Rays that go to the same octant, along the same axis mostly.
pub struct Packet {
    /// What the box test takes, by word; the fourth is `t_max`, the closest hit so far, the eighth `t_min`.
    slab: [Column; 8],
    /// What the triangle test takes; its last word is `t_max`.
    pub triangle: [[Words; 2]; RAYS],
    /// The rest of the closest hits so far.
    u: [f32; RAYS],
    v: [f32; RAYS],
    prim: [u32; RAYS],
    geom: [u32; RAYS],
    /// Their rows.
    pub rows: [u32; RAYS],
    /// Rays that may still hit something.
    pub alive: u64,
    /// Rays that the box test of many does not suit.
    pub unsuited: u64,
    /// How many there are.
    pub len: usize,
    /// What is visited next, and by which rays.
    pub next: (Child, u64),
    /// What comes after that.
    pub stack: PacketStack,
    /// By axis: which side of a box is near.
    pub near: [usize; 3],
    /// Bounds of what they have in common.
    pub interval: Interval,
}

impl Packet {
    /// None.
    pub fn new() -> Packet {
        Packet {
            slab: [[0.0; RAYS + MOST_LANES]; 8],
            triangle: [[[0; 4]; 2]; RAYS],
            u: [0.0; RAYS],
            v: [0.0; RAYS],
            prim: [MISS; RAYS],
            geom: [MISS; RAYS],
            rows: [0; RAYS],
            alive: 0,
            unsuited: 0,
            len: 0,
            next: (Child::EMPTY, 0),
            stack: PacketStack::new(),
            near: [0; 3],
            interval: Interval::NONE,
        }
    }

    /// Sets the first `len` rows up, to start at the root.
    #[inline(always)]
    pub fn load<W: Wide, N: Node, I: Intersect>(
        &mut self,
        wide: W,
        tree: &Tree<'_, N, impl TriangleBlock>,
        rays: &RayColumns<'_>,
        rows: &[u32; RAYS],
        len: usize,
    ) {
        let mut bounds = Bounds::NONE;
        let (mut suited, mut unsuited) = (0u64, 0u64);
        for quad in (0..len.min(RAYS)).step_by(4) {
            let [i, j, k, l] = [0, 1, 2, 3].map(|ray| rows[quad + ray] as usize);
            // Rows ascend, but for those that stand in for missing ones.
            let consecutive = quad + 4 <= len && l == i + 3;
            let four = if consecutive { Rays4::load(rays, i) } else { Rays4::at(rays, [i, j, k, l]) };
            let ([a, b], suits) = N::slab(wide, &tree.frame, &four);
            for (column, words) in self.slab.iter_mut().zip(a.into_iter().chain(b)) {
                words.write_to_slice(&mut column[quad..]);
            }
            let [c, d] = I::prepare4(&four);
            let (c, d) = (transposed(c), transposed(d));
            for ray in 0..4 {
                self.triangle[quad + ray] = [c[ray], d[ray]];
            }
            // Untraceable rays hit nothing, and may have any origin and direction.
            let traceable = four.traceable();
            suited |= u64::from(suits & traceable) << quad;
            unsuited |= u64::from(!suits & traceable & 15) << quad;
            bounds.add(&four, traceable);
        }
        self.prim[..len].fill(MISS);
        self.rows = *rows;
        let negative = [0, 1, 2].map(|axis| self.slab[axis][0].is_sign_negative());
        self.near = negative.map(usize::from);
        self.interval = Interval::new::<N>(&tree.frame, &bounds, negative);
        let among = u64::MAX >> (RAYS - len);
        self.alive = suited & among;
        self.unsuited = unsuited & among;
        self.len = len;
        self.next = if self.alive != 0 { (Child::ROOT, self.alive) } else { (Child::EMPTY, 0) };
        self.stack.clear();
    }

    /// What one ray hit.
    #[inline(always)]
    pub fn hit(&self, ray: usize) -> Hit {
        let ray = ray % RAYS;
        if self.prim[ray] == MISS { Hit::NONE } else { self.closest(ray) }
    }

    #[inline(always)]
    fn closest(&self, ray: usize) -> Hit {
        Hit { t: self.slab[3][ray], u: self.u[ray], v: self.v[ray], prim: self.prim[ray], geom: self.geom[ray] }
    }

    /// How far a ray goes still.
    #[inline(always)]
    pub fn t_max(&self, ray: usize) -> f32 {
        self.slab[3][ray % RAYS]
    }

    /// Takes the hit if it comes before the closest so far. A ray that asks for any hit is then done.
    #[inline(always)]
    pub fn offer<const ANY: bool>(&mut self, ray: usize, hit: Hit) {
        let ray = ray % RAYS;
        if closer(&hit, self.slab[7][ray], &self.closest(ray)) {
            (self.slab[3][ray], self.triangle[ray][1][3]) = (hit.t, hit.t.to_bits());
            (self.u[ray], self.v[ray], self.prim[ray], self.geom[ray]) = (hit.u, hit.v, hit.prim, hit.geom);
            if ANY {
                self.alive &= !(1 << ray);
            }
        }
    }

    /// A vector of rays as the box test takes them.
    #[inline(always)]
    pub fn slab_lanes<W: Wide>(&self, wide: W, first: usize) -> [W::Lanes; 8] {
        let [a, b, c, d, e, f, g, h] = &self.slab;
        [
            wide.load(lanes(a, first)),
            wide.load(lanes(b, first)),
            wide.load(lanes(c, first)),
            wide.load(lanes(d, first)),
            wide.load(lanes(e, first)),
            wide.load(lanes(f, first)),
            wide.load(lanes(g, first)),
            wide.load(lanes(h, first)),
        ]
    }

    /// Those of the rays in `mask` that have not hit anything before `distance`. Equal distances may still win by primitive.
    #[inline(always)]
    pub fn reaching<W: Wide>(&self, wide: W, mask: u64, distance: f32) -> u64 {
        let distance = wide.splat(distance);
        let (mut left, mut reaching) = (mask, 0);
        while left != 0 {
            let first = first_of::<W>(left);
            let bits = wide.bits(wide.at_most(distance, wide.load(lanes(&self.slab[3], first))));
            reaching |= u64::from(bits) << first;
            left &= !(vector::<W>() << first);
        }
        mask & reaching
    }
}

/// The rays of the first vector.
#[inline(always)]
pub fn vector<W: Wide>() -> u64 {
    u64::MAX >> (64 - 4 * W::RAYS)
}

/// The first ray of the vector that the first of these rays is in.
#[inline(always)]
pub fn first_of<W: Wide>(rays: u64) -> usize {
    rays.trailing_zeros() as usize & !(4 * W::RAYS - 1)
}

#[inline(always)]
fn lanes(column: &Column, first: usize) -> &[f32; MOST_LANES] {
    column[first % RAYS..].first_chunk().expect("there is room beyond the last ray")
}
