//! Vectors of three numbers whose operations have a fixed order.
//!
//! The reference integrator and the stages share pure functions over `f32` and [`V3`]; stages call them in loops that the compiler makes vectors of. Same
//! operations in the same order give the same bits. Nothing here fuses a multiplication with an addition, and nothing is approximate; glam, which
//! holds points at rest, promises neither.

use super::order::max;
use glam::Vec3;
use std::ops::{Add, Mul, Neg, Sub};

/// A point, a direction or a colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct V3 {
    /// x
    pub x: f32,
    /// y
    pub y: f32,
    /// z
    pub z: f32,
}

impl V3 {
    /// From components.
    #[inline(always)]
    pub fn new(x: f32, y: f32, z: f32) -> Self {
        V3 { x, y, z }
    }
    /// Row `i` of three columns.
    #[inline(always)]
    pub fn load(columns: [&[f32]; 3], i: usize) -> Self {
        V3::new(columns[0][i], columns[1][i], columns[2][i])
    }
    /// Scalar product.
    #[inline(always)]
    pub fn dot(self, o: Self) -> f32 {
        self.x * o.x + self.y * o.y + self.z * o.z
    }
    /// Vector product.
    #[inline(always)]
    pub fn cross(self, o: Self) -> Self {
        V3::new(self.y * o.z - self.z * o.y, self.z * o.x - self.x * o.z, self.x * o.y - self.y * o.x)
    }
    /// Component-wise product.
    #[inline(always)]
    pub fn times(self, o: Self) -> Self {
        V3::new(self.x * o.x, self.y * o.y, self.z * o.z)
    }
    /// Component-wise absolute value.
    #[inline(always)]
    pub fn abs(self) -> Self {
        V3::new(self.x.abs(), self.y.abs(), self.z.abs())
    }
    /// Unit length; not finite for the zero vector.
    #[inline(always)]
    pub fn normalize(self) -> Self {
        self * (1.0 / self.dot(self).sqrt())
    }
    /// The largest component.
    #[inline(always)]
    pub fn max_component(self) -> f32 {
        max(max(self.x, self.y), self.z)
    }
    /// `mask ? yes : no`: both are computed, and one is taken without a branch in loops of vectors.
    #[inline(always)]
    pub fn select(mask: bool, yes: Self, no: Self) -> Self {
        V3::new(if mask { yes.x } else { no.x }, if mask { yes.y } else { no.y }, if mask { yes.z } else { no.z })
    }
    /// Whether all components are 0.
    #[inline(always)]
    pub fn is_zero(self) -> bool {
        self.x == 0.0 && self.y == 0.0 && self.z == 0.0
    }
}

impl From<Vec3> for V3 {
    #[inline(always)]
    fn from(v: Vec3) -> Self {
        V3::new(v.x, v.y, v.z)
    }
}

impl From<V3> for Vec3 {
    #[inline(always)]
    fn from(v: V3) -> Self {
        Vec3::new(v.x, v.y, v.z)
    }
}

impl Add for V3 {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        V3::new(self.x + o.x, self.y + o.y, self.z + o.z)
    }
}

impl Sub for V3 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        V3::new(self.x - o.x, self.y - o.y, self.z - o.z)
    }
}

impl Mul<f32> for V3 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: f32) -> Self {
        V3::new(self.x * s, self.y * s, self.z * s)
    }
}

impl Neg for V3 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        V3::new(-self.x, -self.y, -self.z)
    }
}
