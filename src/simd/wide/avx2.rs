//! Two quads: AVX2 and FMA.

#![allow(clippy::undocumented_unsafe_blocks)] // One reason covers them all: see `Avx2`.

use super::{MOST_LANES, Wide, Words};
use glam::Vec4;
use std::arch::x86_64::*;

/// AVX2, FMA, BMI, LZCNT and POPCNT: proof that this processor has it.
///
/// SAFETY of every intrinsic below: a value of this type exists only where [`crate::simd::Tier`] found them, and
/// references are to as many bytes as are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Avx2(());

impl Avx2 {
    /// If this processor has it.
    pub(in crate::simd) fn detect() -> Option<Avx2> {
        (is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt"))
        .then_some(Avx2(()))
    }
}

/// 2²³ in the high half of a float's bits: under a 16-bit number, their sum.
const MAGIC: i16 = 0x4b00;
const MAGIC_FLOAT: f32 = 8_388_608.0;

/// The numbers of the lanes in `keep`, close together.
#[inline(always)]
fn order(keep: u32) -> __m256i {
    unsafe {
        // A byte a lane kept, of the lanes' numbers those.
        let bytes = _pdep_u64(u64::from(keep), 0x0101_0101_0101_0101) * 0xff;
        let kept = _pext_u64(0x0706_0504_0302_0100, bytes);
        _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(kept as i64))
    }
}

/// How many ones four groups of four bits have, less one.
#[inline(always)]
pub(super) fn climb(bits: u32) -> __m128i {
    unsafe {
        // A byte for each four bits; the number of their ones from a table, less one.
        let quads = _mm_cvtsi32_si128(_pdep_u32(bits, 0x0f0f_0f0f) as i32);
        let ones = _mm_setr_epi8(-1, 0, 0, 1, 0, 1, 1, 2, 0, 1, 1, 2, 1, 2, 2, 3);
        _mm_cvtepi8_epi32(_mm_shuffle_epi8(ones, quads))
    }
}

impl Wide for Avx2 {
    const RAYS: usize = 2;
    type Lanes = __m256;
    type Mask = __m256;

