//! Nodes of eight children: what rays in flight step through.
//!
//! They are made from the four-wide tree, on its grid and with its leaves, once it is built or loaded: each takes the children of a node of
//! four, and puts those of an inner child in the place of that child, the largest first, as long as eight have room; where seven stand, it cuts
//! one in two, whose halves are then nodes with room for all that two nodes of four hold. They hold five children on average: nodes at the bottom have
//! the four leaves of one of four. A ray takes fewer
//! steps, and eight boxes fill a vector of their own: its numbers need not be gathered from several rays (`traverse/wave/nodes.rs`).

use std::collections::VecDeque;

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;
use smallvec::SmallVec;

use super::child::Child;
use super::grid_node4::{Grid, GridNode4};
use super::node::Node;
use crate::system::Buffer;

/// Children of a node.
pub const WIDTH: usize = 8;

/// Most levels that rays in flight have room for on their stacks, on each of which seven children are left behind.
pub const MAX_LEVELS: u32 = 34;

/// Eight children and their boxes: two cache lines. Boxes are those of [`GridNode4`], to the bit.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct GridNode8 {
    /// By axis, four children and then the others: four low planes before the four high ones. So each half of a vector has both sides of
    /// its children.
    planes: [[[[u16; 4]; 2]; 2]; 3],
    /// References; empty slots repeat the first.
    children: [u32; WIDTH],
}

const _: () = assert!(size_of::<GridNode8>() == 128);

impl GridNode8 {
    /// The planes of an axis, as vectors take them.
    #[inline(always)]
    pub fn words(&self, axis: usize) -> &[u32; WIDTH] {
        bytemuck::cast_ref(&self.planes[axis])
    }

    /// The children, as references; those of empty slots may be any, and no ray comes to harm there.
    #[inline(always)]
    pub fn children(&self) -> &[u32; WIDTH] {
        &self.children
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        (0..WIDTH).filter(|&lane| self.planes[0][lane / 4][0][lane % 4] != GridNode4::EMPTY).count()
    }

    /// Of up to eight. Those without a child get one later.
    fn of(parts: &[Part]) -> GridNode8 {
        let first = parts.first().map_or(Child::EMPTY, |part| part.slot.child).bits();
        let mut node = GridNode8 { planes: [[[[GridNode4::EMPTY; 4]; 2]; 2]; 3], children: [first; WIDTH] };
        for (lane, Part { slot, .. }) in parts.iter().enumerate() {
            node.children[lane] = slot.child.bits();
            for axis in 0..3 {
                for side in 0..2 {
                    node.planes[axis][lane / 4][side][lane % 4] = slot.planes[axis][side];
                }
            }
        }
        node
    }

    /// Gives an inner child its reference.
    fn refer(&mut self, lane: usize, child: Child) {
        let count = if lane == 0 { self.count() } else { WIDTH };
        self.children[lane] = child.bits();
        self.children[count..].fill(child.bits());
    }
}

/// A child of a node of four, and its planes: first the axis, then the side.
#[derive(Clone, Copy)]
struct Slot {
    child: Child,
    planes: [[u16; 2]; 3],
}

type Slots = SmallVec<[Slot; 4]>;

impl Slot {
    /// The children of a node of four.
    fn all(node: &GridNode4) -> Slots {
        let slot =
            |lane: usize| Some(Slot { planes: node.numbers(lane)?, child: Child::from_bits(node.children()[lane]) });
        (0..4).filter_map(slot).collect()
    }
}

/// A child of a node of eight in the making.
struct Part {
    slot: Slot,
    /// Half the surface of its box.
    half_area: f32,
    /// What is in it; nothing if it is a leaf.
    below: Slots,
}

type Parts = SmallVec<[Part; WIDTH]>;

