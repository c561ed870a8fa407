//! Parallelograms by what would arrive from their corners.
//!
//! What arrives from a point of a lamp, were nothing in the way, is in proportion to cos θ · cos θ′ / r². Over most lamps, as most points see them,
//! that is nearly bilinear in between the corners, and from a bilinear density points are drawn with two square roots (Hart, Pharr, Müller, Lopes, McGuire
//! & Shirley, *Practical Product Sampling by Fitting and Composing Warps*, CGF 39(4), 2020, §4.1). What is left to chance is what is in
//! the way. By area, the distance and both cosines are left to it as well; by solid angle ([`super::rectangle`]), which takes four times the
//! arithmetic, the cosine at the seeing point is.
//!
//! No point is left out: a corner weighs nothing only where the surface faces away from it, and if all corners do, no light arrives. Where a lamp is so near
//! that its middle is much closer than its corners, the density is flatter than what arrives, as it is by area.

use crate::sampling::order::{max, min};
use crate::sampling::v3::V3;

/// A density over a parallelogram, bilinear between its corners, as a surface sees them.
#[derive(Clone, Copy, Debug)]
pub struct Corners {
    /// Shares of the corners at (0, 0), (1, 0), (0, 1), (1, 1).
    shares: [f32; 4],
}

/// A point drawn, as fractions of the sides, and its density relative to that of a uniform point.
#[derive(Clone, Copy, Debug)]
pub struct Drawn {
    /// Along the first side.
    pub s: f32,
    /// Along the second side.
    pub t: f32,
    /// Its mean over the parallelogram is 1.
    pub density: f32,
}

impl Corners {
    /// From the way to the first corner, the sides, and the unit normal of the seeing surface.
    #[inline(always)]
    pub fn new(way: V3, [u, v]: [V3; 2], normal: V3) -> Self {
        // The height of the surface above the lamp's plane is the same to all corners.
        let weight = |way: V3| {
            let squared = way.dot(way);
            max(way.dot(normal), 0.0) / (squared * squared)
        };
        let weights = [weight(way), weight(way + u), weight(way + v), weight(way + u + v)];
        let sum = (weights[0] + weights[1]) + (weights[2] + weights[3]);
        // Nothing to go by, or more than a number holds.
        let usable = (sum > 0.0) & (sum < f32::MAX);
        let scale = 1.0 / if usable { sum } else { 1.0 };
        let share = |weight: f32| {
            let share = weight * scale;
            if usable { share } else { 0.25 }
        };
        Corners { shares: [share(weights[0]), share(weights[1]), share(weights[2]), share(weights[3])] }
    }

    /// The point that two numbers in [0, 1) choose.
    #[inline(always)]
    pub fn sample(&self, u: f32, v: f32) -> Drawn {
        let [near, right, up, far] = self.shares;
        let t = linear(v, near + right, up + far);
        let (left, right) = (mix(near, up, t), mix(right, far, t));
        let s = linear(u, left, right);
        Drawn { s, t, density: 4.0 * mix(left, right, s) }
    }
}

/// From `a` at 0 to `b` at 1.
#[inline(always)]
fn mix(a: f32, b: f32, x: f32) -> f32 {
    a * (1.0 - x) + b * x
}

