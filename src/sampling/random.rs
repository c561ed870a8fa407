//! Random numbers as a pure function of where they are used.
//!
//! `pcg4d` (Jarzynski & Olano, *Hash Functions for GPU Rendering*, JCGT 9(3), 2020) turns (pixel, sample,
//! dimension, seed) into four numbers. No state: any stage may draw the numbers of any path in any order, and the
//! picture does not depend on who drew first.

/// Where a set of four random numbers belongs: which decision of a path it serves.
///
/// Block 0 is the camera. Each vertex then owns `1 + light_samples` blocks: the continuing ray and roulette first,
/// then one a light sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dimensions {
    /// Light (or hemisphere) samples a vertex.
    pub light_samples: u32,
}

impl Dimensions {
    /// The camera's block.
    pub const CAMERA: u32 = 0;

    /// The block of the rays that look for lamps. Those of vertices count upwards.
    pub const LAMPS: u32 = u32::MAX - 1;

    /// The block of the lot that says which pixels share paths.
    pub const SHARING: u32 = u32::MAX;

    /// The block of the continuing ray at vertex `depth` (0 is the first surface): two numbers for the direction,
    /// one for roulette.
    ///
    /// Wraps around where depth × samples exceeds 2³²: such a path has long lost all throughput, and at worst draws
    /// numbers that it has drawn before.
    #[inline(always)]
    pub fn bounce(self, depth: u32) -> u32 {
        depth.wrapping_mul(1 + self.light_samples).wrapping_add(1)
    }

    /// The block of light sample `k` at vertex `depth`.
    #[inline(always)]
    pub fn light(self, depth: u32, k: u32) -> u32 {
        self.bounce(depth).wrapping_add(1 + k)
    }
}

/// Four numbers in [0, 1) for one decision.
#[inline(always)]
pub fn uniform4(pixel: u32, sample: u32, dimension: u32, seed: u32) -> [f32; 4] {
    pcg4d([pixel, sample, dimension, seed]).map(to_unit)
}

/// The 24 high bits as a number in [0, 1): every value is representable, 1 is never reached.
#[inline(always)]
pub fn to_unit(bits: u32) -> f32 {
    // Through i32, which SSE2 converts in one instruction; the value is below 2²⁴ either way.
    (bits >> 8) as i32 as f32 * (1.0 / (1u32 << 24) as f32)
}

/// The hash: four words in, four words out.
#[inline(always)]
pub fn pcg4d(v: [u32; 4]) -> [u32; 4] {
    let [mut x, mut y, mut z, mut w] = v.map(|a| a.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    x = x.wrapping_add(y.wrapping_mul(w));
    y = y.wrapping_add(z.wrapping_mul(x));
    z = z.wrapping_add(x.wrapping_mul(y));
    w = w.wrapping_add(y.wrapping_mul(z));
    x ^= x >> 16;
    y ^= y >> 16;
    z ^= z >> 16;
    w ^= w >> 16;
    x = x.wrapping_add(y.wrapping_mul(w));
    y = y.wrapping_add(z.wrapping_mul(x));
    z = z.wrapping_add(x.wrapping_mul(y));
    w = w.wrapping_add(y.wrapping_mul(z));
    [x, y, z, w]
}

/// A hash of one word: `lowbias32` (Wellons, *Prospecting for Hash Functions*, 2018), moved off its fixed point 0.
///
/// All its bits are good. The low ones of [`pcg4d`] are not: with its words as keys, pairs of scrambled numbers over many seeds
/// had a χ² of 12,600 for 255 degrees of freedom.
#[inline(always)]
pub fn mix(word: u32) -> u32 {
    let word = word.wrapping_add(0x9e37_79b9);
    let word = (word ^ word >> 16).wrapping_mul(0x7feb_352d);
    let word = (word ^ word >> 15).wrapping_mul(0x846c_a68b);
    word ^ word >> 16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_matches_a_transcription_of_the_paper() {
        // The paper's listing, done in u64 and reduced: no wrapping operators shared with the code above.
        fn m(a: u64) -> u64 {
            a % (1 << 32)
        }
        let mut v = [1u64, 2, 3, 4].map(|a| m(a * 1_664_525 + 1_013_904_223));
        for round in 0..2 {
            v[0] = m(v[0] + m(v[1] * v[3]));
            v[1] = m(v[1] + m(v[2] * v[0]));
            v[2] = m(v[2] + m(v[0] * v[1]));
            v[3] = m(v[3] + m(v[1] * v[2]));
            if round == 0 {
                v = v.map(|a| a ^ (a >> 16));
            }
        }
        assert_eq!(pcg4d([1, 2, 3, 4]).map(u64::from), v);
    }

    #[test]
    fn numbers_stay_in_the_half_open_interval() {
        assert_eq!(to_unit(0), 0.0);
        assert!(to_unit(u32::MAX) < 1.0);
    }

    #[test]
    fn blocks_of_different_decisions_never_coincide() {
        let d = Dimensions { light_samples: 3 };
        let mut seen = std::collections::HashSet::from([Dimensions::CAMERA]);
        for depth in 0..20 {
            assert!(seen.insert(d.bounce(depth)));
            for k in 0..3 {
                assert!(seen.insert(d.light(depth, k)));
            }
        }
    }

    /// χ² of 16×16×… cells over pairs of neighbouring outputs, pixels, samples and dimensions.
    #[test]
    fn pairs_are_uniform_in_every_direction_of_use() {
        use statrs::distribution::{ChiSquared, ContinuousCDF};
        type Pair = fn(u32) -> (f32, f32);
        let pairs: [(&str, Pair); 6] = [
            ("two numbers of a block", |i| {
                let r = uniform4(i % 4096, i / 4096, 3, 0);
                (r[0], r[1])
            }),
            ("third and fourth", |i| {
                let r = uniform4(i % 4096, i / 4096, 3, 0);
                (r[2], r[3])
            }),
            ("neighbouring pixels", |i| (uniform4(i, 5, 1, 7)[0], uniform4(i + 1, 5, 1, 7)[0])),
            ("successive samples", |i| (uniform4(11, i, 1, 7)[1], uniform4(11, i + 1, 1, 7)[1])),
            ("successive dimensions", |i| (uniform4(11, i, 1, 7)[2], uniform4(11, i, 2, 7)[2])),
            ("successive seeds", |i| (uniform4(11, i, 1, 7)[0], uniform4(11, i, 1, 8)[0])),
        ];
        for (what, pair) in pairs {
            let n = 1u32 << 20;
            let mut cells = vec![0u32; 32 * 32];
            for i in 0..n {
                let (a, b) = pair(i);
                cells[(a * 32.0) as usize * 32 + (b * 32.0) as usize] += 1;
            }
            let expected = f64::from(n) / cells.len() as f64;
            let chi2: f64 = cells.iter().map(|&c| (f64::from(c) - expected).powi(2) / expected).sum();
            let p = 1.0 - ChiSquared::new(cells.len() as f64 - 1.0).unwrap().cdf(chi2);
            // Two-sided at 1e-4, Šidák over the six cases.
            assert!(p > 1.6e-5 && p < 1.0 - 1.6e-5, "{what}: χ² = {chi2:.0}, p = {p:e}");
        }
    }
}
