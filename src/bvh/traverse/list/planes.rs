//! Which rays may hit a triangle that many rays are tested against: by its plane and two of its edges' planes, computed once.
//!
//! A bound, not a decision: what the triangle test itself would accept, watertight or not, gets through, and little else. With the unit normal n of
//! the triangle and r from its first corner to the ray's origin, a ray o + t·d meets the plane where
//!
//! ```text
//! t·(−n·d) = n·r
//! ```
//!
//! and there u, the distance from an edge at that corner in units of `height`, is e·(r + t·d) for a vector e within the plane. Times −n·d,
//! nothing needs a division:
//!
//! ```text
//! u·(−n·d) = (e·r)·(−n·d) + (n·r)·(e·d)
//! ```
//!
//! Twice that and what the third edge needs take two thirds of the operations of a test that has to begin with the corners, and every
//! ray may go its own way.
//!
//! **Bounds**, in half-ulps of R, the longest way on an axis from the ray's origin to any corner. n·r errs by less than 9: r and n are
//! rounded, each of three operations rounds, and |r| is at most √3 R. The watertight test computes with corners that it has rounded as seen from the ray: on
//! each of two axes by less than 6, in depth by 1, so that what it accepts passes within 10 of the triangle, and n·r of it differs by no more.
//! Where |ab| and |ac| are the triangle's sides, that of Möller and Trumbore errs by less than 8·|ab||ac| ÷ |ab×ac|. [`NEAR`] covers both: it
//! must not be much wider, because most rays start close to a triangle that they do not hit, by 32 half-ulps of a position. The two sums for u err by
//! less than 40·|d|₁ (e is no longer than 1), and the tests by less than 20·|d|₁; nothing is gained by a close bound there, and [`BESIDE`] is 128,
//! three times that for the third edge, which is a sum of the two others.

use super::swept::Swept;
use crate::bvh::aabb::Aabb;
use crate::bvh::block::TriangleBlock;
use crate::bvh::ray::MISS;
use crate::bvh::traverse::crossings::Triangle;
use crate::simd::wide::Wide;
use glam::{DVec3, Vec3};

/// By how much a distance from the plane may be off, relative to the way to the farthest corner.
pub const NEAR: f32 = 20.0 * HALF_ULP;

/// By how much a distance from an edge may be.
const BESIDE: f32 = 128.0 * HALF_ULP;

pub const HALF_ULP: f32 = 0.5 * f32::EPSILON;

/// Room so that no sum overflows where its bound does not.
const ROOM: f32 = 8.0;

/// More than what underflow takes from any sum.
pub const LEAST: f32 = 1e-36;

/// A triangle as rays meet it.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    /// The unit normal n, and −n.
    normal: [[f32; 3]; 2],
    /// The corner that both edges start from.
    corner: [f32; 3],
    /// Of the edges opposite the second and the third corner: e.
    edges: [[f32; 3]; 2],
    /// What two distances from edges add up to at most.
    height: f32,
    /// |ab||ac| ÷ |ab×ac|.
    slant: f32,
    /// The triangle itself.
    pub triangle: Triangle,
}

impl Plane {
    /// All triangles of a block.
    pub fn of(block: &impl TriangleBlock) -> impl Iterator<Item = Plane> {
        (0..4).filter(|&lane| block.prims()[lane] != MISS).map(|lane| {
            let corners = [0, 3, 6].map(|row| [0, 1, 2].map(|corner| block.coordinate(row, corner, lane)));
            Plane::new(Triangle { corners, prim: block.prims()[lane], geom: block.geom(lane) })
        })
    }

    /// Of what has no plane, all numbers are NaN: every ray may hit it.
    fn new(triangle: Triangle) -> Plane {
        let [x, y, z] = triangle.corners;
        let [a, b, c] = [0, 1, 2].map(|i| DVec3::new(x[i].into(), y[i].into(), z[i].into()));
        let (ab, ac) = (b - a, c - a);
        let normal = ab.cross(ac);
        let area = normal.length();
        let n = normal / area;
        // Grows by 1 from the edge to the corner that lies opposite.
        let (u, v) = (ac.cross(n) / area, n.cross(ab) / area);
        let height = u.length().max(v.length()).recip();
        Plane {
            normal: [n, -n].map(|n| n.as_vec3().to_array()),
            corner: [x[0], y[0], z[0]],
            edges: [u, v].map(|weight| (weight * height).as_vec3().to_array()),
            height: height as f32,
            slant: (ab.length() * ac.length() / area) as f32,
            triangle,
        }
    }

