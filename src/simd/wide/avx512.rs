//! Four quads: AVX-512.

#![allow(clippy::undocumented_unsafe_blocks)] // One reason covers them all: see `Avx512`.

use super::{MOST_LANES, Wide, Words};
use glam::Vec4;
use std::arch::x86_64::*;

/// AVX-512 F, VL, BW and DQ, and all of [`super::avx2::Avx2`]: proof that this processor has it.
///
/// SAFETY of every intrinsic below: a value of this type exists only where [`crate::simd::Tier`] found them, and
/// references are to as many bytes as are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Avx512(());

impl Avx512 {
    /// If this processor has it.
    pub(in crate::simd) fn detect() -> Option<Avx512> {
        (super::avx2::Avx2::detect().is_some()
            && is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512dq"))
        .then_some(Avx512(()))
    }
}

/// 2²³ in the high half of a float's bits: under a 16-bit number, their sum.
const MAGIC: i16 = 0x4b00;
const MAGIC_FLOAT: f32 = 8_388_608.0;

/// The larger of two keys, as whole numbers.
#[inline(always)]
fn larger(a: __m512, b: __m512) -> __m512 {
    unsafe { _mm512_castsi512_ps(_mm512_max_epi32(_mm512_castps_si512(a), _mm512_castps_si512(b))) }
}

/// The smaller of two keys.
#[inline(always)]
fn smaller(a: __m512, b: __m512) -> __m512 {
    unsafe { _mm512_castsi512_ps(_mm512_min_epi32(_mm512_castps_si512(a), _mm512_castps_si512(b))) }
}

impl Wide for Avx512 {
    const RAYS: usize = 4;
    type Lanes = __m512;
    type Mask = __mmask16;

    #[inline(always)]
    fn gather<'a>(self, mut at: impl FnMut(usize) -> &'a Words) -> __m512 {
        unsafe {
            let quad = |words: &Words| _mm_loadu_ps(words.as_ptr().cast());
            let lanes = _mm512_castps128_ps512(quad(at(0)));
            let lanes = _mm512_insertf32x4::<1>(lanes, quad(at(1)));
            let lanes = _mm512_insertf32x4::<2>(lanes, quad(at(2)));
            _mm512_insertf32x4::<3>(lanes, quad(at(3)))
        }
    }

    #[inline(always)]
    fn repeat(self, quad: &Words) -> __m512 {
        unsafe { _mm512_broadcast_f32x4(_mm_loadu_ps(quad.as_ptr().cast())) }
    }

    #[inline(always)]
    fn load(self, from: &[f32; MOST_LANES]) -> __m512 {
        unsafe { _mm512_loadu_ps(from.as_ptr()) }
    }

