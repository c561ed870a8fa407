//! Instruction-set tiers, and the home of `unsafe` (but for calls into C libraries, [`crate::peer`]).
//!
//! A kernel is written once, as a plain `#[inline(always)]` body: loops that the compiler makes vectors of, or [`glam::Vec4`]. [`Tier::run`] compiles
//! that body once for each tier and calls the one asked for; it is meant to be called once a batch, never once
//! a ray. The compiler fuses and reorders nothing by itself, so all tiers give the same bits.

#![allow(unsafe_code)]

pub mod aligned;
pub mod wide;

use glam::Vec4;

use crate::error::{Error, Result};
use crate::options::Simd;
#[cfg(target_arch = "x86_64")]
use wide::{Avx2, Avx512};
use wide::{Quad, WideKernel};

/// The instruction set that a batch runs with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tier {
    /// What every processor of the architecture has.
    Baseline,
    /// AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    /// AVX-512 in the kernels over [`wide::Wide`] vectors, AVX2 in the others.
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx2, Avx512),
}

impl Tier {
    /// The tier to use, given the option; an error if the option forces one that this processor lacks.
    pub fn detect(option: Simd) -> Result<Tier> {
        match option {
            Simd::Baseline => Ok(Tier::Baseline),
            Simd::Auto => Ok(Tier::available().pop().unwrap_or(Tier::Baseline)),
            Simd::Avx2 => Tier::named("avx2")
                .ok_or_else(|| Error::Options("this processor has no AVX2 and FMA: use --simd baseline".into())),
            Simd::Avx512 => Tier::named("avx512")
                .ok_or_else(|| Error::Options("this processor has no AVX-512: use --simd avx2 or baseline".into())),
        }
    }

    /// The tier of that name, if this processor has it.
    fn named(name: &str) -> Option<Tier> {
        Tier::available().into_iter().find(|tier| tier.name() == name)
    }

    /// For reports.
    pub fn name(self) -> &'static str {
        match self {
            Tier::Baseline => "baseline",
            #[cfg(target_arch = "x86_64")]
            Tier::Avx2(_) => "avx2",
            #[cfg(target_arch = "x86_64")]
            Tier::Avx512(..) => "avx512",
        }
    }

    /// Every tier that this processor has, the best last: what tests run through.
    pub fn available() -> Vec<Tier> {
        #[allow(unused_mut)]
        let mut tiers = vec![Tier::Baseline];
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = Avx2::detect() {
            tiers.push(Tier::Avx2(avx2));
            tiers.extend(Avx512::detect().map(|avx512| Tier::Avx512(avx2, avx512)));
        }
        tiers
    }

    /// Runs `kernel`, compiled for this tier.
    #[inline]
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self {
            Tier::Baseline => kernel.run(),
            // SAFETY: the token exists, so the processor has every feature that the shell enables.
            #[cfg(target_arch = "x86_64")]
            Tier::Avx2(_) | Tier::Avx512(..) => unsafe { run_avx2(kernel) },
        }
    }

    /// Runs `kernel` with the widest vectors of this tier.
    #[inline]
    pub fn run_wide<K: WideKernel>(self, kernel: K) -> K::Output {
        match self {
            Tier::Baseline => kernel.run(Quad),
            // SAFETY: the token exists, so the processor has every feature that the shell enables.
            #[cfg(target_arch = "x86_64")]
            Tier::Avx2(avx2) => unsafe { run_wide_avx2(kernel, avx2) },
            // SAFETY: likewise.
            #[cfg(target_arch = "x86_64")]
            Tier::Avx512(_, avx512) => unsafe { run_wide_avx512(kernel, avx512) },
        }
    }
}

/// Where something lies, for [`prefetch_line`] alone.
#[derive(Clone, Copy, Debug)]
pub struct Address(*const i8);

impl Address {
    /// Of `items[index]`, or of where that would be.
    #[inline(always)]
    pub fn of<T>(items: &[T], index: usize) -> Address {
        Address(items.as_ptr().wrapping_add(index).cast())
    }
}

