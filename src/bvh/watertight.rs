//! The watertight ray–triangle test of Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection" (JCGT 2013).
//!
//! The ray's largest direction component becomes its z axis, and a shear makes the ray the z axis itself. Which
//! side of an edge the ray passes then depends on four numbers that both triangles at the edge compute alike, so
//! no ray slips between them. Rounding keeps order, so an f32 edge function that is not 0 has the right sign; those of
//! triangles that a ray may hit are computed again in f64, where they are exact but for one rounding: of slivers, f32 would leave
//! no digit of the weights, and so of the distance.
//!
//! Two-sided, so the paper's swap that keeps the winding is left out. Without fused operations, in one order:
//! every tier gives the same bits, and [`scalar`] the same as the blocks of [`Watertight`].

use glam::{BVec4A, Vec3, Vec3Swizzles, Vec4};

use super::block::TriangleBlock;
use super::intersect::{Crossing, Intersect, RayLanes, beyond_ends};
use super::ray::Ray;
use super::rays4::Rays4;
use crate::simd::wide::{Wide, Words};

/// A ray as the test needs it.
#[derive(Clone, Copy, Debug)]
pub struct ShearedRay {
    /// The two other axes, then the axis of the largest direction component.
    axes: [usize; 3],
    /// Origin, permuted by `axes`.
    origin: [f32; 3],
    /// What to subtract from x and y per unit of z.
    shear: [f32; 2],
    /// The largest direction component.
    depth: f32,
}

impl ShearedRay {
    /// Permutes and shears. The ray must be traceable.
    #[inline(always)]
    pub fn new(ray: &Ray) -> ShearedRay {
        let d = ray.direction.abs();
        let (axes, origin, direction) = if d.x > d.y && d.x > d.z {
            ([1, 2, 0], ray.origin.yzx(), ray.direction.yzx())
        } else if d.y > d.z {
            ([2, 0, 1], ray.origin.zxy(), ray.direction.zxy())
        } else {
            ([0, 1, 2], ray.origin, ray.direction)
        };
        let (shear, depth) = shear(direction.to_array());
        ShearedRay { axes, origin: origin.to_array(), shear, depth }
    }
}

/// What to subtract from x and y per unit of z, and the z of the direction.
#[inline(always)]
fn shear([x, y, z]: [f32; 3]) -> ([f32; 2], f32) {
    ([x / z, y / z], z)
}

/// The test, as kernels that are generic over it know it.
#[derive(Clone, Copy, Debug)]
pub struct Watertight;

/// The first row of a block's corners for each of three axes, a byte each.
#[inline(always)]
fn rows(axes: [usize; 3]) -> u32 {
    let [x, y, z] = axes.map(|axis| 3 * axis as u32);
    x | y << 8 | z << 16
}

impl Intersect for Watertight {
    #[inline(always)]
    fn prepare(ray: &Ray) -> [Words; 2] {
        let sheared = ShearedRay::new(ray);
        let [x, y, z] = sheared.origin.map(f32::to_bits);
        let [shear_x, shear_y] = sheared.shear.map(f32::to_bits);
        [[x, y, z, rows(sheared.axes)], [shear_x, shear_y, sheared.depth.to_bits(), ray.t_max.min(f32::MAX).to_bits()]]
    }

    #[inline(always)]
    fn prepare4(rays: &Rays4) -> [[Vec4; 4]; 2] {
        let ([ox, oy, oz], [dx, dy, dz]) = (rays.origin, rays.direction);
        let (along_x, along_y) = along(rays.direction);
        let select = |x: Vec4, y: Vec4, z: Vec4| Vec4::select(along_x, x, Vec4::select(along_y, y, z));
        let axes = |axes: [usize; 3]| Vec4::splat(f32::from_bits(rows(axes)));
        let rows = select(axes([1, 2, 0]), axes([2, 0, 1]), axes([0, 1, 2]));
        let origin = [select(oy, oz, ox), select(oz, ox, oy), select(ox, oy, oz), rows];
        let depth = select(dx, dy, dz);
        [origin, [select(dy, dz, dx) / depth, select(dz, dx, dy) / depth, depth, rays.t_max]]
    }