    #[inline(always)]
    fn scatter(self, lanes: __m512, mut to: impl FnMut(usize, Words)) {
        unsafe {
            to(0, std::mem::transmute::<__m128, Words>(_mm512_castps512_ps128(lanes)));
            to(1, std::mem::transmute::<__m128, Words>(_mm512_extractf32x4_ps::<1>(lanes)));
            to(2, std::mem::transmute::<__m128, Words>(_mm512_extractf32x4_ps::<2>(lanes)));
            to(3, std::mem::transmute::<__m128, Words>(_mm512_extractf32x4_ps::<3>(lanes)));
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
        unsafe { u32::from(_mm256_cmp_ps_mask::<_CMP_LE_OQ>(a, b)) }
    }

    #[inline(always)]
    fn packed8(self, numbers: __m256, keep: u32) -> __m256 {
        unsafe { _mm256_maskz_compress_ps(keep as u8, numbers) }
    }

    #[inline(always)]
    fn negative(self, numbers: &[u32; MOST_LANES]) -> u32 {
        unsafe { u32::from(_mm512_movepi32_mask(_mm512_loadu_si512(numbers.as_ptr().cast()))) }
    }

    #[inline(always)]
    fn equal(self, numbers: &[u32; MOST_LANES], number: u32) -> u32 {
        unsafe {
            let numbers = _mm512_loadu_si512(numbers.as_ptr().cast());
            u32::from(_mm512_cmpeq_epi32_mask(numbers, _mm512_set1_epi32(number as i32)))
        }
    }

    #[inline(always)]
    fn climb(self, numbers: &mut [u32], bits: u32) {
        assert!(numbers.len() >= 4);
        unsafe {
            let four = numbers.as_mut_ptr().cast();
            _mm_storeu_si128(four, _mm_add_epi32(_mm_loadu_si128(four), super::avx2::climb(bits)));
        }
    }

    #[inline(always)]
    fn pack(self, numbers: &[u32; MOST_LANES], keep: u32, to: &mut [u32]) {
        assert!(to.len() >= MOST_LANES);
        unsafe {
            let packed = _mm512_maskz_compress_epi32(keep as u16, _mm512_loadu_si512(numbers.as_ptr().cast()));
            _mm512_storeu_si512(to.as_mut_ptr().cast(), packed);
        }
    }

    #[inline(always)]
    fn splat(self, number: f32) -> __m512 {
        unsafe { _mm512_set1_ps(number) }
    }

    #[inline(always)]
    fn spread<const LANE: usize>(self, lanes: __m512) -> __m512 {
        unsafe {
            match LANE {
                0 => _mm512_permute_ps::<0b00_00_00_00>(lanes),
                1 => _mm512_permute_ps::<0b01_01_01_01>(lanes),
                2 => _mm512_permute_ps::<0b10_10_10_10>(lanes),
                _ => _mm512_permute_ps::<0b11_11_11_11>(lanes),
            }
        }
    }

    #[inline(always)]
    fn add(self, a: __m512, b: __m512) -> __m512 {
        unsafe { _mm512_add_ps(a, b) }
    }

    #[inline(always)]
    fn sub(self, a: __m512, b: __m512) -> __m512 {
        unsafe { _mm512_sub_ps(a, b) }
    }

    #[inline(always)]
    fn mul(self, a: __m512, b: __m512) -> __m512 {
        unsafe { _mm512_mul_ps(a, b) }
    }

    #[inline(always)]
    fn about(self, a: __m512, b: __m512, c: __m512) -> __m512 {
        unsafe { _mm512_fmadd_ps(a, b, c) }
    }

    #[inline(always)]
    fn abs(self, a: __m512) -> __m512 {
        unsafe { _mm512_abs_ps(a) }
    }

    #[inline(always)]
    fn flipped(self, a: __m512, by: __m512) -> __m512 {
        unsafe { _mm512_xor_ps(a, _mm512_and_ps(by, _mm512_set1_ps(-0.0))) }
    }

    #[inline(always)]
    fn min(self, a: __m512, b: __m512) -> __m512 {
        unsafe { _mm512_min_ps(a, b) }
    }

    #[inline(always)]
    fn max(self, a: __m512, b: __m512) -> __m512 {
        unsafe { _mm512_max_ps(a, b) }
    }

    #[inline(always)]
    fn at_most(self, a: __m512, b: __m512) -> __mmask16 {
        unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(a, b) }
    }

    #[inline(always)]
    fn grid_offset(self, origin: Vec4, scale: Vec4) -> Vec4 {
        // Errs by half an ulp of 2²³·scale, which is half a step of the grid.
        -(scale * MAGIC_FLOAT + origin * scale)
    }

    #[inline(always)]
    fn grid_low(self, words: __m512, scale: __m512, offset: __m512) -> __m512 {
        unsafe {
            let numbers = _mm512_unpacklo_epi16(_mm512_castps_si512(words), _mm512_set1_epi16(MAGIC));
            _mm512_fmadd_ps(_mm512_castsi512_ps(numbers), scale, offset)
        }
    }

    #[inline(always)]
    fn grid_numbers(self, numbers: Vec4) -> Vec4 {
        numbers + MAGIC_FLOAT
    }

    #[inline(always)]
    fn grid(self, number: f32, scale: __m512, offset: __m512) -> __m512 {
        unsafe { _mm512_fmadd_ps(_mm512_set1_ps(number), scale, offset) }
    }

    #[inline(always)]
    fn grid_high(self, words: __m512, scale: __m512, offset: __m512) -> __m512 {
        unsafe {
            let numbers = _mm512_unpackhi_epi16(_mm512_castps_si512(words), _mm512_set1_epi16(MAGIC));
            _mm512_fmadd_ps(_mm512_castsi512_ps(numbers), scale, offset)
        }
    }

