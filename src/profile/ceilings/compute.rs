//! What one thread computes at most.

use std::hint::black_box;
use std::time::Instant;

use crate::simd::Tier;
use crate::simd::wide::{Wide, WideKernel};

/// Independent chains of vectors: as many as fit in the sixteen registers of AVX2 beside two constants and a product. They
/// cover two multiplications and two additions a cycle, of three cycles each.
const VECTORS: usize = 12;
/// Independent chains of integers, likewise. A step of one takes seven cycles or more, and five operations: so this keeps the
/// widest processors there are busy.
const INTEGERS: usize = 10;
/// Operations of a step of a chain.
const OPERATIONS: usize = 5;
/// Steps of a sample: about half a millisecond.
const STEPS: usize = 50_000;

/// 32-bit lanes of a vector.
pub fn lanes(tier: Tier) -> usize {
    tier.run_wide(Lanes)
}

/// Multiplications and additions a second, of all lanes.
pub fn vector(tier: Tier) -> f64 {
    let operations = STEPS * VECTORS * lanes(tier) * 2;
    rate(operations, || tier.run_wide(Vectors { factor: black_box(0.5), term: black_box(1.0) }))
}

/// Integer operations a second.
pub fn integer() -> f64 {
    rate(STEPS * INTEGERS * OPERATIONS, || integers(black_box([1; INTEGERS]), black_box(3), black_box(5), black_box(7)))
}

fn rate<T>(operations: usize, work: impl FnOnce() -> T) -> f64 {
    let start = Instant::now();
    black_box(work());
    operations as f64 / start.elapsed().as_secs_f64()
}

/// How many there are in a vector.
struct Lanes;

impl WideKernel for Lanes {
    type Output = usize;

    #[inline(always)]
    fn run<W: Wide>(self, _: W) -> usize {
        4 * W::RAYS
    }
}

/// `x ← x·factor + term` in all chains, again and again. The sum of all that they reach.
struct Vectors {
    factor: f32,
    term: f32,
}

impl WideKernel for Vectors {
    type Output = f32;

    #[inline(always)]
    fn run<W: Wide>(self, wide: W) -> f32 {
        let (factor, term) = (wide.splat(self.factor), wide.splat(self.term));
        let mut chains: [W::Lanes; VECTORS] = std::array::from_fn(|chain| wide.splat(chain as f32));
        for _ in 0..STEPS {
            for chain in &mut chains {
                *chain = wide.add(wide.mul(*chain, factor), term);
            }
        }
        let mut sum = 0.0;
        for chain in chains {
            wide.scatter(chain, |_, words| sum += words.into_iter().map(f32::from_bits).sum::<f32>());
        }
        sum
    }
}

/// Additions and exclusive ors, and a multiplication to keep the compiler from making vectors of the chains: that would take more
/// operations than it saves.
#[inline(never)]
fn integers(mut chains: [u64; INTEGERS], term: u64, bits: u64, factor: u64) -> [u64; INTEGERS] {
    for _ in 0..STEPS {
        for chain in &mut chains {
            *chain = ((chain.wrapping_add(term) ^ bits).wrapping_add(term) ^ bits).wrapping_mul(factor);
        }
    }
    chains
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chains_are_computed() {
        for tier in Tier::available() {
            // Half of what is missing to 2 is missing after each step.
            let sum = tier.run_wide(Vectors { factor: 0.5, term: 1.0 });
            assert_eq!(sum, 2.0 * (VECTORS * lanes(tier)) as f32, "{}", tier.name());
        }
        assert_eq!(integers([7; INTEGERS], 2, 0, 1), [7 + 4 * STEPS as u64; INTEGERS]);
        assert_eq!(integers([7; INTEGERS], 0, 9, 1), [7; INTEGERS]);
    }
}
