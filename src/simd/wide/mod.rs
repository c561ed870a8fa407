//! Vectors as wide as the tier has, seen as quads: four lanes a ray, several rays a vector.
//!
//! A node has four children and a leaf block four triangles, so a quad is what one ray needs in a step. The baseline
//! steps one ray at a time, AVX2 two, AVX-512 four: the kernel over [`Wide`] is the same.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
use glam::Vec4;

mod baseline;

#[cfg(target_arch = "x86_64")]
pub use avx2::Avx2;
#[cfg(target_arch = "x86_64")]
pub use avx512::Avx512;
pub use baseline::Quad;

/// Four 32-bit words, as they lie in memory: floats by their bits.
pub type Words = [u32; 4];

/// Lanes of the widest vectors.
pub const MOST_LANES: usize = 16;

/// Operations on [`Wide::RAYS`] quads of 32-bit lanes. Values are proof that the processor has the instructions.
pub trait Wide: Copy {
    /// Quads in a vector.
    const RAYS: usize;
    /// Floats, or the bits of anything.
    type Lanes: Copy;
    /// A truth value a lane.
    type Mask: Copy;

    /// One quad from each of [`Wide::RAYS`] places.
    fn gather<'a>(self, at: impl FnMut(usize) -> &'a Words) -> Self::Lanes;
    /// The same quad everywhere.
    fn repeat(self, quad: &Words) -> Self::Lanes;
    /// The first numbers, as many as there are lanes.
    fn load(self, from: &[f32; MOST_LANES]) -> Self::Lanes;
    /// Gives each quad back, with its number.
    fn scatter(self, lanes: Self::Lanes, to: impl FnMut(usize, Words));
    /// Which numbers have their highest bit set: one bit a lane.
    fn negative(self, numbers: &[u32; MOST_LANES]) -> u32;
    /// Writes the numbers of the lanes in `keep`, close together. What follows them in the first [`MOST_LANES`] of `to` may
    /// change, too.
    fn pack(self, numbers: &[u32; MOST_LANES], keep: u32, to: &mut [u32]);
    /// The same number in every lane.
    fn splat(self, number: f32) -> Self::Lanes;
    /// In each quad, its lane `LANE` everywhere.
    fn spread<const LANE: usize>(self, lanes: Self::Lanes) -> Self::Lanes;
    /// `a + b`.
    fn add(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// `a − b`.
    fn sub(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// `a·b`, rounded.
    fn mul(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// `a·b + c`, rounded once or twice: for bounds alone, since tiers differ.
    fn about(self, a: Self::Lanes, b: Self::Lanes, c: Self::Lanes) -> Self::Lanes;
    /// `|a|`.
    fn abs(self, a: Self::Lanes) -> Self::Lanes;
    /// `a` where `by` has no sign, `−a` where it has.
    fn flipped(self, a: Self::Lanes, by: Self::Lanes) -> Self::Lanes;
    /// The smaller of `a` and `b`; `b` if either is NaN.
    fn min(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// The larger of `a` and `b`; `b` if either is NaN.
    fn max(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// `a <= b`.
    fn at_most(self, a: Self::Lanes, b: Self::Lanes) -> Self::Mask;
    /// What [`Wide::grid_low`] takes for a ray that starts at `origin` on an axis of the grid and moves 1 in `scale`.
    fn grid_offset(self, origin: Vec4, scale: Vec4) -> Vec4;
    /// `(n − origin)·scale` for the four 16-bit numbers `n` in the low half of each quad. Tiers round differently: they err
    /// by less than 0.55·`scale` for origins within ±2¹⁸.
    fn grid_low(self, words: Self::Lanes, scale: Self::Lanes, offset: Self::Lanes) -> Self::Lanes;
    /// Numbers of the grid as [`Wide::grid`] takes them.
    fn grid_numbers(self, numbers: Vec4) -> Vec4;
    /// The same as [`Wide::grid_low`] of one number in all lanes.
    fn grid(self, number: f32, scale: Self::Lanes, offset: Self::Lanes) -> Self::Lanes;
    /// The same of the high half.
    fn grid_high(self, words: Self::Lanes, scale: Self::Lanes, offset: Self::Lanes) -> Self::Lanes;
    /// `a < b`.
    fn below(self, a: Self::Lanes, b: Self::Lanes) -> Self::Mask;
    /// Whether both hold.
    fn both(self, a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Whether `a` holds and `b` does not.
    fn but_not(self, a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Whether either holds.
    fn either(self, a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// One bit a lane, the lowest for lane 0.
    fn bits(self, mask: Self::Mask) -> u32;
    /// Keys to sort children by: the bits of `distance`, not negative, with the lane in the two lowest; −1 where not `met`.
    fn keys(self, distance: Self::Lanes, met: Self::Mask) -> Self::Lanes;
    /// Each quad's keys, largest first.
    fn sorted(self, keys: Self::Lanes) -> Self::Lanes;
    /// In each quad, the lanes named by the two lowest bits of `by`.
    fn permuted(self, lanes: Self::Lanes, by: Self::Lanes) -> Self::Lanes;
    /// The first twelve bytes of each quad as numbers: four, the next four, the last four.
    fn bytes(self, quads: Self::Lanes) -> [Self::Lanes; 3];
    /// In each quad, what a table of its own has at the numbers of `by`, of which the three lowest bits count; three times.
    fn pick<'a>(self, table: impl FnMut(usize) -> &'a [f32; 8], by: [Self::Lanes; 3]) -> [Self::Lanes; 3];
    /// The same of one table for all quads.
    fn pick_from_one(self, table: &[f32; 8], by: [Self::Lanes; 3]) -> [Self::Lanes; 3];
}

/// A batch kernel over [`Wide`] vectors. As for [`crate::simd::Kernel`], all that it calls must be `#[inline(always)]`.
pub trait WideKernel {
    /// What the batch gives back.
    type Output;
    /// The body.
    fn run<W: Wide>(self, wide: W) -> Self::Output;
}
