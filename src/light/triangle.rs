//! Triangles by solid angle.
//!
//! What Arvo's *Stratified Sampling of Spherical Triangles* (SIGGRAPH 1995) does – cut off a part of the triangle in proportion,
//! then choose a point of the cut – by the formulas of Peters, *BRDF Importance Sampling for Polygonal Lights* (TOG 40(4), 2021, §4): one
//! arc tangent, one sine and cosine, and no difference of angles, so that small triangles keep their digits.

use crate::sampling::angle::{angle_of, sin_cos};
use crate::sampling::v3::V3;

/// Solid angles (sr) above which edges are nearly half circles, which two corners no longer determine: seen from 0.004 above a triangle
/// of size 1, 6.2 sr, directions did not follow the density (χ²).
const LARGEST: f32 = 6.0;

/// Numerator and denominator of the arc tangent that together are smaller than this, for points next to an edge, have lost
/// too many digits.
const UNSURE: f32 = 1.0 / 64.0;

/// A triangle as a point sees it, from its front.
pub struct SeenTriangle {
    /// One over the distances of the corners.
    inverse: [f32; 3],
    /// Unit vectors towards the corners.
    corners: [V3; 3],
    /// Volume of the parallelepiped of the unit vectors, and the sums of cosines of Peters' formula.
    volume: f32,
    cosines: [f32; 2],
    /// Half of the solid angle, 0 to π. Without meaning for `height` ≤ 0.
    pub half: f32,
}

impl SeenTriangle {
    /// From the ways to the corners, the distance to the plane, and the triangle's area.
    #[inline(always)]
    pub fn new(ways: [V3; 3], height: f32, area: f32) -> Self {
        let inverse = ways.map(|way| 1.0 / way.dot(way).sqrt());
        let [a, b, c] = [0, 1, 2].map(|i: usize| ways[i] * inverse[i]);
        let volume = (height * inverse[0]) * (2.0 * area * inverse[1] * inverse[2]);
        let cosines = [a.dot(c) + b.dot(c), 1.0 + a.dot(b)];
        let half = angle_of(volume.max(0.0), cosines[0] + cosines[1]);
        SeenTriangle { inverse, corners: [a, b, c], volume, cosines, half }
    }

    /// Whether it may be drawn from by solid angle: it fills at least `least` steradians, and its angle keeps its digits.
    #[inline(always)]
    pub fn is_wide(&self, least: f32) -> bool {
        let [from, to] = self.cosines;
        let sure = self.volume + (from + to).abs() > UNSURE;
        sure && self.half < LARGEST / 2.0 && self.half > least / 2.0
    }

    /// Barycentric weights of the point that two numbers choose: uniform by solid angle.
    #[inline(always)]
    pub fn sample(&self, u: f32, v: f32) -> [f32; 3] {
        let [a, b, c] = self.corners;
        let (sin, cos) = sin_cos(u * self.half);
        // The corner `c`, moved along its arc to `a`, so that the triangle has `u` times its solid angle.
        let (p, q) = (self.volume * cos - self.cosines[0] * sin, self.cosines[1] * sin);
        let ac = a.dot(c);
        let reflect = 2.0 * (p + q * ac) / (p * p + q * q + 2.0 * p * q * ac);
        let (to_a, to_c) = ((reflect * p - 1.0).max(0.0), (reflect * q).max(0.0));
        let moved = a * to_a + c * to_c;
        // A point of the arc from `b` to there; `drop` is 1 − its cosine, as half the square of the chord. The share of
        // `moved` exceeds 1 where the arc is longer than a quarter circle.
        let chord = b - moved;
        let drop = chord.dot(chord) * 0.5;
        let along = (v * (2.0 - v * drop) / (2.0 - drop)).max(0.0).sqrt();
        let beside = ((1.0 - along) - drop * (v - along)).max(0.0);
        let weights = [along * to_a * self.inverse[0], beside * self.inverse[1], along * to_c * self.inverse[2]];
        let sum = weights[0] + weights[1] + weights[2];
        if sum > 0.0 && sum.is_finite() { weights.map(|w| w / sum) } else { [0.0, 1.0, 0.0] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// L'Huilier's theorem, in double precision.
    fn exact(ways: [DVec3; 3]) -> f64 {
        let [a, b, c] = ways.map(DVec3::normalize);
        let side = |a: DVec3, b: DVec3| 2.0 * ((a - b).length() / 2.0).asin();
        let sides = [side(b, c), side(c, a), side(a, b)];
        let s = sides.iter().sum::<f64>() / 2.0;
        let product: f64 = sides.iter().map(|side| ((s - side) / 2.0).tan()).product();
        4.0 * ((s / 2.0).tan() * product).max(0.0).sqrt().atan()
    }

    #[test]
    fn parts_have_their_share_of_the_solid_angle() {
        let shapes = [
            [[-0.4, -0.3, 1.0], [0.7, -0.2, 1.0], [0.1, 0.9, 1.0]],
            [[-4.0, -3.0, 0.1], [7.0, -2.0, 0.1], [1.0, 9.0, 0.1]],
            [[2.0, 1.0, 0.3], [2.5, 1.1, 0.3], [2.2, 1.6, 0.3]],
            [[0.01, 0.02, 1.0], [0.03, 0.02, 1.0], [0.01, 0.035, 1.0]],
            [[-1.0, 0.5, 0.2], [1.0, 0.5, 0.2], [0.0, 0.6, 0.2]],
            [[0.0, 0.0, 2.0], [1e-3, 3.0, 2.0], [0.0, 3.0, 2.0]],
        ];
        for shape in shapes {
            let corners = shape.map(DVec3::from_array);
            let [a, b, c] = corners;
            let area = (b - a).cross(c - a).length() / 2.0;
            let ways = corners.map(|corner| V3::from(corner.as_vec3()));
            let seen = SeenTriangle::new(ways, a.z as f32, area as f32);
            let whole = exact(corners);
            assert!((f64::from(2.0 * seen.half) / whole - 1.0).abs() < 1e-5, "{shape:?}: {whole}");
            for i in 0..=16 {
                let u = i as f32 / 16.0;
                // With the second number 1, points lie on the edge from `a` to `c`, at the corner that was moved.
                let [x, y, z] = seen.sample(u, 1.0).map(f64::from);
                let part = exact([a, b, a * x + b * y + c * z]) / whole;
                assert!((part - f64::from(u)).abs() < 2e-3, "{shape:?}: {u} gives {part}");
                let weights = seen.sample(u, 0.37);
                assert!(weights.iter().all(|w| (0.0..=1.0).contains(w)), "{weights:?}");
                // Along the cut, 1 − cosine grows in proportion to the second number.
                let [x, y, z] = weights.map(f64::from);
                let (point, moved) = (a * x + b * y + c * z, seen.sample(u, 1.0).map(f64::from));
                let end = a * moved[0] + b * moved[1] + c * moved[2];
                let drop = |p: DVec3| (p.normalize() - b.normalize()).length_squared();
                assert!((drop(point) / drop(end) - 0.37).abs() < 2e-3, "{shape:?}: {u}");
            }
        }
    }
}
