//! Polygons into triangles: a fan where it covers the polygon, ear clipping where not.

use glam::{DVec2, DVec3, Vec3};
use smallvec::{SmallVec, smallvec};

/// Triangles as corner numbers of their polygon.
pub type Triangles = SmallVec<[[u32; 3]; 4]>;

/// The most corners that ears are clipped from: the effort grows with the square.
pub const MAX_CLIPPED: usize = 512;

/// Splits a polygon of three or more finite corners into `corners.len() - 2` triangles of the same winding, or fewer
/// where corners lie on a straight line. `out` is overwritten.
///
/// Returns `false` if the triangles may not cover the polygon: its outline was seen to cross itself, or it is concave
/// with more than [`MAX_CLIPPED`] corners. What could not be split well is then a fan.
pub fn triangulate(corners: &[Vec3], out: &mut Triangles) -> bool {
    out.clear();
    let count = corners.len();
    if count == 3 {
        out.push([0, 1, 2]);
        return true;
    }
    let normal = area_vector(corners);
    if fan_covers(corners, normal) {
        out.extend(fan(count));
        return true;
    }
    if count <= MAX_CLIPPED && clip_ears(&project(corners, normal), out) {
        return true;
    }
    if out.is_empty() {
        out.extend(fan(count));
    }
    false
}

fn fan(count: usize) -> impl Iterator<Item = [u32; 3]> {
    (1..(count as u32).saturating_sub(1)).map(|corner| [0, corner, corner + 1])
}

/// Twice the polygon's area along its mean normal (Newell). In `f64`, where products of `f32`s cannot overflow.
fn area_vector(corners: &[Vec3]) -> DVec3 {
    let origin = corners.first().copied().unwrap_or_default().as_dvec3();
    corners.windows(2).map(|edge| (edge[0].as_dvec3() - origin).cross(edge[1].as_dvec3() - origin)).sum()
}

/// No triangle of the fan faces backwards: true of every convex polygon, and of some that are not.
fn fan_covers(corners: &[Vec3], normal: DVec3) -> bool {
    let origin = corners.first().copied().unwrap_or_default().as_dvec3();
    corners.windows(2).all(|edge| {
        let facing = (edge[0].as_dvec3() - origin).cross(edge[1].as_dvec3() - origin);
        facing.dot(normal) >= 0.0
    })
}

/// Drops the axis that the polygon faces most, so that it winds counter-clockwise in the plane.
fn project(corners: &[Vec3], normal: DVec3) -> SmallVec<[DVec2; 8]> {
    let size = normal.abs();
    let (axis, facing) = if size.x >= size.y && size.x >= size.z {
        (0, normal.x)
    } else if size.y >= size.z {
        (1, normal.y)
    } else {
        (2, normal.z)
    };
    let flat = |corner: &Vec3| {
        let c = corner.as_dvec3();
        let (u, v) = [(c.y, c.z), (c.z, c.x), (c.x, c.y)][axis];
        if facing < 0.0 { DVec2::new(v, u) } else { DVec2::new(u, v) }
    };
    corners.iter().map(flat).collect()
}

