//! The ray–triangle test of Möller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection" (JGT 1997).
//!
//! Fewer operations than the watertight test, and rays may slip between triangles: neighbours do not compute alike at
//! the edge they share. Two-sided. Without fused operations, in one order: every tier gives the same bits, and [`scalar`] the same as the
//! blocks of [`MollerTrumbore`].

use glam::{Vec3, Vec4};

use super::block::TriangleBlock;
use super::intersect::{Crossing, Intersect, RayLanes};
use super::ray::Ray;
use super::rays4::Rays4;
use crate::simd::wide::{Wide, Words};

/// The test, as kernels that are generic over it know it.
#[derive(Clone, Copy, Debug)]
pub struct MollerTrumbore;

impl Intersect for MollerTrumbore {
    #[inline(always)]
    fn prepare(ray: &Ray) -> [Words; 2] {
        let words = |v: Vec3, last: f32| v.extend(last).to_array().map(f32::to_bits);
        [words(ray.origin, 0.0), words(ray.direction, ray.t_max.min(f32::MAX))]
    }

    #[inline(always)]
    fn prepare4(rays: &Rays4) -> [[Vec4; 4]; 2] {
        let ([ox, oy, oz], [dx, dy, dz]) = (rays.origin, rays.direction);
        [[ox, oy, oz, Vec4::ZERO], [dx, dy, dz, rays.t_max]]
    }

    #[inline(always)]
    fn class(_: [Vec4; 3]) -> [u32; 2] {
        [0; 2]
    }

    #[inline(always)]
    fn first_row(_: &Words, axis: u32) -> usize {
        3 * axis as usize
    }

    #[inline(always)]
    fn test<W: Wide>(wide: W, rays: &RayLanes<W::Lanes>, [a, b, c]: [[W::Lanes; 3]; 3]) -> W::Mask {
        let RayLanes { origin, direction, t_max } = *rays;
        let (e1, e2, s) = (minus(wide, b, a), minus(wide, c, a), minus(wide, origin, a));
        let p = cross(wide, direction, e2);
        let determinant = dot(wide, e1, p);
        let q = cross(wide, s, e1);
        // Weights and distance, times the determinant; with its sign taken off, they need no division.
        let u = wide.flipped(dot(wide, s, p), determinant);
        let v = wide.flipped(dot(wide, direction, q), determinant);
        let t = wide.flipped(dot(wide, e2, q), determinant);
        let (zero, magnitude) = (wide.splat(0.0), wide.abs(determinant));
        let inside = wide.both(wide.at_most(zero, u), wide.at_most(zero, v));
        let inside = wide.both(inside, wide.at_most(wide.add(u, v), magnitude));
        // A little beyond `t_max`: the division rounds.
        let reach = wide.mul(wide.mul(magnitude, t_max), wide.splat(1.0 + 1.0 / (1 << 20) as f32));
        let within = wide.both(wide.at_most(zero, t), wide.at_most(t, reach));
        wide.both(inside, within)
    }

    #[inline(always)]
    fn crossing(ray: &[Words; 2], block: &impl TriangleBlock, lane: usize) -> Option<Crossing> {
        let vector = |words: &Words| Vec3::from_array(std::array::from_fn(|axis| f32::from_bits(words[axis])));
        let corner =
            |corner: usize| Vec3::from_array(std::array::from_fn(|axis| block.coordinate(3 * axis, corner, lane)));
        scalar(vector(&ray[0]), vector(&ray[1]), [corner(0), corner(1), corner(2)])
    }

    #[inline(always)]
    fn axes(_: [f32; 3]) -> [usize; 3] {
        [0, 1, 2]
    }

    #[inline(always)]
    fn meet(origin: [f32; 3], direction: [f32; 3], [x, y, z]: [[f32; 3]; 3]) -> (Crossing, bool) {
        meet(origin.into(), direction.into(), [0, 1, 2].map(|i| Vec3::new(x[i], y[i], z[i])))
    }
}

/// Tests one triangle: the twin of [`MollerTrumbore`], same bits.
#[inline(always)]
pub fn scalar(origin: Vec3, direction: Vec3, corners: [Vec3; 3]) -> Option<Crossing> {
    let (crossing, does) = meet(origin, direction, corners);
    does.then_some(crossing)
}

/// The same without branches.
#[inline(always)]
fn meet(origin: Vec3, direction: Vec3, [a, b, c]: [Vec3; 3]) -> (Crossing, bool) {
    let (e1, e2, s) = (b - a, c - a, origin - a);
    let p = scalar_cross(direction, e2);
    let determinant = scalar_dot(e1, p);
    let q = scalar_cross(s, e1);
    let flip = |x: f32| f32::from_bits(x.to_bits() ^ determinant.to_bits() & 1 << 31);
    let (u, v, t) = (flip(scalar_dot(s, p)), flip(scalar_dot(direction, q)), flip(scalar_dot(e2, q)));
    let magnitude = determinant.abs();
    let inside = (u >= 0.0) & (v >= 0.0) & (u + v <= magnitude) & (magnitude > 0.0);
    (Crossing { t: t / magnitude, u: u / magnitude, v: v / magnitude }, inside)
}

#[inline(always)]
fn minus<W: Wide>(wide: W, a: [W::Lanes; 3], b: [W::Lanes; 3]) -> [W::Lanes; 3] {
    [wide.sub(a[0], b[0]), wide.sub(a[1], b[1]), wide.sub(a[2], b[2])]
}

#[inline(always)]
fn cross<W: Wide>(wide: W, a: [W::Lanes; 3], b: [W::Lanes; 3]) -> [W::Lanes; 3] {
    [
        wide.sub(wide.mul(a[1], b[2]), wide.mul(a[2], b[1])),
        wide.sub(wide.mul(a[2], b[0]), wide.mul(a[0], b[2])),
        wide.sub(wide.mul(a[0], b[1]), wide.mul(a[1], b[0])),
    ]
}

#[inline(always)]
fn dot<W: Wide>(wide: W, a: [W::Lanes; 3], b: [W::Lanes; 3]) -> W::Lanes {
    wide.add(wide.add(wide.mul(a[0], b[0]), wide.mul(a[1], b[1])), wide.mul(a[2], b[2]))
}

/// As [`cross`], which no library promises to compute in this order.
#[inline(always)]
fn scalar_cross(a: Vec3, b: Vec3) -> Vec3 {
    Vec3::new(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
}

/// As [`dot`].
#[inline(always)]
fn scalar_dot(a: Vec3, b: Vec3) -> f32 {
    (a.x * b.x + a.y * b.y) + a.z * b.z
}
