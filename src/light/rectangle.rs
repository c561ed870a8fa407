//! Rectangles by solid angle.
//!
//! The map of Ureña, Fajardo & King, *An Area-Preserving Parametrization for Spherical Rectangles*, CGF 32(4), 2013: the first
//! number cuts off a part of the rectangle along one side so that solid angles are in proportion, the second is the
//! height on the cut. Their formulas subtract 2π from a sum of four angles, which leaves few digits for small rectangles; these
//! are arranged so that nothing of the size of 1 is subtracted.
//!
//! Points that are nearly in the plane see a rectangle end where c below is nearly 1, which no longer tells x; there the
//! rectangle is not to be drawn from by solid angle.
//!
//! Frame: the seen point is the origin, x and y run along the sides, the rectangle is at distance h.

use crate::sampling::angle::{angle_of, sin_cos};
use crate::sampling::order::{max, min};

/// Distances to the plane, as a fraction of the largest coordinate, from which on points keep three digits: at 1/64, a rectangle
/// a tenth as wide as far away is off by 1.7·10⁻³ of itself.
const FLATTEST: f32 = 1.0 / 16.0;

/// A rectangle from (x0, y0) to (x1, y1) at distance h > 0, in units of its largest coordinate.
#[derive(Clone, Copy)]
pub struct SeenRectangle {
    x0: f32,
    x1: f32,
    y0: f32,
    y1: f32,
    h: f32,
    width: f32,
    height: f32,
    /// Distances of the corners (x0, y0) and (x0, y1).
    r00: f32,
    r01: f32,
    /// Half of the solid angle, 0 to π. Not a number, or without meaning, for h ≤ 0.
    pub half: f32,
}

impl SeenRectangle {
    /// From the near corner, the sides' lengths and the distance.
    #[inline(always)]
    pub fn new([x0, y0]: [f32; 2], [width, height]: [f32; 2], h: f32) -> Self {
        let (x1, y1) = (x0 + width, y0 + height);
        let largest = max(max(max(x0.abs(), x1.abs()), max(y0.abs(), y1.abs())), h);
        let scale = 1.0 / largest;
        let [x0, x1, y0, y1, h] = [x0 * scale, x1 * scale, y0 * scale, y1 * scale, h * scale];
        let (width, height) = (width * scale, height * scale);
        let hh = h * h;
        let [xx00, xx01, xx11] = [x0 * x0, x0 * x1, x1 * x1];
        let [yy00, yy01, yy11] = [y0 * y0 + hh, y0 * y1 + hh, y1 * y1 + hh];
        let r00 = (xx00 + yy00).sqrt();
        let r10 = (xx11 + yy00).sqrt();
        let r11 = (xx11 + yy11).sqrt();
        let r01 = (xx00 + yy11).sqrt();
        // Two triangles (Van Oosterom & Strackee 1983); their angles add up as those of complex numbers do. The
        // determinant, h · width · height, loses no digits however small the rectangle.
        let volume = h * width * height;
        let diagonal = xx01 + yy01;
        let a = r00 * r10 * r11 + (xx01 + yy00) * r11 + (xx11 + yy01) * r00 + diagonal * r10;
        let b = r00 * r01 * r11 + (xx00 + yy01) * r11 + (xx01 + yy11) * r00 + diagonal * r01;
        let half = angle_of(max(volume * (a + b), 0.0), a * b - volume * volume);
        SeenRectangle { x0, x1, y0, y1, h, width, height, r00, r01, half }
    }

    /// Whether it may be drawn from by solid angle: it is in front, not nearly edge on, and fills at least `least` steradians.
    #[inline(always)]
    pub fn is_wide(&self, least: f32) -> bool {
        (self.h > FLATTEST) & (self.half > least / 2.0)
    }