impl Part {
    fn new(tree: &Four, slot: Slot) -> Part {
        let below = if slot.child.is_leaf() { Slots::new() } else { Slot::all(&tree.nodes[slot.child.node()]) };
        Part { half_area: tree.half_area(&slot), slot, below }
    }

    /// Some children of a node of four as a node of their own.
    fn group(tree: &Four, below: [Slot; 2]) -> Part {
        let [a, b] = below;
        let union = |axis: usize| {
            let (a, b) = (a.planes[axis], b.planes[axis]);
            [a[0].min(b[0]), a[1].max(b[1])]
        };
        let slot = Slot { child: Child::EMPTY, planes: [union(0), union(1), union(2)] };
        Part { half_area: tree.half_area(&slot), slot, below: SmallVec::from_slice(&below) }
    }

    /// Whether it holds four inner children.
    fn is_cut(&self) -> bool {
        self.below.len() == 4 && !self.below.iter().any(|slot| slot.child.is_leaf())
    }

    /// Its four children in two pairs, of the three ways the one whose boxes are smallest.
    fn pairs(&self, tree: &Four) -> Option<[Part; 2]> {
        let &[a, b, c, d] = &self.below[..] else { return None };
        let ways = [[[a, b], [c, d]], [[a, c], [b, d]], [[a, d], [b, c]]];
        let area = |pairs: &[Part; 2]| pairs[0].half_area + pairs[1].half_area;
        ways.map(|pairs| pairs.map(|pair| Part::group(tree, pair)))
            .into_iter()
            .min_by(|a, b| area(a).total_cmp(&area(b)))
    }
}

/// What will be a node: its children to be, the place that refers to it, and its level.
struct Waiting {
    below: Slots,
    place: Option<(usize, usize)>,
    level: u32,
}

/// Subtrees that are widened by themselves, at least, if the tree has as many.
const PIECES: usize = 256;

/// The tree of eight children a node, the root first. Empty if it were too deep for the stacks of rays in flight, which then step
/// through nodes of four.
pub fn widened(nodes: &[GridNode4], grid: &Grid) -> Buffer<GridNode8> {
    let Some(root) = nodes.first() else { return Buffer::default() };
    let tree = Four { nodes, grid };
    // The upper nodes level by level, and what is below them in parallel.
    let mut wide = Vec::new();
    let mut waiting = VecDeque::from([Waiting { below: Slot::all(root), place: None, level: 1 }]);
    while waiting.len() < PIECES
        && let Some(next) = waiting.pop_front()
    {
        if !tree.widen(next, &mut wide, |next| waiting.push_back(next)) {
            return Buffer::default();
        }
    }
    let below = waiting.par_iter().map(|next| tree.piece(next)).collect::<Option<Vec<_>>>();
    let Some(below) = below else { return Buffer::default() };
    for (Waiting { place, .. }, piece) in waiting.iter().zip(below) {
        let first = wide.len() as u32;
        if let Some((parent, lane)) = *place {
            wide[parent].refer(lane, Child::inner(first));
        }
        wide.extend(piece.into_iter().map(|mut node: GridNode8| {
            node.children = node.children.map(|child| Child::from_bits(child).moved(first, 0, 0).bits());
            node
        }));
    }
    Buffer::from_slice(&wide)
}

/// The tree of four children a node.
struct Four<'a> {
    nodes: &'a [GridNode4],
    grid: &'a Grid,
}