    /// The box of the triangle.
    pub fn bounds(&self) -> Aabb {
        let [x, y, z] = self.triangle.corners;
        Aabb::around([0, 1, 2].map(|i| Vec3::new(x[i], y[i], z[i])))
    }
}

/// By how much the sums of one ray may be off, negative: distances from planes, and distances from edges times n·d. `bounds` hold all
/// corners.
#[inline(always)]
pub fn slack(origin: Vec3, direction: Vec3, bounds: &Aabb) -> [f32; 2] {
    let [x, y, z] = ((bounds.max - origin).max(origin - bounds.min)).to_array();
    let reach = ROOM * x.max(y).max(z);
    let speed = direction.x.abs() + direction.y.abs() + direction.z.abs();
    [-(reach * (NEAR / ROOM) + LEAST), -(reach * speed * (BESIDE / ROOM) + LEAST)]
}

/// Rays, a lane each.
#[derive(Clone, Copy, Debug)]
pub struct Rays<L> {
    /// Their origins.
    pub origin: [L; 3],
    /// Their directions.
    pub direction: [L; 3],
    /// Their ends.
    pub t_max: L,
    /// [`slack`].
    pub slack: [L; 2],
}

impl Plane {
    /// Whether any of the rays may hit the triangle: not if all of them stay on one side of its plane.
    #[inline(always)]
    pub fn may_be_met(&self, swept: &Swept) -> bool {
        let normal = Vec3::from_array(self.normal[0]);
        let away = normal.dot(swept.center - Vec3::from_array(self.corner)).abs();
        // What is not a number is not beside it.
        let beside = away - normal.abs().dot(swept.half) > swept.off * self.slant;
        !beside
    }

    /// Which rays may hit the triangle, one bit each. Comparisons with what is not a number let a ray through.
    #[inline(always)]
    pub fn candidates<W: Wide>(&self, wide: W, rays: &Rays<W::Lanes>) -> u32 {
        let [x, y, z] = self.corner;
        let from_corner = [
            wide.sub(rays.origin[0], wide.splat(x)),
            wide.sub(rays.origin[1], wide.splat(y)),
            wide.sub(rays.origin[2], wide.splat(z)),
        ];
        let along = dot(wide, self.normal[0], from_corner);
        let speed = dot(wide, self.normal[1], rays.direction);
        let u = weight(wide, self.edges[0], from_corner, rays.direction, along, speed);
        let v = weight(wide, self.edges[1], from_corner, rays.direction, along, speed);
        let (along, speed) = (wide.flipped(along, speed), wide.abs(speed));
        let rest = wide.sub(wide.sub(wide.mul(wide.splat(self.height), speed), u), v);
        let [near, beside] = rays.slack;
        let near = wide.mul(near, wide.splat(self.slant));
        let outside = wide.either(wide.below(u, beside), wide.below(v, beside));
        let outside = wide.either(outside, wide.below(rest, wide.mul(beside, wide.splat(3.0))));
        let before = wide.below(along, near);
        let after = wide.below(wide.mul(rays.t_max, speed), wide.add(along, near));
        let missed = wide.either(outside, wide.either(before, after));
        !wide.bits(missed) & (u32::MAX >> (32 - 4 * W::RAYS))
    }
}

/// The distance from an edge, times |n·d|. (No closure: those with vectors in them must be inlined.)
#[inline(always)]
fn weight<W: Wide>(
    wide: W,
    edge: [f32; 3],
    from_corner: [W::Lanes; 3],
    direction: [W::Lanes; 3],
    along: W::Lanes,
    speed: W::Lanes,
) -> W::Lanes {
    let start = wide.mul(dot(wide, edge, from_corner), speed);
    wide.flipped(wide.about(along, dot(wide, edge, direction), start), speed)
}

