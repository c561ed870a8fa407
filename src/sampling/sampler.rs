//! Which random numbers a path gets: a pure function of pixel, sample, decision and seed.
//!
//! No state: any stage may draw the numbers of any path in any order, and the picture does not depend on who drew first.
//!
//! # How dimensions are used
//!
//! A path makes decisions, each a block of four numbers (see [`Dimensions`](super::random::Dimensions)): block 0 is the
//! camera, then every vertex owns one for the continuing ray and one for each of its shadow rays. The first two numbers of a
//! block choose a point or a direction, the other two what is chosen beside: the light, the triangle of it, roulette.
//!
//! Sobol points fill this padded: eight blocks in a row take their first two numbers from sixteen dimensions of *one*
//! shuffled sequence, the next eight blocks from another shuffle of the same dimensions, and so on without end. The other two
//! numbers come from a shuffle of the block's own. With another hash for keys, gain in relative mean squared error over independent numbers at depth 5,
//! 240 × 180 pixels, for groups of 1, 2, 4 and 8 blocks: 2.47, 2.46, 2.58, 2.69 on the Cornell box with spheres at 64 samples
//! (2.80, 2.84, 3.01, 3.18 with the bunny; 1.59, 1.50, 1.48, 1.48 at 4 samples); groups of 16: as 8. All four numbers from
//! dimensions of one sequence (four dimensions a block): 2.43 to 2.47. Direct light alone gains 25.
//!
//! # Standard errors
//!
//! Points of one sequence avoid each other, so their spread says too much of the error of their mean: an upper bound. With
//! *replicates*, the samples of a pixel are dealt to that many sequences in turn, each randomised on its own: their means are
//! independent and the spread between them is honest. It costs accuracy, as each sequence is shorter: on the same box at 64
//! samples the gain falls from 2.64 to 2.12 with 4 replicates and 1.45 with 8 or 16.
//!
//! # Blue noise
//!
//! The pixels share one sequence, in the order of a space-filling curve, each taking the next few points (Ahmed & Wonka,
//! *Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering of Pixels*, SIGGRAPH Asia 2020):
//! neighbours' errors cancel when looked at from afar. Owen's shuffle of the whole index replaces their permutation tables.

use super::random::{mix, to_unit, uniform4};
use super::sobol;
use crate::options::{self, RenderOptions};

/// Blocks that share a sequence.
const GROUP: u32 = 8;
const _: () = assert!(2 * GROUP as usize <= sobol::DIMENSIONS);

/// Draws the numbers of a render.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    kind: Kind,
    /// Seed of everything.
    seed: u32,
    /// Independent sequences a pixel: 2 to this power.
    replicates: u32,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    Independent,
    Sobol,
    BlueNoise(Screen),
}

/// How pixels and their samples share one sequence.
#[derive(Clone, Copy, Debug)]
struct Screen {
    /// Pixels across the frame.
    width: u32,
    /// Samples of a pixel that follow each other: 2 to this power. Later ones belong to another sequence.
    samples: u32,
    /// Bits of an index in all.
    bits: u32,
}

impl Sampler {
    /// The sampler that `options` ask for.
    pub fn new(options: &RenderOptions) -> Sampler {
        let replicates = options.replicates.next_power_of_two().ilog2();
        let kind = match options.sampler {
            options::Sampler::Independent => Kind::Independent,
            options::Sampler::Sobol => Kind::Sobol,
            options::Sampler::BlueNoise => {
                let pixels = 2 * options.width.max(options.height).next_power_of_two().ilog2();
                let wanted = options.samples.div_ceil(options.replicates).checked_next_power_of_two();
                let samples = wanted.map_or(32, u32::ilog2).min(32 - pixels.min(32));
                Kind::BlueNoise(Screen { width: options.width, samples, bits: pixels + samples })
            }
        };
        Sampler { kind, seed: options.seed, replicates }
    }

    /// Four numbers in [0, 1) for the decision `dimension` of sample `index` of a pixel.
    #[inline(always)]
    pub fn draw(&self, pixel: u32, index: u32, dimension: u32) -> [f32; 4] {
        let mut out = [[0.0]; 4];
        self.draw_rows(&[pixel], &[index], dimension, &mut out);
        out.map(|[number]| number)
    }

