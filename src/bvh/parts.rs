//! Which primitives of a scene stand beside its tree. It depends on the scene alone, so that a tree that was kept is taken up where it
//! was left: any change here makes other trees of the same input (`cache::file::VERSION`).

use std::collections::HashSet;
use std::ops::Range;

use super::aabb::Aabb;
use super::build;
use crate::scene::shapes::Shapes;

/// Most primitives that stand beside the tree.
const FEW: usize = 20;

/// Fewest that make a tree worth the while.
const MANY: usize = 64;

/// What the tree's surface may be of the whole scene's: the share of rays that come to it.
const SHARE: f32 = 0.6;

/// Primitives, as runs of numbers, ascending.
type Runs = Vec<Range<u32>>;

/// A scene in two parts.
#[derive(Debug)]
pub struct Parts {
    /// The primitives beside the tree.
    pub few: Runs,
    /// All others.
    pub rest: Runs,
    /// The box of these.
    pub tree: Aabb,
}

impl Parts {
    /// The primitives of small meshes, smallest first, as long as they are few, and all others; `None` if it would not be worth the
    /// while.
    pub fn of(shapes: &Shapes) -> Option<Parts> {
        let mut smallest: Vec<usize> = (0..shapes.geometries.len()).collect();
        smallest.sort_by_key(|&geometry| shapes.geometries[geometry].prim_count);
        let mut left = FEW as u32;
        let fits = |&geometry: &usize| match left.checked_sub(shapes.geometries[geometry].prim_count) {
            Some(rest) => {
                left = rest;
                true
            }
            None => false,
        };
        let small = smallest.into_iter().take_while(fits).collect::<HashSet<_>>();
        let of_small = |wanted: bool| -> Runs {
            let geometries =
                shapes.geometries.iter().enumerate().filter(|(geometry, _)| small.contains(geometry) == wanted);
            geometries.map(|(_, geometry)| geometry.first_prim..geometry.first_prim + geometry.prim_count).collect()
        };
        let (few, rest) = (of_small(true), of_small(false));
        let many = rest.iter().map(ExactSizeIterator::len).sum::<usize>() >= MANY;
        if few.is_empty() || !many {
            return None;
        }
        let [beside, tree] = [&few, &rest].map(|prims| build::tight_bounds(shapes, prims));
        let scene = beside.union(tree);
        let scale = build::area_scale(&scene);
        (tree.half_area(scale) <= SHARE * scene.half_area(scale)).then_some(Parts { few, rest, tree })
    }
}
