//! The film: what each pixel's samples add up to, tile by tile.
//!
//! A tile is a square of pixels in Morton order, so that pixels near each other in the frame are near each other
//! in a wave. Samples of a pixel are added one after another in the order of their index, whatever the wave: the sums, and so the
//! picture's bytes, do not depend on how the work was cut.

use super::convergence::Moments;
use super::doubling::Doubling;
use super::sequences::Sequences;
use crate::options::{Area, Cell, Integrator, RenderOptions, Sampler, Trust};

/// Pixels along a tile's side.
pub const SIDE: u32 = 16;

/// Pixels of a whole tile.
pub const PIXELS: usize = (SIDE * SIDE) as usize;

/// Which sums a film keeps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FilmLayout {
    /// Variance of each channel.
    pub variance: bool,
    /// Moments of luminance, for adaptive sampling.
    pub luminance: bool,
    /// First-hit albedo, normal and depth.
    pub aovs: bool,
    /// Sums of each of so many sequences that the samples of a pixel are dealt to in turn; 0 where nobody looks at them.
    pub sequences: u32,
    /// Even and odd samples stop by themselves, and count as much.
    pub halves: bool,
    /// What the last doubling of a pixel's samples changed, where a tile is judged by it.
    pub doublings: bool,
}

impl FilmLayout {
    /// The sums that `options` ask for. What the camera sees first is not known where only the way there is counted.
    pub fn new(options: &RenderOptions) -> FilmLayout {
        let halves = options.adaptive.is_some_and(|rule| rule.trust == Trust::Halves);
        let errors = options.aovs || options.adaptive.is_some();
        let sequences = match options.replicates {
            1 => 2 * u32::from(halves),
            replicates => replicates * u32::from(errors),
        };
        let single = options.sampler != Sampler::Independent && options.replicates == 1;
        FilmLayout {
            variance: options.aovs,
            luminance: options.adaptive.is_some(),
            aovs: options.aovs && options.integrator != Integrator::BvhCost,
            sequences,
            halves,
            doublings: single && !halves && options.adaptive.is_some_and(|rule| rule.area == Area::Tile),
        }
    }

    /// Bytes a pixel of the picture: beauty and sample count, and the layers that the sums allow.
    pub fn picture_bytes_per_pixel(self) -> usize {
        let color = size_of::<[f32; 3]>();
        let first_hits = (2 * color + size_of::<f32>()) * usize::from(self.aovs);
        color + size_of::<u32>() + color * usize::from(self.variance) + first_hits
    }

    /// Bytes a pixel.
    pub fn bytes_per_pixel(self) -> usize {
        let sums = size_of::<[f64; 3]>() * (1 + usize::from(self.variance));
        let luminance = size_of::<Moments>() * usize::from(self.luminance);
        let aovs = size_of::<FirstHits>() * usize::from(self.aovs);
        let sequences = Sequences::BYTES * self.sequences as usize;
        let doublings = size_of::<Doubling>() * usize::from(self.doublings);
        // Position (two), active list and samples that count; whether a test was passed and which halves go on.
        size_of::<u32>() * 4 + 2 + sums + luminance + aovs + sequences + doublings
    }
}

/// A sample as retire hands it over.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sample {
    /// Radiance.
    pub radiance: [f32; 3],
    /// Albedo and normal of the first hit.
    pub albedo: [f32; 3],
    /// Shading normal of the first hit.
    pub normal: [f32; 3],
    /// Distance to the first hit.
    pub depth: f32,
}

/// Sums of first-hit values.
#[derive(Clone, Copy, Debug, Default)]
pub struct FirstHits {
    /// Albedo.
    pub albedo: [f64; 3],
    /// Normal.
    pub normal: [f64; 3],
    /// Distance, of samples that hit something.
    pub depth: f64,
    /// How many did.
    pub hits: u32,
}

/// A square of pixels and their sums.
#[derive(Clone, Debug)]
pub struct Tile {
    /// Frame column of each pixel.
    pub x: Vec<u32>,
    /// Frame row of each pixel.
    pub y: Vec<u32>,
    /// Pixels that want more samples, as indices into the columns here, ascending.
    pub active: Vec<u32>,
    /// Which halves of a pixel want more samples: bit 0 the even ones, bit 1 the odd ones.
    pub open: Vec<u8>,
    /// Pixels whose last test was passed.
    pub passed: Vec<bool>,
    /// Samples that count.
    pub count: Vec<u32>,
    /// Mean radiance.
    pub mean: Vec<[f64; 3]>,
    /// Sum of squared differences from the mean, by channel (Welford 1962); empty without the variance layer.
    pub m2: Vec<[f64; 3]>,
    /// Moments of luminance; empty without adaptive sampling.
    pub luminance: Vec<Moments>,
    /// Sums of each sequence; empty where nobody looks at them.
    pub sequences: Sequences,
    /// What the last doubling of the samples changed; empty where nobody asks.
    pub doublings: Vec<Doubling>,
    /// First-hit sums; empty without those layers.
    pub first_hits: Vec<FirstHits>,
    /// Pixels that met the adaptive rule.
    pub converged: u32,
    /// Samples left out because a channel was not finite.
    pub non_finite: u64,
    /// The first of them: x, y, sample.
    pub first_non_finite: Option<(u32, u32, u32)>,
}

