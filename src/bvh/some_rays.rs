//! Those rays of a batch that come to a box.

use super::aabb::Aabb;
use super::columns::RayColumns;
use super::node::SLACK;
use super::rays4::Rays4;
use crate::simd::{Kernel, Tier};
use glam::Vec4;

/// How many there is room for.
pub const ROWS: usize = 2048;

/// Rays, each with its row in the batch.
pub struct SomeRays {
    row: [u32; ROWS],
    /// Origin, direction, `t_min`, `t_max`.
    columns: [[f32; ROWS]; 8],
    len: usize,
}

/// Where rays end, besides their `t_max`.
#[derive(Clone, Copy)]
pub enum Ends<'a> {
    /// At their hits, if they have any: distances.
    Hits(&'a [f32]),
    /// At once, those that are occluded.
    Occluded(&'a [bool]),
}

impl SomeRays {
    /// None. (Made where they stay: moved, they would be copied.)
    #[inline(always)]
    pub fn new() -> SomeRays {
        SomeRays { row: [0; ROWS], columns: [[0.0; ROWS]; 8], len: 0 }
    }

    /// Takes those rays of the rows from `first` on that come to a box before they end, until there is no room for more. Gives the
    /// first row not looked at. The box test is that of [`super::traverse`]: conservative.
    pub fn fill(&mut self, tier: Tier, rays: RayColumns<'_>, first: usize, bounds: &Aabb, ends: Ends) -> usize {
        tier.run(Fill { some: self, rays, first, bounds: bounds.padded(), ends })
    }

    /// Their rows in the batch.
    pub fn rows(&self) -> impl Iterator<Item = usize> {
        self.row[..self.len].iter().map(|&row| row as usize)
    }

    /// The rays.
    pub fn columns(&self) -> RayColumns<'_> {
        let [ox, oy, oz, dx, dy, dz, t_min, t_max] = self.columns.each_ref().map(|column| &column[..self.len]);
        RayColumns { ox, oy, oz, dx, dy, dz, t_min: Some(t_min), t_max: Some(t_max), low: None }
    }
}

struct Fill<'a> {
    some: &'a mut SomeRays,
    rays: RayColumns<'a>,
    first: usize,
    bounds: Aabb,
    ends: Ends<'a>,
}

impl Kernel for Fill<'_> {
    type Output = usize;

    #[inline(always)]
    fn run(self) -> usize {
        let Fill { some, rays, mut first, bounds, ends } = self;
        some.len = 0;
        while first < rays.len() && some.len + 4 <= ROWS {
            let four = Rays4::load(&rays, first);
            let rows: [usize; 4] = std::array::from_fn(|i| (first + i).min(rays.len() - 1));
            let end = match ends {
                Ends::Hits(t) => Vec4::from_array(rows.map(|row| t[row])),
                Ends::Occluded(occluded) => {
                    Vec4::from_array(rows.map(|row| if occluded[row] { -1.0 } else { f32::MAX }))
                }
            };
            let four = Rays4 { t_max: four.t_max.min(end), ..four };
            let mut rest = meets(&four, &bounds) & four.traceable() & (15 >> (4 - (rays.len() - first).min(4)));
            let values = [
                four.origin[0],
                four.origin[1],
                four.origin[2],
                four.direction[0],
                four.direction[1],
                four.direction[2],
                four.t_min,
                four.t_max,
            ];
            if rest == 0b1111 {
                // All come, as they mostly do: no number is moved by itself.
                let to = some.len % ROWS;
                for (row, first) in some.row[to..][..4].iter_mut().zip(first as u32..) {
                    *row = first;
                }
                for (column, lanes) in some.columns.iter_mut().zip(values) {
                    lanes.write_to_slice(&mut column[to..][..4]);
                }
                some.len += 4;
                first += 4;
                continue;
            }
            let values = values.map(|lanes| lanes.to_array());
            while rest != 0 {
                let lane = rest.trailing_zeros() as usize & 3;
                rest &= rest - 1;
                let to = some.len % ROWS;
                some.row[to] = (first + lane) as u32;
                for (column, value) in some.columns.iter_mut().zip(&values) {
                    column[to] = value[lane];
                }
                some.len += 1;
            }
            first += 4;
        }
        first.min(rays.len())
    }
}

/// Which rays meet a box before they end, one bit each.
#[inline(always)]
fn meets(rays: &Rays4, bounds: &Aabb) -> u32 {
    let scale = rays.scale();
    let (mut entry, mut exit) = (rays.t_min, rays.t_max);
    let planes = bounds.min.to_array().into_iter().zip(bounds.max.to_array());
    for ((low, high), (origin, scale)) in planes.zip(rays.origin.into_iter().zip(scale)) {
        let (low, high) = ((Vec4::splat(low) - origin) * scale, (Vec4::splat(high) - origin) * scale);
        entry = entry.max(low.min(high));
        exit = exit.min(low.max(high));
    }
    (entry * (1.0 - SLACK)).cmple(exit).bitmask()
}