/// Number in [0, 1] with density in proportion to `mix(a, b, _)`; `a` and `b` are not negative.
#[inline(always)]
fn linear(u: f32, a: f32, b: f32) -> f32 {
    let root = mix(a * a, b * b, u).sqrt();
    // In this order, a number that is none, where both are zero, becomes 0.
    min(max(u * (a + b) / (a + root), 0.0), 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec2, Vec3};

    /// A lamp below a surface that looks down, as seen from near, far, beside, and from a surface that sees a part of it.
    fn cases() -> Vec<(V3, [V3; 2], V3)> {
        let v = |x: f32, y: f32, z: f32| V3::from(Vec3::new(x, y, z));
        let n = |x: f32, y: f32, z: f32| V3::from(Vec3::new(x, y, z).normalize());
        let sides = [v(1.0, 0.0, 0.0), v(0.0, 0.0, 0.7)];
        vec![
            (v(-0.5, -2.0, -0.3), sides, n(0.0, -1.0, 0.0)),
            (v(-0.5, -0.2, -0.3), sides, n(0.0, -1.0, 0.0)),
            (v(3.0, -0.5, 1.0), sides, n(0.3, -1.0, 0.2)),
            (v(-0.3, -0.4, -0.2), sides, n(1.0, -0.1, 0.0)),
            (v(1e6, -3e6, 0.0), sides, n(0.0, -1.0, 0.5)),
            (v(-0.5, -2.0, -0.3), [v(1.0, 0.1, 0.3), v(0.2, 0.0, 0.7)], n(0.1, -1.0, 0.4)),
        ]
    }

    /// A grid of numbers, mapped, is as dense as the density says: cell by cell, against the integral of the bilinear function.
    #[test]
    fn points_are_as_dense_as_is_said() {
        const CELLS: usize = 8;
        const NUMBERS: usize = 512;
        for (case, (way, sides, normal)) in cases().into_iter().enumerate() {
            let corners = Corners::new(way, sides, normal);
            let mut found = [[0.0; CELLS]; CELLS];
            for i in 0..NUMBERS * NUMBERS {
                let number = |i: usize| (i as f32 + 0.5) / NUMBERS as f32;
                let drawn = corners.sample(number(i % NUMBERS), number(i / NUMBERS));
                let cell = |x: f32| ((x * CELLS as f32) as usize).min(CELLS - 1);
                found[cell(drawn.s)][cell(drawn.t)] += 1.0 / (NUMBERS * NUMBERS) as f64;
                let [a, b, c, d] = corners.shares.map(f64::from);
                let at = DVec2::new(drawn.s.into(), drawn.t.into());
                let exact = 4.0 * ((a * (1.0 - at.x) + b * at.x) * (1.0 - at.y) + (c * (1.0 - at.x) + d * at.x) * at.y);
                assert!((f64::from(drawn.density) - exact).abs() < 1e-5, "{case}: {drawn:?} {exact}");
            }
            for (i, j) in (0..CELLS).flat_map(|i| (0..CELLS).map(move |j| (i, j))) {
                // The mean of a bilinear function over a cell is its value in the middle.
                let middle = |i: usize| (i as f64 + 0.5) / CELLS as f64;
                let [a, b, c, d] = corners.shares.map(f64::from);
                let (s, t) = (middle(i), middle(j));
                let share = 4.0 * ((a * (1.0 - s) + b * s) * (1.0 - t) + (c * (1.0 - s) + d * s) * t);
                let (found, expected) = (found[i][j], share / (CELLS * CELLS) as f64);
                // Of the grid's rows and columns, one may lie on the other side of the cell's edge.
                let most = expected * 2.0 * CELLS as f64 / NUMBERS as f64;
                assert!((found - expected).abs() < most, "{case}, cell {i} {j}: {found} for {expected}");
            }
        }
    }

    /// Far from a lamp, density is in proportion to what arrives.
    #[test]
    fn far_away_all_points_are_worth_the_same() {
        let (way, sides, normal) = cases().swap_remove(4);
        let corners = Corners::new(way, sides, normal);
        for (u, v) in [(0.1, 0.2), (0.9, 0.4), (0.5, 0.99)] {
            let drawn = corners.sample(u, v);
            let to = way + sides[0] * drawn.s + sides[1] * drawn.t;
            let arrives = |to: V3| f64::from(to.dot(normal)) / f64::from(to.dot(to)).powi(2);
            let worth = arrives(to) / f64::from(drawn.density) / arrives(way);
            assert!((worth - 1.0).abs() < 1e-5, "{worth}");
        }
    }

    #[test]
    fn where_nothing_is_to_go_by_points_are_uniform() {
        let (_, sides, normal) = cases().swap_remove(0);
        let v = |x: f32, y: f32, z: f32| V3::from(Vec3::new(x, y, z));
        // Faces away; stands in a corner; cannot be squared; too small to be.
        for way in [v(-0.5, 2.0, -0.3), v(0.0, 0.0, 0.0), v(1e20, -1e25, 0.0), v(f32::NAN, -1.0, 0.0)] {
            let drawn = Corners::new(way, sides, normal).sample(0.25, 0.75);
            assert_eq!((drawn.s, drawn.t, drawn.density), (0.25, 0.75, 1.0), "{way:?}");
        }
    }

    #[test]
    fn points_stay_on_the_lamp() {
        let numbers = [0.0, 1e-7, 0.3, 0.999_999_94];
        for (way, sides, normal) in cases() {
            let corners = Corners::new(way, sides, normal);
            for (u, v) in numbers.iter().flat_map(|&u| numbers.map(|v| (u, v))) {
                let drawn = corners.sample(u, v);
                assert!((0.0..=1.0).contains(&drawn.s) && (0.0..=1.0).contains(&drawn.t), "{u} {v}: {drawn:?}");
            }
        }
    }
}
