//! A node of the tree, and how much its four groups of emitters may send to a point: all four at once, a lane each.

use super::NOWHERE;
use super::bounds::LightBounds;
use crate::sampling::angle::sin_cos;
use crate::sampling::v3::V3;
use glam::{Vec3, Vec4};
use std::f32::consts::PI;

/// Four vectors: x, y and z of each.
type Four = [Vec4; 3];

/// Up to four groups of emitters, one a lane. Places are in units of the radius of all emitters, from their middle.
#[derive(Clone, Copy)]
pub struct Node {
    center: Four,
    /// Square of the radius of the bounding sphere.
    radius2: Vec4,
    axis: Four,
    cos: Vec4,
    sin: Vec4,
    /// Share of the power; 0 in lanes without a group.
    power: Vec4,
    /// The node that opens the group, or `EMITTER` and the emitter.
    pub link: [u32; 4],
}

/// A point of a surface as nodes are tested with it, in every lane.
#[derive(Clone, Copy)]
pub struct Asking {
    at: Four,
    normal: Four,
}

impl Asking {
    /// From a place in the tree's units, and the surface's unit normal.
    #[inline(always)]
    pub fn new(at: V3, normal: V3) -> Asking {
        let splat = |v: V3| [Vec4::splat(v.x), Vec4::splat(v.y), Vec4::splat(v.z)];
        Asking { at: splat(at), normal: splat(normal) }
    }
}

impl Node {
    /// Of up to four groups, the tree's middle, and what one unit of length is in its own.
    pub fn new<'a>(groups: impl Iterator<Item = &'a LightBounds>, middle: Vec3, scale: f32) -> Node {
        let mut lanes = [[0.0f32; 10]; 4];
        for (lane, group) in lanes.iter_mut().zip(groups) {
            let center = (group.center() - middle) * scale;
            // A little more, so that rounding excludes nothing.
            let radius = group.radius() * scale * 1.0001 + 1e-6;
            let (sin, cos) = sin_cos((group.angle + 1e-4).min(PI));
            let Vec3 { x, y, z } = group.axis;
            *lane = [center.x, center.y, center.z, radius * radius, x, y, z, cos, sin, group.power];
        }
        let of = |field: usize| Vec4::from_array(lanes.map(|lane| lane[field]));
        Node {
            center: [of(0), of(1), of(2)],
            radius2: of(3),
            axis: [of(4), of(5), of(6)],
            cos: of(7),
            sin: of(8),
            power: of(9),
            link: [NOWHERE; 4],
        }
    }

    /// Power over squared distance, times bounds of the cosines at the light and at the surface; 0 only where nothing arrives.
    #[inline(always)]
    pub fn importance(&self, asking: &Asking) -> [f32; 4] {
        let (zero, one) = (Vec4::ZERO, Vec4::ONE);
        let ([x, y, z], [cx, cy, cz]) = (asking.at, self.center);
        let way = [x - cx, y - cy, z - cz];
        let squared = dot(way, way);
        let scale = one / sqrt(max(squared, Vec4::splat(f32::MIN_POSITIVE)));
        let [x, y, z] = way;
        let away = [x * scale, y * scale, z * scale];
        // The angle that the bounding sphere fills; from inside, all.
        let sin2 = self.radius2 / squared;
        let outside = sin2.cmplt(one);
        let fill = [Vec4::select(outside, sqrt(sin2), zero), Vec4::select(outside, sqrt(max(one - sin2, zero)), -one)];
        let cos_light = dot(away, self.axis);
        let [_, cos_light] = less(less([root(cos_light), cos_light], [self.sin, self.cos]), fill);
        let cos_surface = -dot(away, asking.normal);
        let [_, cos_surface] = less([root(cos_surface), cos_surface], fill);
        let bound = max(cos_light, zero) * max(cos_surface, zero);
        (self.power * bound / max(squared, self.radius2)).to_array()
    }
}

/// Scalar products.
#[inline(always)]
fn dot([ax, ay, az]: Four, [bx, by, bz]: Four) -> Vec4 {
    ax * bx + ay * by + az * bz
}

/// Square roots, correctly rounded.
#[inline(always)]
fn sqrt(x: Vec4) -> Vec4 {
    let [a, b, c, d] = x.to_array();
    Vec4::new(a.sqrt(), b.sqrt(), c.sqrt(), d.sqrt())
}

/// As [`crate::sampling::order::max`]; what glam's says of NaN depends on the machine.
#[inline(always)]
fn max(a: Vec4, b: Vec4) -> Vec4 {
    Vec4::select(a.cmpgt(b), a, b)
}

/// √(1 − x²).
#[inline(always)]
fn root(x: Vec4) -> Vec4 {
    sqrt(max(Vec4::ONE - x * x, Vec4::ZERO))
}

/// Sine and cosine of a − b, or of 0 where b is the larger; both from 0 to π.
#[inline(always)]
fn less([sin_a, cos_a]: [Vec4; 2], [sin_b, cos_b]: [Vec4; 2]) -> [Vec4; 2] {
    let larger = cos_a.cmpgt(cos_b);
    let sin = Vec4::select(larger, Vec4::ZERO, sin_a * cos_b - cos_a * sin_b);
    let cos = Vec4::select(larger, Vec4::ONE, cos_a * cos_b + sin_a * sin_b);
    [sin, cos]
}
