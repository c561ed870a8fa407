//! Which triangle test a tree is asked with, and what the kernels need of it.

use glam::Vec4;

use super::block::TriangleBlock;
use super::ray::Ray;
use super::rays4::Rays4;
use crate::simd::wide::{Wide, Words};

/// A ray–triangle test.
pub trait Intersect: Copy + Send + Sync {
    /// A traceable ray as the test needs it; the last lane of the second quad is `t_max`, and to be kept so.
    fn prepare(ray: &Ray) -> [Words; 2];

    /// The same of four rays, a column a word.
    fn prepare4(rays: &Rays4) -> [[Vec4; 4]; 2];

    /// Which of four classes rays of these directions are of, as the two bits of a number: those of one class have the same
    /// [`Intersect::first_row`]s.
    fn class(directions: [Vec4; 3]) -> [u32; 2];

    /// The first of the three rows of a block ([`super::tri4::Tri4::rows`]) that hold the coordinate which the ray takes as its x, y or
    /// z; `words` are the first that were prepared.
    fn first_row(words: &Words, axis: u32) -> usize;

    /// Which lanes' rays may hit which lanes' triangles: [`Intersect::crossing`] decides. `corners` by corner, then by the
    /// ray's axis.
    fn test<W: Wide>(wide: W, rays: &RayLanes<W::Lanes>, corners: [[W::Lanes; 3]; 3]) -> W::Mask;

    /// The triangles that rays may hit, a quad of each a ray.
    #[inline(always)]
    fn candidates<'a, W: Wide, B: TriangleBlock>(
        wide: W,
        ray: impl Fn(usize) -> &'a [Words; 2] + Copy,
        block: impl Fn(usize) -> &'a B + Copy,
    ) -> W::Mask {
        let (a, b) = (wide.gather(|r| &ray(r)[0]), wide.gather(|r| &ray(r)[1]));
        let rays = RayLanes {
            origin: [wide.spread::<0>(a), wide.spread::<1>(a), wide.spread::<2>(a)],
            direction: [wide.spread::<0>(b), wide.spread::<1>(b), wide.spread::<2>(b)],
            t_max: wide.spread::<3>(b),
        };
        let corners = B::corners(wide, block, |r, axis| Self::first_row(&ray(r)[0], axis));
        Self::test(wide, &rays, corners)
    }

    /// The same of one block for all rays, whose `first_row`s are the same.
    #[inline(always)]
    fn candidates_in<'a, W: Wide>(
        wide: W,
        ray: impl Fn(usize) -> &'a [Words; 2] + Copy,
        block: &impl TriangleBlock,
    ) -> W::Mask {
        let (a, b) = (wide.gather(|r| &ray(r)[0]), wide.gather(|r| &ray(r)[1]));
        let rays = RayLanes {
            origin: [wide.spread::<0>(a), wide.spread::<1>(a), wide.spread::<2>(a)],
            direction: [wide.spread::<0>(b), wide.spread::<1>(b), wide.spread::<2>(b)],
            t_max: wide.spread::<3>(b),
        };
        let rows = [0, 1, 2].map(|axis| Self::first_row(&ray(0)[0], axis));
        let corners = block.corners_for_all(wide, rows);
        Self::test(wide, &rays, corners)
    }

    /// Where the ray crosses the triangle in one lane, if it does; not yet limited in `t`.
    fn crossing(ray: &[Words; 2], block: &impl TriangleBlock, lane: usize) -> Option<Crossing>;

    /// The axes that a ray of this direction takes as its x, y and z.
    fn axes(direction: [f32; 3]) -> [usize; 3];

    /// Where a ray crosses a triangle, and whether it does; not yet limited in `t`. Everything along the ray's axes; `corners` first
    /// by the axis. Without branches, so that a loop over many can be made one of vectors.
    fn meet(origin: [f32; 3], direction: [f32; 3], corners: [[f32; 3]; 3]) -> (Crossing, bool);
}

/// Prepared rays, by component.
#[derive(Clone, Copy, Debug)]
pub struct RayLanes<L> {
    /// Their origins, or what the test takes for them.
    pub origin: [L; 3],
    /// Their directions, likewise.
    pub direction: [L; 3],
    /// Their ends.
    pub t_max: L,
}

/// Where a ray meets a triangle; on the whole line, not yet limited to `t_min < t <= t_max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Distance in units of the ray's direction.
    pub t: f32,
    /// Weight of the second corner.
    pub u: f32,
    /// Weight of the third corner.
    pub v: f32,
}

/// The candidates of whose plane the ray is sure to cross beyond its ends: most rays start close to a triangle that they do
/// not hit, and each would otherwise be a candidate. `inside` and `depths` are the weights of the corners, all of one sign,
/// and their distances along the ray, so that `t` is the weighted mean of the distances over `per_t`. The weights err by two half-ulps
/// of themselves and of `product` at most: of slivers, they may hardly be known.
#[inline(always)]
pub fn beyond_ends<W: Wide>(
    wide: W,
    weights: [W::Lanes; 3],
    product: W::Lanes,
    depths: [W::Lanes; 3],
    per_t: W::Lanes,
    t_max: W::Lanes,
) -> W::Mask {
    // The sums err by less than 14 half-ulps of `size`; the margin is twice that, and more than any underflow.
    const MARGIN: f32 = 1.0 / (1 << 19) as f32;
    let area = wide.add(wide.add(weights[0], weights[1]), weights[2]);
    let sum = wide.mul(weights[0], depths[0]);
    let sum = wide.about(weights[1], depths[1], sum);
    let sum = wide.about(weights[2], depths[2], sum);
    let deepest = wide.max(wide.max(wide.abs(depths[0]), wide.abs(depths[1])), wide.abs(depths[2]));
    let size = wide.mul(wide.add(wide.abs(area), product), deepest);
    let margin = wide.about(size, wide.splat(MARGIN), wide.splat(1e-30));
    let unit = wide.mul(area, per_t);
    let sum = wide.flipped(sum, unit);
    let before = wide.below(wide.add(sum, margin), wide.splat(0.0));
    let after = wide.below(wide.mul(wide.abs(unit), t_max), wide.sub(sum, margin));
    wide.either(before, after)
}
