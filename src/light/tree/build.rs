//! Building the light tree: binary by the cost of orientation and surface, then four children a node.

use super::bounds::LightBounds;
use glam::Vec3;

/// An emitter to be put into the tree.
#[derive(Clone, Copy, Debug)]
pub struct Item {
    /// Its bounds.
    pub bounds: LightBounds,
    /// Its number.
    pub emitter: u32,
}

/// A binary tree.
pub enum Binary {
    /// One emitter.
    Leaf(Item),
    /// Two groups.
    Inner(LightBounds, Box<[Binary; 2]>),
}

impl Binary {
    /// Bounds of all that is in it.
    pub fn bounds(&self) -> &LightBounds {
        match self {
            Binary::Leaf(item) => &item.bounds,
            Binary::Inner(bounds, _) => bounds,
        }
    }

    /// The groups of a node with up to four children: whichever is largest by power is opened until there are four.
    pub fn open(children: [Binary; 2]) -> Vec<Binary> {
        let mut open = Vec::with_capacity(4);
        open.extend(children);
        while open.len() < 4 {
            let inner = open.iter().enumerate().filter(|(_, c)| matches!(c, Binary::Inner(..)));
            let strongest = inner.max_by(|(_, a), (_, b)| a.bounds().power.total_cmp(&b.bounds().power));
            let Some((at, _)) = strongest else { break };
            if let Binary::Inner(_, grandchildren) = open.remove(at) {
                let [a, b] = *grandchildren;
                open.splice(at..at, [a, b]);
            }
        }
        open
    }
}

/// Buckets an axis.
const BUCKETS: usize = 12;

/// Levels that are split by cost; below, halves bound the depth and the stack.
const LEVELS: u32 = 32;

/// Groups at least this large are built by two threads. The tree is the same.
const PARALLEL: usize = 4096;

/// Builds the tree of at least one item.
pub fn binary(items: &mut [Item], level: u32) -> Binary {
    if let [item] = items {
        return Binary::Leaf(*item);
    }
    let middle = match split(items) {
        Some(split) if level < LEVELS => partition(items, split),
        _ => halve(items),
    };
    let parallel = items.len() >= PARALLEL;
    let (left, right) = items.split_at_mut(middle);
    let (left, right) = if parallel {
        rayon::join(|| binary(left, level + 1), || binary(right, level + 1))
    } else {
        (binary(left, level + 1), binary(right, level + 1))
    };
    Binary::Inner(left.bounds().union(right.bounds()), Box::new([left, right]))
}

/// Where to split: an axis, the lowest centre on it, the buckets per unit, and the last bucket of the lower side.
#[derive(Clone, Copy)]
struct Split {
    axis: usize,
    low: f32,
    scale: f32,
    last: usize,
}

impl Split {
    fn bucket(&self, item: &Item) -> usize {
        (((item.bounds.center()[self.axis] - self.low) * self.scale) as usize).min(BUCKETS - 1)
    }
}

/// The range of centres.
fn centers(items: &[Item]) -> (Vec3, Vec3) {
    let start = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    items.iter().fold(start, |(low, high), item| (low.min(item.bounds.center()), high.max(item.bounds.center())))
}

/// The cheapest split; `None` if all centres are in one place.
fn split(items: &[Item]) -> Option<Split> {
    let (low, high) = centers(items);
    let all = items.iter().skip(1).fold((items[0].bounds.low, items[0].bounds.high), |(low, high), item| {
        (low.min(item.bounds.low), high.max(item.bounds.high))
    });
    let extent = all.1 - all.0;
    let mut best: Option<(f32, Split)> = None;
    for axis in 0..3 {
        let scale = BUCKETS as f32 / (high[axis] - low[axis]);
        if !(scale > 0.0 && scale.is_finite()) {
            continue;
        }
        let split = Split { axis, low: low[axis], scale, last: 0 };
        let mut buckets: [Option<LightBounds>; BUCKETS] = [None; BUCKETS];
        for item in items {
            let bucket = &mut buckets[split.bucket(item)];
            *bucket = Some(join(bucket.as_ref(), Some(&item.bounds)).unwrap_or(item.bounds));
        }
        let mut above = [None; BUCKETS];
        for i in (1..BUCKETS).rev() {
            above[i - 1] = join(above[i].as_ref(), buckets[i].as_ref());
        }
        // Long groups are cut across.
        let thin = extent.max_element() / extent[axis];
        let mut below = None;
        for last in 0..BUCKETS - 1 {
            below = join(below.as_ref(), buckets[last].as_ref());
            let (Some(lower), Some(upper)) = (below, above[last]) else { continue };
            let cost = thin * (lower.cost() + upper.cost());
            if cost.is_finite() && best.as_ref().is_none_or(|(least, _)| cost < *least) {
                best = Some((cost, Split { last, ..split }));
            }
        }
    }
    best.map(|(_, split)| split)
}

fn join(a: Option<&LightBounds>, b: Option<&LightBounds>) -> Option<LightBounds> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.union(b)),
        (a, b) => a.or(b).copied(),
    }
}

/// Puts the lower side first, both in their order; returns its length.
fn partition(items: &mut [Item], split: Split) -> usize {
    let (lower, upper): (Vec<Item>, Vec<Item>) = items.iter().partition(|item| split.bucket(item) <= split.last);
    items[..lower.len()].copy_from_slice(&lower);
    items[lower.len()..].copy_from_slice(&upper);
    lower.len()
}

/// Sorts along the longest axis and cuts in the middle.
fn halve(items: &mut [Item]) -> usize {
    let (low, high) = centers(items);
    let extent = high - low;
    let axis = (0..3).max_by(|&a, &b| extent[a].total_cmp(&extent[b])).unwrap_or(0);
    items.sort_by(|a, b| {
        let [x, y] = [a, b].map(|item| item.bounds.center()[axis]);
        x.total_cmp(&y).then(a.emitter.cmp(&b.emitter))
    });
    items.len() / 2
}
