//! Rays as Embree wants them: records of 32-bit words, one ray after another or in blocks of columns.
//!
//! A ray has twelve words (origin, tnear, direction, time, tfar, mask, id, flags), a hit eight (normal, u, v, primitive,
//! geometry, instance), and a ninth in builds of version 4.4 that know arrays of instances. A block of `width` rays has
//! `width` values of each word in turn; a single ray is a block of one, padded to 16 bytes.

use super::ffi::NOTHING;
use crate::bvh::RayColumns;
use crate::bvh::ray::MISS;
use crate::simd::aligned::Aligned;

/// Words of a ray.
pub const RAY: usize = 12;
/// Words of a hit that every version has.
pub const HIT: usize = 8;
/// The most words of a hit that any known build has.
pub const LARGEST_HIT: usize = 9;
const TNEAR: usize = 3;
const TFAR: usize = 8;
const MASK: usize = 9;
const PRIMITIVE: usize = RAY + 5;
const GEOMETRY: usize = RAY + 6;
const INSTANCE: usize = RAY + 7;

/// How rays lie in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Rays a block.
    pub width: usize,
    /// Words a block.
    pub words: usize,
    /// Hits follow the rays of a block.
    hits: bool,
}

impl Layout {
    /// Blocks of `width` rays, with room for their hits of `hit_words` words unless only occlusion is asked for.
    pub fn new(width: usize, hit_words: Option<usize>) -> Layout {
        let words = width * (RAY + hit_words.unwrap_or(0));
        // Records are multiples of 16 bytes.
        Layout { width, words: words.next_multiple_of(4), hits: hit_words.is_some() }
    }

    /// Blocks that `rays` rays take.
    pub fn blocks(self, rays: usize) -> usize {
        rays.div_ceil(self.width)
    }
}

/// Blocks of rays, and which rays of the last block are there.
pub struct Records {
    /// 64-byte aligned; spare lines at the end catch what a library of another layout would write.
    pub words: Aligned<u32>,
    /// All bits set for rays that are there, 0 for others: of a full block, and of the last one.
    pub valid: [Aligned<u32>; 2],
    /// How they lie.
    pub layout: Layout,
    /// How many there are.
    pub rays: usize,
}

impl Records {
    /// Room for `rays` rays.
    pub fn allocate(layout: Layout, rays: usize) -> Records {
        let width = layout.width.next_multiple_of(16);
        let mut all = Aligned::zeroed(width);
        all.fill(u32::MAX);
        let words = Aligned::zeroed(layout.blocks(rays) * layout.words + 64);
        Records { words, valid: [all, Aligned::zeroed(width)], layout, rays: 0 }
    }

    /// Fills in `rays`, ready to be traced.
    pub fn fill(&mut self, rays: RayColumns<'_>) {
        let Layout { width, words, hits } = self.layout;
        self.rays = rays.len();
        let last = rays.len() - (self.layout.blocks(rays.len()).max(1) - 1) * width;
        for (lane, valid) in self.valid[1].iter_mut().enumerate() {
            *valid = if lane < last { u32::MAX } else { 0 };
        }
        let infinite = f32::INFINITY.to_bits();
        for (block, chunk) in self.words.chunks_exact_mut(words).take(self.layout.blocks(rays.len())).enumerate() {
            let rows = block * width..(block * width + width).min(rays.len());
            let columns = [(rays.ox, 0), (rays.oy, 1), (rays.oz, 2), (rays.dx, 4), (rays.dy, 5), (rays.dz, 6)];
            for (column, word) in columns {
                for (to, from) in chunk[word * width..].iter_mut().zip(&column[rows.clone()]) {
                    *to = from.to_bits();
                }
            }
            chunk[TNEAR * width..][..width].fill(0f32.to_bits());
            chunk[(TNEAR + 4) * width..][..width].fill(0f32.to_bits());
            chunk[TFAR * width..][..width].fill(infinite);
            if let Some(t_max) = rays.t_max {
                for (to, from) in chunk[TFAR * width..].iter_mut().zip(&t_max[rows]) {
                    *to = from.to_bits();
                }
            }
            chunk[MASK * width..][..width].fill(u32::MAX);
            chunk[(MASK + 1) * width..][..2 * width].fill(0);
            if hits {
                chunk[GEOMETRY * width..][..width].fill(NOTHING);
                chunk[INSTANCE * width..][..width].fill(NOTHING);
            }
        }
    }

    fn word(&self, ray: usize, word: usize) -> u32 {
        let Layout { width, words, .. } = self.layout;
        self.words[ray / width * words + word * width + ray % width]
    }

    /// Distance and primitive of the closest hit of each ray; `first[g]` is the first primitive of geometry `g`.
    pub fn closest<'a>(&'a self, first: &'a [u32]) -> impl Iterator<Item = (f32, u32)> + 'a {
        (0..self.rays).map(|ray| match self.word(ray, GEOMETRY) {
            NOTHING => (f32::INFINITY, MISS),
            geometry => {
                let first = first.get(geometry as usize).copied().unwrap_or(0);
                (f32::from_bits(self.word(ray, TFAR)), first.wrapping_add(self.word(ray, PRIMITIVE)))
            }
        })
    }

    /// Whether each ray is occluded: Embree makes `tfar` minus infinity.
    pub fn occluded(&self) -> impl Iterator<Item = bool> + '_ {
        (0..self.rays).map(|ray| f32::from_bits(self.word(ray, TFAR)) == f32::NEG_INFINITY)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every word is where the layout of Embree's headers has it, for whole blocks and a last one in part.
    #[test]
    fn blocks_are_columns_of_their_width() {
        let columns: [Vec<f32>; 7] = std::array::from_fn(|c| (0..5).map(|row| (10 * c + row) as f32).collect());
        let [ox, oy, oz, dx, dy, dz, t] = columns.each_ref().map(Vec::as_slice);
        let rays = RayColumns { ox, oy, oz, dx, dy, dz, t_min: None, t_max: Some(t), low: None };
        for width in [1, 4, 8] {
            let mut records = Records::allocate(Layout::new(width, Some(HIT)), 5);
            records.fill(rays);
            for row in 0..5 {
                let words = [(0, ox), (1, oy), (2, oz), (4, dx), (5, dy), (6, dz), (TFAR, t)];
                for (word, column) in words {
                    assert_eq!(f32::from_bits(records.word(row, word)), column[row], "width {width}");
                }
                assert_eq!(records.word(row, TNEAR), 0);
                assert_eq!((records.word(row, MASK), records.word(row, GEOMETRY)), (u32::MAX, NOTHING));
            }
            let valid = records.valid[1][..width].iter().filter(|&&valid| valid != 0).count();
            assert_eq!(valid, (5 - 1) % width + 1);
            assert_eq!(records.words.as_ptr().addr() % 64, 0);
            assert_eq!(records.layout.words * 4 % 16, 0);
            assert!(records.closest(&[0]).all(|hit| hit == (f32::INFINITY, MISS)));
            assert!(records.occluded().all(|occluded| !occluded));
        }
        assert_eq!(Layout::new(1, Some(LARGEST_HIT)).words, 24);
    }
}