impl Address {
    /// So many bytes on.
    #[inline(always)]
    pub fn plus(self, bytes: usize) -> Address {
        Address(self.0.wrapping_add(bytes))
    }
}

/// Asks for a cache line; does nothing where the architecture has no such instruction on stable Rust.
#[inline(always)]
pub fn prefetch_line(address: Address) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: a hint: it changes nothing that the program can see, and no address makes it fault.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(address.0) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = address;
}

/// Eight 16-bit numbers as floats, the first four and the others.
#[inline(always)]
pub fn floats(numbers: &[[u16; 4]; 2]) -> [Vec4; 2] {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{
            _mm_castsi128_ps, _mm_loadu_si128, _mm_set1_epi16, _mm_unpackhi_epi16, _mm_unpacklo_epi16,
        };
        // Under the high half of 2²³, a number is their sum.
        let both = Vec4::splat(8_388_608.0);
        // SAFETY: SSE2 is part of every x86-64 processor, and the reference is to the 16 bytes that are read.
        let [low, high] = unsafe {
            let (numbers, magic) = (_mm_loadu_si128(numbers.as_ptr().cast()), _mm_set1_epi16(0x4b00));
            [_mm_unpacklo_epi16(numbers, magic), _mm_unpackhi_epi16(numbers, magic)].map(|v| _mm_castsi128_ps(v))
        };
        [Vec4::from(low) - both, Vec4::from(high) - both]
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        numbers.map(|four| Vec4::from_array(four.map(f32::from)))
    }
}

/// A batch kernel. `run` and everything it calls in its loops must be `#[inline(always)]`: code that stays a
/// function of its own is compiled for the baseline.
pub trait Kernel {
    /// What the batch gives back.
    type Output;
    /// The body.
    fn run(self) -> Self::Output;
}

/// The AVX2 shell.
///
/// # Safety
/// The processor must have the features named here; an [`Avx2`] says so.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
unsafe fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}

/// The AVX2 shell of wide kernels.
///
/// # Safety
/// As for [`run_avx2`].
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
unsafe fn run_wide_avx2<K: WideKernel>(kernel: K, avx2: Avx2) -> K::Output {
    kernel.run(avx2)
}

/// The AVX-512 shell of wide kernels.
///
/// # Safety
/// The processor must have the features named here; an [`Avx512`] says so.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx512bw,avx512dq,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
unsafe fn run_wide_avx512<K: WideKernel>(kernel: K, avx512: Avx512) -> K::Output {
    kernel.run(avx512)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Products and sums that fusing would round differently.
    struct Sum<'a>(&'a [f32]);

    impl Kernel for Sum<'_> {
        type Output = f32;
        #[inline(always)]
        fn run(self) -> f32 {
            self.0.iter().fold(0.0, |sum, x| sum * 0.7 + x * 1.3)
        }
    }

    #[test]
    fn tiers_give_the_same_bits() {
        let numbers: Vec<f32> = (1..1000).map(|i| 1.0 / i as f32).collect();
        let expected = Sum(&numbers).run();
        for tier in Tier::available() {
            assert_eq!(tier.run(Sum(&numbers)), expected, "{}", tier.name());
        }
    }

    #[test]
    fn numbers_become_floats() {
        let numbers = [[0, 1, 255, 256], [32767, 32768, 65534, 65535]];
        assert_eq!(floats(&numbers), numbers.map(|four: [u16; 4]| Vec4::from_array(four.map(f32::from))));
    }

    #[test]
    fn options_choose_the_tier() {
        assert_eq!(Tier::detect(Simd::Baseline).unwrap(), Tier::Baseline);
        assert_eq!(Some(&Tier::detect(Simd::Auto).unwrap()), Tier::available().last());
        for (simd, name) in [(Simd::Avx2, "avx2"), (Simd::Avx512, "avx512")] {
            assert_eq!(Tier::detect(simd).ok(), Tier::available().into_iter().find(|tier| tier.name() == name));
        }
    }
}
