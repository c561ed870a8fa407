//! Memory in order: reading, and copying.

use std::hint::black_box;
use std::ops::Range;
use std::sync::Barrier;
use std::time::Instant;

use crate::simd::Tier;
use crate::simd::wide::{MOST_LANES, Wide, WideKernel};

/// Bytes of a sample, of each thread.
const SAMPLE: usize = 32 << 20;
/// Vectors that are loaded before any is combined with the next of its chain: enough for loads not to wait for that.
const CHAINS: usize = 8;

/// Where a sample begins, in words: where the one before ended, so that a set larger than a cache is never found in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Place(usize);

impl Place {
    /// The part of a set of `len` words that a sample takes, of at most `most` words, and how often.
    fn advance(&mut self, len: usize, most: usize) -> (Range<usize>, usize) {
        let piece = len.min(most).max(1);
        if self.0 + piece > len {
            self.0 = 0;
        }
        let start = self.0;
        self.0 += piece;
        (start..self.0, most / piece)
    }
}

/// Bytes/s of one thread.
pub fn read(words: &[u32], place: &mut Place, tier: Tier) -> f64 {
    let start = Instant::now();
    let bytes = read_sample(words, place, tier);
    bytes as f64 / start.elapsed().as_secs_f64()
}

/// Bytes/s of as many threads as there are places, which all read all of `words`.
pub fn read_shared(words: &[u32], places: &mut [Place], tier: Tier) -> f64 {
    together(places.iter_mut().map(|place| (words, place)), tier)
}

/// Bytes/s of as many threads as there are places, each of which reads a part of `words`.
pub fn read_parts(words: &[u32], places: &mut [Place], tier: Tier) -> f64 {
    let part = words.len().div_ceil(places.len());
    together(words.chunks(part).zip(places), tier)
}

/// Bytes/s of one thread for each set: from when all may begin until the last has ended.
fn together<'a>(sets: impl ExactSizeIterator<Item = (&'a [u32], &'a mut Place)>, tier: Tier) -> f64 {
    let barrier = Barrier::new(sets.len());
    std::thread::scope(|scope| {
        let reader = |(words, place)| {
            let barrier = &barrier;
            scope.spawn(move || {
                barrier.wait();
                let start = Instant::now();
                (read_sample(words, place, tier), start, Instant::now())
            })
        };
        let readers: Vec<_> = sets.map(reader).collect();
        let turns: Vec<_> = readers.into_iter().map(|reader| reader.join().expect("a loop does not panic")).collect();
        let bytes: usize = turns.iter().map(|(bytes, ..)| bytes).sum();
        let start = turns.iter().map(|(_, start, _)| *start).min();
        let end = turns.iter().map(|(.., end)| *end).max();
        start.zip(end).map_or(f64::NAN, |(start, end)| bytes as f64 / (end - start).as_secs_f64())
    })
}

/// Reads a sample, and tells how many bytes it was.
fn read_sample(words: &[u32], place: &mut Place, tier: Tier) -> usize {
    let (piece, passes) = place.advance(words.len(), SAMPLE / 4);
    let words = &bytemuck::cast_slice(words)[piece];
    black_box(tier.run_wide(Read { words, passes }));
    words.len() * 4 * passes
}

/// The largest of all words, `passes` times over. Links are no ordinary floats; comparing takes no longer for that.
struct Read<'a> {
    words: &'a [f32],
    passes: usize,
}

impl WideKernel for Read<'_> {
    type Output = f32;

    #[inline(always)]
    fn run<W: Wide>(self, wide: W) -> f32 {
        let lanes = 4 * W::RAYS;
        let step = CHAINS * lanes;
        // A vector is loaded from sixteen words, of which it takes the first: a step must leave some behind it.
        let behind = MOST_LANES - lanes;
        let mut largest = [wide.splat(0.0); CHAINS];
        for _ in 0..self.passes {
            let words = black_box(self.words);
            let mut at = 0;
            while let Some(block) = words.get(at..at + step + behind) {
                for (chain, largest) in largest.iter_mut().enumerate() {
                    let vector = block[chain * lanes..].first_chunk().expect("a step and what is behind it");
                    *largest = wide.max(wide.load(vector), *largest);
                }
                at += step;
            }
            // What is behind the last step, but for the last of the sixteen words.
            while let Some(block) = words.get(at..).and_then(|words| words.first_chunk::<MOST_LANES>()) {
                largest[0] = wide.max(wide.load(block), largest[0]);
                at += lanes;
            }
        }
        let mut result = 0f32;
        for vector in largest {
            wide.scatter(vector, |_, words| {
                result = words.into_iter().map(f32::from_bits).fold(result, f32::max);
            });
        }
        result
    }
}

/// Bytes/s that one thread reads and writes, copying the second half over the first.
pub fn copy(words: &mut [u32], place: &mut Place) -> f64 {
    let (to, from) = words.split_at_mut(words.len() / 2);
    let (piece, passes) = place.advance(to.len(), SAMPLE / 8);
    let bytes = 2 * 4 * piece.len() * passes;
    let start = Instant::now();
    for _ in 0..passes {
        black_box(&mut to[piece.clone()]).copy_from_slice(black_box(&from[piece.clone()]));
    }
    bytes as f64 / start.elapsed().as_secs_f64()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reading_reads_every_word() {
        for len in [1 << 12, 3 << 10] {
            for place in [0, 1, 17, 1000, len / 2, len - 100, len - 50, len - 16, len - 13] {
                let mut words = vec![1f32; len];
                words[place] = 2.0;
                for tier in Tier::available() {
                    assert_eq!(tier.run_wide(Read { words: &words, passes: 2 }), 2.0, "{place} {}", tier.name());
                }
            }
        }
    }

    #[test]
    fn samples_go_on_where_the_last_one_ended() {
        let mut place = Place::default();
        let turns: Vec<_> = (0..3).map(|_| place.advance(250, 100)).collect();
        assert_eq!(turns, [(0..100, 1), (100..200, 1), (0..100, 1)]);
        assert_eq!(Place::default().advance(30, 100), (0..30, 3));
    }

    #[test]
    fn threads_read_a_sample_each() {
        let words = vec![0u32; 1 << 12];
        let mut places = [Place::default(); 3];
        assert!(read_shared(&words, &mut places, Tier::Baseline) > 0.0);
        assert!(read_parts(&words, &mut places, Tier::Baseline) > 0.0);
        let len = read_sample(&words, &mut places[0], Tier::Baseline);
        assert!((SAMPLE - (1 << 14)..=SAMPLE).contains(&len));
    }

    #[test]
    fn copying_copies() {
        let mut words: Vec<u32> = (0..1 << 12).collect();
        assert!(copy(&mut words, &mut Place::default()) > 0.0);
        assert_eq!(words[..1 << 11], words[1 << 11..]);
    }
}
