//! One quad: what every processor has, by way of glam (SSE2, NEON, or scalars). Also what the other tiers are tested by.

use super::{MOST_LANES, Wide, Words};
use glam::{BVec4A, Vec4};

/// One ray a vector.
#[derive(Clone, Copy, Debug)]
pub struct Quad;

#[inline(always)]
fn words(lanes: Vec4) -> Words {
    lanes.to_array().map(f32::to_bits)
}

#[inline(always)]
fn lanes(words: Words) -> Vec4 {
    Vec4::from_array(words.map(f32::from_bits))
}

impl Wide for Quad {
    const RAYS: usize = 1;
    type Lanes = Vec4;
    type Mask = BVec4A;

    #[inline(always)]
    fn gather<'a>(self, mut at: impl FnMut(usize) -> &'a Words) -> Vec4 {
        lanes(*at(0))
    }

    #[inline(always)]
    fn repeat(self, quad: &Words) -> Vec4 {
        lanes(*quad)
    }

    #[inline(always)]
    fn load(self, from: &[f32; MOST_LANES]) -> Vec4 {
        Vec4::from_slice(&from[..4])
    }

    #[inline(always)]
    fn scatter(self, lanes: Vec4, mut to: impl FnMut(usize, Words)) {
        to(0, words(lanes));
    }

    type Eight = [Vec4; 2];

    #[inline(always)]
    fn eights(self, numbers: &Words) -> [[Vec4; 2]; 4] {
        numbers.map(|number| [Vec4::splat(f32::from_bits(number)); 2])
    }

    #[inline(always)]
    fn load8(self, from: &[u32; 8]) -> [Vec4; 2] {
        let [a, b, c, d, e, f, g, h] = *from;
        [lanes([a, b, c, d]), lanes([e, f, g, h])]
    }

    #[inline(always)]
    fn store8(self, [a, b]: [Vec4; 2], to: &mut [u32]) {
        to[..4].copy_from_slice(&words(a));
        to[4..8].copy_from_slice(&words(b));
    }

    #[inline(always)]
    fn planes8(self, words: &[u32; 8], scale: [Vec4; 2], offset: [Vec4; 2]) -> [[Vec4; 2]; 2] {
        let [a, b, c, d, e, f, g, h] = *words;
        let (low, high) = (
            [grid([a, b], scale[0], offset[0]), grid([e, f], scale[1], offset[1])],
            [grid([c, d], scale[0], offset[0]), grid([g, h], scale[1], offset[1])],
        );
        [self.min8(low, high), self.max8(low, high)]
    }

    #[inline(always)]
    fn min8(self, a: [Vec4; 2], b: [Vec4; 2]) -> [Vec4; 2] {
        [self.min(a[0], b[0]), self.min(a[1], b[1])]
    }

    #[inline(always)]
    fn max8(self, a: [Vec4; 2], b: [Vec4; 2]) -> [Vec4; 2] {
        [self.max(a[0], b[0]), self.max(a[1], b[1])]
    }

    #[inline(always)]
    fn at_most8(self, a: [Vec4; 2], b: [Vec4; 2]) -> u32 {
        a[0].cmple(b[0]).bitmask() | a[1].cmple(b[1]).bitmask() << 4
    }

    #[inline(always)]
    fn packed8(self, [a, b]: [Vec4; 2], keep: u32) -> [Vec4; 2] {
        let (from, mut to, mut kept) = ([words(a), words(b)], [[0; 4]; 2], 0);
        for lane in (0..8).filter(|lane| keep >> lane & 1 == 1) {
            to[kept / 4][kept % 4] = from[lane / 4][lane % 4];
            kept += 1;
        }
        to.map(lanes)
    }

    #[inline(always)]
    fn negative(self, numbers: &[u32; MOST_LANES]) -> u32 {
        numbers[..4].iter().enumerate().fold(0, |bits, (lane, number)| bits | number >> 31 << lane)
    }

    #[inline(always)]
    fn equal(self, numbers: &[u32; MOST_LANES], number: u32) -> u32 {
        (0..4).fold(0, |bits, lane| bits | u32::from(numbers[lane] == number) << lane)
    }

    #[inline(always)]
    fn climb(self, numbers: &mut [u32], bits: u32) {
        numbers[0] = numbers[0].wrapping_add((bits & 15).count_ones()).wrapping_sub(1);
    }

    #[inline(always)]
    fn pack(self, numbers: &[u32; MOST_LANES], keep: u32, to: &mut [u32]) {
        let mut end = 0;
        for (lane, &number) in numbers[..4].iter().enumerate() {
            to[end] = number;
            end += (keep >> lane & 1) as usize;
        }
    }

    #[inline(always)]
    fn splat(self, number: f32) -> Vec4 {
        Vec4::splat(number)
    }

    #[inline(always)]
    fn spread<const LANE: usize>(self, lanes: Vec4) -> Vec4 {
        Vec4::splat(lanes[LANE])
    }

    #[inline(always)]
    fn add(self, a: Vec4, b: Vec4) -> Vec4 {
        a + b
    }

    #[inline(always)]
    fn sub(self, a: Vec4, b: Vec4) -> Vec4 {
        a - b
    }

    #[inline(always)]
    fn mul(self, a: Vec4, b: Vec4) -> Vec4 {
        a * b
    }

    #[inline(always)]
    fn about(self, a: Vec4, b: Vec4, c: Vec4) -> Vec4 {
        a * b + c
    }

    #[inline(always)]
    fn abs(self, a: Vec4) -> Vec4 {
        a.abs()
    }

    #[inline(always)]
    fn flipped(self, a: Vec4, by: Vec4) -> Vec4 {
        lanes(std::array::from_fn(|i| words(a)[i] ^ words(by)[i] & 1 << 31))
    }

    #[inline(always)]
    fn min(self, a: Vec4, b: Vec4) -> Vec4 {
        a.min(b)
    }

    #[inline(always)]
    fn max(self, a: Vec4, b: Vec4) -> Vec4 {
        a.max(b)
    }

    #[inline(always)]
    fn at_most(self, a: Vec4, b: Vec4) -> BVec4A {
        a.cmple(b)
    }

    #[inline(always)]
    fn grid_offset(self, origin: Vec4, _: Vec4) -> Vec4 {
        origin
    }

    #[inline(always)]
    fn grid_low(self, words: Vec4, scale: Vec4, offset: Vec4) -> Vec4 {
        let [a, b, _, _] = self::words(words);
        grid([a, b], scale, offset)
    }

    #[inline(always)]
    fn grid_numbers(self, numbers: Vec4) -> Vec4 {
        numbers
    }

    #[inline(always)]
    fn grid(self, number: f32, scale: Vec4, offset: Vec4) -> Vec4 {
        (Vec4::splat(number) - offset) * scale
    }

    #[inline(always)]
    fn grid_high(self, words: Vec4, scale: Vec4, offset: Vec4) -> Vec4 {
        let [_, _, a, b] = self::words(words);
        grid([a, b], scale, offset)
    }

    #[inline(always)]
    fn below(self, a: Vec4, b: Vec4) -> BVec4A {
        a.cmplt(b)
    }

    #[inline(always)]
    fn both(self, a: BVec4A, b: BVec4A) -> BVec4A {
        a & b
    }

    #[inline(always)]
    fn but_not(self, a: BVec4A, b: BVec4A) -> BVec4A {
        a & !b
    }

    #[inline(always)]
    fn either(self, a: BVec4A, b: BVec4A) -> BVec4A {
        a | b
    }

    #[inline(always)]
    fn bits(self, mask: BVec4A) -> u32 {
        mask.bitmask()
    }

    #[inline(always)]
    fn keys(self, distance: Vec4, met: BVec4A) -> Vec4 {
        let (distance, met) = (words(distance), met.bitmask());
        lanes(std::array::from_fn(|i| if met >> i & 1 == 1 { distance[i] & !3 | i as u32 } else { u32::MAX }))
    }

    #[inline(always)]
    fn sorted(self, keys: Vec4) -> Vec4 {
        let [a, b, c, d] = words(keys).map(|key| key as i32);
        let order = |a: i32, b: i32| (a.max(b), a.min(b));
        let (a, b) = order(a, b);
        let (c, d) = order(c, d);
        let (a, c) = order(a, c);
        let (b, d) = order(b, d);
        let (b, c) = order(b, c);
        lanes([a, b, c, d].map(|key| key as u32))
    }

    #[inline(always)]
    fn permuted(self, lanes: Vec4, by: Vec4) -> Vec4 {
        let (from, by) = (words(lanes), words(by));
        self::lanes(by.map(|lane| from[lane as usize & 3]))
    }

    #[inline(always)]
    fn bytes(self, quads: Vec4) -> [Vec4; 3] {
        let [a, b, c, _] = words(quads);
        [a, b, c].map(|four| lanes(four.to_ne_bytes().map(u32::from)))
    }

    #[inline(always)]
    fn pick<'a>(self, mut table: impl FnMut(usize) -> &'a [f32; 8], by: [Vec4; 3]) -> [Vec4; 3] {
        self.pick_from_one(table(0), by)
    }

    #[inline(always)]
    fn pick_from_one(self, table: &[f32; 8], by: [Vec4; 3]) -> [Vec4; 3] {
        by.map(|by| Vec4::from_array(words(by).map(|number| table[number as usize & 7])))
    }
}

/// Four numbers of 16 bits on the ray. The other tiers fuse a product with a difference; without, the difference comes first.
#[inline(always)]
fn grid(pairs: [u32; 2], scale: Vec4, offset: Vec4) -> Vec4 {
    let number = |i: usize| (pairs[i / 2] >> (16 * (i % 2)) & 0xffff) as f32;
    (Vec4::new(number(0), number(1), number(2), number(3)) - offset) * scale
}
