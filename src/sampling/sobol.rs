//! The Sobol sequence, shuffled and scrambled by hashes: as many dimensions and samples as anybody asks for, from no state.
//!
//! Points are those of Sobol with the direction numbers of Joe & Kuo (*Constructing Sobol Sequences with Better
//! Two-Dimensional Projections*, SISC 30(5), 2008), randomised by Owen's nested uniform scrambling in the form of a
//! hash: Burley, *Practical Hash-based Owen Scrambling*, JCGT 9(4), 2020, after Laine & Karras 2011, with the
//! constants of Vegdahl (*Building a Better LK Hash*, 2021).
//!
//! Everything here works on *bit-reversed* numbers, where "a bit may depend on those above it" is what addition and
//! multiplication do by themselves; only a finished number is turned around.

/// Dimensions with direction numbers of their own.
pub const DIMENSIONS: usize = 32;

/// Primitive polynomials over GF(2), and initial numbers m₁ m₂ …, of the dimensions behind the first (van der Corput's):
/// the head of `new-joe-kuo-6.21201`.
const JOE_KUO: [(u32, &[u32]); DIMENSIONS - 1] = [
    (0b11, &[1]),
    (0b111, &[1, 3]),
    (0b1011, &[1, 3, 1]),
    (0b1101, &[1, 1, 1]),
    (0b10011, &[1, 1, 3, 3]),
    (0b11001, &[1, 3, 5, 13]),
    (0b100101, &[1, 1, 5, 5, 17]),
    (0b101001, &[1, 1, 5, 5, 5]),
    (0b101111, &[1, 1, 7, 11, 19]),
    (0b110111, &[1, 1, 5, 1, 1]),
    (0b111011, &[1, 1, 1, 3, 11]),
    (0b111101, &[1, 3, 5, 5, 31]),
    (0b1000011, &[1, 3, 3, 9, 7, 49]),
    (0b1011011, &[1, 1, 1, 15, 21, 21]),
    (0b1100001, &[1, 3, 1, 13, 27, 49]),
    (0b1100111, &[1, 1, 1, 15, 7, 5]),
    (0b1101101, &[1, 3, 1, 15, 13, 25]),
    (0b1110011, &[1, 1, 5, 5, 19, 61]),
    (0b10000011, &[1, 3, 7, 11, 23, 15, 103]),
    (0b10001001, &[1, 3, 7, 13, 13, 15, 69]),
    (0b10001111, &[1, 1, 3, 13, 7, 35, 63]),
    (0b10010001, &[1, 3, 5, 9, 1, 25, 53]),
    (0b10011101, &[1, 3, 1, 13, 9, 35, 107]),
    (0b10100111, &[1, 3, 1, 5, 27, 61, 31]),
    (0b10101011, &[1, 1, 5, 11, 19, 41, 61]),
    (0b10111001, &[1, 3, 5, 3, 3, 13, 69]),
    (0b10111111, &[1, 1, 7, 13, 1, 19, 1]),
    (0b11000001, &[1, 3, 7, 5, 13, 19, 59]),
    (0b11001011, &[1, 1, 3, 9, 25, 29, 41]),
    (0b11010011, &[1, 3, 5, 13, 23, 1, 55]),
    (0b11010101, &[1, 3, 7, 3, 13, 59, 17]),
];

/// What bit `k` of an index adds to the point, bit-reversed: `DIRECTIONS[dimension][k]`.
pub static DIRECTIONS: [[u32; 32]; DIMENSIONS] = directions();

const fn directions() -> [[u32; 32]; DIMENSIONS] {
    let mut table = [[0; 32]; DIMENSIONS];
    let mut dimension = 0;
    while dimension < DIMENSIONS {
        let mut m = [1u64; 32];
        if dimension > 0 {
            let (polynomial, initial) = JOE_KUO[dimension - 1];
            let degree = initial.len();
            let mut k = 0;
            while k < 32 {
                m[k] = if k < degree { initial[k] as u64 } else { m[k - degree] };
                let mut term = 1;
                while k >= degree && term <= degree {
                    if polynomial >> (degree - term) & 1 == 1 {
                        m[k] ^= m[k - term] << term;
                    }
                    term += 1;
                }
                k += 1;
            }
        }
        let mut k = 0;
        while k < 32 {
            table[dimension][k] = ((m[k] << (31 - k)) as u32).reverse_bits();
            k += 1;
        }
        dimension += 1;
    }
    table
}

/// What bit `k` of `index` adds to its point, bit-reversed: `direction` where the bit is set. The exclusive or of all terms is
/// the point.
#[inline(always)]
pub fn term(index: u32, k: u32, direction: u32) -> u32 {
    // All ones where bit `k` is set.
    direction & ((index << (31 - k)) as i32 >> 31) as u32
}

