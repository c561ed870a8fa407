//! Leaves of a packet's way.

use super::rays::Packet;
use crate::bvh::block::TriangleBlock;
use crate::bvh::columns::RayColumns;
use crate::bvh::intersect::Intersect;
use crate::bvh::ray::{Hit, MISS};
use crate::bvh::sphere;
use crate::bvh::sphere4::Sphere4;
use crate::bvh::traverse::bins::RAYS;
use crate::simd::wide::Wide;

impl Packet {
    /// Tests the rays in `mask` against a block of triangles.
    #[inline(always)]
    pub fn visit_block<W: Wide, I: Intersect, const ANY: bool>(
        &mut self,
        wide: W,
        block: &impl TriangleBlock,
        mask: u64,
    ) {
        let mut left = mask;
        while left != 0 {
            let among = left.count_ones().min(W::RAYS as u32);
            let mut number = [0; 4];
            for ray in 0..W::RAYS {
                // Past the last ray, the one before again.
                number[ray] = if left == 0 { number[ray.saturating_sub(1)] } else { left.trailing_zeros() as usize };
                left &= left.wrapping_sub(1);
            }
            let candidates = wide.bits(I::candidates_in(wide, |ray| &self.triangle[number[ray] % RAYS], block));
            let mut rest = candidates & (u32::MAX >> (32 - 4 * among));
            while rest != 0 {
                let bit = rest.trailing_zeros() as usize;
                rest &= rest - 1;
                let (ray, lane) = (number[bit >> 2 & 3] % RAYS, bit & 3);
                if let Some(crossing) = I::crossing(&self.triangle[ray], block, lane) {
                    let (prim, geom) = (block.prims()[lane], block.geom(lane));
                    self.offer::<ANY>(ray, Hit { t: crossing.t, u: crossing.u, v: crossing.v, prim, geom });
                }
            }
        }
    }

    /// Tests the rays in `mask` against a block of spheres.
    #[inline(always)]
    pub fn visit_spheres<const ANY: bool>(&mut self, block: &Sphere4, rays: &RayColumns<'_>, mask: u64) {
        let mut left = mask;
        while left != 0 {
            let number = left.trailing_zeros() as usize;
            left &= left - 1;
            let ray = rays.ray(self.rows[number] as usize);
            for lane in (0..4).filter(|&lane| block.prim[lane] != MISS) {
                let (center, radius) = (block.center(lane), block.radius[lane]);
                if let Some(t) = sphere::intersect(&ray, center, radius, self.t_max(number)) {
                    let hit = Hit { t, u: 0.0, v: 0.0, prim: block.prim[lane], geom: block.geom[lane] };
                    self.offer::<ANY>(number, hit);
                }
            }
        }
    }
}
