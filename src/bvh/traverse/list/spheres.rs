//! Which rays may hit a sphere that many rays are tested against.

use crate::bvh::sphere4::Sphere4;
use crate::simd::wide::Wide;

/// Which rays may hit the sphere in one lane of a block: their lines come near enough to its centre, and it does not lie behind them. One
/// bit a ray.
///
/// Distance by the cross product, which errs by less than 2⁻²¹ |l| |d|; all bounds are wider than that by far. A comparison
/// with what is not a number lets the ray through.
#[inline(always)]
pub fn candidates<W: Wide>(wide: W, origin: [W::Lanes; 3], d: [W::Lanes; 3], block: &Sphere4, lane: usize) -> u32 {
    let (center, radius) = (block.center(lane), block.radius[lane]);
    let l = [
        wide.sub(wide.splat(center.x), origin[0]),
        wide.sub(wide.splat(center.y), origin[1]),
        wide.sub(wide.splat(center.z), origin[2]),
    ];
    let cross = [
        wide.sub(wide.mul(l[1], d[2]), wide.mul(l[2], d[1])),
        wide.sub(wide.mul(l[2], d[0]), wide.mul(l[0], d[2])),
        wide.sub(wide.mul(l[0], d[1]), wide.mul(l[1], d[0])),
    ];
    let (squared, long) = (dot(wide, l, l), dot(wide, d, d));
    let r2 = wide.splat(radius * radius * 1.0001);
    let reach = wide.mul(long, wide.add(r2, wide.mul(squared, wide.splat(1e-5))));
    let wide_off = wide.below(reach, dot(wide, cross, cross));
    let behind =
        wide.both(wide.below(dot(wide, l, d), wide.splat(0.0)), wide.below(r2, wide.mul(squared, wide.splat(0.9999))));
    !wide.bits(wide.either(wide_off, behind)) & (u32::MAX >> (32 - 4 * W::RAYS))
}

#[inline(always)]
fn dot<W: Wide>(wide: W, a: [W::Lanes; 3], b: [W::Lanes; 3]) -> W::Lanes {
    wide.about(a[2], b[2], wide.about(a[1], b[1], wide.mul(a[0], b[0])))
}
