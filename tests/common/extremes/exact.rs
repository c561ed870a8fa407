//! Signs that no rounding can turn: f64 where its error is certainly smaller than the value, exact sums of f64 elsewhere.
//!
//! After Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates" (1997): an [`Expansion`] is a sum of
//! f64 that do not overlap. Coordinates are f32, or sums of two f32, so no product below leaves the range of f64 (2⁻⁵⁹⁶ to 2⁵²⁰), and none of its errors.

use glam::{DVec3, Vec3};

/// A sum of f64, by increasing magnitude, none overlapping another, none 0.
#[derive(Clone, Debug, Default)]
pub struct Expansion(Vec<f64>);

/// a + b and what rounding took from it (Knuth).
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let part = sum - a;
    (sum, (a - (sum - part)) + (b - part))
}

impl Expansion {
    /// p − o.
    pub fn difference(p: f64, o: f64) -> Expansion {
        Expansion::default().plus_number(p).plus_number(-o)
    }

    /// Exactly this number.
    pub fn of(value: f64) -> Expansion {
        Expansion::default().plus_number(value)
    }

    fn plus_number(&self, value: f64) -> Expansion {
        let mut all = Vec::with_capacity(self.0.len() + 1);
        let mut carried = value;
        for &part in &self.0 {
            let (sum, error) = two_sum(carried, part);
            if error != 0.0 {
                all.push(error);
            }
            carried = sum;
        }
        if carried != 0.0 {
            all.push(carried);
        }
        Expansion(all)
    }

    /// The sum.
    pub fn plus(&self, other: &Expansion) -> Expansion {
        other.0.iter().fold(self.clone(), |sum, &part| sum.plus_number(part))
    }

    /// The difference.
    pub fn minus(&self, other: &Expansion) -> Expansion {
        other.0.iter().fold(self.clone(), |sum, &part| sum.plus_number(-part))
    }

    /// The product.
    pub fn times(&self, other: &Expansion) -> Expansion {
        let mut product = Expansion::default();
        for &a in &self.0 {
            for &b in &other.0 {
                let high = a * b;
                // Fused, so that nothing is lost.
                product = product.plus_number(a.mul_add(b, -high)).plus_number(high);
            }
        }
        product
    }

    /// −1, 0 or 1.
    pub fn sign(&self) -> i32 {
        self.0.last().map_or(0, |largest| if *largest > 0.0 { 1 } else { -1 })
    }
}

type Exact3 = [Expansion; 3];

fn exact_difference(p: DVec3, o: DVec3) -> Exact3 {
    std::array::from_fn(|axis| Expansion::difference(p[axis], o[axis]))
}

fn exact_cross(a: &Exact3, b: &Exact3) -> Exact3 {
    std::array::from_fn(|axis| {
        let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
        a[i].times(&b[j]).minus(&a[j].times(&b[i]))
    })
}

fn exact_dot(a: &Exact3, b: &Exact3) -> Expansion {
    (0..3).fold(Expansion::default(), |sum, axis| sum.plus(&a[axis].times(&b[axis])))
}

/// Bound on the relative error of a triple product in f64 of three differences of f32, in parts of the sum of the magnitudes of its six products:
/// each passes through at most eight roundings of 2⁻⁵³.
const TRIPLE_ERROR: f64 = 9.0 / (1u64 << 53) as f64;

/// a·(b × c) in f64, and a bound on its error if each component carries one rounding.
pub fn triple(a: DVec3, b: DVec3, c: DVec3) -> (f64, f64) {
    let (x, y) = (b.yzx() * c.zxy(), b.zxy() * c.yzx());
    (a.dot(x - y), a.abs().dot(x.abs() + y.abs()) * TRIPLE_ERROR)
}

/// The components in another order.
trait Turned {
    fn yzx(self) -> Self;
    fn zxy(self) -> Self;
}

impl Turned for DVec3 {
    fn yzx(self) -> DVec3 {
        DVec3::new(self.y, self.z, self.x)
    }
    fn zxy(self) -> DVec3 {
        DVec3::new(self.z, self.x, self.y)
    }
}

fn sign_of(value: f64, error: f64) -> Option<i32> {
    (value.abs() > error).then_some(if value > 0.0 { 1 } else { -1 })
}

/// On which side of the line from `p` to `q` the line through `origin` along `direction` passes: the sign of (p − o) × (q − o) · d.
pub fn edge_sign(origin: DVec3, direction: Vec3, p: DVec3, q: DVec3) -> i32 {
    let direction = direction.as_dvec3();
    let (value, error) = triple(direction, p - origin, q - origin);
    sign_of(value, error).unwrap_or_else(|| {
        let cross = exact_cross(&exact_difference(p, origin), &exact_difference(q, origin));
        exact_dot(&cross, &exact_difference(direction, DVec3::ZERO)).sign()
    })
}

/// The sign of (a − o) · (b − o) × (c − o): on which side of a triangle's plane the point lies.
pub fn side(origin: DVec3, [a, b, c]: [DVec3; 3]) -> i32 {
    let (value, error) = triple(a - origin, b - origin, c - origin);
    sign_of(value, error).unwrap_or_else(|| {
        let [a, b, c] = [a, b, c].map(|corner| exact_difference(corner, origin));
        exact_dot(&a, &exact_cross(&b, &c)).sign()
    })
}

/// The sign of r²·d² − |(c − o) × d|²: whether a line meets a sphere.
pub fn sphere_sign(origin: DVec3, direction: Vec3, center: DVec3, radius: f64) -> i32 {
    let f = exact_difference(center, origin);
    let d = exact_difference(direction.as_dvec3(), DVec3::ZERO);
    let cross = exact_cross(&f, &d);
    let r = Expansion::of(radius);
    r.times(&r).times(&exact_dot(&d, &d)).minus(&exact_dot(&cross, &cross)).sign()
}

/// The sign of |c − o|² − r²: 1 if the point lies outside of the sphere.
pub fn outside_sphere(origin: DVec3, center: DVec3, radius: f64) -> i32 {
    let f = exact_difference(center, origin);
    let r = Expansion::of(radius);
    exact_dot(&f, &f).minus(&r.times(&r)).sign()
}
