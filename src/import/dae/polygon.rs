//! Splitting polygons into triangles: a fan where the polygon is convex, ear clipping where it is not.

use glam::{DVec2, DVec3};
use smallvec::SmallVec;

/// Most point-in-triangle tests for one document: a few seconds' worth, far above what real polygons need.
const MAX_TESTS: u64 = 1 << 29;

/// Deviation from a straight edge, relative to the polygon's area, that does not make a corner reflex.
const STRAIGHT: f64 = 1e-10;

/// The concave polygons of a document have too many corners.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct TooComplex;

/// Splits polygons, within a budget for all of them.
pub(super) struct Splitter {
    tests_left: u64,
    /// Polygons that cross themselves: they were split somehow.
    pub crossing: usize,
}

impl Splitter {
    /// With the whole budget.
    pub fn new() -> Self {
        Splitter { tests_left: MAX_TESTS, crossing: 0 }
    }

    /// Appends triangles, as corner numbers in the polygon's own winding, to `triangles`.
    pub fn split(&mut self, corners: &[DVec3], triangles: &mut Vec<[u32; 3]>) -> Result<(), TooComplex> {
        let count = corners.len() as u32;
        let fan = (2..count).map(|last| [0, last - 1, last]);
        if count > 3
            && let Some(flat) = project(corners)
            && !is_convex(&flat)
        {
            return self.clip_ears(&flat, triangles);
        }
        triangles.extend(fan);
        Ok(())
    }

    /// Cuts off corners that have no other corner in their triangle, until one triangle is left.
    fn clip_ears(&mut self, flat: &[DVec2], triangles: &mut Vec<[u32; 3]>) -> Result<(), TooComplex> {
        let count = flat.len();
        let mut next: Vec<usize> = (1..count).chain([0]).collect();
        let mut previous: Vec<usize> = [count - 1].into_iter().chain(0..count - 1).collect();
        let (mut corner, mut remaining, mut misses) = (0, count, 0);
        let mut crosses = false;
        while remaining > 3 {
            let (before, after) = (previous[corner], next[corner]);
            // A simple polygon always has an ear; going round without one means that it crosses itself.
            let forced = misses == remaining;
            if !forced && !self.is_ear(flat, &next, [before, corner, after])? {
                corner = after;
                misses += 1;
                continue;
            }
            crosses |= forced;
            triangles.push([before, corner, after].map(|index| index as u32));
            next[before] = after;
            previous[after] = before;
            remaining -= 1;
            misses = 0;
            corner = next[after];
        }
        triangles.push([previous[corner], corner, next[corner]].map(|index| index as u32));
        self.crossing += usize::from(crosses);
        Ok(())
    }

    /// Whether the triangle turns left and holds no other remaining corner.
    fn is_ear(&mut self, flat: &[DVec2], next: &[usize], triangle: [usize; 3]) -> Result<bool, TooComplex> {
        let [a, b, c] = triangle.map(|index| flat[index]);
        self.spend()?;
        if turn(a, b, c) <= 0.0 {
            return Ok(false);
        }
        let mut other = next[triangle[2]];
        while other != triangle[0] {
            self.spend()?;
            let point = flat[other];
            let touches = point == a || point == b || point == c;
            if !touches && turn(a, b, point) >= 0.0 && turn(b, c, point) >= 0.0 && turn(c, a, point) >= 0.0 {
                return Ok(false);
            }
            other = next[other];
        }
        Ok(true)
    }

    fn spend(&mut self) -> Result<(), TooComplex> {
        self.tests_left = self.tests_left.checked_sub(1).ok_or(TooComplex)?;
        Ok(())
    }
}

/// The corners in the plane, counter-clockwise; nothing if the polygon has no area to speak of.
fn project(corners: &[DVec3]) -> Option<SmallVec<[DVec2; 8]>> {
    let origin = *corners.first()?;
    let edges = corners.iter().zip(corners.iter().cycle().skip(1));
    let normal: DVec3 = edges.map(|(a, b)| (*a - origin).cross(*b - origin)).sum();
    let unit = normal.try_normalize()?;
    let across = unit.any_orthonormal_vector();
    let along = unit.cross(across);
    Some(
        corners
            .iter()
            .map(|corner| DVec2::new((*corner - origin).dot(across), (*corner - origin).dot(along)))
            .collect(),
    )
}