    /// A number in [0, 1) that has nothing to do with the others, for a lot.
    #[inline(always)]
    pub fn lot(&self, pixel: u32, index: u32, dimension: u32) -> f32 {
        to_unit(mix(pixel.wrapping_add(mix(index.wrapping_add(mix(dimension.wrapping_add(mix(!self.seed))))))))
    }

    /// The first `N` of the four numbers for each of `ROWS` rows, in step: every loop here becomes vector instructions.
    #[inline(always)]
    pub fn draw_rows<const ROWS: usize, const N: usize>(
        &self,
        pixel: &[u32; ROWS],
        index: &[u32; ROWS],
        dimension: u32,
        out: &mut [[f32; ROWS]; N],
    ) {
        match self.kind {
            Kind::Independent => {
                for i in 0..ROWS {
                    let numbers = uniform4(pixel[i], index[i], dimension, self.seed);
                    for (out, number) in out.iter_mut().zip(numbers) {
                        out[i] = number;
                    }
                }
            }
            Kind::Sobol => {
                let bits = u32::BITS - index.iter().fold(0, |all, &index| all | index).leading_zeros();
                let mut place = Places { key: [0; ROWS], index: [0; ROWS] };
                for i in 0..ROWS {
                    let (replicate, index) = self.replicate(index[i]);
                    place.key[i] = mix(pixel[i].wrapping_add(mix(self.seed.wrapping_add(mix(replicate)))));
                    place.index[i] = index;
                }
                numbers(&place, bits, dimension, out, sobol::shuffle);
            }
            Kind::BlueNoise(screen) => {
                let mut place = Places { key: [0; ROWS], index: [0; ROWS] };
                for i in 0..ROWS {
                    let (replicate, index) = self.replicate(index[i]);
                    // Shifted in two steps: 32 at once would be none.
                    let chunk = (index >> (screen.samples / 2)) >> screen.samples.div_ceil(2);
                    let low = index & ((1u64 << screen.samples) - 1) as u32;
                    let curve = spread(pixel[i] % screen.width) | spread(pixel[i] / screen.width) << 1;
                    place.key[i] = mix(chunk.wrapping_add(mix(!self.seed.wrapping_add(mix(replicate)))));
                    place.index[i] = (u64::from(curve) << screen.samples) as u32 | low;
                }
                // Only the bits in use take part, so that indices stay below 2 to the power of `bits`.
                let unused = u32::BITS - screen.bits.clamp(1, 32);
                let shuffle =
                    |index: u32, key| sobol::scramble((index << unused).reverse_bits(), key).reverse_bits() >> unused;
                numbers(&place, screen.bits, dimension, out, shuffle);
            }
        }
    }

    /// The index of draw `part` of `parts` that sample `index` makes of one decision: all draws of a pixel are one sequence, those of a
    /// replicate still its own.
    #[inline(always)]
    pub fn part(&self, index: u32, parts: u32, part: u32) -> u32 {
        let (replicate, index) = self.replicate(index);
        index.wrapping_mul(parts).wrapping_add(part) << self.replicates | replicate
    }

    /// Which replicate a sample belongs to, and its index there.
    #[inline(always)]
    fn replicate(&self, index: u32) -> (u32, u32) {
        (index & ((1 << self.replicates) - 1), index >> self.replicates)
    }
}

/// Where rows stand: whose sequence it is, and which of its points.
struct Places<const ROWS: usize> {
    key: [u32; ROWS],
    index: [u32; ROWS],
}

/// The numbers of a block: two from a point of the group's sequence, two from one of the block's own. No index has more than
/// `bits` bits.
#[inline(always)]
fn numbers<const ROWS: usize, const N: usize>(
    place: &Places<ROWS>,
    bits: u32,
    dimension: u32,
    out: &mut [[f32; ROWS]; N],
    shuffle: impl Fn(u32, u32) -> u32,
) {
    // Told apart by what they are for: the four numbers, and the two shuffles.
    let salt = |which: u32, what: u32| mix(which.wrapping_mul(8).wrapping_add(what));
    let mut index = [0; ROWS];
    for (n, out) in out.iter_mut().enumerate() {
        if n % 2 == 0 {
            let salt = if n == 0 { salt(dimension / GROUP, 5) } else { salt(dimension, 4) };
            for (index, (&at, &key)) in index.iter_mut().zip(place.index.iter().zip(&place.key)) {
                *index = shuffle(at, mix(key.wrapping_add(salt)));
            }
        }
        let column = if n < 2 { (2 * (dimension % GROUP)) as usize + n } else { n - 2 };
        let mut reversed = [0u32; ROWS];
        for (k, &direction) in sobol::DIRECTIONS[column].iter().enumerate().take(bits as usize) {
            for (reversed, &index) in reversed.iter_mut().zip(&index) {
                *reversed ^= sobol::term(index, k as u32, direction);
            }
        }
        let salt = salt(dimension, n as u32);
        for (out, (&reversed, &key)) in out.iter_mut().zip(reversed.iter().zip(&place.key)) {
            *out = to_unit(sobol::scramble(reversed, mix(key.wrapping_add(salt))).reverse_bits());
        }
    }
}