/// a·b.
#[inline(always)]
fn dot<W: Wide>(wide: W, a: [f32; 3], b: [W::Lanes; 3]) -> W::Lanes {
    let xy = wide.about(wide.splat(a[1]), b[1], wide.mul(wide.splat(a[0]), b[0]));
    wide.about(wide.splat(a[2]), b[2], xy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::columns::RayColumns;
    use crate::bvh::intersect::Intersect;
    use crate::bvh::moller_trumbore::MollerTrumbore;
    use crate::bvh::ray::Ray;
    use crate::bvh::watertight::Watertight;
    use crate::simd::wide::Quad;
    use proptest::prelude::*;

    /// A triangle anywhere, of any shape: points of a box, a corner close to the opposite edge or to another corner among them.
    fn triangle() -> impl Strategy<Value = [Vec3; 3]> {
        let point = || [-1f32..1.0, -1f32..1.0, -1f32..1.0].prop_map(Vec3::from_array);
        let narrowness = prop_oneof![Just(1.0f32), Just(1e-3), Just(1e-6), Just(0.0)];
        let flat = prop_oneof![Just(Vec3::ONE), Just(Vec3::new(1.0, 0.0, 1.0)), Just(Vec3::new(1.0, 1.0, 0.0))];
        let far = prop_oneof![Just(0.0f32), Just(10.0), Just(1e4)];
        (point(), point(), point(), narrowness, flat, (point(), far)).prop_map(|(a, b, c, narrow, flat, (way, far))| {
            [a, b, a.lerp(b, 0.4) + (c - a) * narrow].map(|corner| corner * flat + way * far)
        })
    }

    /// A ray through a point of the triangle's plane close to an edge, to a corner or inside, from anywhere, from another such point among
    /// them; with an end close to the plane or far beyond.
    fn ray(corners: [Vec3; 3], ((u, v, speed), from, size, end): ((f32, f32, f32), [f32; 3], f32, f32)) -> Ray {
        let [a, b, c] = corners;
        let through = a * u + b * v + c * (1.0 - u - v);
        let origin = through + Vec3::from_array(from) * size;
        let direction = (through - origin).normalize_or(Vec3::from_array(from).normalize_or(Vec3::X)) * speed;
        let t_max = if end == f32::MAX { end } else { end * through.distance(origin).max(1e-6) / speed };
        Ray { t_max, ..Ray::new(origin, direction) }
    }

    fn near(number: f32) -> impl Strategy<Value = f32> {
        (-1e-6f32..1e-6).prop_map(move |off| number + off)
    }

    fn weight() -> impl Strategy<Value = f32> {
        prop_oneof![Just(0.0f32), Just(1.0), 0f32..1.0, near(0.0), near(1.0)]
    }

    /// Where one ray passes.
    fn swept(ray: &Ray, bounds: &Aabb) -> Swept {
        let [[ox, oy, oz], [dx, dy, dz]] = [ray.origin, ray.direction].map(|v| v.to_array().map(|number| [number]));
        let (t_max, none) = ([ray.t_max], None);
        let rays = RayColumns {
            ox: &ox,
            oy: &oy,
            oz: &oz,
            dx: &dx,
            dy: &dy,
            dz: &dz,
            t_min: none,
            t_max: Some(&t_max),
            low: None,
        };
        Swept::of(&rays, 0, bounds)
    }

    /// What the test accepts within the ray's ends.
    fn accepts<I: Intersect>(ray: &Ray, triangle: &Triangle) -> bool {
        let axes = I::axes(ray.direction.to_array());
        let along = |v: Vec3| axes.map(|axis| v[axis]);
        let (crossing, does) =
            I::meet(along(ray.origin), along(ray.direction), axes.map(|axis| triangle.corners[axis]));
        does && crossing.t > 0.0 && crossing.t <= ray.t_max
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 60_000, failure_persistence: None, ..Default::default() })]
        #[test]
        fn no_ray_that_a_test_accepts_is_kept_away(
            corners in triangle(),
            numbers in (
                (weight(), weight(), prop_oneof![Just(1.0f32), 1e-3f32..1e3]),
                [-1f32..1.0, -1f32..1.0, -1f32..1.0],
                prop_oneof![Just(1.0f32), Just(1e-3), Just(1e-6), Just(0.0), Just(1e5)],
                prop_oneof![Just(1.0f32), Just(f32::MAX), near(1.0)],
            ),
            scale in prop_oneof![Just(1.0f32), Just(1e-9), Just(1e9), Just(1e-30), Just(1e17)],
        ) {
            let ray = ray(corners, numbers);
            let ray = Ray { origin: ray.origin * scale, t_max: ray.t_max * scale, ..ray };
            prop_assume!(ray.is_traceable());
            let corners = corners.map(|corner| corner * scale);
            let triangle = Triangle { corners: [0, 1, 2].map(|axis| corners.map(|corner| corner[axis])), prim: 0, geom: 0 };
            let plane = Plane::new(triangle);
            let splat = |v: Vec3| v.to_array().map(|number| Quad.splat(number));
            let rays = Rays {
                origin: splat(ray.origin),
                direction: splat(ray.direction),
                t_max: Quad.splat(ray.t_max),
                slack: slack(ray.origin, ray.direction, &plane.bounds()).map(|number| Quad.splat(number)),
            };
            let met = plane.may_be_met(&swept(&ray, &plane.bounds()));
            let may = met && plane.candidates(Quad, &rays) & 1 == 1;
            prop_assert!(may || !accepts::<Watertight>(&ray, &triangle), "watertight");
            prop_assert!(may || !accepts::<MollerTrumbore>(&ray, &triangle), "fast");
        }
    }

    /// A bound that lets everything through would pass the test above.
    #[test]
    fn rays_that_start_on_a_triangle_or_pass_beside_it_are_kept_away() {
        let corners = [Vec3::new(-1.0, 1.0, -1.0), Vec3::new(1.0, 1.0, -1.0), Vec3::new(-1.0, 1.0, 1.0)];
        let triangle = Triangle { corners: [0, 1, 2].map(|axis| corners.map(|corner| corner[axis])), prim: 0, geom: 0 };
        let plane = Plane::new(triangle);
        let may = |origin: Vec3, direction: Vec3| {
            let splat = |v: Vec3| v.to_array().map(|number| Quad.splat(number));
            let slack = slack(origin, direction, &plane.bounds()).map(|number| Quad.splat(number));
            let rays = Rays { origin: splat(origin), direction: splat(direction), t_max: Quad.splat(10.0), slack };
            plane.candidates(Quad, &rays) & 1 == 1
        };
        let met = |[start, end]: [Vec3; 2]| {
            let ray = Ray { t_max: 1.0, ..Ray::new(start, end - start) };
            plane.may_be_met(&swept(&ray, &plane.bounds()))
        };
        let off = Vec3::Y * (80.0 * HALF_ULP);
        assert!(!met([Vec3::new(-0.9, 1.0, -0.5) - off, Vec3::new(0.3, -1.0, 0.7)]));
        assert!(!met([Vec3::new(-0.9, 1.0, -0.5) + off, Vec3::new(0.3, 1.0, 0.7) + off]));
        assert!(met([Vec3::new(-0.9, 1.0, -0.5) + off, Vec3::new(0.3, 1.0, 0.7) - off]));
        assert!(met([Vec3::new(f32::INFINITY, 2.0, 0.0), Vec3::new(0.0, 3.0, 0.0)]));
        let on = Vec3::new(-0.5, 1.0 + 32.0 * HALF_ULP * 2.0, -0.5);
        assert!(!may(on, Vec3::new(0.3, 1.0, 0.2)));
        assert!(may(on, Vec3::new(0.3, -1.0, 0.2)));
        assert!(may(Vec3::new(-0.5, 0.0, -0.5), Vec3::Y));
        assert!(!may(Vec3::new(0.1, 0.0, 0.1), Vec3::Y));
        assert!(!may(Vec3::new(-0.5, 0.0, -0.5), Vec3::NEG_Y));
    }
}
