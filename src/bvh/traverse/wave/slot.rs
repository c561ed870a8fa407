//! A ray on its way through the tree.

use super::setup::Prepared;
use crate::bvh::child::Child;
use crate::bvh::grid_node8::{MAX_LEVELS, WIDTH};
use crate::bvh::ray::{Hit, MISS};
use crate::bvh::traverse::stack::MAX_DEPTH;

/// Entries of a stack: each level leaves at most three children behind, or seven. As many as a byte can count, so that no index needs
/// a check.
const CAPACITY: usize = 256;
const _: () = assert!(1 + 3 * (MAX_DEPTH as usize) + 4 <= CAPACITY);
const _: () = assert!(1 + (WIDTH - 1) * (MAX_LEVELS as usize) + WIDTH <= CAPACITY);

/// Children that are written at a time.
const WRITTEN: usize = WIDTH;

/// What a key tells of a distance: all but the bits that name lanes. No child is entered before.
const DISTANCE: u32 = !7;

/// A ray and the children that it has still to visit. Which of them is next, the top of its stack, goes along with its step
/// ([`super::queue::Steps`]); [`Child::EMPTY`] is at the bottom.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct Slot {
    /// The ray, to its closest hit so far.
    pub ray: Prepared,
    /// The rest of the closest hit so far.
    u: f32,
    v: f32,
    prim: u32,
    geom: u32,
    /// The ray's row.
    pub row: u32,
    /// Children; four or eight are written at a time, of which only those that count are kept.
    pub children: [u32; CAPACITY + WRITTEN],
    /// Bits of the distances at which the ray enters them, but for the lowest, which name lanes.
    pub keys: [u32; CAPACITY + WRITTEN],
}

impl Slot {
    /// No ray.
    pub const IDLE: Slot = Slot {
        ray: Prepared { slab: [[0; 4]; 2], triangle: [[0; 4]; 2] },
        u: 0.0,
        v: 0.0,
        prim: MISS,
        geom: MISS,
        row: 0,
        children: [u32::MAX; CAPACITY + WRITTEN],
        keys: [0; CAPACITY + WRITTEN],
    };

    /// Puts a ray at the root. Gives the top of its stack.
    #[inline(always)]
    pub fn launch(&mut self, row: u32, ray: &Prepared) -> u8 {
        (self.ray, self.row) = (*ray, row);
        self.prim = MISS;
        // Nothing is ever written to the bottom, which was empty from the beginning.
        self.children[1] = Child::ROOT.bits();
        1
    }

    /// One of the children.
    #[inline(always)]
    pub fn child(&self, at: u8) -> Child {
        Child::from_bits(self.children[at as usize])
    }

    /// Puts a child in the place of another.
    #[inline(always)]
    pub fn set_child(&mut self, at: u8, child: Child) {
        self.children[at as usize] = child.bits();
    }

    /// The farthest `t` that still counts.
    #[inline(always)]
    pub fn t_max(&self) -> f32 {
        f32::from_bits(self.ray.slab[0][3])
    }

    /// The nearest `t` that does not count.
    #[inline(always)]
    pub fn t_min(&self) -> f32 {
        f32::from_bits(self.ray.slab[1][3])
    }

    /// The hit so far.
    #[inline(always)]
    pub fn hit(&self) -> Hit {
        if self.prim == MISS { Hit::NONE } else { self.closest() }
    }

    /// The hit that others have to beat.
    #[inline(always)]
    pub fn closest(&self) -> Hit {
        Hit { t: self.t_max(), u: self.u, v: self.v, prim: self.prim, geom: self.geom }
    }

    /// Takes a closer hit: ends or shortens the visit. Gives the top of the stack then.
    #[inline(always)]
    pub fn hit_at<const ANY: bool>(&mut self, hit: Hit, top: u8) -> u8 {
        self.ray.slab[0][3] = hit.t.to_bits();
        // What the triangle test takes for the end, too.
        self.ray.triangle[1][3] = hit.t.to_bits();
        (self.u, self.v, self.prim, self.geom) = (hit.u, hit.v, hit.prim, hit.geom);
        if ANY { 0 } else { self.cull(top) }
    }

    /// Drops the children that the ray enters beyond its closest hit. Hits are rare, visits are not: culling here lets them do
    /// without a branch. Equal distances may still win by primitive, so they stay.
    #[inline(always)]
    fn cull(&mut self, top: u8) -> u8 {
        let t_max = self.ray.slab[0][3];
        let mut kept = 0u8;
        for i in 1..=top {
            let (child, key) = (self.children[i as usize], self.keys[i as usize]);
            self.children[kept.wrapping_add(1) as usize] = child;
            self.keys[kept.wrapping_add(1) as usize] = key;
            kept = kept.wrapping_add(u8::from(key & DISTANCE <= t_max));
        }
        kept
    }
}
