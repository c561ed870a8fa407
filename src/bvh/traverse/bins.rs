//! Which rays make a packet.

use crate::bvh::columns::RayColumns;
use crate::bvh::intersect::Intersect;
use crate::bvh::rays4::Rays4;
use glam::Vec4;

/// Rays of a packet: a bit of a word each.
pub const RAYS: usize = 64;
/// One for each octant of directions and each class of [`Intersect::class`].
const BINS: usize = 32;

/// Rows that wait for others of their kind: those of a packet go to the same octant, along the same axis mostly, so that the
/// near sides of boxes are the same for all, and so are the rows of corners that the triangle test reads.
pub struct Bins {
    rows: [[u32; RAYS]; BINS],
    len: [usize; BINS],
    /// The bins of the rows of one packet's length around `next_row`.
    bins: [u8; RAYS],
    next_row: usize,
}

impl Bins {
    /// None yet.
    pub fn new() -> Bins {
        Bins { rows: [[0; RAYS]; BINS], len: [0; BINS], bins: [0; RAYS], next_row: 0 }
    }

    /// The rows of the next packet, and how many; past them, the last again. `None` if there are no more.
    #[inline(always)]
    pub fn next<I: Intersect>(&mut self, rays: &RayColumns<'_>) -> Option<([u32; RAYS], usize)> {
        while self.next_row < rays.len() {
            let row = self.next_row;
            if row.is_multiple_of(RAYS) {
                // Most often all go the same way, and nobody waits.
                if row + RAYS <= rays.len() && alike::<I>(rays, row) {
                    self.next_row += RAYS;
                    return Some((std::array::from_fn(|ray| (row + ray) as u32), RAYS));
                }
                self.sort::<I>(rays, row);
            }
            let bin = self.bins[row % RAYS] as usize % BINS;
            self.next_row += 1;
            let len = self.len[bin] % RAYS;
            self.rows[bin][len] = row as u32;
            self.len[bin] = (len + 1) % RAYS;
            if len + 1 == RAYS {
                return Some((self.rows[bin], RAYS));
            }
        }
        let bin = self.len.iter().position(|&len| len > 0)?;
        let len = self.len[bin];
        self.len[bin] = 0;
        let last = self.rows[bin][(len - 1) % RAYS];
        self.rows[bin][len..].fill(last);
        Some((self.rows[bin], len))
    }

    /// Finds the bins of the rows from `row` on.
    #[inline(always)]
    fn sort<I: Intersect>(&mut self, rays: &RayColumns<'_>, row: usize) {
        for quad in (0..RAYS.min(rays.len() - row)).step_by(4) {
            let bits = bits::<I>(rays, row + quad);
            for (ray, bin) in self.bins[quad..quad + 4].iter_mut().enumerate() {
                *bin = (0..5).fold(0, |bin, bit| bin | ((bits[bit] >> ray & 1) as u8) << bit);
            }
        }
    }
}

/// Whether the rows of a packet from `row` on are all of one bin.
#[inline(always)]
fn alike<I: Intersect>(rays: &RayColumns<'_>, row: usize) -> bool {
    let (mut any, mut all) = ([0; 5], [0b1111; 5]);
    for quad in (0..RAYS).step_by(4) {
        let bits = bits::<I>(rays, row + quad);
        any = std::array::from_fn(|i| any[i] | bits[i]);
        all = std::array::from_fn(|i| all[i] & bits[i]);
    }
    (0..5).all(|i| any[i] == 0 || all[i] == 0b1111)
}

/// The numbers of the bins of four rows, in binary: each bit of all four together, the lowest first.
#[inline(always)]
fn bits<I: Intersect>(rays: &RayColumns<'_>, row: usize) -> [u32; 5] {
    let directions = Rays4::directions(rays, row);
    let [x, y, z] = directions.map(Vec4::is_negative_bitmask);
    let [a, b] = I::class(directions);
    [x, y, z, a, b]
}