impl Four<'_> {
    fn half_area(&self, slot: &Slot) -> f32 {
        let [x, y, z] = self.grid.size(slot.planes);
        x * y + y * z + z * x
    }

    /// A subtree by itself, depth first; `None` if it is too deep.
    fn piece(&self, root: &Waiting) -> Option<Vec<GridNode8>> {
        let mut wide = Vec::new();
        let mut waiting = vec![Waiting { below: root.below.clone(), place: None, level: root.level }];
        while let Some(next) = waiting.pop() {
            let before = waiting.len();
            self.widen(next, &mut wide, |next| waiting.push(next)).then_some(())?;
            // The largest, which come first, are visited first.
            waiting[before..].reverse();
        }
        Some(wide)
    }

    /// Adds a node to `wide`, and hands over what will be its inner children. False if it would be too deep.
    fn widen(
        &self,
        Waiting { below, place, level }: Waiting,
        wide: &mut Vec<GridNode8>,
        mut wait: impl FnMut(Waiting),
    ) -> bool {
        let this = wide.len();
        if let Some((parent, lane)) = place {
            wide[parent].refer(lane, Child::inner(this as u32));
        }
        let parts = self.parts(&below);
        wide.push(GridNode8::of(&parts));
        for (lane, part) in parts.into_iter().enumerate().filter(|(_, part)| !part.below.is_empty()) {
            wait(Waiting { below: part.below, place: Some((this, lane)), level: level + 1 });
        }
        level <= MAX_LEVELS
    }

    /// The children of a node of which these are part, its largest ones opened as long as there is room, or else cut in two; largest first.
    fn parts(&self, below: &[Slot]) -> Parts {
        let mut parts: Parts = below.iter().map(|&slot| Part::new(self, slot)).collect();
        while parts.len() < WIDTH {
            let room = WIDTH - parts.len();
            let fits = |part: &Part| (1..=room + 1).contains(&part.below.len());
            if let Some(open) = largest(&parts, fits) {
                let open = parts.swap_remove(open);
                parts.extend(open.below.iter().map(|&slot| Part::new(self, slot)));
            } else if let Some(cut) = largest(&parts, Part::is_cut) {
                let cut = parts.swap_remove(cut);
                parts.extend(cut.pairs(self).into_iter().flatten());
            } else {
                break;
            }
        }
        parts.sort_by(|a, b| b.half_area.total_cmp(&a.half_area));
        parts
    }
}

