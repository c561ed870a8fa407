//! Setting rays up: what the tests need of them, four at a time.

use crate::bvh::columns::RayColumns;
use crate::bvh::intersect::Intersect;
use crate::bvh::node::Node;
use crate::bvh::rays4::{Rays4, transposed};
use crate::simd::wide::{Wide, Words};

/// Rays set up ahead.
const AHEAD: usize = 4;

/// The next rays.
pub struct Setup {
    first: usize,
    rays: [Prepared; AHEAD],
    suits: u32,
}

/// A ray as the tests need it.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Prepared {
    /// What the box test takes ([`Node::slab`]): in the last lanes `t_max`, the closest hit so far, and `t_min`.
    pub slab: [Words; 2],
    /// What the triangle test takes ([`Intersect::prepare`]).
    pub triangle: [Words; 2],
}

impl Setup {
    /// The rows from `first` on.
    #[inline(always)]
    pub fn new<W: Wide, N: Node, I: Intersect>(
        wide: W,
        frame: &N::Frame,
        rays: &RayColumns<'_>,
        first: usize,
    ) -> Setup {
        let rays = Rays4::load(rays, first);
        let ([a, b], suits) = N::slab(wide, frame, &rays);
        let [c, d] = I::prepare4(&rays);
        let (a, b, c, d) = (transposed(a), transposed(b), transposed(c), transposed(d));
        let prepared = |ray: usize| Prepared { slab: [a[ray], b[ray]], triangle: [c[ray], d[ray]] };
        Setup { first, rays: [prepared(0), prepared(1), prepared(2), prepared(3)], suits }
    }

    /// The row after the last that is set up.
    #[inline(always)]
    pub fn end(&self) -> usize {
        self.first + AHEAD
    }

    /// Whether the box test of many suits this row.
    #[inline(always)]
    pub fn suits(&self, row: usize) -> bool {
        self.suits >> (row - self.first) & 1 == 1
    }

    /// The ray of this row.
    #[inline(always)]
    pub fn ray(&self, row: usize) -> &Prepared {
        &self.rays[(row - self.first) % AHEAD]
    }
}