fn is_convex(flat: &[DVec2]) -> bool {
    let count = flat.len();
    let turns = (0..count).map(|i| turn(flat[i], flat[(i + 1) % count], flat[(i + 2) % count]));
    let (mut total, mut least) = (0.0, f64::INFINITY);
    for (i, turn_here) in turns.enumerate() {
        total += flat[i].perp_dot(flat[(i + 1) % count]);
        least = least.min(turn_here);
    }
    least >= -STRAIGHT * total.abs()
}

/// Twice the signed area of a triangle: above zero when it turns left.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn split(points: &[[f64; 3]]) -> (Vec<[u32; 3]>, usize) {
        let corners: Vec<DVec3> = points.iter().map(|point| DVec3::from(*point)).collect();
        let (mut splitter, mut triangles) = (Splitter::new(), Vec::new());
        splitter.split(&corners, &mut triangles).unwrap();
        (triangles, splitter.crossing)
    }

    fn normals(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Vec<DVec3> {
        let corner = |index: u32| DVec3::from(points[index as usize]);
        triangles.iter().map(|t| (corner(t[1]) - corner(t[0])).cross(corner(t[2]) - corner(t[0])) / 2.0).collect()
    }

    #[test]
    fn convex_polygons_become_fans() {
        let square = [[0.0, 0.0, 5.0], [1.0, 0.0, 5.0], [1.0, 1.0, 5.0], [0.0, 1.0, 5.0]];
        assert_eq!(split(&square).0, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(split(&square[..3]).0, [[0, 1, 2]]);
        assert_eq!(split(&square[..2]).0, [[0; 3]; 0]);
        let straight = [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0]];
        assert_eq!(split(&straight).0, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    }

    #[test]
    fn concave_polygons_keep_area_and_winding() {
        let comb: Vec<[f64; 3]> = (0..20)
            .map(|i| [f64::from(i), if i % 2 == 0 { 1.0 } else { 5.0 }, 0.0])
            .chain([[19.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
            .collect();
        for polygon in [comb.clone(), comb.iter().rev().copied().collect()] {
            let expected =
                normals(&polygon, &(2..22).map(|i| [0, i - 1, i]).collect::<Vec<_>>()).into_iter().sum::<DVec3>();
            let (triangles, crossing) = split(&polygon);
            assert_eq!((triangles.len(), crossing), (20, 0));
            let parts = normals(&polygon, &triangles);
            assert!((parts.iter().sum::<DVec3>() - expected).length() < 1e-9);
            assert!(parts.iter().all(|part| part.z * expected.z > 0.0));
        }
    }

    #[test]
    fn odd_polygons_end() {
        let crossing = [[0.0, 0.0, 0.0], [2.0, 2.0, 0.0], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0]];
        assert_eq!(split(&crossing).0.len(), 2);
        assert_eq!(split(&[[1.0; 3]; 6]).0.len(), 4);
        assert_eq!(
            split(&[[f64::MAX, 0.0, 0.0], [0.0, f64::MAX, 0.0], [-f64::MAX, 0.0, 0.0], [0.0, 0.1, 0.0]]).0.len(),
            2
        );
    }

    #[test]
    fn the_budget_ends_hopeless_work() {
        let star: Vec<DVec3> = (0..2000)
            .map(|i| {
                let (angle, radius) = (f64::from(i) * 0.003_141, if i % 2 == 0 { 1.0 } else { 2.0 });
                DVec3::new(angle.cos() * radius, angle.sin() * radius, 0.0)
            })
            .collect();
        let mut splitter = Splitter { tests_left: 10_000, crossing: 0 };
        assert_eq!(splitter.split(&star, &mut Vec::new()), Err(TooComplex));
    }
}
