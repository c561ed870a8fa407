//! What is known of a group of emitters: where they are, where to they shine, how much.
//!
//! Conty Estevez & Kulla, *Importance Sampling of Many Lights with Adaptive Tree Splitting*, 2018, §4. All that is built comes
//! from arithmetic and polynomials, so that a tree is the same on every machine.

use crate::sampling::angle::{angle_of, sin_cos};
use crate::sampling::v3::V3;
use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, PI};

/// Bounds of a group of emitters.
#[derive(Clone, Copy, Debug)]
pub struct LightBounds {
    /// Lowest corner of the box.
    pub low: Vec3,
    /// Highest corner.
    pub high: Vec3,
    /// Unit; all normals are within `angle` of it.
    pub axis: Vec3,
    /// 0 to π. Each emitter shines up to π/2 off its normal.
    pub angle: f32,
    /// Share of the power of all emitters.
    pub power: f32,
}

impl LightBounds {
    /// Both groups together.
    pub fn union(&self, other: &LightBounds) -> LightBounds {
        let (axis, angle) = cone(self, other);
        LightBounds {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            axis,
            angle,
            power: self.power + other.power,
        }
    }

    /// Centre of the box.
    pub fn center(&self) -> Vec3 {
        // Halves first: the sum of large numbers overflows.
        self.low * 0.5 + self.high * 0.5
    }

    /// Half of its diagonal.
    pub fn radius(&self) -> f32 {
        (self.high * 0.5 - self.low * 0.5).length()
    }

    /// The cost of a group: its power, times the extent of its cone, times that of its place (Conty Estevez & Kulla 2018, eq. 1). Extent is
    /// that of the bounding sphere, by which nodes are bounded too.
    pub fn cost(&self) -> f32 {
        let (sin, cos) = sin_cos(self.angle);
        let wide = (self.angle + FRAC_PI_2).min(PI);
        // cos(θo − 2 θw), θw being θo + π/2 or π.
        let turned = if self.angle < FRAC_PI_2 { -cos } else { cos };
        let cone = 2.0 * PI * (1.0 - cos) + FRAC_PI_2 * (2.0 * wide * sin - turned - 2.0 * self.angle * sin + cos);
        let radius = self.radius();
        self.power * cone * radius * radius
    }
}

/// The angle between unit vectors, with all digits near 0 and π (Kahan).
fn between(a: Vec3, b: Vec3) -> f32 {
    2.0 * angle_of((a - b).length(), (a + b).length())
}

/// The cone around two cones (Conty Estevez & Kulla 2018, algorithm 1).
fn cone(a: &LightBounds, b: &LightBounds) -> (Vec3, f32) {
    let (wide, narrow) = if a.angle >= b.angle { (a, b) } else { (b, a) };
    let apart = between(wide.axis, narrow.axis);
    if (apart + narrow.angle).min(PI) <= wide.angle {
        return (wide.axis, wide.angle);
    }
    let angle = 0.5 * (wide.angle + apart + narrow.angle);
    let turn = wide.axis.cross(narrow.axis).cross(wide.axis);
    let across = V3::from(turn).dot(turn.into());
    if angle >= PI || across <= 1e-12 {
        return (wide.axis, PI);
    }
    // The axis moves from the wide cone's towards the narrow one's.
    let (sin, cos) = sin_cos(angle - wide.angle);
    (wide.axis * cos + turn * (sin / across.sqrt()), angle)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::random::uniform4;
    use crate::sampling::warp;

    fn random(i: u32) -> LightBounds {
        let [u, v, w, x] = uniform4(i, 0, 0, 0);
        let axis = warp::uniform_cap(u, v, 2.0f32);
        let low = Vec3::new(u, w, x);
        LightBounds { low, high: low + Vec3::splat(v), axis: axis.into(), angle: PI * w * w, power: x }
    }

    #[test]
    fn a_union_holds_both_cones() {
        for i in 0..2000 {
            let (a, b) = (random(2 * i), random(2 * i + 1));
            let union = a.union(&b);
            assert!((union.axis.length() - 1.0).abs() < 1e-5);
            for part in [a, b] {
                let reach = (between(union.axis, part.axis) + part.angle).min(PI);
                assert!(reach <= union.angle + 1e-4, "{part:?} in {union:?}");
            }
            assert!(union.angle <= PI && union.angle >= a.angle.max(b.angle));
        }
    }

    #[test]
    fn the_cost_of_a_cone_is_the_formula_of_the_paper() {
        for i in 0..=100 {
            let angle = PI * i as f32 / 100.0;
            let bounds = LightBounds { low: Vec3::ZERO, high: Vec3::X * 2.0, axis: Vec3::X, angle, power: 1.0 };
            let o = f64::from(angle);
            let w = (o + std::f64::consts::FRAC_PI_2).min(std::f64::consts::PI);
            let cone = std::f64::consts::TAU * (1.0 - o.cos())
                + std::f64::consts::FRAC_PI_2 * (2.0 * w * o.sin() - (o - 2.0 * w).cos() - 2.0 * o * o.sin() + o.cos());
            assert!((f64::from(bounds.cost()) - cone).abs() < 2e-5 * cone.abs().max(1.0), "{angle}: {cone}");
        }
    }
}
