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
    /// Eight floats of one ray, or the bits of anything.
    type Eight: Copy;
    /// Each of these numbers eight times.
    fn eights(self, numbers: &Words) -> [Self::Eight; 4];
    /// Eight numbers.
    fn load8(self, from: &[u32; 8]) -> Self::Eight;
    /// Writes eight numbers.
    fn store8(self, numbers: Self::Eight, to: &mut [u32]);
    /// `(n − origin)·scale` for sixteen 16-bit numbers `n`, four low ones and four high ones in each half of `words`, as
    /// [`Wide::grid_low`] has it: the nearer, and the farther of each two.
    fn planes8(self, words: &[u32; 8], scale: Self::Eight, offset: Self::Eight) -> [Self::Eight; 2];
    /// The smaller of `a` and `b`; `b` if either is NaN.
    fn min8(self, a: Self::Eight, b: Self::Eight) -> Self::Eight;
    /// The larger of `a` and `b`; `b` if either is NaN.
    fn max8(self, a: Self::Eight, b: Self::Eight) -> Self::Eight;
    /// `a <= b`: one bit a lane.
    fn at_most8(self, a: Self::Eight, b: Self::Eight) -> u32;
    /// The lanes in `keep`, close together; the others may be anything.
    fn packed8(self, numbers: Self::Eight, keep: u32) -> Self::Eight;
    /// Which numbers have their highest bit set: one bit a lane.
    fn negative(self, numbers: &[u32; MOST_LANES]) -> u32;
    /// Which numbers are this one: one bit a lane.
    fn equal(self, numbers: &[u32; MOST_LANES], number: u32) -> u32;
    /// Adds to each of the first [`Wide::RAYS`] of these numbers how many bits its quad has in `bits`, less one.
    fn climb(self, numbers: &mut [u32], bits: u32);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::random::uniform4;
    use crate::simd::Tier;

    /// Whole numbers below `below`, some negative if seen as such where it is large.
    fn numbers<const N: usize>(seed: u32, below: f32) -> [u32; N] {
        std::array::from_fn(|i| (uniform4(seed, i as u32, 0, 0)[0] * below) as u32)
    }

    /// Every operation that moves lanes, against what it should give.
    struct Moves;

    impl WideKernel for Moves {
        type Output = ();

        #[inline(always)]
        fn run<W: Wide>(self, wide: W) {
            for seed in 0..2000 {
                let quads: [Words; 4] = bytemuck::cast(numbers::<16>(seed, 6.0).map(|key| key.wrapping_sub(1)));
                let sorted = wide.sorted(wide.gather(|quad| &quads[quad]));
                wide.scatter(sorted, |quad, found| {
                    let mut expected = quads[quad].map(|key| key as i32);
                    expected.sort_by(|a, b| b.cmp(a));
                    assert_eq!(found.map(|key| key as i32), expected);
                });
                let bits = numbers::<1>(seed, 65536.0)[0] & (u32::MAX >> (32 - 4 * W::RAYS));
                let before: [u32; 8] = numbers(seed + 7, 200.0);
                let mut tops = before;
                wide.climb(&mut tops, bits);
                for (quad, (top, before)) in tops.into_iter().zip(before).enumerate() {
                    let ones = if quad < W::RAYS { (bits >> (4 * quad) & 15).count_ones() } else { 1 };
                    assert_eq!(top.wrapping_add(1), before + ones, "quad {quad} of {bits:x}");
                }
                let few: [u32; MOST_LANES] = numbers(seed, 3.0);
                let equal = (0..4 * W::RAYS).fold(0, |bits, lane| bits | u32::from(few[lane] == 1) << lane);
                assert_eq!(wide.equal(&few, 1), equal);
                let (eight, keep): ([u32; 8], u32) = (numbers(seed, 1e9), numbers::<1>(seed + 9, 256.0)[0]);
                let mut packed = [0; 8];
                wide.store8(wide.packed8(wide.load8(&eight), keep), &mut packed);
                let kept: Vec<u32> = (0..8).filter(|lane| keep >> lane & 1 == 1).map(|lane| eight[lane]).collect();
                assert_eq!(packed[..kept.len()], kept);
            }
        }
    }

    #[test]
    fn lanes_go_where_they_should_on_every_tier() {
        for tier in Tier::available() {
            tier.run_wide(Moves);
        }
    }

    /// Where a ray crosses the planes of eight boxes, by way of [`Wide::planes8`].
    struct Planes<'a>(&'a [u16; 16], f32, f32);

    impl WideKernel for Planes<'_> {
        type Output = [[u32; 8]; 2];

        #[inline(always)]
        fn run<W: Wide>(self, wide: W) -> [[u32; 8]; 2] {
            let Planes(words, origin, scale) = self;
            let offset = wide.grid_offset(Vec4::splat(origin), Vec4::splat(scale))[0];
            let [scale, offset, ..] = wide.eights(&[scale, offset, 0.0, 0.0].map(f32::to_bits));
            let [near, far] = wide.planes8(&bytemuck::cast(*words), scale, offset);
            let mut found = [[0; 8]; 2];
            wide.store8(near, &mut found[0]);
            wide.store8(far, &mut found[1]);
            found
        }
    }

    #[test]
    fn planes_of_eight_boxes_are_crossed_where_they_lie() {
        for seed in 0..500 {
            let words = numbers::<16>(seed, 65536.0).map(|n| n as u16);
            let [origin, scale, ..] = uniform4(seed, 1, 2, 3).map(|u| (u - 0.5) * 1e5);
            for tier in Tier::available() {
                let [near, far] = tier.run_wide(Planes(&words, origin, scale)).map(|side| side.map(f32::from_bits));
                for lane in 0..8 {
                    // Four low planes before the four high ones of the same children, twice.
                    let at = |side: usize| {
                        (f64::from(words[lane / 4 * 8 + side * 4 + lane % 4]) - f64::from(origin)) * f64::from(scale)
                    };
                    let error = 0.55 * f64::from(scale.abs()) + 1e-6 * at(0).abs().max(at(1).abs());
                    assert!((f64::from(near[lane]) - at(0).min(at(1))).abs() <= error, "{}", tier.name());
                    assert!((f64::from(far[lane]) - at(0).max(at(1))).abs() <= error, "{}", tier.name());
                }
            }
        }
    }
}
