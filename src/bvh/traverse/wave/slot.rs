//! A ray on its way through the tree.

use super::setup::Prepared;
use crate::bvh::child::Child;
use crate::bvh::ray::{Hit, MISS};
use crate::bvh::traverse::stack::MAX_DEPTH;

/// Entries of a stack: each level leaves at most three children behind. As many as a byte can count, so that no index needs
/// a check.
const CAPACITY: usize = 256;
const _: () = assert!(1 + 3 * (MAX_DEPTH as usize) + 4 <= CAPACITY);

/// A ray and the children that it has still to visit.
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
    /// Which of the children is next; [`Child::EMPTY`] is at the bottom.
    pub top: u8,
    /// Children; four are written at a time, of which only those that count are kept.
    pub children: [u32; CAPACITY + 4],
    /// Bits of the distances at which the ray enters them, give or take the two lowest.
    pub keys: [u32; CAPACITY + 4],
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
        top: 0,
        children: [u32::MAX; CAPACITY + 4],
        keys: [0; CAPACITY + 4],
    };

    /// Puts a ray at the root.
    #[inline(always)]
    pub fn launch(&mut self, row: u32, ray: &Prepared) {
        (self.ray, self.row) = (*ray, row);
        self.prim = MISS;
        self.children[0] = Child::EMPTY.bits();
        self.children[1] = Child::ROOT.bits();
        self.keys[0] = 0;
        self.top = 1;
    }

    /// What comes next; [`Child::EMPTY`] when the ray is done.
    #[inline(always)]
    pub fn next(&self) -> Child {
        Child::from_bits(self.children[self.top as usize])
    }

    /// After one block of the leaf on top: its other blocks are next, or what is below.
    #[inline(always)]
    pub fn leave_block(&mut self, leaf: Child) {
        self.children[self.top as usize] = leaf.without_first_block().bits();
        self.top = self.top.wrapping_sub(u8::from(leaf.is_one_block()));
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
        if self.prim == MISS {
            return Hit::NONE;
        }
        Hit { t: self.t_max(), u: self.u, v: self.v, prim: self.prim, geom: self.geom }
    }

    /// The hit that others have to beat.
    #[inline(always)]
    pub fn closest(&self) -> Hit {
        Hit { t: self.t_max(), u: self.u, v: self.v, prim: self.prim, geom: self.geom }
    }

    /// Takes a closer hit.
    #[inline(always)]
    pub fn set_closest(&mut self, hit: Hit) {
        self.ray.slab[0][3] = hit.t.to_bits();
        (self.u, self.v, self.prim, self.geom) = (hit.u, hit.v, hit.prim, hit.geom);
    }

    /// After blocks were tested, before which the closest hit was at `before`: ends or shortens the visit.
    #[inline(always)]
    pub fn settle<const ANY: bool>(&mut self, before: f32) {
        if ANY {
            if self.prim != MISS {
                self.top = 0;
            }
        } else if self.t_max() < before {
            self.cull();
        }
    }

    /// Drops the children that the ray enters beyond its closest hit. Hits are rare, visits are not: culling here lets them do
    /// without a branch. Equal distances may still win by primitive, so they stay.
    #[inline(always)]
    fn cull(&mut self) {
        let t_max = self.ray.slab[0][3];
        let mut kept = 0u8;
        for i in 1..=self.top {
            let (child, key) = (self.children[i as usize], self.keys[i as usize]);
            self.children[kept.wrapping_add(1) as usize] = child;
            self.keys[kept.wrapping_add(1) as usize] = key;
            kept = kept.wrapping_add(u8::from(key <= t_max));
        }
        self.top = kept;
    }
}
