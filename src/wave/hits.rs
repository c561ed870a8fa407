//! Hits: one row a ray of the batch just traced.

use super::columns::columns;
use super::features::Features;
use crate::bvh::ray::Hit;

columns! {
    /// What a ray hit.
    pub struct Hits = "hit" {
        /// distance along the ray, world units; infinite for a miss
        t: f32 => Features::HITS;
        /// barycentric weight of the second corner
        u: f32 => Features::HITS;
        /// barycentric weight of the third corner
        v: f32 => Features::HITS;
        /// primitive, or u32::MAX
        prim: u32 => Features::HITS;
        /// geometry, or u32::MAX
        geom: u32 => Features::HITS;
    }
}

impl Hits {
    /// The first `n` rows, to be written.
    pub fn columns_mut(&mut self, n: usize) -> crate::bvh::HitColumnsMut<'_> {
        crate::bvh::HitColumnsMut {
            t: &mut self.t[..n],
            u: &mut self.u[..n],
            v: &mut self.v[..n],
            prim: &mut self.prim[..n],
            geom: &mut self.geom[..n],
        }
    }

    /// One row.
    #[inline(always)]
    pub fn hit(&self, row: usize) -> Hit {
        Hit { t: self.t[row], u: self.u[row], v: self.v[row], prim: self.prim[row], geom: self.geom[row] }
    }
}
