//! Whether two tracers give the same answers to the same rays.
//!
//! Closest hits agree if both miss, or both hit the same primitive, or both hit at the same distance: up to 10⁻⁴ of it and 10⁻⁶ of
//! the size of the scene. So an edge that two triangles share may be hit on either, but no hit may be lost. Any-hit
//! answers agree if they are the same.

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

impl Comparison {
    /// More than 1 ray in 10⁶ differs, and more than one: grazing rays of a small set are not held against anyone.
    pub fn fails(&self) -> bool {
        self.different >= 2 && self.different as f64 > self.rays as f64 * 1e-6
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
