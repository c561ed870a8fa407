//! Instruction-set tiers, and the only home of `unsafe`.
//!
//! A kernel is written once, as a plain `#[inline(always)]` body over [`glam::Vec4`]. [`Tier::run`] compiles
//! that body once for each tier and calls the one asked for; it is meant to be called once a batch, never once
//! a ray. Only [`Lanes`] differs between tiers, and only where a difference in rounding cannot reach the picture.

#![allow(unsafe_code)]

use glam::Vec4;

use crate::error::{Error, Result};
use crate::options::Simd;

/// The instruction set that a batch runs with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tier {
    /// What every processor of the architecture has.
    Baseline,
    /// AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
}

/// Proof that this processor has AVX2, FMA, BMI and POPCNT: only [`Tier::detect`] makes one.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Avx2(());

/// Marker of the baseline tier.
#[derive(Clone, Copy, Debug)]
pub struct Baseline;

impl Tier {
    /// The tier to use, given the option; an error if the option forces one that this processor lacks.
    pub fn detect(option: Simd) -> Result<Tier> {
        match option {
            Simd::Baseline => Ok(Tier::Baseline),
            Simd::Auto => Ok(best().unwrap_or(Tier::Baseline)),
            Simd::Avx2 => {
                best().ok_or_else(|| Error::Options("this processor has no AVX2 and FMA: use --simd baseline".into()))
            }
        }
    }

    /// For reports.
    pub fn name(self) -> &'static str {
        match self {
            Tier::Baseline => "baseline",
            #[cfg(target_arch = "x86_64")]
            Tier::Avx2(_) => "avx2",
        }
    }

    /// Every tier that this processor has: what tests run through.
    pub fn available() -> Vec<Tier> {
        std::iter::once(Tier::Baseline).chain(best()).collect()
    }

    /// Runs `kernel`, compiled for this tier.
    #[inline]
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self {
            Tier::Baseline => kernel.run(Baseline),
            // SAFETY: the token exists, so the processor has every feature that the shell enables.
            #[cfg(target_arch = "x86_64")]
            Tier::Avx2(token) => unsafe { run_avx2(kernel, token) },
        }
    }
}

/// The best tier above the baseline, if there is one.
fn best() -> Option<Tier> {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("fma")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("lzcnt")
        && is_x86_feature_detected!("popcnt")
    {
        return Some(Tier::Avx2(Avx2(())));
    }
    None
}

/// A batch kernel. `run` and everything it calls in its loops must be `#[inline(always)]`: code that stays a
/// function of its own is compiled for the baseline.
pub trait Kernel {
    /// What the batch gives back.
    type Output;
    /// The body.
    fn run<L: Lanes>(self, lanes: L) -> Self::Output;
}

/// Four-lane operations that tiers round differently.
pub trait Lanes: Copy {
    /// `a·b − c`, fused or not. For conservative tests only, never for what reaches the picture.
    fn mul_sub(self, a: Vec4, b: Vec4, c: Vec4) -> Vec4;
}

impl Lanes for Baseline {
    #[inline(always)]
    fn mul_sub(self, a: Vec4, b: Vec4, c: Vec4) -> Vec4 {
        a * b - c
    }
}

#[cfg(target_arch = "x86_64")]
impl Lanes for Avx2 {
    #[inline(always)]
    fn mul_sub(self, a: Vec4, b: Vec4, c: Vec4) -> Vec4 {
        // SAFETY: `self` is proof that the processor has FMA.
        unsafe { std::arch::x86_64::_mm_fmsub_ps(a.into(), b.into(), c.into()) }.into()
    }
}

/// The AVX2 shell.
///
/// # Safety
/// The processor must have the features named here; the token says so.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
unsafe fn run_avx2<K: Kernel>(kernel: K, token: Avx2) -> K::Output {
    kernel.run(token)
}

#[cfg(test)]
mod tests {
    use super::*;

    struct MulSub(Vec4, Vec4, Vec4);

    impl Kernel for MulSub {
        type Output = Vec4;
        #[inline(always)]
        fn run<L: Lanes>(self, lanes: L) -> Vec4 {
            lanes.mul_sub(self.0, self.1, self.2)
        }
    }

    #[test]
    fn every_tier_multiplies_and_subtracts() {
        for tier in Tier::available() {
            let result = tier.run(MulSub(Vec4::new(1.0, 2.0, 3.0, 4.0), Vec4::splat(2.0), Vec4::splat(1.0)));
            assert_eq!(result, Vec4::new(1.0, 3.0, 5.0, 7.0), "{}", tier.name());
        }
    }

    #[test]
    fn options_choose_the_tier() {
        assert_eq!(Tier::detect(Simd::Baseline).unwrap(), Tier::Baseline);
        assert_eq!(Tier::detect(Simd::Auto).unwrap(), best().unwrap_or(Tier::Baseline));
        assert_eq!(Tier::detect(Simd::Avx2).is_ok(), best().is_some());
    }
}