/// The largest of those that fit.
fn largest(parts: &[Part], fits: impl Fn(&Part) -> bool) -> Option<usize> {
    let fitting = (0..parts.len()).filter(|&i| fits(&parts[i]));
    fitting.max_by(|&i, &j| parts[i].half_area.total_cmp(&parts[j].half_area))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::Bvh4;
    use crate::bvh::bvh4::Tables;
    use crate::bvh::{RayColumns, Traversal};
    use crate::options::{AccelOptions, NodeFormat};
    use crate::sampling::random::uniform4;
    use crate::simd::Tier;

    fn tree(spec: &str) -> (Buffer<GridNode4>, Grid, Buffer<GridNode8>) {
        let scene = crate::scene::procedural::generate(spec).unwrap();
        let shapes = crate::scene::Scene::build(scene, Default::default()).unwrap().shapes;
        let options = AccelOptions { nodes: NodeFormat::Compact, ..Default::default() };
        let bvh = Bvh4::build(&shapes, &options).unwrap();
        let Tables::Grid(nodes, grid, _) = bvh.tables else { panic!("compact nodes were asked for") };
        (nodes, grid, bvh.wide)
    }

    /// Children of a node of eight and their planes.
    fn children(node: &GridNode8) -> Vec<(Child, [[u16; 2]; 3])> {
        let planes = |lane: usize| node.planes.map(|axis| axis[lane / 4].map(|side| side[lane % 4]));
        (0..node.count()).map(|lane| (Child::from_bits(node.children[lane]), planes(lane))).collect()
    }

    #[test]
    fn every_leaf_is_there_once_with_its_box_and_in_those_above() {
        for spec in ["proc:coral,tris=60k", "proc:soup,tris=3k", "proc:cubes,tris=120"] {
            let (nodes, grid, wide) = tree(spec);
            let mut expected: Vec<_> = nodes.iter().flat_map(Slot::all).filter(|slot| slot.child.is_leaf()).collect();
            let (mut found, mut visited) = (Vec::new(), 0);
            let mut waiting = vec![(0, [[0, u16::MAX]; 3], 1)];
            while let Some((node, around, level)) = waiting.pop() {
                assert!(level <= MAX_LEVELS);
                visited += 1;
                let children = children(&wide[node]);
                assert!(!children.is_empty());
                // Nothing waits in the other slots but what the first refers to, at a point.
                assert!(wide[node].children[children.len()..].iter().all(|&child| child == children[0].0.bits()));
                for (child, planes) in children {
                    for axis in 0..3 {
                        assert!(around[axis][0] <= planes[axis][0] && planes[axis][1] <= around[axis][1]);
                    }
                    if child.is_leaf() {
                        found.push(Slot { child, planes });
                    } else {
                        waiting.push((child.node(), planes, level + 1));
                    }
                }
            }
            assert_eq!(visited, wide.len());
            let key = |slot: &Slot| (slot.child.bits(), slot.planes);
            expected.sort_by_key(key);
            found.sort_by_key(key);
            assert!(expected.iter().map(key).eq(found.iter().map(key)), "{spec}");
            let filled = wide.iter().map(GridNode8::count).sum::<usize>() as f64 / wide.len() as f64;
            assert!(wide.len() < 20 || filled > 4.5, "{spec}: {filled} children a node");
            assert_eq!(&widened(&nodes, &grid)[..], &wide[..]);
        }
    }

    #[test]
    fn rays_find_the_same_without_them() {
        let scene = crate::scene::procedural::generate("proc:coral,tris=20k").unwrap();
        let shapes = crate::scene::Scene::build(scene, Default::default()).unwrap().shapes;
        let options = AccelOptions { nodes: NodeFormat::Compact, ..Default::default() };
        let bvh = Bvh4::build(&shapes, &options).unwrap();
        let plain = Bvh4 { wide: Buffer::default(), ..bvh.clone() };
        let (low, high) = (bvh.bounds().min, bvh.bounds().max);
        let number = |row: u32, i: usize| uniform4(row, (i / 4) as u32, 0, 0)[i % 4];
        let column = |i: usize, at: &dyn Fn(f32) -> f32| (0..3000).map(|row| at(number(row, i))).collect::<Vec<f32>>();
        let origins = [0, 1, 2].map(|axis| column(axis, &|u| low[axis] + u * (high[axis] - low[axis])));
        let directions = [3, 4, 5].map(|i| column(i, &|u| u - 0.5));
        let ([ox, oy, oz], [dx, dy, dz]) = (&origins, &directions);
        let rays = RayColumns { ox, oy, oz, dx, dy, dz, t_min: None, t_max: None, low: None };
        for tier in Tier::available() {
            let [mut with, mut without] = [vec![false; 3000], vec![false; 3000]];
            bvh.any_hits(Traversal::InFlight, tier, rays, &mut with, false);
            plain.any_hits(Traversal::InFlight, tier, rays, &mut without, true);
            let hits = with.iter().filter(|&&hit| hit).count();
            assert!((300..2700).contains(&hits), "{hits}");
            assert_eq!(with, without, "{}", tier.name());
        }
    }

    #[test]
    fn trees_too_deep_are_not_widened() {
        let (nodes, grid, _) = tree("proc:cubes,tris=120");
        // Levels of one inner child and three leaves.
        let leaf = Slot::all(&nodes[0])[0].planes;
        let chain = |levels: u32| -> Vec<GridNode4> {
            let slot = |level: u32, lane: u32| match lane {
                0 if level + 1 < levels => Child::inner(level + 1),
                _ => Child::leaf(4 * level + lane, 1, false),
            };
            (0..levels).map(|level| GridNode4::of([0, 1, 2, 3].map(|lane| (slot(level, lane), leaf)))).collect()
        };
        assert!(!widened(&chain(60), &grid).is_empty());
        assert!(widened(&chain(80), &grid).is_empty());
    }
}
