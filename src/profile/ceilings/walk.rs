//! Cache lines in random order: what waiting for one costs, and what it costs when they do not wait for each other.
//!
//! The first word of each line is where the next line of the walk starts, counted in words; the walk goes through all lines and
//! ends where it began. Its order is a bijection of the line numbers that no prefetcher follows, and that is cheap to
//! invert: the links are written in the order of memory.

use std::hint::black_box;
use std::time::Instant;

/// Words of a cache line.
const LINE: usize = 16;
/// Steps of a sample.
const STEPS: usize = 1 << 15;
/// Odd, so that it has an inverse modulo any power of two.
const FACTOR: u32 = 747_796_405;

/// The order of a walk through 2^`bits` lines.
#[derive(Clone, Copy)]
struct Order {
    mask: u32,
    shift: u32,
    inverse: u32,
}

impl Order {
    /// Of so many lines, a power of two.
    fn new(lines: usize) -> Order {
        assert!(lines.is_power_of_two() && lines * LINE <= 1 << 31, "{lines} lines");
        // Newton's iteration: each step doubles the number of right bits, of which there are 3 at first.
        let inverse = (0..4).fold(FACTOR, |x, _| x.wrapping_mul(2u32.wrapping_sub(FACTOR.wrapping_mul(x))));
        // From half of the bits on, shifting twice leaves nothing: such a step is its own inverse.
        Order { mask: lines as u32 - 1, shift: lines.ilog2().div_ceil(2), inverse }
    }

    /// The line in a place of the walk, counted modulo their number.
    #[inline(always)]
    fn line(self, place: u32) -> u32 {
        let x = place & self.mask;
        let x = (x ^ x >> self.shift).wrapping_mul(FACTOR) & self.mask;
        x ^ x >> self.shift
    }

    /// The place of a line.
    #[inline(always)]
    fn place(self, line: u32) -> u32 {
        let x = (line ^ line >> self.shift).wrapping_mul(self.inverse) & self.mask;
        x ^ x >> self.shift
    }
}

/// Writes the links, on `threads` threads: pages that were not touched before come one by one.
pub fn link(words: &mut [u32], threads: usize) {
    let order = Order::new(words.len() / LINE);
    let part = (words.len() / LINE).div_ceil(threads) * LINE;
    std::thread::scope(|scope| {
        for (i, words) in words.chunks_mut(part).enumerate() {
            let first = (i * part / LINE) as u32;
            scope.spawn(move || {
                for (line, words) in (first..).zip(words.chunks_mut(LINE)) {
                    words[0] = order.line(order.place(line).wrapping_add(1)) * LINE as u32;
                }
            });
        }
    });
}

/// Nanoseconds a line, each waiting for the one before, from `at` on, where the next sample goes on.
pub fn latency(words: &[u32], at: &mut u32) -> f64 {
    let start = Instant::now();
    *at = black_box(walk(words, *at, STEPS));
    start.elapsed().as_secs_f64() * 1e9 / STEPS as f64
}

/// Where `steps` steps from `at` lead.
#[inline(never)]
fn walk(words: &[u32], mut at: u32, steps: usize) -> u32 {
    for _ in 0..steps {
        at = words[at as usize];
    }
    at
}

/// Nanoseconds a line, none waiting for another, from a place of the walk on, where the next sample goes on.
pub fn gather(words: &[u32], place: &mut u32) -> f64 {
    let order = Order::new(words.len() / LINE);
    let start = Instant::now();
    black_box(sum(words, order, black_box(*place)));
    let seconds = start.elapsed().as_secs_f64();
    *place = place.wrapping_add(STEPS as u32);
    seconds * 1e9 / STEPS as f64
}

/// The sum of the links in [`STEPS`] places of the walk.
#[inline(never)]
fn sum(words: &[u32], order: Order, from: u32) -> u32 {
    (0..STEPS as u32).fold(0, |sum, i| sum.wrapping_add(words[order.line(from.wrapping_add(i)) as usize * LINE]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_walk_visits_each_line_once() {
        for log in 0..=17 {
            for threads in [1, 3] {
                let mut words = vec![0u32; LINE << log];
                link(&mut words, threads);
                let mut seen = vec![false; 1 << log];
                let mut at = 0;
                for _ in 0..1 << log {
                    assert_eq!(at as usize % LINE, 0);
                    assert!(!std::mem::replace(&mut seen[at as usize / LINE], true), "2^{log} lines");
                    at = walk(&words, at, 1);
                }
                assert_eq!(at, 0, "2^{log} lines");
            }
        }
    }

    #[test]
    fn places_and_lines_are_inverse() {
        for log in [1, 9, 14, 24] {
            let order = Order::new(1 << log);
            for line in (0..1 << log).step_by(1 + (1 << log) / 1000) {
                assert_eq!(order.line(order.place(line)), line);
            }
        }
    }

    #[test]
    fn neighbours_of_the_walk_are_far_apart() {
        let mut words = vec![0u32; LINE << 14];
        link(&mut words, 1);
        let far = words.iter().step_by(LINE).enumerate().filter(|(i, next)| i.abs_diff(**next as usize / LINE) > 64);
        assert!(far.count() > 16_000, "of 16384 steps");
    }

    #[test]
    fn gathering_reads_each_line_equally_often() {
        let mut words = vec![0u32; LINE << 5];
        link(&mut words, 1);
        let all: u32 = words.iter().step_by(LINE).sum();
        assert_eq!(sum(&words, Order::new(words.len() / LINE), 7), all.wrapping_mul(STEPS as u32 >> 5));
    }
}