impl Tile {
    /// Adds sample `index` of pixel `local`. One that is not finite is counted and left out.
    #[inline]
    pub fn add(&mut self, local: usize, index: u32, sample: &Sample) {
        if !sample.radiance.iter().all(|c| c.is_finite()) {
            self.non_finite += 1;
            self.first_non_finite.get_or_insert((self.x[local], self.y[local], index));
            return;
        }
        self.sequences.add(local, index, sample.radiance);
        self.count[local] += 1;
        let weight = 1.0 / f64::from(self.count[local]);
        let mean = &mut self.mean[local];
        for c in 0..3 {
            let value = f64::from(sample.radiance[c]);
            let before = value - mean[c];
            mean[c] += before * weight;
            if let Some(m2) = self.m2.get_mut(local) {
                m2[c] += before * (value - mean[c]);
            }
        }
        if let Some(moments) = self.luminance.get_mut(local) {
            moments.push(luminance(sample.radiance));
            if let Some(doubling) = self.doublings.get_mut(local) {
                doubling.note(moments.n, moments.mean);
            }
        }
        if let Some(first) = self.first_hits.get_mut(local) {
            for c in 0..3 {
                first.albedo[c] += f64::from(sample.albedo[c]);
                first.normal[c] += f64::from(sample.normal[c]);
            }
            if sample.depth.is_finite() {
                first.depth += f64::from(sample.depth);
                first.hits += 1;
            }
        }
    }

    /// The sample numbers that pixel `local` wants of `first..first + step`: the first, how far they are apart, how many.
    pub fn wanted(&self, local: usize, first: u32, step: u32) -> (u32, u32, u32) {
        let end = first + step;
        let of_half = |half: u32| {
            let start = first + (first % 2 + half) % 2;
            (start, 2, end.saturating_sub(start).div_ceil(2))
        };
        match self.open[local] {
            0b01 => of_half(0),
            0b10 => of_half(1),
            _ => (first, 1, step),
        }
    }
}

/// Relative luminance of linear Rec. 709.
pub fn luminance<T: Into<f64>>(colour: [T; 3]) -> f64 {
    let [r, g, b] = colour.map(T::into);
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// Tiles that cover `cell`, in Morton order, their pixels too.
pub fn tiles(cell: Cell, layout: FilmLayout) -> Vec<Tile> {
    let across = cell.width.div_ceil(SIDE);
    let down = cell.height.div_ceil(SIDE);
    let mut corners: Vec<(u32, u32)> = (0..down).flat_map(|ty| (0..across).map(move |tx| (tx, ty))).collect();
    corners.sort_by_key(|&(tx, ty)| morton(tx, ty));
    let mut order: Vec<(u32, u32)> = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))).collect();
    order.sort_by_key(|&(x, y)| morton(x, y));
    let tile = |(tx, ty): (u32, u32)| {
        let inside = |&(x, y): &(u32, u32)| tx * SIDE + x < cell.width && ty * SIDE + y < cell.height;
        let (x, y): (Vec<u32>, Vec<u32>) =
            order.iter().filter(|p| inside(p)).map(|&(x, y)| (cell.x + tx * SIDE + x, cell.y + ty * SIDE + y)).unzip();
        let n = x.len();
        Tile {
            x,
            y,
            active: (0..n as u32).collect(),
            open: vec![0b11; n],
            passed: vec![false; n],
            count: vec![0; n],
            mean: vec![[0.0; 3]; n],
            m2: vec![[0.0; 3]; if layout.variance { n } else { 0 }],
            luminance: vec![Moments::default(); if layout.luminance { n } else { 0 }],
            sequences: Sequences::new(n, layout),
            doublings: vec![Doubling::default(); if layout.doublings { n } else { 0 }],
            first_hits: vec![FirstHits::default(); if layout.aovs { n } else { 0 }],
            converged: 0,
            non_finite: 0,
            first_non_finite: None,
        }
    };
    corners.into_iter().map(tile).collect()
}

/// Interleaves the bits of two 16-bit numbers.
fn morton(x: u32, y: u32) -> u32 {
    let spread = |v: u32| (0..16).fold(0, |m, bit| m | ((v >> bit) & 1) << (2 * bit));
    spread(x) | spread(y) << 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_every_pixel_of_a_cell_once() {
        for (width, height) in [(1, 1), (16, 16), (17, 33), (100, 7), (64, 48)] {
            let cell = Cell { x: 5, y: 9, width, height };
            let mut seen = vec![0; (width * height) as usize];
            for tile in tiles(cell, FilmLayout::default()) {
                for (x, y) in tile.x.iter().zip(&tile.y) {
                    seen[((y - 9) * width + (x - 5)) as usize] += 1;
                }
            }
            assert!(seen.iter().all(|&n| n == 1), "{width}×{height}");
        }
    }

    #[test]
    fn samples_that_are_not_numbers_are_counted_and_left_out() {
        let cell = Cell { x: 0, y: 0, width: 1, height: 1 };
        let mut tile =
            tiles(cell, FilmLayout { variance: true, luminance: true, aovs: true, ..FilmLayout::default() }).remove(0);
        for (index, r) in [1.0, f32::NAN, 3.0, f32::INFINITY].into_iter().enumerate() {
            tile.add(0, index as u32, &Sample { radiance: [r, r, r], ..Sample::default() });
        }
        assert_eq!((tile.count[0], tile.mean[0], tile.m2[0]), (2, [2.0; 3], [2.0; 3]));
        assert_eq!((tile.non_finite, tile.first_non_finite), (2, Some((0, 0, 1))));
    }
}
