//! The watertight ray–triangle test of Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection" (JCGT 2013).
//!
//! The ray's largest direction component becomes its z axis, and a shear makes the ray the z axis itself. Which
//! side of an edge the ray passes then depends on four numbers that both triangles at the edge compute alike, so
//! no ray slips between them. An edge function that is exactly 0 is computed again in f64, where it is exact.
//!
//! Two-sided, so the paper's swap that keeps the winding is left out. Without fused operations, in one order:
//! every tier gives the same bits, and [`scalar`] the same as [`block`].

use glam::{Vec3, Vec3Swizzles, Vec4};

use super::ray::Ray;
use super::tri4::Tri4;

/// A ray as the test needs it.
#[derive(Clone, Copy, Debug)]
pub struct ShearedRay {
    /// The two other axes, then the axis of the largest direction component.
    axes: [usize; 3],
    /// Origin, permuted by `axes`.
    origin: [f32; 3],
    /// What to subtract from x and y per unit of z.
    shear: [f32; 2],
    /// The largest direction component.
    depth: f32,
}

/// Where a ray meets a triangle's plane, inside the triangle; on the whole line, not yet limited to `0 < t <= t_max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Distance in units of the ray's direction.
    pub t: f32,
    /// Weight of the second corner.
    pub u: f32,
    /// Weight of the third corner.
    pub v: f32,
}

impl ShearedRay {
    /// Permutes and shears. The ray must be traceable.
    #[inline(always)]
    pub fn new(ray: &Ray) -> ShearedRay {
        let d = ray.direction.abs();
        let (axes, origin, direction) = if d.x > d.y && d.x > d.z {
            ([1, 2, 0], ray.origin.yzx(), ray.direction.yzx())
        } else if d.y > d.z {
            ([2, 0, 1], ray.origin.zxy(), ray.direction.zxy())
        } else {
            ([0, 1, 2], ray.origin, ray.direction)
        };
        let depth = direction.z;
        ShearedRay { axes, origin: origin.to_array(), shear: [direction.x / depth, direction.y / depth], depth }
    }
}

/// Tests the four triangles of a block: bit `i` of the mask says that lane `i` may be crossed, and
/// [`CandidateLanes::crossing`] decides.
#[inline(always)]
pub fn block(ray: &ShearedRay, block: &Tri4) -> Candidates {
    let [kx, ky, kz] = ray.axes;
    let (shear_x, shear_y) = (Vec4::splat(ray.shear[0]), Vec4::splat(ray.shear[1]));
    let (ox, oy, oz) = (Vec4::splat(ray.origin[0]), Vec4::splat(ray.origin[1]), Vec4::splat(ray.origin[2]));
    let (corners_x, corners_y, corners_z) = (&block.corners[kx], &block.corners[ky], &block.corners[kz]);
    let z = [corners_z[0] - oz, corners_z[1] - oz, corners_z[2] - oz];
    let x = [
        (corners_x[0] - ox) - shear_x * z[0],
        (corners_x[1] - ox) - shear_x * z[1],
        (corners_x[2] - ox) - shear_x * z[2],
    ];
    let y = [
        (corners_y[0] - oy) - shear_y * z[0],
        (corners_y[1] - oy) - shear_y * z[1],
        (corners_y[2] - oy) - shear_y * z[2],
    ];
    let edges = [x[2] * y[1] - y[2] * x[1], x[0] * y[2] - y[0] * x[2], x[1] * y[0] - y[1] * x[0]];
    let least = edges[0].min(edges[1]).min(edges[2]);
    let most = edges[0].max(edges[1]).max(edges[2]);
    // Zeros count as either sign here. Minimum and maximum may lose a NaN; `finish` rejects it.
    let mask = least.cmpge(Vec4::ZERO).bitmask() | most.cmple(Vec4::ZERO).bitmask();
    Candidates { mask, x, y, z, edges }
}

/// The lanes of a block that a ray may cross.
#[derive(Clone, Copy, Debug)]
pub struct Candidates {
    /// One bit a lane.
    pub mask: u32,
    x: [Vec4; 3],
    y: [Vec4; 3],
    z: [Vec4; 3],
    edges: [Vec4; 3],
}

impl Candidates {
    /// In memory, where lanes can be picked; most blocks have no candidate and need not go there.
    #[inline(always)]
    pub fn lanes(&self) -> CandidateLanes {
        let store = |v: &[Vec4; 3]| v.map(|v| v.to_array());
        CandidateLanes { x: store(&self.x), y: store(&self.y), z: store(&self.z), edges: store(&self.edges) }
    }
}

/// [`Candidates`] in memory.
#[derive(Clone, Copy, Debug)]
pub struct CandidateLanes {
    x: [[f32; 4]; 3],
    y: [[f32; 4]; 3],
    z: [[f32; 4]; 3],
    edges: [[f32; 4]; 3],
}

impl CandidateLanes {
    /// The crossing of one candidate lane, if it is one.
    #[inline(always)]
    pub fn crossing(&self, ray: &ShearedRay, lane: usize) -> Option<Crossing> {
        let pick = |v: &[[f32; 4]; 3]| [v[0][lane], v[1][lane], v[2][lane]];
        finish(ray.depth, pick(&self.edges), pick(&self.x), pick(&self.y), pick(&self.z))
    }
}