    /// The point, as fractions of the sides, that the numbers `u` and `v` choose: uniform by solid angle.
    ///
    /// The part of the rectangle up to x has the solid angle T(x) − T(x0) with T = asin(c s1) − asin(c s0), where c = x / √(x² + h²)
    /// and s = y / √(y² + h²). Here T is known by sine and cosine only, and c follows from it.
    #[inline(always)]
    pub fn sample(&self, u: f32, v: f32) -> (f32, f32) {
        let SeenRectangle { x0, x1, y0, y1, h, width, height, r00, r01, half } = *self;
        let hh = h * h;
        let (w0, w1, m) = ((y0 * y0 + hh).sqrt(), (y1 * y1 + hh).sqrt(), (x0 * x0 + hh).sqrt());
        let (s0, s1, c0) = (y0 / w0, y1 / w1, x0 / m);
        // Differences of numbers of one sign, by the difference of their squares.
        let same_side = y0 * y1 > 0.0;
        let apart = hh * height * (y0 + y1) / (w0 * w1 * (y1 * w0 + y0 * w1));
        let difference = s1 - s0;
        let ds = if same_side { apart } else { difference };
        let (q0, q1) = (h * r00 / (m * w0), h * r01 / (m * w1));
        let apart = ds * (s0 + s1) / (s1 * q0 + s0 * q1);
        let difference = s1 * q0 - s0 * q1;
        let sin_0 = c0 * if same_side { apart } else { difference };
        let cos_0 = q0 * q1 + c0 * c0 * s0 * s1;
        let (s, c) = sin_cos(u * half);
        let (sin, cos) = (2.0 * s * c, 1.0 - 2.0 * s * s);
        let sin_t = sin * cos_0 + cos * sin_0;
        let cos_t = cos * cos_0 - sin * sin_0;
        let (from_above, from_below) = (sin_t * sin_t / (1.0 + cos_t), 1.0 - cos_t);
        let rise = if cos_t > 0.0 { from_above } else { from_below };
        let c = sin_t / max(ds * ds + 2.0 * s0 * s1 * rise, f32::MIN_POSITIVE).sqrt();
        let x = h * c / max((1.0 - c) * (1.0 + c), f32::MIN_POSITIVE).sqrt();
        // In this order, a number that is none becomes a corner.
        let x = min(max(x, x0), x1);
        let dd = x * x + hh;
        let (t0, t1) = (y0 / (dd + y0 * y0).sqrt(), y1 / (dd + y1 * y1).sqrt());
        let t = t0 + v * (t1 - t0);
        let y = t * (dd / max((1.0 - t) * (1.0 + t), f32::MIN_POSITIVE)).sqrt();
        let y = min(max(y, y0), y1);
        (min((x - x0) / width, 1.0), min((y - y0) / height, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Solid angle of the part up to x, in double precision: four corners, each with the sign of its place.
    fn exact([x0, x1, y0, y1, h]: [f64; 5]) -> f64 {
        let corner = |x: f64, y: f64| (x * y / (h * (x * x + y * y + h * h).sqrt())).atan();
        corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0)
    }

    /// Corner, sides and distance: near, far, thin, above the middle, beside, nearly in the plane.
    const CASES: [[f32; 5]; 12] = [
        [-0.5, -0.5, 1.0, 1.0, 1.0],
        [-0.5, -0.5, 1.0, 1.0, 0.01],
        [0.2, -0.3, 2.0, 0.7, 0.4],
        [0.2, 0.3, 2.0, 0.7, 0.4],
        [-3.0, -4.0, 0.7, 2.0, 0.9],
        [-3.0, 4.0, 0.05, 0.04, 2.0],
        [1.0, 1.0, 0.1, 0.1, 0.02],
        [30.0, -10.0, 1.0, 1.5, 40.0],
        [-1.0, 2e-3, 2.0, 1e-3, 0.05],
        [0.0, 0.0, 1.0, 1.0, 1.0],
        [-0.4e6, 0.2e6, 1e6, 1e6, 0.3e6],
        [-0.4e-6, 0.2e-6, 1e-6, 1e-6, 0.3e-6],
    ];

    #[test]
    fn solid_angles_keep_their_digits() {
        for [x, y, width, height, h] in CASES {
            let seen = SeenRectangle::new([x, y], [width, height], h);
            let f = f64::from;
            let exact = exact([f(x), f(x) + f(width), f(y), f(y) + f(height), f(h)]);
            let error = f64::from(2.0 * seen.half) / exact - 1.0;
            println!("{x} {y} {width} {height} {h}: {exact:.3e}, off by {error:+.1e}");
            assert!(error.abs() < 1e-5, "{x} {y} {width} {height} {h}: {error:e}");
        }
    }

    #[test]
    fn parts_have_their_share_of_the_solid_angle() {
        let mut drawn = 0;
        for [x, y, width, height, h] in CASES {
            let seen = SeenRectangle::new([x, y], [width, height], h);
            if !seen.is_wide(0.0) {
                continue;
            }
            drawn += 1;
            let f = f64::from;
            let sides =
                |to_x: f64, to_y: f64| exact([f(x), f(x) + to_x * f(width), f(y), f(y) + to_y * f(height), f(h)]);
            for i in 0..=16 {
                let u = i as f32 / 16.0;
                let (s, _) = seen.sample(u, 0.5);
                let share = sides(s.into(), 1.0) / sides(1.0, 1.0);
                assert!((share - f(u)).abs() < 5e-4, "{x} {y} {width} {height} {h}: {u} gives {share}");
                // Within a narrow strip around the cut, the second number divides in proportion too.
                let (s, t) = seen.sample(0.5, u);
                let strip = |to_y: f64| {
                    let s = f64::from(s);
                    let (a, b) = ((s - 1e-3).max(0.0), (s + 1e-3).min(1.0));
                    sides(b, to_y) - sides(a, to_y)
                };
                let share = strip(t.into()) / strip(1.0);
                assert!((share - f(u)).abs() < 2e-3, "{x} {y} {width} {height} {h}: {u} gives {share} in y");
            }
        }
        assert_eq!(drawn, 9, "the others are nearly edge on");
    }

    #[test]
    fn points_stay_on_the_rectangle_wherever_it_is_seen_from() {
        let numbers = [0.0, 1e-7, 0.3, 0.999_999_94];
        for h in [1e-30, 1e-10, 1e-3, 1.0, 1e4] {
            for (x, y) in [(0.0, 0.0), (-1.0, -1.0), (-0.5, 0.0), (-0.5, -0.5), (3.0, -1e5), (1e-20, -1.0)] {
                let seen = SeenRectangle::new([x, y], [1.0f32, 1.0], h);
                for (u, v) in numbers.iter().flat_map(|&u| numbers.map(|v| (u, v))) {
                    let (s, t) = seen.sample(u, v);
                    assert!((0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t), "{x} {y} {h} {u} {v}: {s} {t}");
                }
            }
        }
    }
}
