//! Whether two tracers give the same answers to the same rays.
//!
//! Closest hits agree if both miss, or both hit the same primitive, or both hit at the same distance: up to 10⁻⁴ of it and 10⁻⁶ of
//! the size of the scene. So an edge that two triangles share may be hit on either, but no hit may be lost. Any-hit
//! answers agree if they are the same.
//!
//! Of tests that are watertight on both sides, more than one ray in 10⁶ that disagrees is a failure. A peer that was told to test
//! fast loses hits at edges, a few in 10⁵ rays of a scan: it may disagree about one ray in 10⁴, and is told on.

use super::rays::RaySet;
use crate::bvh::ray::{MISS, Ray};

/// Answers to a set of rays.
#[derive(Clone, Debug, PartialEq)]
pub enum Answers {
    /// Distance and primitive of each closest hit; infinite and [`MISS`] for a miss.
    Closest(Vec<(f32, u32)>),
    /// Whether anything is hit.
    Any(Vec<bool>),
}

/// A ray about which two tracers disagree.
#[derive(Clone, Debug)]
pub struct Disagreement {
    /// Its number in the set.
    pub row: usize,
    /// The ray.
    pub ray: Ray,
    /// What the two say, for people.
    pub answers: [String; 2],
}

/// How far two sets of answers agree.
#[derive(Clone, Debug, Default)]
pub struct Comparison {
    /// Rays compared.
    pub rays: usize,
    /// How many disagree.
    pub different: usize,
    /// The first few of them.
    pub first: Vec<Disagreement>,
}

/// Disagreements that are shown.
const SHOWN: usize = 5;

/// Share of rays that may differ between watertight tests.
pub const WATERTIGHT: f64 = 1e-6;
/// Share of rays that may differ from those of tests that are not watertight.
pub const FAST: f64 = 1e-4;

impl Comparison {
    /// More than the share `allowed` of all rays differs, and more than one: a grazing ray of a small set is not held against
    /// anyone.
    pub fn fails(&self, allowed: f64) -> bool {
        self.different >= 2 && self.different as f64 > self.rays as f64 * allowed
    }
}

/// Compares two sets of answers to `set`, of a scene of size `extent`.
pub fn compare(set: &RaySet, extent: f32, a: &Answers, b: &Answers) -> Comparison {
    let mut comparison = Comparison { rays: set.rays.len(), ..Comparison::default() };
    let mut differ = |row: usize, answers: [String; 2]| {
        comparison.different += 1;
        if comparison.first.len() < SHOWN {
            comparison.first.push(Disagreement { row, ray: set.rays.all().ray(row), answers });
        }
    };
    match (a, b) {
        (Answers::Closest(a), Answers::Closest(b)) => {
            for (row, (a, b)) in a.iter().zip(b).enumerate() {
                if !same_hit(*a, *b, extent) {
                    differ(row, [*a, *b].map(hit_text));
                }
            }
        }
        (Answers::Any(a), Answers::Any(b)) => {
            for (row, (a, b)) in a.iter().zip(b).enumerate() {
                if a != b {
                    differ(row, [*a, *b].map(|any| if any { "occluded".into() } else { "free".into() }));
                }
            }
        }
        _ => comparison.different = set.rays.len(),
    }
    comparison
}

fn same_hit(a: (f32, u32), b: (f32, u32), extent: f32) -> bool {
    if a.1 == b.1 || a.1 == MISS || b.1 == MISS {
        return a.1 == b.1;
    }
    (a.0 - b.0).abs() <= 1e-4 * a.0.abs().max(b.0.abs()) + 1e-6 * extent
}

fn hit_text((t, prim): (f32, u32)) -> String {
    if prim == MISS { "a miss".into() } else { format!("primitive {prim} at {t}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::rays::Rays;
    use crate::bvh::Query;
    use glam::Vec3;

    fn set(rays: usize, query: Query) -> RaySet {
        let mut all = Rays::default();
        (0..rays).for_each(|_| all.push(Ray::new(Vec3::ZERO, Vec3::X)));
        RaySet::in_waves("X", query, all, 16, false)
    }

    fn different(a: (f32, u32), b: (f32, u32)) -> usize {
        let answers = |hit| Answers::Closest(vec![hit]);
        compare(&set(1, Query::Closest), 10.0, &answers(a), &answers(b)).different
    }

    #[test]
    fn hits_agree_by_primitive_or_by_distance() {
        let miss = (f32::INFINITY, MISS);
        assert_eq!(different(miss, miss), 0);
        assert_eq!(different((1.0, 3), miss), 1);
        assert_eq!(different(miss, (1.0, 3)), 1);
        assert_eq!(different((1.0, 3), (2.0, 3)), 0, "the same primitive");
        assert_eq!(different((1.0, 3), (1.00005, 4)), 0, "an edge that both share");
        assert_eq!(different((1.0, 3), (1.001, 4)), 1);
        assert_eq!(different((1e-6, 3), (8e-6, 4)), 0, "closer than the coordinates of the scene tell apart");
        assert_eq!(different((1.0, 3), (f32::NAN, 4)), 1);
    }

    #[test]
    fn one_ray_in_a_million_may_differ_and_one_in_any_case() {
        let comparison = |rays, different| Comparison { rays, different, first: Vec::new() };
        assert!(!comparison(100, 1).fails(WATERTIGHT));
        assert!(comparison(100, 2).fails(WATERTIGHT));
        assert!(!comparison(3_000_000, 3).fails(WATERTIGHT));
        assert!(comparison(3_000_000, 4).fails(WATERTIGHT));
        assert!(!comparison(100_000, 10).fails(FAST) && comparison(100_000, 11).fails(FAST));
    }

    #[test]
    fn the_first_few_are_shown() {
        let comparison = compare(&set(9, Query::Any), 1.0, &Answers::Any(vec![true; 9]), &Answers::Any(vec![false; 9]));
        assert_eq!((comparison.different, comparison.first.len()), (9, SHOWN));
        assert_eq!(comparison.first[4].row, 4);
        assert_eq!(comparison.first[0].answers, ["occluded", "free"]);
    }
}