/// The low sixteen bits with a zero above each: half of a Morton code.
#[inline(always)]
fn spread(x: u32) -> u32 {
    let x = (x | x << 8) & 0x00ff_00ff;
    let x = (x | x << 4) & 0x0f0f_0f0f;
    let x = (x | x << 2) & 0x3333_3333;
    (x | x << 1) & 0x5555_5555
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::random::Dimensions;
    use statrs::distribution::{ChiSquared, ContinuousCDF};

    const SAMPLERS: [options::Sampler; 3] =
        [options::Sampler::Independent, options::Sampler::Sobol, options::Sampler::BlueNoise];

    fn sampler(sampler: options::Sampler, samples: u32, replicates: u32) -> Sampler {
        let options =
            RenderOptions { width: 64, height: 48, sampler, samples, replicates, seed: 5, ..RenderOptions::default() };
        Sampler::new(&options)
    }

    #[test]
    fn rows_are_what_single_draws_are() {
        for kind in SAMPLERS {
            for replicates in [1, 8] {
                let sampler = sampler(kind, 100, replicates);
                let pixel: [u32; 300] = std::array::from_fn(|i| i as u32 * 7 % 3072);
                let index: [u32; 300] =
                    std::array::from_fn(|i| if i % 50 == 0 { u32::MAX - i as u32 } else { (i * i) as u32 });
                for dimension in [0, 1, 7, 8, 1000, u32::MAX] {
                    let (mut four, mut two) = ([[0.0; 300]; 4], [[0.0; 300]; 2]);
                    sampler.draw_rows(&pixel, &index, dimension, &mut four);
                    sampler.draw_rows(&pixel, &index, dimension, &mut two);
                    for i in 0..300 {
                        let row = four.map(|column| column[i]);
                        assert_eq!(row, sampler.draw(pixel[i], index[i], dimension), "{kind:?} {i}");
                        assert!(row.iter().all(|x| (0.0..1.0).contains(x)));
                        assert_eq!(two.map(|column| column[i]), [row[0], row[1]]);
                    }
                }
            }
        }
    }

    /// Every interval of every number, and every cell of every first pair, has its share: for any power of two of samples.
    #[test]
    fn points_of_a_pixel_are_spread_evenly() {
        for (kind, replicates) in [(1, 1), (1, 4), (2, 1), (2, 4)] {
            for bits in [4u32, 6, 10] {
                let n = 1 << bits;
                let sampler = sampler(SAMPLERS[kind], n * replicates, replicates);
                for dimension in (0..20).chain([1 << 20]) {
                    for replicate in 0..replicates {
                        let points: Vec<[f32; 4]> =
                            (0..n).map(|i| sampler.draw(1234, i * replicates + replicate, dimension)).collect();
                        for c in 0..4 {
                            let mut cells = vec![0; n as usize];
                            points.iter().for_each(|p| cells[(p[c] * n as f32) as usize] += 1);
                            assert!(cells.iter().all(|&count| count == 1), "number {c} of block {dimension}");
                        }
                        // Dimensions 0 and 1 are a (0, 2)-sequence: boxes of every shape.
                        let pairs: &[usize] = if dimension % GROUP == 0 { &[0, 2] } else { &[2] };
                        for &c in pairs {
                            for across in 0..=bits {
                                let (w, h) = ((1u32 << across) as f32, (1u32 << (bits - across)) as f32);
                                let mut cells = vec![0; n as usize];
                                for p in &points {
                                    cells[((p[c] * w) as u32 * h as u32 + (p[c + 1] * h) as u32) as usize] += 1;
                                }
                                assert!(cells.iter().all(|&count| count == 1), "{kind} {dimension}: {w} × {h}");
                            }
                        }
                    }
                }
            }
        }
    }

    /// χ² over many seeds: each number, and pairs that decisions, samples, pixels and replicates must not tie together.
    #[test]
    fn one_sample_over_many_seeds_is_uniform_in_any_two_numbers() {
        type Place = (u32, u32, u32, usize);
        let pairs: [(&str, Place, Place); 7] = [
            ("two numbers of a block", (9, 5, 2, 0), (9, 5, 2, 1)),
            ("the two pairs of a block", (9, 5, 2, 1), (9, 5, 2, 2)),
            ("blocks of a group", (9, 5, 2, 0), (9, 5, 3, 0)),
            ("blocks of two groups", (9, 5, 2, 0), (9, 5, 10, 0)),
            ("replicates", (9, 4, 2, 0), (9, 5, 2, 0)),
            ("far samples", (9, 5, 2, 0), (9, 50_000_005, 2, 1)),
            ("pixels far apart", (9, 5, 2, 0), (1109, 5, 2, 0)),
        ];
        for kind in SAMPLERS {
            for (what, a, b) in pairs {
                let n = 1u32 << 17;
                let mut cells = vec![0u32; 256];
                let mut sampler = sampler(kind, 64, 2);
                for seed in 0..n {
                    sampler.seed = seed;
                    let at = |(pixel, index, dimension, number): Place| {
                        (sampler.draw(pixel, index, dimension)[number] * 16.0) as usize
                    };
                    cells[at(a) * 16 + at(b)] += 1;
                }
                let expected = f64::from(n) / 256.0;
                let chi2: f64 = cells.iter().map(|&c| (f64::from(c) - expected).powi(2) / expected).sum();
                let p = 1.0 - ChiSquared::new(255.0).unwrap().cdf(chi2);
                // Two-sided at 1e-3, Šidák over the twenty-one cases.
                assert!(p > 2.4e-5 && p < 1.0 - 2.4e-5, "{kind:?}, {what}: χ² = {chi2:.0}, p = {p:e}");
            }
        }
    }

    #[test]
    fn more_than_a_million_samples_go_on_getting_better() {
        // Mean of u·v over the first 2²² samples of one pixel: independent samples err by 1e-4, these by far less.
        let sampler = sampler(options::Sampler::Sobol, 64, 1);
        let mean = |n: u32| {
            let sum: f64 = (0..n)
                .map(|i| {
                    let [u, v, ..] = sampler.draw(3, i, Dimensions { light_samples: 1 }.light(2, 0));
                    f64::from(u) * f64::from(v)
                })
                .sum();
            sum / f64::from(n)
        };
        let (few, many) = ((mean(1 << 12) - 0.25).abs(), (mean(1 << 22) - 0.25).abs());
        assert!(few < 4e-4, "{few:e}");
        assert!(many < 2e-6, "{many:e}");
    }

    /// What blue noise is for: seen from afar, means over blocks of pixels, errors cancel.
    #[test]
    fn blue_noise_cancels_between_neighbours() {
        let error = |kind| {
            let sampler = sampler(kind, 4, 1);
            let pixel = |x: u32, y: u32| {
                let of = |i| {
                    let [u, v, ..] = sampler.draw(y * 64 + x, i, 2);
                    f64::from(u * v) - 0.25
                };
                (0..4).map(of).sum::<f64>() / 4.0
            };
            let (mut alone, mut blocks) = (0.0, 0.0);
            for (by, bx) in (0..12).flat_map(|by| (0..16).map(move |bx| (by, bx))) {
                let all: Vec<f64> = (0..16).map(|k| pixel(bx * 4 + k % 4, by * 4 + k / 4)).collect();
                alone += all.iter().map(|e| e * e).sum::<f64>() / 16.0;
                blocks += (all.iter().sum::<f64>() / 16.0).powi(2);
            }
            (alone / 192.0, blocks / 192.0)
        };
        let (sobol, blue) = (error(options::Sampler::Sobol), error(options::Sampler::BlueNoise));
        assert!(blue.0 < sobol.0 * 1.3, "no worse by itself: {blue:?} {sobol:?}");
        assert!(blue.1 < sobol.1 / 5.0, "far better together: {blue:?} {sobol:?}");
    }
}