/// Tests one triangle: the twin of [`block`], same bits.
#[inline(always)]
pub fn scalar(ray: &ShearedRay, corners: [Vec3; 3]) -> Option<Crossing> {
    let [kx, ky, kz] = ray.axes;
    let z = corners.map(|c| c[kz] - ray.origin[2]);
    let x: [f32; 3] = std::array::from_fn(|i| (corners[i][kx] - ray.origin[0]) - ray.shear[0] * z[i]);
    let y: [f32; 3] = std::array::from_fn(|i| (corners[i][ky] - ray.origin[1]) - ray.shear[1] * z[i]);
    let edges = [x[2] * y[1] - y[2] * x[1], x[0] * y[2] - y[0] * x[2], x[1] * y[0] - y[1] * x[0]];
    if !(edges.iter().all(|&e| e >= 0.0) || edges.iter().all(|&e| e <= 0.0)) {
        return None;
    }
    finish(ray.depth, edges, x, y, z)
}

/// What both do with a triangle whose edge functions do not differ in sign. In f64: the few lanes that come this
/// far cost nothing, and tiny triangles do not underflow.
#[inline(always)]
fn finish(depth: f32, edges: [f32; 3], x: [f32; 3], y: [f32; 3], z: [f32; 3]) -> Option<Crossing> {
    let [mut a, mut b, mut c] = edges.map(f64::from);
    // Overflow in f32: where lanes are compared, NaN may or may not have come through.
    if (a + b + c).is_nan() {
        return None;
    }
    if a == 0.0 || b == 0.0 || c == 0.0 {
        [a, b, c] = exact_edges(x, y);
        if (a < 0.0 || b < 0.0 || c < 0.0) && (a > 0.0 || b > 0.0 || c > 0.0) {
            return None;
        }
    }
    let area = a + b + c;
    if area == 0.0 {
        return None;
    }
    let t = (a * f64::from(z[0]) + b * f64::from(z[1]) + c * f64::from(z[2])) / (area * f64::from(depth));
    // After overflow this may be NaN, which no range of `t` contains.
    Some(Crossing { t: t as f32, u: (b / area) as f32, v: (c / area) as f32 })
}

/// The edge functions again, with products that are exact in f64, and so with the right sign.
#[cold]
#[inline(never)]
fn exact_edges(x: [f32; 3], y: [f32; 3]) -> [f64; 3] {
    let (x, y) = (x.map(f64::from), y.map(f64::from));
    [x[2] * y[1] - y[2] * x[1], x[0] * y[2] - y[0] * x[2], x[1] * y[0] - y[1] * x[0]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn ray(origin: [f32; 3], direction: [f32; 3]) -> Ray {
        Ray { origin: origin.into(), direction: direction.into(), t_max: f32::INFINITY }
    }

    #[test]
    fn weights_belong_to_the_second_and_third_corner() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let ray = ShearedRay::new(&ray([0.25, 0.5, 2.0], [0.0, 0.0, -1.0]));
        assert_eq!(scalar(&ray, corners), Some(Crossing { t: 2.0, u: 0.25, v: 0.5 }));
    }

    #[test]
    fn crossings_lie_where_the_weights_say() {
        let corners = [Vec3::new(1.0, 0.2, 3.0), Vec3::new(-1.0, 0.1, 2.5), Vec3::new(0.3, 1.5, 4.0)];
        let ray = ray([0.1, -0.2, -1.0], [0.0, 0.15, 1.0]);
        let hit = scalar(&ShearedRay::new(&ray), corners).unwrap();
        let by_weights = corners[0] * (1.0 - hit.u - hit.v) + corners[1] * hit.u + corners[2] * hit.v;
        assert!((ray.origin + ray.direction * hit.t).distance(by_weights) < 1e-6);
    }

    #[test]
    fn degenerate_triangles_are_missed() {
        let ray = ShearedRay::new(&ray([0.0, 0.0, 1.0], [0.0, 0.0, -1.0]));
        assert_eq!(scalar(&ray, [Vec3::ZERO; 3]), None);
        assert_eq!(scalar(&ray, [Vec3::ZERO, Vec3::X, Vec3::X * 2.0]), None);
        assert_eq!(scalar(&ray, [Vec3::NAN; 3]), None);
    }

    /// Small integers make edges that pass exactly through the ray likely.
    fn coordinate() -> impl Strategy<Value = f32> {
        prop_oneof![(-3i32..=3).prop_map(|i| i as f32), -10f32..10.0, Just(1e-30f32), Just(3e18f32), Just(2e30f32)]
    }

    fn vector() -> impl Strategy<Value = [f32; 3]> {
        [coordinate(), coordinate(), coordinate()]
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None, ..Default::default() })]
        #[test]
        fn block_and_scalar_give_the_same_bits(
            origin in vector(),
            direction in vector(),
            triangles in proptest::collection::vec([vector(), vector(), vector()], 4),
        ) {
            let ray = ray(origin, direction);
            prop_assume!(ray.is_traceable());
            let ray = ShearedRay::new(&ray);
            let mut tri4 = Tri4::EMPTY;
            for (lane, corners) in triangles.iter().enumerate() {
                tri4.set(lane, corners.map(Vec3::from_array), lane as u32, 0);
            }
            let candidates = block(&ray, &tri4);
            for (lane, corners) in triangles.iter().enumerate() {
                let wide = if candidates.mask >> lane & 1 == 1 { candidates.lanes().crossing(&ray, lane) } else { None };
                let narrow = scalar(&ray, corners.map(Vec3::from_array));
                let bits = |c: Option<Crossing>| c.map(|c| [c.t, c.u, c.v].map(f32::to_bits));
                prop_assert_eq!(bits(wide), bits(narrow));
            }
        }
    }
}