    #[inline(always)]
    fn class(directions: [Vec4; 3]) -> [u32; 2] {
        let (along_x, along_y) = along(directions);
        [along_x.bitmask(), along_y.bitmask()]
    }

    #[inline(always)]
    fn first_row(words: &Words, axis: u32) -> usize {
        // The mask spares a bounds check: there are 12 rows.
        (words[3] >> (8 * axis) & 7) as usize
    }

    #[inline(always)]
    fn test<W: Wide>(wide: W, rays: &RayLanes<W::Lanes>, [a, b, c]: [[W::Lanes; 3]; 3]) -> W::Mask {
        let (a, b, c) = (sheared(wide, rays, a), sheared(wide, rays, b), sheared(wide, rays, c));
        let [(e0, p0), (e1, p1), (e2, p2)] = [edge(wide, c, b), edge(wide, a, c), edge(wide, b, a)];
        let edges = [e0, e1, e2];
        let least = wide.min(wide.min(edges[0], edges[1]), edges[2]);
        let most = wide.max(wide.max(edges[0], edges[1]), edges[2]);
        // Zeros count as either sign here. Minimum and maximum may lose a NaN; `finish` rejects it.
        let zero = wide.splat(0.0);
        let inside = wide.either(wide.at_most(zero, least), wide.at_most(most, zero));
        // Where an edge function is 0, the weights that count are others.
        let strictly = wide.either(wide.below(zero, least), wide.below(most, zero));
        let product = wide.max(wide.max(wide.abs(p0), wide.abs(p1)), wide.abs(p2));
        let beyond = beyond_ends(wide, edges, product, [a[2], b[2], c[2]], rays.direction[2], rays.t_max);
        wide.but_not(inside, wide.both(strictly, beyond))
    }

    #[inline(always)]
    fn crossing(ray: &[Words; 2], block: &impl TriangleBlock, lane: usize) -> Option<Crossing> {
        let [origin, shear] = ray.map(|words| words.map(f32::from_bits));
        let corner = |axis: u32, corner: usize| block.coordinate(Self::first_row(&ray[0], axis), corner, lane);
        let corners = |axis: u32| [corner(axis, 0), corner(axis, 1), corner(axis, 2)];
        cross([origin[0], origin[1], origin[2]], [shear[0], shear[1]], shear[2], [corners(0), corners(1), corners(2)])
    }

    #[inline(always)]
    fn axes(direction: [f32; 3]) -> [usize; 3] {
        let [x, y, z] = direction.map(f32::abs);
        // A table instead of branches, which nobody could predict.
        let which = usize::from((x > y) & (x > z)) << 1 | usize::from(y > z);
        [[0, 1, 2], [2, 0, 1], [1, 2, 0], [1, 2, 0]][which]
    }

    #[inline(always)]
    fn meet(origin: [f32; 3], direction: [f32; 3], corners: [[f32; 3]; 3]) -> (Crossing, bool) {
        let (shear, depth) = shear(direction);
        meet(origin, shear, depth, corners)
    }
}

/// Which rays move on x mostly, and which on y; the others on z.
#[inline(always)]
fn along(directions: [Vec4; 3]) -> (BVec4A, BVec4A) {
    let [x, y, z] = directions.map(Vec4::abs);
    let along_x = x.cmpgt(y) & x.cmpgt(z);
    (along_x, y.cmpgt(z) & !along_x)
}

/// A corner as seen from the ray.
#[inline(always)]
fn sheared<W: Wide>(wide: W, rays: &RayLanes<W::Lanes>, [x, y, z]: [W::Lanes; 3]) -> [W::Lanes; 3] {
    let z = wide.sub(z, rays.origin[2]);
    let x = wide.sub(wide.sub(x, rays.origin[0]), wide.mul(rays.direction[0], z));
    let y = wide.sub(wide.sub(y, rays.origin[1]), wide.mul(rays.direction[1], z));
    [x, y, z]
}

