//! One number or four: the arithmetic that scalar and SIMD kernels share.
//!
//! A pure function written over [`Lanes`] runs on `f32` in the reference integrator and on [`Vec4`] in the
//! stages, with the same operations in the same order, so both give the same bits. Nothing here fuses
//! a multiplication with an addition, and nothing is approximate.

use glam::{BVec4A, Vec3, Vec4};
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Sub};

/// `f32`, or four of them in step.
pub trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self> + 'static
{
    /// The result of a comparison.
    type Mask: Copy + BitAnd<Output = Self::Mask> + BitOr<Output = Self::Mask>;

    /// How many numbers.
    const WIDTH: usize;

    /// The same number in every lane.
    fn splat(x: f32) -> Self;
    /// `WIDTH` numbers from the start of a slice.
    fn load(from: &[f32]) -> Self;
    /// Writes `WIDTH` numbers to the start of a slice.
    fn store(self, to: &mut [f32]);
    /// Square root, correctly rounded.
    fn sqrt(self) -> Self;
    /// `self < other ? self : other`: the second if one is NaN.
    fn min(self, other: Self) -> Self;
    /// `self > other ? self : other`: the second if one is NaN.
    fn max(self, other: Self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// This magnitude with that sign.
    fn copysign(self, sign: Self) -> Self;
    /// `self < other`.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self > other`.
    fn gt(self, other: Self) -> Self::Mask;
    /// `mask ? yes : no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// Whether it holds in every lane.
    fn all(mask: Self::Mask) -> bool;
}

impl Lanes for f32 {
    type Mask = bool;
    const WIDTH: usize = 1;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        x
    }
    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        from[0]
    }
    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        to[0] = self;
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f32::sqrt(self)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f32::abs(self)
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        f32::copysign(self, sign)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn gt(self, other: Self) -> bool {
        self > other
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
    #[inline(always)]
    fn all(mask: bool) -> bool {
        mask
    }
}

impl Lanes for Vec4 {
    type Mask = BVec4A;
    const WIDTH: usize = 4;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Vec4::splat(x)
    }
    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        Vec4::from_slice(from)
    }
    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        self.write_to_slice(to);
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let [a, b, c, d] = self.to_array();
        Vec4::new(a.sqrt(), b.sqrt(), c.sqrt(), d.sqrt())
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Vec4::select(self.cmplt(other), self, other)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Vec4::select(self.cmpgt(other), self, other)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Vec4::abs(self)
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        Vec4::copysign(self, sign)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> BVec4A {
        self.cmplt(other)
    }
    #[inline(always)]
    fn gt(self, other: Self) -> BVec4A {
        self.cmpgt(other)
    }
    #[inline(always)]
    fn select(mask: BVec4A, yes: Self, no: Self) -> Self {
        Vec4::select(mask, yes, no)
    }
    #[inline(always)]
    fn all(mask: BVec4A) -> bool {
        mask.all()
    }
}

/// A vector of lanes: one direction, or four.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct V3<F> {
    /// x
    pub x: F,
    /// y
    pub y: F,
    /// z
    pub z: F,
}

impl<F: Lanes> V3<F> {
    /// From components.
    #[inline(always)]
    pub fn new(x: F, y: F, z: F) -> Self {
        V3 { x, y, z }
    }
    /// The same vector in every lane.
    #[inline(always)]
    pub fn splat(v: Vec3) -> Self {
        V3::new(F::splat(v.x), F::splat(v.y), F::splat(v.z))
    }
    /// Lanes from three columns, at row `i`.
    #[inline(always)]
    pub fn load(columns: [&[f32]; 3], i: usize) -> Self {
        V3::new(F::load(&columns[0][i..]), F::load(&columns[1][i..]), F::load(&columns[2][i..]))
    }
    /// Lanes to three columns, at row `i`.
    #[inline(always)]
    pub fn store(self, columns: [&mut [f32]; 3], i: usize) {
        let [x, y, z] = columns;
        self.x.store(&mut x[i..]);
        self.y.store(&mut y[i..]);
        self.z.store(&mut z[i..]);
    }
    /// Scalar product.
    #[inline(always)]
    pub fn dot(self, o: Self) -> F {
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
        self * (F::splat(1.0) / self.dot(self).sqrt())
    }
    /// The largest component.
    #[inline(always)]
    pub fn max_component(self) -> F {
        self.x.max(self.y).max(self.z)
    }
    /// `mask ? yes : no`, lane by lane.
    #[inline(always)]
    pub fn select(mask: F::Mask, yes: Self, no: Self) -> Self {
        V3::new(F::select(mask, yes.x, no.x), F::select(mask, yes.y, no.y), F::select(mask, yes.z, no.z))
    }
}

impl From<Vec3> for V3<f32> {
    #[inline(always)]
    fn from(v: Vec3) -> Self {
        V3::new(v.x, v.y, v.z)
    }
}

impl From<V3<f32>> for Vec3 {
    #[inline(always)]
    fn from(v: V3<f32>) -> Self {
        Vec3::new(v.x, v.y, v.z)
    }
}

impl<F: Lanes> Add for V3<F> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        V3::new(self.x + o.x, self.y + o.y, self.z + o.z)
    }
}

impl<F: Lanes> Sub for V3<F> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        V3::new(self.x - o.x, self.y - o.y, self.z - o.z)
    }
}

impl<F: Lanes> Mul<F> for V3<F> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: F) -> Self {
        V3::new(self.x * s, self.y * s, self.z * s)
    }
}

impl<F: Lanes> Neg for V3<F> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        V3::new(-self.x, -self.y, -self.z)
    }
}

impl V3<f32> {
    /// Whether all components are 0.
    #[inline(always)]
    pub fn is_zero(self) -> bool {
        self.x == 0.0 && self.y == 0.0 && self.z == 0.0
    }
}
