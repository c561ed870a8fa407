//! Builds the tree in double precision: binned SAH from the top (Wald, "On fast construction of SAH-based bounding volume hierarchies",
//! 2007), halves of equal number where that goes too deep. The result is the same for any number of threads.

use super::{Double, Node, Primitive, Shape};
use crate::bvh::Aabb;
use crate::bvh::stats::BvhStats;
use crate::options::Quality;
use crate::scene::shapes::Shapes;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::time::Instant;

/// Boxes are larger than what they hold by this much of their largest side: see [`Aabb::padded`], whose argument holds here with the
/// half-ulps of `f64`.
const MARGIN: f64 = 1.0 / (1u64 << 49) as f64;
/// Places at which a set may be split, and one.
const BINS: usize = 16;
/// Most primitives of a leaf that the SAH may ask for.
const LEAF: usize = 4;
/// From this depth on, sets are halved by number, so that no scene makes a tree of more than 72 levels.
const DEEP: u32 = 40;
/// Sets from this size on are split on two threads.
const LARGE: usize = 1 << 12;

/// What the builder knows of a primitive.
#[derive(Clone, Copy)]
struct Fragment {
    min: DVec3,
    max: DVec3,
    prim: u32,
}

impl Fragment {
    fn center(&self) -> DVec3 {
        (self.min + self.max) * 0.5
    }
}

impl Double {
    /// A tree over all primitives.
    pub fn build(shapes: &Shapes) -> Double {
        let start = Instant::now();
        let mut fragments = fragments(shapes);
        let nodes = if fragments.is_empty() { Vec::new() } else { split(&mut fragments, 0, 0) };
        Double::of(shapes, nodes, &fragments, Some(Quality::Default), start)
    }

    /// All primitives in one leaf, in order: every ray tests every one.
    pub fn list(shapes: &Shapes) -> Double {
        let start = Instant::now();
        let fragments = fragments(shapes);
        let (min, max) = bounds(&fragments);
        let nodes = match fragments.len() as u32 {
            0 => Vec::new(),
            count => vec![Node { min, max, first: 0, count }],
        };
        Double::of(shapes, nodes, &fragments, None, start)
    }

    fn of(
        shapes: &Shapes,
        nodes: Vec<Node>,
        fragments: &[Fragment],
        quality: Option<Quality>,
        start: Instant,
    ) -> Double {
        let (min, max) = bounds(fragments);
        let primitives: Vec<Primitive> =
            fragments.par_iter().map(|fragment| primitive(shapes, fragment.prim)).collect();
        let bytes = size_of_val(&nodes[..]) + size_of_val(&primitives[..]);
        let inner = nodes.iter().filter(|node| node.count == 0).count();
        let stats = BvhStats {
            quality,
            primitives: primitives.len(),
            nodes: inner,
            leaf_blocks: nodes.len() - inner,
            depth: levels(&nodes),
            sah_cost: sah_cost(&nodes),
            bytes,
            bytes_per_primitive: bytes as f64 / primitives.len().max(1) as f64,
            build_seconds: start.elapsed().as_secs_f64(),
            ..BvhStats::default()
        };
        let bounds = if nodes.is_empty() { Aabb::EMPTY } else { rounded(min, max) };
        Double { nodes, primitives, bounds, stats }
    }
}

/// Bytes that building takes at its peak, the tree among them: a fragment and a row each, and at most two nodes, held twice while they
/// are joined.
pub fn peak_bytes(prims: usize) -> u64 {
    let each = size_of::<Fragment>() + size_of::<Primitive>() + 4 * size_of::<Node>();
    (prims as u64).saturating_mul(each as u64)
}

/// The box in single precision, rounded outwards.
pub fn rounded(min: DVec3, max: DVec3) -> Aabb {
    let down = |x: f64| if f64::from(x as f32) > x { (x as f32).next_down() } else { x as f32 };
    let up = |x: f64| if f64::from(x as f32) < x { (x as f32).next_up() } else { x as f32 };
    Aabb { min: Vec3::from(min.to_array().map(down)), max: Vec3::from(max.to_array().map(up)) }
}

fn primitive(shapes: &Shapes, prim: u32) -> Primitive {
    let shape = match (prim as usize).checked_sub(shapes.triangles.len()) {
        None => Shape::Triangle(shapes.corners_in_double(prim)),
        Some(sphere) => {
            let (center, radius) = shapes.sphere_in_double(sphere);
            Shape::Sphere { center, radius }
        }
    };
    Primitive { shape, prim, geom: shapes.geometry_of(prim) }
}

fn fragments(shapes: &Shapes) -> Vec<Fragment> {
    let fragment = |prim: u32| {
        let (min, max) = match primitive(shapes, prim).shape {
            Shape::Triangle([a, b, c]) => (a.min(b).min(c), a.max(b).max(c)),
            Shape::Sphere { center, radius } => (center - radius, center + radius),
        };
        let margin = (max - min).max_element() * MARGIN;
        let down = (min - margin).to_array().map(f64::next_down);
        let up = (max + margin).to_array().map(f64::next_up);
        Fragment { min: down.into(), max: up.into(), prim }
    };
    (0..shapes.prim_count() as u32).into_par_iter().map(fragment).collect()
}

fn bounds(fragments: &[Fragment]) -> (DVec3, DVec3) {
    let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    fragments.iter().fold(empty, |(min, max), fragment| (min.min(fragment.min), max.max(fragment.max)))
}