/// Which side of the edge between two corners the ray is on; and the first of the products that this is the difference of, by
/// which it errs.
#[inline(always)]
fn edge<W: Wide>(wide: W, p: [W::Lanes; 3], q: [W::Lanes; 3]) -> (W::Lanes, W::Lanes) {
    let product = wide.mul(p[0], q[1]);
    (wide.sub(product, wide.mul(p[1], q[0])), product)
}

/// Tests one triangle: the twin of [`Watertight`], same bits.
#[inline(always)]
pub fn scalar(ray: &ShearedRay, corners: [Vec3; 3]) -> Option<Crossing> {
    cross(ray.origin, ray.shear, ray.depth, ray.axes.map(|axis| corners.map(|corner| corner[axis])))
}

/// Tests one triangle whose corners' coordinates are permuted as the ray is: first the axis, then the corner.
#[inline(always)]
fn cross(origin: [f32; 3], shear: [f32; 2], depth: f32, corners: [[f32; 3]; 3]) -> Option<Crossing> {
    let (crossing, does) = meet(origin, shear, depth, corners);
    does.then_some(crossing)
}

/// The same without branches.
#[inline(always)]
fn meet(origin: [f32; 3], shear: [f32; 2], depth: f32, corners: [[f32; 3]; 3]) -> (Crossing, bool) {
    // Spelt out, here and below: loops over three, however short, keep the compiler from making vectors of the loop over pairs.
    let z = [corners[2][0] - origin[2], corners[2][1] - origin[2], corners[2][2] - origin[2]];
    let x = |i: usize| (corners[0][i] - origin[0]) - shear[0] * z[i];
    let y = |i: usize| (corners[1][i] - origin[1]) - shear[1] * z[i];
    let (x, y) = ([x(0), x(1), x(2)], [y(0), y(1), y(2)]);
    // As the lanes have it: overflow in f32 is a miss, whatever f64 would say.
    let [p, q, r] = [x[2] * y[1] - y[2] * x[1], x[0] * y[2] - y[0] * x[2], x[1] * y[0] - y[1] * x[0]];
    let inside = (p >= 0.0) & (q >= 0.0) & (r >= 0.0) | (p <= 0.0) & (q <= 0.0) & (r <= 0.0);
    let [a, b, c] = exact_edges(x, y);
    let outside = ((a < 0.0) | (b < 0.0) | (c < 0.0)) & ((a > 0.0) | (b > 0.0) | (c > 0.0));
    let area = a + b + c;
    let t = (a * f64::from(z[0]) + b * f64::from(z[1]) + c * f64::from(z[2])) / (area * f64::from(depth));
    // After overflow `t` may be NaN, which no range contains.
    (Crossing { t: t as f32, u: (b / area) as f32, v: (c / area) as f32 }, inside & !outside & (area != 0.0))
}

