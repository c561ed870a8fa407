//! Where to split a set of fragments: binned SAH (Wald, "On fast Construction of SAH-based Bounding Volume
//! Hierarchies", 2007), with leaves counted in blocks of four.

use glam::Vec4;
use rayon::prelude::*;

use super::fragment::{CHUNK, Extent, Fragment, WideBox};

/// Most bins an axis.
const BINS: usize = 32;

/// Maps centres to bins: one function for counting and for partitioning, so that both always agree.
#[derive(Clone, Copy, Debug)]
pub struct Binner {
    origin: Vec4,
    scale: Vec4,
    /// Bins in use.
    count: usize,
}

impl Binner {
    /// For `fragments` fragments whose centres have these bounds.
    ///
    /// Few fragments get few bins: sweeping 32 would cost more than the fragments themselves.
    #[inline(always)]
    fn new(centers: &WideBox, fragments: usize) -> Binner {
        let count = (4 + fragments / 4).min(BINS);
        let extent = centers.max - centers.min;
        // Flat axes get scale 0: a single bin, which no split divides.
        let scale = Vec4::select(
            extent.cmpgt(Vec4::splat(f32::MIN_POSITIVE)),
            Vec4::splat((count - 1) as f32) / extent,
            Vec4::ZERO,
        );
        Binner { origin: centers.min, scale: scale.with_w(0.0), count }
    }

    /// The bins of a centre on the three axes: always below [`BINS`], and never falling as the centre rises.
    #[inline(always)]
    fn bins(&self, center: Vec4) -> [usize; 3] {
        // Adding 2²³ rounds to an integer and leaves it in the low bits; a conversion would be three instructions
        // a lane more.
        let magic = (center - self.origin) * self.scale + Vec4::splat(8_388_608.0);
        // One by one: `map` would stay a call inside of kernels.
        let [x, y, z, _] = magic.to_array();
        [x.to_bits() as usize % BINS, y.to_bits() as usize % BINS, z.to_bits() as usize % BINS]
    }
}

/// A place to split: fragments of bins below `bin` on `axis` go left.
#[derive(Clone, Copy, Debug)]
pub struct Split {
    axis: usize,
    bin: usize,
    binner: Binner,
    /// The boxes of both sides.
    pub bounds: [WideBox; 2],
}

impl Split {
    /// Whether the fragment goes left.
    #[inline(always)]
    pub fn is_left(&self, fragment: &Fragment) -> bool {
        self.binner.bins(fragment.center())[self.axis] < self.bin
    }
}

/// Boxes and counts of the fragments in each bin of each axis.
#[derive(Clone, Debug)]
pub struct Bins {
    boxes: [[WideBox; BINS]; 3],
    counts: [[u32; BINS]; 3],
}

impl Bins {
    /// Empty bins.
    pub fn new() -> Bins {
        Bins { boxes: [[WideBox::EMPTY; BINS]; 3], counts: [[0; BINS]; 3] }
    }

    #[inline(always)]
    fn fill(&mut self, fragments: &[Fragment], binner: &Binner) {
        for axis in 0..3 {
            self.boxes[axis][..binner.count].fill(WideBox::EMPTY);
            self.counts[axis][..binner.count].fill(0);
        }
        for fragment in fragments {
            let (min, max) = (fragment.min(), fragment.max());
            let bins = binner.bins(fragment.center());
            for (axis, &bin) in bins.iter().enumerate() {
                self.boxes[axis][bin].grow(min, max);
                self.counts[axis][bin] += 1;
            }
        }
    }

    fn merge(mut self, other: &Bins) -> Bins {
        for axis in 0..3 {
            for bin in 0..BINS {
                self.boxes[axis][bin] = self.boxes[axis][bin].union(other.boxes[axis][bin]);
                self.counts[axis][bin] += other.counts[axis][bin];
            }
        }
        self
    }

    /// The cheapest split of `fragments`, or `None` if all centres share their bins. `scale` keeps areas finite.
    #[inline(always)]
    pub fn best_split(&mut self, fragments: &[Fragment], extent: &Extent, scale: f32) -> Option<Split> {
        let binner = Binner::new(&extent.centers, fragments.len());
        self.fill(fragments, &binner);
        self.cheapest(&binner, scale)
    }

    /// As [`Bins::best_split`], in parallel.
    pub fn best_split_of_many(fragments: &[Fragment], extent: &Extent, scale: f32) -> Option<Split> {
        let binner = Binner::new(&extent.centers, fragments.len());
        let bins = fragments.par_chunks(CHUNK).map(|chunk| {
            let mut bins = Bins::new();
            bins.fill(chunk, &binner);
            bins
        });
        bins.reduce(Bins::new, |a, b| a.merge(&b)).cheapest(&binner, scale)
    }

    #[inline(always)]
    fn cheapest(&self, binner: &Binner, scale: f32) -> Option<Split> {
        let mut best = (f32::INFINITY, 0, 0);
        for axis in 0..3 {
            // Flat axes have everything in bin 0.
            if binner.scale[axis] > 0.0 {
                let (cost, bin) = self.sweep(axis, binner.count, scale);
                if cost < best.0 {
                    best = (cost, axis, bin);
                }
            }
        }
        let (cost, axis, bin) = best;
        (cost < f32::INFINITY).then(|| {
            let union = |boxes: &[WideBox]| boxes.iter().fold(WideBox::EMPTY, |all, &one| all.union(one));
            let (left, right) = self.boxes[axis][..binner.count].split_at(bin);
            Split { axis, bin, binner: *binner, bounds: [union(left), union(right)] }
        })
    }

    /// The cheapest border of one axis: cost (infinite if there is none) and first bin to its right.
    #[inline(always)]
    fn sweep(&self, axis: usize, count: usize, scale: f32) -> (f32, usize) {
        let (boxes, counts) = (&self.boxes[axis][..count], &self.counts[axis][..count]);
        // Cost of everything from a bin rightwards; infinite where that is nothing.
        let mut right_costs = [f32::INFINITY; BINS];
        let (mut right, mut right_count) = (WideBox::EMPTY, 0);
        for bin in (1..count).rev() {
            right = right.union(boxes[bin]);
            right_count += counts[bin];
            if right_count > 0 {
                right_costs[bin] = right.half_area(scale) * right_count.div_ceil(4) as f32;
            }
        }
        let mut best = (f32::INFINITY, 0);
        let (mut left, mut left_count) = (WideBox::EMPTY, 0);
        for bin in 1..count {
            left = left.union(boxes[bin - 1]);
            left_count += counts[bin - 1];
            if left_count > 0 {
                let cost = left.half_area(scale) * left_count.div_ceil(4) as f32 + right_costs[bin];
                if cost < best.0 {
                    best = (cost, bin);
                }
            }
        }
        best
    }
}