    #[inline(always)]
    fn below(self, a: __m512, b: __m512) -> __mmask16 {
        unsafe { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, b) }
    }

    #[inline(always)]
    fn both(self, a: __mmask16, b: __mmask16) -> __mmask16 {
        a & b
    }

    #[inline(always)]
    fn but_not(self, a: __mmask16, b: __mmask16) -> __mmask16 {
        a & !b
    }

    #[inline(always)]
    fn either(self, a: __mmask16, b: __mmask16) -> __mmask16 {
        a | b
    }

    #[inline(always)]
    fn bits(self, mask: __mmask16) -> u32 {
        u32::from(mask)
    }

    #[inline(always)]
    fn keys(self, distance: __m512, met: __mmask16) -> __m512 {
        unsafe {
            // (distance & !3) | lane, in one instruction; −1 where missed.
            let lane = _mm512_setr4_epi32(0, 1, 2, 3);
            let distance = _mm512_castps_si512(distance);
            let keys = _mm512_ternarylogic_epi32::<0b1011_1010>(distance, _mm512_set1_epi32(3), lane);
            _mm512_castsi512_ps(_mm512_mask_mov_epi32(_mm512_set1_epi32(-1), met, keys))
        }
    }

    #[inline(always)]
    fn sorted(self, keys: __m512) -> __m512 {
        unsafe {
            // Batcher's network. The second vector that each stage compares with is made by the shuffle that merges the larger and the
            // smaller keys of the stage before: there is no blend by a constant but through a register of masks.
            // Lanes 0 and 1, 2 and 3.
            let partner = _mm512_permute_ps::<0b10_11_00_01>(keys);
            let (large, small) = (larger(keys, partner), smaller(keys, partner));
            // The larger of the pairs, and the smaller.
            let a = _mm512_shuffle_ps::<0b00_00_00_00>(large, small);
            let b = _mm512_shuffle_ps::<0b10_10_10_10>(large, small);
            let (large, small) = (larger(a, b), smaller(a, b));
            // Largest, two between, smallest.
            let keys = _mm512_shuffle_ps::<0b10_00_10_00>(large, small);
            let swapped = _mm512_permute_ps::<0b11_01_10_00>(keys);
            _mm512_shuffle_ps::<0b11_10_01_00>(larger(keys, swapped), smaller(keys, swapped))
        }
    }

    #[inline(always)]
    fn permuted(self, lanes: __m512, by: __m512) -> __m512 {
        unsafe { _mm512_permutevar_ps(lanes, _mm512_castps_si512(by)) }
    }

    #[inline(always)]
    fn bytes(self, quads: __m512) -> [__m512; 3] {
        unsafe {
            let quads = _mm512_castps_si512(quads);
            // Each number to the lowest byte of a lane; negative bytes of the order make the others 0.
            const UP: i32 = !0xff;
            let first = _mm512_setr4_epi32(UP, UP | 1, UP | 2, UP | 3);
            let second = _mm512_setr4_epi32(UP | 4, UP | 5, UP | 6, UP | 7);
            let third = _mm512_setr4_epi32(UP | 8, UP | 9, UP | 10, UP | 11);
            [
                _mm512_castsi512_ps(_mm512_shuffle_epi8(quads, first)),
                _mm512_castsi512_ps(_mm512_shuffle_epi8(quads, second)),
                _mm512_castsi512_ps(_mm512_shuffle_epi8(quads, third)),
            ]
        }
    }

    #[inline(always)]
    fn pick<'a>(self, mut table: impl FnMut(usize) -> &'a [f32; 8], [a, b, c]: [__m512; 3]) -> [__m512; 3] {
        unsafe {
            // Two tables a vector, so that all four are within reach of numbers of five bits.
            let eight = |table: &[f32; 8]| _mm256_loadu_ps(table.as_ptr());
            let low = _mm512_insertf32x8::<1>(_mm512_castps256_ps512(eight(table(0))), eight(table(1)));
            let high = _mm512_insertf32x8::<1>(_mm512_castps256_ps512(eight(table(2))), eight(table(3)));
            let own = _mm512_setr_epi32(0, 0, 0, 0, 8, 8, 8, 8, 16, 16, 16, 16, 24, 24, 24, 24);
            // (number & 7) | own, in one instruction.
            let seven = _mm512_set1_epi32(7);
            let (a, b, c) = (_mm512_castps_si512(a), _mm512_castps_si512(b), _mm512_castps_si512(c));
            [
                _mm512_permutex2var_ps(low, _mm512_ternarylogic_epi32::<0b1110_1010>(a, seven, own), high),
                _mm512_permutex2var_ps(low, _mm512_ternarylogic_epi32::<0b1110_1010>(b, seven, own), high),
                _mm512_permutex2var_ps(low, _mm512_ternarylogic_epi32::<0b1110_1010>(c, seven, own), high),
            ]
        }
    }

    #[inline(always)]
    fn pick_from_one(self, table: &[f32; 8], [a, b, c]: [__m512; 3]) -> [__m512; 3] {
        unsafe {
            // Twice, so that the fourth bit does not matter.
            let table = _mm512_broadcast_f32x8(_mm256_loadu_ps(table.as_ptr()));
            [
                _mm512_permutexvar_ps(_mm512_castps_si512(a), table),
                _mm512_permutexvar_ps(_mm512_castps_si512(b), table),
                _mm512_permutexvar_ps(_mm512_castps_si512(c), table),
            ]
        }
    }
}
