//! Blocks of spheres.

use super::slot::Slot;
use crate::bvh::closest::closer;
use crate::bvh::ray::{Hit, MISS, Ray};
use crate::bvh::sphere;
use crate::bvh::sphere4::Sphere4;

/// Tests the first block of a leaf of spheres, which was taken off the stack. Gives the top of the stack then. Out of line: spheres are
/// few.
#[inline(never)]
pub fn visit<const ANY: bool>(block: &Sphere4, ray: &Ray, slot: &mut Slot, mut top: u8) -> u8 {
    for lane in (0..4).filter(|&lane| block.prim[lane] != MISS) {
        if let Some(t) = sphere::intersect(ray, block.center(lane), block.radius[lane], slot.t_max()) {
            let hit = Hit { t, u: 0.0, v: 0.0, prim: block.prim[lane], geom: block.geom[lane] };
            if closer(&hit, slot.t_min(), &slot.closest()) {
                top = slot.hit_at::<ANY>(hit, top);
            }
        }
    }
    top
}
