//! What each of the independent sequences of a pixel's samples adds up to.

use super::interval::Interval;
use super::tile::{FilmLayout, luminance};

/// Sums of one sequence.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    samples: u32,
    mean: [f64; 3],
    /// Sum of squared deviations of luminance from its mean.
    m2: f64,
}

/// Sums of the sequences of all pixels of a tile. Sample `i` of a pixel belongs to sequence `i mod n`; even sequences are one
/// half of the samples, odd ones the other.
#[derive(Clone, Debug, Default)]
pub struct Sequences {
    each: u32,
    /// Even and odd ones stop by themselves.
    pub halves: bool,
    rows: Vec<Sums>,
}

impl Sequences {
    /// Bytes of one sequence of one pixel.
    pub const BYTES: usize = size_of::<Sums>();

    /// For `pixels` pixels.
    pub fn new(pixels: usize, layout: FilmLayout) -> Sequences {
        Sequences {
            each: layout.sequences,
            halves: layout.halves,
            rows: vec![Sums::default(); pixels * layout.sequences as usize],
        }
    }

    /// There are just the two halves, and the samples of each are independent.
    pub fn independent(&self) -> bool {
        self.halves && self.each == 2
    }

    /// Bytes that they take.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.rows[..])
    }

    /// Whether there are any.
    pub fn is_empty(&self) -> bool {
        self.each == 0
    }

    /// Adds sample `index` of pixel `local`.
    #[inline]
    pub fn add(&mut self, local: usize, index: u32, radiance: [f32; 3]) {
        if self.each == 0 {
            return;
        }
        let row = &mut self.rows[local * self.each as usize + (index % self.each) as usize];
        row.samples += 1;
        let weight = 1.0 / f64::from(row.samples);
        let before = luminance(radiance) - luminance(row.mean);
        for (mean, value) in row.mean.iter_mut().zip(radiance) {
            *mean += (f64::from(value) - *mean) * weight;
        }
        row.m2 += before * (luminance(radiance) - luminance(row.mean));
    }

    fn of(&self, local: usize, half: Option<u32>) -> impl Iterator<Item = &Sums> + Clone {
        let each = self.each as usize;
        let (from, step) = half.map_or((0, 1), |half| (half as usize, 2));
        self.rows[local * each..(local + 1) * each].iter().skip(from).step_by(step)
    }

    /// The interval of luminance of a pixel, or of one half of its samples: by the spread between sequences, or where a half is
    /// a single one, whose samples are independent then, by the spread of those.
    pub fn luminance(&self, local: usize, half: Option<u32>) -> Interval {
        match half {
            Some(half) if self.independent() => {
                let sums = self.rows[local * 2 + half as usize];
                let moments = super::convergence::Moments { n: sums.samples, mean: luminance(sums.mean), m2: sums.m2 };
                Interval::of_samples(&moments)
            }
            _ => Interval::of_sequences(self.of(local, half).map(|s| (s.samples, luminance(s.mean)))),
        }
    }

    /// The interval of channel `c` of a pixel, or of one half of its samples, by the spread between sequences.
    pub fn channel(&self, local: usize, half: Option<u32>, c: usize) -> Interval {
        Interval::of_sequences(self.of(local, half).map(|s| (s.samples, s.mean[c])))
    }
}
