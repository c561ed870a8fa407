//! Blocks of spheres.

use super::slot::Slot;
use crate::bvh::child::Child;
use crate::bvh::closest::closer;
use crate::bvh::ray::{Hit, MISS, Ray};
use crate::bvh::sphere;
use crate::bvh::sphere4::Sphere4;

/// Tests the first block of a leaf of spheres, and takes it off the stack. Out of line: spheres are few.
#[inline(never)]
pub fn visit<const ANY: bool>(spheres: &[Sphere4], leaf: Child, ray: &Ray, slot: &mut Slot) {
    let block = &spheres[leaf.first_block()];
    let before = slot.t_max();
    slot.leave_block(leaf);
    for lane in (0..4).filter(|&lane| block.prim[lane] != MISS) {
        if let Some(t) = sphere::intersect(ray, block.center(lane), block.radius[lane], slot.t_max()) {
            let hit = Hit { t, u: 0.0, v: 0.0, prim: block.prim[lane], geom: block.geom[lane] };
            if closer(&hit, slot.t_min(), &slot.closest()) {
                slot.set_closest(hit);
            }
        }
    }
    slot.settle::<ANY>(before);
}