/// Nested uniform scrambling of a bit-reversed number: bit `i` is flipped, or not, as `seed` and the bits below `i` say.
#[inline(always)]
pub fn scramble(reversed: u32, seed: u32) -> u32 {
    let mut x = reversed;
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x
}

/// `index` in another order: indices that share their leading bits stay together, at every level, and 2ᵏ … 2ᵏ⁺¹ − 1 change
/// places among themselves only.
///
/// So the first 2ᵏ indices are always the first 2ᵏ (of Owen's shuffles, one that never flips the topmost set bit
/// or zeros above it), and no bit above the index's own is ever set: points are short sums.
#[inline(always)]
pub fn shuffle(index: u32, seed: u32) -> u32 {
    // Bits below the topmost set one, by smearing it downwards: vectors have no count of leading zeros.
    let mut below = index >> 1;
    below |= below >> 1;
    below |= below >> 2;
    below |= below >> 4;
    below |= below >> 8;
    below |= below >> 16;
    let shuffled = scramble(index.reverse_bits(), seed).reverse_bits();
    (shuffled & below) | (index & !below)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(index: u32, directions: &[u32; 32]) -> u32 {
        directions.iter().enumerate().fold(0, |point, (k, &d)| point ^ term(index, k as u32, d)).reverse_bits()
    }

    /// The first sixteen points in pairs of dimensions, in sixteenths, as `scipy.stats.qmc.Sobol` 1.x gives them (in another order).
    #[test]
    fn points_are_those_of_another_implementation() {
        type Pairs = [(u32, u32); 16];
        let known: [(usize, usize, Pairs); 3] = [
            (
                2,
                3,
                [
                    (0, 0),
                    (1, 13),
                    (2, 6),
                    (3, 11),
                    (4, 4),
                    (5, 9),
                    (6, 2),
                    (7, 15),
                    (8, 8),
                    (9, 5),
                    (10, 14),
                    (11, 3),
                    (12, 12),
                    (13, 1),
                    (14, 10),
                    (15, 7),
                ],
            ),
            (
                5,
                17,
                [
                    (0, 0),
                    (1, 1),
                    (2, 14),
                    (3, 15),
                    (4, 12),
                    (5, 13),
                    (6, 2),
                    (7, 3),
                    (8, 8),
                    (9, 9),
                    (10, 6),
                    (11, 7),
                    (12, 4),
                    (13, 5),
                    (14, 10),
                    (15, 11),
                ],
            ),
            (
                30,
                31,
                [
                    (0, 0),
                    (1, 15),
                    (2, 6),
                    (3, 9),
                    (4, 4),
                    (5, 11),
                    (6, 2),
                    (7, 13),
                    (8, 8),
                    (9, 7),
                    (10, 14),
                    (11, 1),
                    (12, 12),
                    (13, 3),
                    (14, 10),
                    (15, 5),
                ],
            ),
        ];
        for (a, b, known) in known {
            let at = |index, dimension: usize| point(index, &DIRECTIONS[dimension]) >> 28;
            let mut points: Vec<(u32, u32)> = (0..16).map(|index| (at(index, a), at(index, b))).collect();
            points.sort_unstable();
            assert_eq!(points, known, "dimensions {a} and {b}");
        }
    }

    #[test]
    fn every_dimension_is_a_permutation_at_every_level() {
        for directions in &DIRECTIONS {
            for bits in 1..=12 {
                let mut seen = vec![false; 1 << bits];
                for index in 0..1 << bits {
                    let cell = point(index, directions) >> (32 - bits);
                    assert!(!std::mem::replace(&mut seen[cell as usize], true));
                }
            }
        }
    }

    #[test]
    fn scrambling_and_shuffling_keep_the_tree() {
        for seed in [0, 1, 0xdead_beef, u32::MAX] {
            // Numbers that agree in their low bits still do, and differ where they first differed.
            for (a, b) in [(0b1011_0101, 0b0011_0101), (7, 7 + 64), (0, 1)] {
                let common = |a: u32, b: u32| (a ^ b).trailing_zeros();
                assert_eq!(common(scramble(a, seed), scramble(b, seed)), common(a, b));
            }
            for bits in 1..12 {
                let mut all: Vec<u32> = (0..1 << bits).map(|index| shuffle(index, seed)).collect();
                all.sort_unstable();
                assert!(all.iter().enumerate().all(|(i, &index)| i as u32 == index));
            }
            assert_eq!(shuffle(1 << 31, seed) >> 31, 1);
        }
    }
}