/// Cuts off corners whose triangle lies inside the outline, until a triangle is left.
///
/// A corner found unfit is not looked at again until a neighbour is cut: only that can change it. Returns `false`
/// when no corner fits; the rest is then fanned.
fn clip_ears(points: &[DVec2], out: &mut Triangles) -> bool {
    let mut ring: SmallVec<[u32; 8]> = (0..points.len() as u32).collect();
    let mut unfit: SmallVec<[bool; 8]> = smallvec![false; points.len()];
    let (mut at, mut misses, mut straight_too) = (0, 0, false);
    while ring.len() > 3 {
        let count = ring.len();
        let (before, after) = ((at + count - 1) % count, (at + 1) % count);
        let ear = [ring[before], ring[at], ring[after]];
        let kind = if unfit[ear[1] as usize] { Corner::Unfit } else { corner(points, &ring, ear) };
        if kind == Corner::Ear || (kind == Corner::Straight && straight_too) {
            if kind == Corner::Ear {
                out.push(ear);
            }
            unfit[ear[0] as usize] = false;
            unfit[ear[2] as usize] = false;
            ring.remove(at);
            at = if at == 0 { ring.len() - 1 } else { at - 1 };
            (misses, straight_too) = (0, false);
            continue;
        }
        unfit[ear[1] as usize] = kind == Corner::Unfit;
        at = after;
        misses += 1;
        if misses >= count {
            if straight_too {
                out.extend(fan(count).map(|triangle| triangle.map(|corner| ring[corner as usize])));
                return false;
            }
            // Corners on a straight line come last: cutting them off early would leave a gap to the neighbours.
            straight_too = true;
            misses = 0;
            unfit.fill(false);
        }
    }
    out.push([ring[0], ring[1], ring[2]]);
    true
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Corner {
    Ear,
    Straight,
    Unfit,
}

fn corner(points: &[DVec2], ring: &[u32], ear: [u32; 3]) -> Corner {
    let [a, b, c] = ear.map(|index| points[index as usize]);
    let turn = (b - a).perp_dot(c - b);
    if turn == 0.0 {
        return Corner::Straight;
    }
    let inside = |p: DVec2| {
        let on_corner = p == a || p == b || p == c;
        let left = |from: DVec2, to: DVec2| (to - from).perp_dot(p - from) >= 0.0;
        !on_corner && left(a, b) && left(b, c) && left(c, a)
    };
    let fits = turn > 0.0 && !ring.iter().any(|&other| inside(points[other as usize]));
    if fits { Corner::Ear } else { Corner::Unfit }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f32::consts::TAU;

    fn split(corners: &[Vec3]) -> (Triangles, bool) {
        let mut out = Triangles::new();
        let covered = triangulate(corners, &mut out);
        (out, covered)
    }

    fn area(corners: &[Vec3], triangles: &Triangles) -> (f64, f64) {
        let normal = area_vector(corners).normalize();
        let signed = triangles.iter().map(|t| area_vector(&t.map(|i| corners[i as usize])).dot(normal));
        (area_vector(corners).length(), signed.inspect(|&a| assert!(a >= 0.0, "a triangle faces backwards")).sum())
    }

    fn covers(corners: &[Vec3]) {
        let (triangles, covered) = split(corners);
        assert!(covered);
        let (expected, sum) = area(corners, &triangles);
        assert!((expected - sum).abs() <= 1e-6 * expected, "{sum} instead of {expected}");
    }

    fn flat(points: &[(f32, f32)]) -> Vec<Vec3> {
        points.iter().map(|&(x, y)| Vec3::new(x, y, 0.0)).collect()
    }

    #[test]
    fn convex_polygons_are_fans() {
        let square = flat(&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]);
        assert_eq!(split(&square).0.as_slice(), [[0, 1, 2], [0, 2, 3]]);
        let circle: Vec<_> =
            (0..700).map(|i| i as f32 / 700.0 * TAU).map(|a| Vec3::new(a.cos(), 2.0, a.sin())).collect();
        assert_eq!(split(&circle).0.len(), 698);
        covers(&circle);
    }

    #[test]
    fn concave_polygons_stay_inside_their_outline_whichever_way_they_face() {
        // An arrowhead, a comb and a U; every start corner, both windings, all axes.
        let shapes = [
            flat(&[(0.0, 0.0), (2.0, -1.0), (0.0, 3.0), (-2.0, -1.0)]),
            flat(&[(0.0, 0.0), (5.0, 0.0), (5.0, 3.0), (4.0, 1.0), (3.0, 3.0), (2.0, 1.0), (1.0, 3.0), (0.5, 1.0)]),
            flat(&[(0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (2.0, 3.0), (2.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)]),
        ];
        for shape in shapes {
            for turn in 0..shape.len() {
                let mut corners = shape.clone();
                corners.rotate_left(turn);
                for axes in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [1, 0, 2]] {
                    let moved = corners.iter().map(|c| Vec3::from_array(axes.map(|axis| c[axis])));
                    let mut moved: Vec<_> = moved.collect();
                    covers(&moved);
                    moved.reverse();
                    covers(&moved);
                }
            }
        }
    }

    #[test]
    fn straight_corners_and_repeated_corners_do_not_stop_it() {
        covers(&flat(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.0, 2.0), (1.0, 1.0), (0.0, 2.0), (0.0, 1.0)]));
        covers(&flat(&[(0.0, 0.0), (2.0, 0.0), (2.0, 0.0), (2.0, 2.0), (1.0, 1.0), (0.0, 2.0)]));
    }

    #[test]
    fn crossing_outlines_still_give_triangles() {
        let star = [0, 2, 4, 1, 3].map(|i| i as f32 / 5.0 * TAU).map(|a| Vec3::new(a.cos(), a.sin(), 0.0));
        assert_eq!(split(&star).0.len(), 3);
        let bow = flat(&[(0.0, 0.0), (4.0, 4.0), (4.0, 0.0), (0.0, 3.0), (-1.0, 1.0)]);
        assert!(!split(&bow).0.is_empty());
    }

    #[test]
    fn huge_concave_polygons_are_not_clipped() {
        let count = 100_000;
        let spiky = |i: usize| [1.0, 0.5][i % 2];
        let gear: Vec<_> = (0..count)
            .map(|i| {
                Vec3::new((i as f32 / count as f32 * TAU).cos(), (i as f32 / count as f32 * TAU).sin(), 0.0) * spiky(i)
            })
            .collect();
        let (triangles, covered) = split(&gear);
        assert!(!covered);
        assert_eq!(triangles.len(), count - 2);
    }

    #[test]
    fn polygons_without_area_or_with_enormous_coordinates_end() {
        assert_eq!(split(&[Vec3::ONE; 6]).0.len(), 4);
        assert!(!split(&[Vec3::splat(f32::MAX), -Vec3::splat(f32::MAX), Vec3::X * f32::MAX, Vec3::Y]).0.is_empty());
        assert!(split(&[]).0.is_empty());
        assert!(split(&[Vec3::ONE, Vec3::X]).0.is_empty());
    }

    proptest! {
        #[test]
        fn star_shaped_polygons_are_covered(radii in proptest::collection::vec(0.1f32..1.0, 4..60)) {
            let count = radii.len() as f32;
            let corner = |(i, r): (usize, &f32)| {
                let angle = i as f32 / count * TAU;
                Vec3::new(angle.cos(), angle.sin(), angle.sin() * 0.5) * *r
            };
            covers(&radii.iter().enumerate().map(corner).collect::<Vec<_>>());
        }

        #[test]
        fn any_corners_give_triangles_of_them(points in proptest::collection::vec((-4i8..4, -4i8..4, -1i8..1), 3..40)) {
            let corners: Vec<_> =
                points.iter().map(|&(x, y, z)| Vec3::new(x.into(), y.into(), z.into())).collect();
            let (triangles, _) = split(&corners);
            prop_assert!(triangles.len() <= corners.len() - 2);
            prop_assert!(triangles.iter().flatten().all(|&i| (i as usize) < corners.len()));
        }
    }
}