/// The edge functions, with products that are exact in f64, and so with the right sign. The few lanes that come this far cost nothing.
#[inline(always)]
fn exact_edges(x: [f32; 3], y: [f32; 3]) -> [f64; 3] {
    let wide = |[a, b, c]: [f32; 3]| [f64::from(a), f64::from(b), f64::from(c)];
    let (x, y) = (wide(x), wide(y));
    [x[2] * y[1] - y[2] * x[1], x[0] * y[2] - y[0] * x[2], x[1] * y[0] - y[1] * x[0]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::tri4::Tri4;
    use crate::simd::wide::Quad;
    use proptest::prelude::*;

    fn ray(origin: [f32; 3], direction: [f32; 3]) -> Ray {
        Ray::new(origin.into(), direction.into())
    }

    #[test]
    fn weights_belong_to_the_second_and_third_corner() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let ray = ShearedRay::new(&ray([0.25, 0.5, 2.0], [0.0, 0.0, -1.0]));
        assert_eq!(scalar(&ray, corners), Some(Crossing { t: 2.0, u: 0.25, v: 0.5 }));
    }

    #[test]
    fn crossings_lie_where_the_weights_say() {
        let corners = [Vec3::new(1.0, 0.2, 3.0), Vec3::new(-1.0, 0.1, 2.5), Vec3::new(0.3, 1.5, 4.0)];
        let ray = ray([0.1, -0.2, -1.0], [0.0, 0.15, 1.0]);
        let hit = scalar(&ShearedRay::new(&ray), corners).unwrap();
        let by_weights = corners[0] * (1.0 - hit.u - hit.v) + corners[1] * hit.u + corners[2] * hit.v;
        assert!((ray.origin + ray.direction * hit.t).distance(by_weights) < 1e-6);
    }

    #[test]
    fn degenerate_triangles_are_missed() {
        let ray = ShearedRay::new(&ray([0.0, 0.0, 1.0], [0.0, 0.0, -1.0]));
        assert_eq!(scalar(&ray, [Vec3::ZERO; 3]), None);
        assert_eq!(scalar(&ray, [Vec3::ZERO, Vec3::X, Vec3::X * 2.0]), None);
        assert_eq!(scalar(&ray, [Vec3::NAN; 3]), None);
    }

    /// Weights in f32 put this hit beyond the sliver's end, half its length from where the ray passes.
    #[test]
    fn slivers_are_hit_where_they_are() {
        let (long, high) = (Vec3::new(0.6, -0.64, 0.48), Vec3::new(0.8, 0.48, -0.36) * 1e-6);
        let corners = [long * -0.5, long * 0.5, long * 0.1 + high].map(|corner| corner + Vec3::new(0.3, 0.2, 1.0));
        let inside = corners.map(Vec3::as_dvec3);
        let inside = inside[0] * 0.3 + inside[1] * 0.3 + inside[2] * 0.4;
        for from in [Vec3::ZERO, Vec3::new(2.0, 1.0, 0.5), Vec3::new(-0.4, 3.0, 0.1)] {
            let direction = (inside - from.as_dvec3()).normalize().as_vec3();
            let ray = Ray::new(from, direction);
            let Some(hit) = scalar(&ShearedRay::new(&ray), corners) else { continue };
            let reported = from.as_dvec3() + direction.as_dvec3() * f64::from(hit.t);
            assert!(reported.distance(inside) < 1e-5, "from {from}: {reported} instead of {inside}");
        }
    }

    /// Small integers make edges that pass exactly through the ray likely.
    fn coordinate() -> impl Strategy<Value = f32> {
        prop_oneof![(-3i32..=3).prop_map(|i| i as f32), -10f32..10.0, Just(1e-30f32), Just(3e18f32), Just(2e30f32)]
    }

    fn vector() -> impl Strategy<Value = [f32; 3]> {
        [coordinate(), coordinate(), coordinate()]
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None, ..Default::default() })]
        #[test]
        fn block_and_scalar_give_the_same_bits(
            origin in vector(),
            direction in vector(),
            triangles in proptest::collection::vec([vector(), vector(), vector()], 4),
        ) {
            let ray = ray(origin, direction);
            prop_assume!(ray.is_traceable());
            let sheared = ShearedRay::new(&ray);
            let words = Watertight::prepare(&ray);
            let mut tri4 = Tri4::EMPTY;
            for (lane, corners) in triangles.iter().enumerate() {
                tri4.set(lane, corners.map(Vec3::from_array), lane as u32, 0);
            }
            let mask = Watertight::candidates(Quad, |_| &words, |_| &tri4).bitmask();
            for (lane, corners) in triangles.iter().enumerate() {
                let wide = if mask >> lane & 1 == 1 { Watertight::crossing(&words, &tri4, lane) } else { None };
                let narrow = scalar(&sheared, corners.map(Vec3::from_array)).filter(|hit| hit.t > 0.0 || wide.is_some());
                let bits = |c: Option<Crossing>| c.map(|c| [c.t, c.u, c.v].map(f32::to_bits));
                prop_assert_eq!(bits(wide), bits(narrow));
            }
        }
    }
}
