//! Setting rays up: what the tests need of them, four at a time.

use crate::bvh::columns::RayColumns;
use crate::bvh::intersect::Intersect;
use crate::bvh::node::Node;
use crate::bvh::rays4::{Rays4, transposed};
use crate::simd::wide::{Wide, Words};

/// Rays set up, and launched, at a time.
pub const AT_ONCE: usize = 4;

/// A ray as the tests need it.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Prepared {
    /// What the box test takes ([`Node::slab`]): in the last lanes `t_max`, the closest hit so far, and `t_min`.
    pub slab: [Words; 2],
    /// What the triangle test takes ([`Intersect::prepare`]).
    pub triangle: [Words; 2],
}

/// The rays of the rows from `first` on, past the end the last one again; and a bit for each that the box test of many suits. They go from here to
/// their slots straight away: read again as a whole after they were written a quad at a time, they would be waited for.
#[inline(always)]
pub fn prepare<W: Wide, N: Node, I: Intersect>(
    wide: W,
    frame: &N::Frame,
    rays: &RayColumns<'_>,
    first: usize,
) -> ([Prepared; AT_ONCE], u32) {
    let rays = Rays4::load(rays, first);
    let ([a, b], suits) = N::slab(wide, frame, &rays);
    let [c, d] = I::prepare4(&rays);
    let (a, b, c, d) = (transposed(a), transposed(b), transposed(c), transposed(d));
    let prepared = |ray: usize| Prepared { slab: [a[ray], b[ray]], triangle: [c[ray], d[ray]] };
    ([prepared(0), prepared(1), prepared(2), prepared(3)], suits)
}
