//! Gradient noise in three dimensions with its gradient, and sums of it.
//!
//! Pure functions of position and seed, in `f32`, so that any number of threads makes the same mesh. The noise is
//! Perlin's (2002) with quintic fade; its derivatives follow Quilez, "gradient noise derivatives" (2017).

use glam::{IVec3, Vec3};

/// A value and its gradient by position.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Field {
    /// The value.
    pub value: f32,
    /// Its derivatives by x, y and z.
    pub gradient: Vec3,
}

/// 32 well-mixed bits from three integers and a seed.
///
/// The constants are those of Wellons' low-bias 32-bit mixer and of Weyl sequences.
pub fn hash(x: u32, y: u32, z: u32, seed: u32) -> u32 {
    let step = |h: u32, v: u32| {
        let mut h = h.wrapping_add(0x9e37_79b9) ^ v;
        h = (h ^ (h >> 16)).wrapping_mul(0x7feb_352d);
        h = (h ^ (h >> 15)).wrapping_mul(0x846c_a68b);
        h ^ (h >> 16)
    };
    step(step(step(seed, x), y), z)
}

/// A number in [0, 1) from 32 bits.
pub fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// One of the twelve directions from a cube's centre to the middles of its edges (four of them twice).
fn lattice_gradient(cell: IVec3, seed: u32) -> Vec3 {
    const EDGES: [Vec3; 16] = [
        Vec3::new(1.0, 1.0, 0.0),
        Vec3::new(-1.0, 1.0, 0.0),
        Vec3::new(1.0, -1.0, 0.0),
        Vec3::new(-1.0, -1.0, 0.0),
        Vec3::new(1.0, 0.0, 1.0),
        Vec3::new(-1.0, 0.0, 1.0),
        Vec3::new(1.0, 0.0, -1.0),
        Vec3::new(-1.0, 0.0, -1.0),
        Vec3::new(0.0, 1.0, 1.0),
        Vec3::new(0.0, -1.0, 1.0),
        Vec3::new(0.0, 1.0, -1.0),
        Vec3::new(0.0, -1.0, -1.0),
        Vec3::new(1.0, 1.0, 0.0),
        Vec3::new(-1.0, 1.0, 0.0),
        Vec3::new(0.0, -1.0, 1.0),
        Vec3::new(0.0, -1.0, -1.0),
    ];
    EDGES[(hash(cell.x as u32, cell.y as u32, cell.z as u32, seed) >> 28) as usize]
}

/// Gradient noise at `p`: values within about ±1, features about one unit wide.
pub fn noise(p: Vec3, seed: u32) -> Field {
    let floor = p.floor();
    let cell = floor.as_ivec3();
    let w = p - floor;
    let u = w * w * w * (w * (w * 6.0 - 15.0) + 10.0);
    let du = 30.0 * w * w * (w * (w - 2.0) + 1.0);
    let corner = |x: i32, y: i32, z: i32| {
        let gradient = lattice_gradient(cell + IVec3::new(x, y, z), seed);
        (gradient, gradient.dot(w - Vec3::new(x as f32, y as f32, z as f32)))
    };
    let (ga, va) = corner(0, 0, 0);
    let (gb, vb) = corner(1, 0, 0);
    let (gc, vc) = corner(0, 1, 0);
    let (gd, vd) = corner(1, 1, 0);
    let (ge, ve) = corner(0, 0, 1);
    let (gf, vf) = corner(1, 0, 1);
    let (gg, vg) = corner(0, 1, 1);
    let (gh, vh) = corner(1, 1, 1);
    // The trilinear blend, along x, then y, then z; and its derivative by the blending weights.
    let (x0, x1, x2, x3) = (va + u.x * (vb - va), vc + u.x * (vd - vc), ve + u.x * (vf - ve), vg + u.x * (vh - vg));
    let (gx0, gx1) = (ga + u.x * (gb - ga), gc + u.x * (gd - gc));
    let (gx2, gx3) = (ge + u.x * (gf - ge), gg + u.x * (gh - gg));
    let (y0, y1) = (x0 + u.y * (x1 - x0), x2 + u.y * (x3 - x2));
    let (gy0, gy1) = (gx0 + u.y * (gx1 - gx0), gx2 + u.y * (gx3 - gx2));
    let by_x = {
        let near = (vb - va) + u.y * ((vd - vc) - (vb - va));
        let far = (vf - ve) + u.y * ((vh - vg) - (vf - ve));
        near + u.z * (far - near)
    };
    let by_y = (x1 - x0) + u.z * ((x3 - x2) - (x1 - x0));
    let by_z = y1 - y0;
    Field { value: y0 + u.z * by_z, gradient: gy0 + u.z * (gy1 - gy0) + du * Vec3::new(by_x, by_y, by_z) }
}

/// `octaves` of noise, each of twice the frequency of the one before and `gain` times its height.
pub fn fractal(p: Vec3, seed: u32, octaves: u32, gain: f32) -> Field {
    sum(p, seed, octaves, gain, |field| field)
}

/// As [`fractal`], of `1 − |noise|` with its crest rounded off: ridges.
pub fn ridges(p: Vec3, seed: u32, octaves: u32, gain: f32) -> Field {
    sum(p, seed, octaves, gain, |field| {
        let fold = (field.value * field.value + 0.004).sqrt();
        Field { value: 1.0 - fold, gradient: field.gradient * (-field.value / fold) }
    })
}

fn sum(p: Vec3, seed: u32, octaves: u32, gain: f32, shape: impl Fn(Field) -> Field) -> Field {
    let mut total = Field::default();
    let (mut amplitude, mut frequency) = (1.0, 1.0);
    for octave in 0..octaves {
        // Each octave has its own lattice, displaced so that the lattices' zeros do not fall together.
        let offset = Vec3::new(0.37, 0.71, 0.13) * octave as f32;
        let field = shape(noise(p * frequency + offset, seed.wrapping_add(octave)));
        total.value += amplitude * field.value;
        total.gradient += (amplitude * frequency) * field.gradient;
        amplitude *= gain;
        frequency *= 2.0;
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points() -> impl Iterator<Item = Vec3> {
        (0..500).map(|i| Vec3::new(unit(hash(i, 0, 0, 1)), unit(hash(i, 1, 0, 1)), unit(hash(i, 2, 0, 1))) * 9.0 - 4.5)
    }

    #[test]
    fn gradients_agree_with_differences() {
        let shapes: [fn(Vec3) -> Field; 3] = [|p| noise(p, 3), |p| fractal(p, 3, 3, 0.5), |p| ridges(p, 3, 2, 0.5)];
        for shape in shapes {
            for p in points() {
                let gradient = shape(p).gradient;
                for axis in 0..3 {
                    let mut step = Vec3::ZERO;
                    step[axis] = 2e-3;
                    let slope = (shape(p + step).value - shape(p - step).value) / 4e-3;
                    assert!((slope - gradient[axis]).abs() < 0.06, "{p}: {slope} {}", gradient[axis]);
                }
            }
        }
    }

    #[test]
    fn noise_stays_in_its_range_and_has_no_bias() {
        let mean = points().map(|p| noise(p, 0).value).inspect(|v| assert!(v.abs() <= 1.2)).sum::<f32>() / 500.0;
        assert!(mean.abs() < 0.06, "{mean}");
    }

    #[test]
    fn unit_numbers_stay_below_one() {
        assert_eq!(unit(0), 0.0);
        assert!(unit(u32::MAX) < 1.0);
    }
}