    #[inline(always)]
    fn gather<'a>(self, mut at: impl FnMut(usize) -> &'a Words) -> __m256 {
        unsafe {
            let quad = |words: &Words| _mm_loadu_ps(words.as_ptr().cast());
            _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(quad(at(0))), quad(at(1)))
        }
    }

    #[inline(always)]
    fn repeat(self, quad: &Words) -> __m256 {
        unsafe { _mm256_broadcast_ps(&_mm_loadu_ps(quad.as_ptr().cast())) }
    }

    #[inline(always)]
    fn load(self, from: &[f32; MOST_LANES]) -> __m256 {
        unsafe { _mm256_loadu_ps(from.as_ptr()) }
    }

    #[inline(always)]
    fn scatter(self, lanes: __m256, mut to: impl FnMut(usize, Words)) {
        unsafe {
            to(0, std::mem::transmute::<__m128, Words>(_mm256_castps256_ps128(lanes)));
            to(1, std::mem::transmute::<__m128, Words>(_mm256_extractf128_ps::<1>(lanes)));
        }
    }

    type Eight = __m256;

    #[inline(always)]
    fn eights(self, numbers: &Words) -> [__m256; 4] {
        unsafe {
            let twice = _mm256_broadcast_ps(&_mm_loadu_ps(numbers.as_ptr().cast()));
            [
                _mm256_permute_ps::<0b00_00_00_00>(twice),
                _mm256_permute_ps::<0b01_01_01_01>(twice),
                _mm256_permute_ps::<0b10_10_10_10>(twice),
                _mm256_permute_ps::<0b11_11_11_11>(twice),
            ]
        }
    }

    #[inline(always)]
    fn load8(self, from: &[u32; 8]) -> __m256 {
        unsafe { _mm256_loadu_ps(from.as_ptr().cast()) }
    }

    #[inline(always)]
    fn store8(self, numbers: __m256, to: &mut [u32]) {
        assert!(to.len() >= 8);
        unsafe { _mm256_storeu_ps(to.as_mut_ptr().cast(), numbers) }
    }

    #[inline(always)]
    fn planes8(self, words: &[u32; 8], scale: __m256, offset: __m256) -> [__m256; 2] {
        unsafe {
            let (words, magic) = (_mm256_loadu_si256(words.as_ptr().cast()), _mm256_set1_epi16(MAGIC));
            let low = _mm256_castsi256_ps(_mm256_unpacklo_epi16(words, magic));
            let high = _mm256_castsi256_ps(_mm256_unpackhi_epi16(words, magic));
            let (low, high) = (_mm256_fmadd_ps(low, scale, offset), _mm256_fmadd_ps(high, scale, offset));
            [_mm256_min_ps(low, high), _mm256_max_ps(low, high)]
        }
    }

    #[inline(always)]
    fn min8(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_min_ps(a, b) }
    }

    #[inline(always)]
    fn max8(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_max_ps(a, b) }
    }

    #[inline(always)]
    fn at_most8(self, a: __m256, b: __m256) -> u32 {
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b)) as u32 }
    }

    #[inline(always)]
    fn packed8(self, numbers: __m256, keep: u32) -> __m256 {
        unsafe { _mm256_permutevar8x32_ps(numbers, order(keep)) }
    }

    #[inline(always)]
    fn negative(self, numbers: &[u32; MOST_LANES]) -> u32 {
        unsafe { _mm256_movemask_ps(_mm256_loadu_ps(numbers.as_ptr().cast())) as u32 }
    }

    #[inline(always)]
    fn equal(self, numbers: &[u32; MOST_LANES], number: u32) -> u32 {
        unsafe {
            let numbers = _mm256_loadu_si256(numbers.as_ptr().cast());
            let equal = _mm256_cmpeq_epi32(numbers, _mm256_set1_epi32(number as i32));
            _mm256_movemask_ps(_mm256_castsi256_ps(equal)) as u32
        }
    }

    #[inline(always)]
    fn climb(self, numbers: &mut [u32], bits: u32) {
        assert!(numbers.len() >= 2);
        unsafe {
            let two = numbers.as_mut_ptr().cast();
            _mm_storel_epi64(two, _mm_add_epi32(_mm_loadl_epi64(two), climb(bits)));
        }
    }

    #[inline(always)]
    fn pack(self, numbers: &[u32; MOST_LANES], keep: u32, to: &mut [u32]) {
        assert!(to.len() >= 8);
        unsafe {
            let packed = _mm256_permutevar8x32_epi32(_mm256_loadu_si256(numbers.as_ptr().cast()), order(keep));
            _mm256_storeu_si256(to.as_mut_ptr().cast(), packed);
        }
    }

    #[inline(always)]
    fn splat(self, number: f32) -> __m256 {
        unsafe { _mm256_set1_ps(number) }
    }

    #[inline(always)]
    fn spread<const LANE: usize>(self, lanes: __m256) -> __m256 {
        unsafe {
            match LANE {
                0 => _mm256_permute_ps::<0b00_00_00_00>(lanes),
                1 => _mm256_permute_ps::<0b01_01_01_01>(lanes),
                2 => _mm256_permute_ps::<0b10_10_10_10>(lanes),
                _ => _mm256_permute_ps::<0b11_11_11_11>(lanes),
            }
        }
    }

    #[inline(always)]
    fn add(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_add_ps(a, b) }
    }

    #[inline(always)]
    fn sub(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_sub_ps(a, b) }
    }

    #[inline(always)]
    fn mul(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_mul_ps(a, b) }
    }

    #[inline(always)]
    fn about(self, a: __m256, b: __m256, c: __m256) -> __m256 {
        unsafe { _mm256_fmadd_ps(a, b, c) }
    }

    #[inline(always)]
    fn abs(self, a: __m256) -> __m256 {
        unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), a) }
    }

    #[inline(always)]
    fn flipped(self, a: __m256, by: __m256) -> __m256 {
        unsafe { _mm256_xor_ps(a, _mm256_and_ps(by, _mm256_set1_ps(-0.0))) }
    }

    #[inline(always)]
    fn min(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_min_ps(a, b) }
    }

    #[inline(always)]
    fn max(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_max_ps(a, b) }
    }

    #[inline(always)]
    fn at_most(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(a, b) }
    }

    #[inline(always)]
    fn grid_offset(self, origin: Vec4, scale: Vec4) -> Vec4 {
        // Errs by half an ulp of 2²³·scale, which is half a step of the grid.
        -(scale * MAGIC_FLOAT + origin * scale)
    }

    #[inline(always)]
    fn grid_low(self, words: __m256, scale: __m256, offset: __m256) -> __m256 {
        unsafe {
            let numbers = _mm256_unpacklo_epi16(_mm256_castps_si256(words), _mm256_set1_epi16(MAGIC));
            _mm256_fmadd_ps(_mm256_castsi256_ps(numbers), scale, offset)
        }
    }

    #[inline(always)]
    fn grid_numbers(self, numbers: Vec4) -> Vec4 {
        numbers + MAGIC_FLOAT
    }

    #[inline(always)]
    fn grid(self, number: f32, scale: __m256, offset: __m256) -> __m256 {
        unsafe { _mm256_fmadd_ps(_mm256_set1_ps(number), scale, offset) }
    }

    #[inline(always)]
    fn grid_high(self, words: __m256, scale: __m256, offset: __m256) -> __m256 {
        unsafe {
            let numbers = _mm256_unpackhi_epi16(_mm256_castps_si256(words), _mm256_set1_epi16(MAGIC));
            _mm256_fmadd_ps(_mm256_castsi256_ps(numbers), scale, offset)
        }
    }

    #[inline(always)]
    fn below(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(a, b) }
    }

    #[inline(always)]
    fn both(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_and_ps(a, b) }
    }

    #[inline(always)]
    fn but_not(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_andnot_ps(b, a) }
    }

    #[inline(always)]
    fn either(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_or_ps(a, b) }
    }

    #[inline(always)]
    fn bits(self, mask: __m256) -> u32 {
        unsafe { _mm256_movemask_ps(mask) as u32 }
    }

    #[inline(always)]
    fn keys(self, distance: __m256, met: __m256) -> __m256 {
        unsafe {
            let distance = _mm256_andnot_ps(_mm256_castsi256_ps(_mm256_set1_epi32(3)), distance);
            let lane = _mm256_castsi256_ps(_mm256_setr_epi32(0, 1, 2, 3, 0, 1, 2, 3));
            let missed = _mm256_xor_ps(met, _mm256_castsi256_ps(_mm256_set1_epi32(-1)));
            _mm256_or_ps(_mm256_or_ps(distance, lane), missed)
        }
    }

    #[inline(always)]
    fn sorted(self, keys: __m256) -> __m256 {
        unsafe {
            // Batcher's network. In each stage a lane and its partner both compute the pair's larger and smaller key.
            let keys = _mm256_castps_si256(keys);
            let partner = _mm256_shuffle_epi32::<0b10_11_00_01>(keys);
            let (large, small) = (_mm256_max_epi32(keys, partner), _mm256_min_epi32(keys, partner));
            let keys = _mm256_blend_epi32::<0b1010_1010>(large, small);
            let partner = _mm256_shuffle_epi32::<0b01_00_11_10>(keys);
            let (large, small) = (_mm256_max_epi32(keys, partner), _mm256_min_epi32(keys, partner));
            let keys = _mm256_blend_epi32::<0b1100_1100>(large, small);
            let partner = _mm256_shuffle_epi32::<0b11_01_10_00>(keys);
            let (large, small) = (_mm256_max_epi32(keys, partner), _mm256_min_epi32(keys, partner));
            _mm256_castsi256_ps(_mm256_blend_epi32::<0b1100_1100>(large, small))
        }
    }

    #[inline(always)]
    fn permuted(self, lanes: __m256, by: __m256) -> __m256 {
        unsafe { _mm256_permutevar_ps(lanes, _mm256_castps_si256(by)) }
    }

    #[inline(always)]
    fn bytes(self, quads: __m256) -> [__m256; 3] {
        unsafe {
            let quads = _mm256_castps_si256(quads);
            // Each number to the lowest byte of a lane; negative bytes of the order make the others 0.
            const UP: i32 = !0xff;
            let first = _mm256_setr_epi32(UP, UP | 1, UP | 2, UP | 3, UP, UP | 1, UP | 2, UP | 3);
            let second = _mm256_setr_epi32(UP | 4, UP | 5, UP | 6, UP | 7, UP | 4, UP | 5, UP | 6, UP | 7);
            let third = _mm256_setr_epi32(UP | 8, UP | 9, UP | 10, UP | 11, UP | 8, UP | 9, UP | 10, UP | 11);
            [
                _mm256_castsi256_ps(_mm256_shuffle_epi8(quads, first)),
                _mm256_castsi256_ps(_mm256_shuffle_epi8(quads, second)),
                _mm256_castsi256_ps(_mm256_shuffle_epi8(quads, third)),
            ]
        }
    }

    #[inline(always)]
    fn pick<'a>(self, mut table: impl FnMut(usize) -> &'a [f32; 8], [a, b, c]: [__m256; 3]) -> [__m256; 3] {
        unsafe {
            let (first, second) = (_mm256_loadu_ps(table(0).as_ptr()), _mm256_loadu_ps(table(1).as_ptr()));
            let (a, b, c) = (_mm256_castps_si256(a), _mm256_castps_si256(b), _mm256_castps_si256(c));
            // All lanes from both tables; the first quad keeps those of the first.
            let [a0, a1] = [_mm256_permutevar8x32_ps(first, a), _mm256_permutevar8x32_ps(second, a)];
            let [b0, b1] = [_mm256_permutevar8x32_ps(first, b), _mm256_permutevar8x32_ps(second, b)];
            let [c0, c1] = [_mm256_permutevar8x32_ps(first, c), _mm256_permutevar8x32_ps(second, c)];
            [_mm256_blend_ps::<0xf0>(a0, a1), _mm256_blend_ps::<0xf0>(b0, b1), _mm256_blend_ps::<0xf0>(c0, c1)]
        }
    }

    #[inline(always)]
    fn pick_from_one(self, table: &[f32; 8], [a, b, c]: [__m256; 3]) -> [__m256; 3] {
        unsafe {
            let table = _mm256_loadu_ps(table.as_ptr());
            [
                _mm256_permutevar8x32_ps(table, _mm256_castps_si256(a)),
                _mm256_permutevar8x32_ps(table, _mm256_castps_si256(b)),
                _mm256_permutevar8x32_ps(table, _mm256_castps_si256(c)),
            ]
        }
    }
}