/// Half the surface of a box; 0 of an empty one.
fn half_area((min, max): (DVec3, DVec3)) -> f64 {
    let e = (max - min).max(DVec3::ZERO);
    e.x * e.y + e.y * e.z + e.z * e.x
}

/// The tree over a set that stands from `first` on in the order of the leaves. References are relative, so trees can be joined as they are.
fn split(fragments: &mut [Fragment], first: u32, depth: u32) -> Vec<Node> {
    let (min, max) = bounds(fragments);
    let count = fragments.len();
    let leaf = || vec![Node { min, max, first, count: count as u32 }];
    if count == 1 {
        return leaf();
    }
    let best = if depth < DEEP { best_split(fragments) } else { None };
    let middle = match best {
        // A node costs about as much as a primitive.
        Some(best) if count <= LEAF && count as f64 * half_area((min, max)) <= best.cost + half_area((min, max)) => {
            return leaf();
        }
        Some(best) => partition(fragments, &best),
        None => halve(fragments, max - min),
    };
    let (left, right) = fragments.split_at_mut(middle);
    let right_first = first + middle as u32;
    let (left, right) = if count >= LARGE {
        rayon::join(|| split(left, first, depth + 1), || split(right, right_first, depth + 1))
    } else {
        (split(left, first, depth + 1), split(right, right_first, depth + 1))
    };
    let mut nodes = Vec::with_capacity(1 + left.len() + right.len());
    nodes.push(Node { min, max, first: 1 + left.len() as u32, count: 0 });
    nodes.extend(left);
    nodes.extend(right);
    nodes
}

/// Where to split a set.
struct Split {
    axis: usize,
    /// Bins below this number go left.
    bin: usize,
    low: f64,
    scale: f64,
    /// Sum of half surface times number of both sides.
    cost: f64,
}

impl Split {
    fn bin_of(low: f64, scale: f64, center: f64) -> usize {
        (((center - low) * scale) as usize).min(BINS - 1)
    }
}

/// The cheapest split between bins of any axis; `None` if all centres are the same.
fn best_split(fragments: &[Fragment]) -> Option<Split> {
    let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = fragments.iter().fold(empty, |(low, high), f| (low.min(f.center()), high.max(f.center())));
    let mut best: Option<Split> = None;
    for axis in 0..3 {
        let extent = high[axis] - low[axis];
        let scale = BINS as f64 / extent;
        // Too close together for as many bins.
        if !(extent > 0.0 && scale.is_finite()) {
            continue;
        }
        let mut bins = [(0usize, empty); BINS];
        for fragment in fragments {
            let (count, (min, max)) = &mut bins[Split::bin_of(low[axis], scale, fragment.center()[axis])];
            *count += 1;
            (*min, *max) = (min.min(fragment.min), max.max(fragment.max));
        }
        let join =
            |a: (usize, (DVec3, DVec3)), b: (usize, (DVec3, DVec3))| (a.0 + b.0, (a.1.0.min(b.1.0), a.1.1.max(b.1.1)));
        let mut right = [(0, empty); BINS];
        let mut sum = (0, empty);
        for bin in (1..BINS).rev() {
            sum = join(sum, bins[bin]);
            right[bin] = sum;
        }
        let mut left = (0, empty);
        for bin in 1..BINS {
            left = join(left, bins[bin - 1]);
            if left.0 == 0 || right[bin].0 == 0 {
                continue;
            }
            let cost = half_area(left.1) * left.0 as f64 + half_area(right[bin].1) * right[bin].0 as f64;
            if best.as_ref().is_none_or(|best| cost < best.cost) {
                best = Some(Split { axis, bin, low: low[axis], scale, cost });
            }
        }
    }
    best
}

/// Brings the left side to the front, in an order that depends on the set alone; returns its number.
fn partition(fragments: &mut [Fragment], split: &Split) -> usize {
    let goes_left = |f: &Fragment| Split::bin_of(split.low, split.scale, f.center()[split.axis]) < split.bin;
    let (left, right): (Vec<Fragment>, Vec<Fragment>) = fragments.iter().copied().partition(goes_left);
    fragments[..left.len()].copy_from_slice(&left);
    fragments[left.len()..].copy_from_slice(&right);
    left.len()
}

/// Sorts along the longest side and cuts in the middle.
fn halve(fragments: &mut [Fragment], size: DVec3) -> usize {
    let axis = size.max_position();
    fragments.sort_by(|a, b| a.center()[axis].total_cmp(&b.center()[axis]).then(a.prim.cmp(&b.prim)));
    fragments.len() / 2
}

/// Levels of inner nodes.
fn levels(nodes: &[Node]) -> u32 {
    let mut depths = vec![0u32; nodes.len()];
    for (index, node) in nodes.iter().enumerate().filter(|(_, node)| node.count == 0) {
        depths[index] += 1;
        for child in [index + 1, index + node.first as usize] {
            depths[child] = depths[index];
        }
    }
    depths.into_iter().max().unwrap_or(0)
}

/// Expected nodes visited plus primitives tested, of a ray that meets the box of the scene.
fn sah_cost(nodes: &[Node]) -> f64 {
    let area = |node: &Node| half_area((node.min, node.max));
    let Some(root) = nodes.first().map(area).filter(|&area| area > 0.0) else { return 0.0 };
    nodes.iter().map(|node| area(node) / root * f64::from(node.count.max(1))).sum()
}
