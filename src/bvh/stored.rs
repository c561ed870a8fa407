//! The tree as sections of a file, and back.
//!
//! A file may hold anything, with right checksums too. So what traversal relies on is checked anew: every node but the
//! root has one parent, which stands before it (depth-first order), so that no ray goes in circles or takes a way twice;
//! the tree is no deeper than the stack; all references are to primitives that it should hold; unused slots and lanes cannot be hit.

use std::ops::Range;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use super::Bvh4;
use super::aabb::Aabb;
use super::block::TriangleBlock;
use super::build::format;
use super::bvh4::Tables;
use super::grid_node4::{Grid, GridNode4};
use super::intersect::Intersect;
use super::node::Node;
use super::node4::Node4;
use super::ray::MISS;
use super::shared_tri4::SharedTri4;
use super::sphere4::Sphere4;
use super::stats::BvhStats;
use super::traverse::stack::MAX_DEPTH;
use super::traverse::{Tree, TreeKernel};
use super::tri4::Tri4;
use crate::options::AccelOptions;
use crate::scene::shapes::Shapes;
use crate::system::{Buffer, MappedFile};

/// How many sections a tree has.
pub const SECTIONS: usize = 5;

/// Bytes of a row of each section: full nodes, compact nodes, full triangle blocks, sphere blocks, compact triangle blocks. One kind of
/// nodes is empty, and so is one kind of triangle blocks.
pub const ROWS: [usize; SECTIONS] =
    [size_of::<Node4>(), size_of::<GridNode4>(), size_of::<Tri4>(), size_of::<Sphere4>(), size_of::<SharedTri4>()];

/// What the sections do not say.
#[derive(Clone, Copy, Debug)]
pub struct Facts {
    /// The box of all primitives.
    pub bounds: Aabb,
    /// The grid of compact nodes, all zeros for full ones.
    pub grid: Grid,
    /// See [`BvhStats::sah_cost`].
    pub sah_cost: f64,
    /// See [`BvhStats::build_seconds`].
    pub build_seconds: f64,
}

/// A tree in a file.
#[derive(Clone, Copy, Debug)]
pub struct Stored<'a> {
    /// The file.
    pub file: &'a Arc<MappedFile>,
    /// Its bytes that are the sections, in the order of [`ROWS`].
    pub sections: &'a [Range<usize>; SECTIONS],
    /// What goes with them.
    pub facts: Facts,
}

impl Bvh4 {
    /// The bytes of the sections, in the order of [`ROWS`].
    pub(crate) fn sections(&self) -> [&[u8]; SECTIONS] {
        let [nodes, triangles] = self.tables.bytes();
        let spheres = bytemuck::cast_slice(&self.spheres);
        match self.tables {
            Tables::Full(..) => [nodes, &[], triangles, spheres, &[]],
            Tables::Grid(..) => [&[], nodes, triangles, spheres, &[]],
            Tables::Compact(..) => [&[], nodes, &[], spheres, triangles],
        }
    }

    /// What goes with them.
    pub(crate) fn facts(&self) -> Facts {
        let grid = match self.tables {
            Tables::Full(..) => Grid::zeroed(),
            Tables::Grid(_, grid, _) | Tables::Compact(_, grid, _) => grid,
        };
        Facts { bounds: self.bounds, grid, sah_cost: self.stats.sah_cost, build_seconds: self.stats.build_seconds }
    }

    /// The tree over `prims` of `shapes`, runs of numbers that ascend, from a file; or what is wrong with it.
    pub(super) fn load(
        stored: Stored<'_>,
        prims: &[Range<u32>],
        shapes: &Shapes,
        options: &AccelOptions,
    ) -> Result<Bvh4, String> {
        let Stored { file, sections, facts } = stored;
        let [full, grid, triangles, spheres, shared] = sections.clone();
        if !(full.is_empty() || grid.is_empty()) || grid.is_empty() == facts.grid.is_sound() {
            return Err("it has nodes of two kinds, or no grid for those it has".into());
        }
        if !(triangles.is_empty() || shared.is_empty()) || grid.is_empty() && !shared.is_empty() {
            return Err("it has leaves of two kinds, or compact ones with full nodes".into());
        }
        let chosen = format::leaves(options, shapes).map_err(|error| error.to_string())?;
        let tables = if grid.is_empty() {
            Tables::Full(mapped(file, full)?, mapped(file, triangles)?)
        } else if shared.is_empty() {
            Tables::Grid(mapped(file, grid)?, facts.grid, mapped(file, triangles)?)
        } else {
            Tables::Compact(mapped(file, grid)?, facts.grid, mapped(file, shared)?)
        };
        let mut bvh = Bvh4 {
            leaves_why: format::leaves_why(&tables, chosen),
            wide: Buffer::default(),
            tables,
            spheres: mapped(file, spheres)?,
            bounds: facts.bounds,
            intersection: options.intersection,
            stats: BvhStats::default(),
        };
        let (depth, used) = rayon::join(|| bvh.with_tree(CheckNodes), || Lanes { shapes, prims }.check(&bvh));
        let (depth, used) = (depth?, used?);
        // Not before they are known to be a tree, and not where it takes longer than all else before the first pixel (1.2 s for the 2.3 million of
        // 28.9 million triangles): rays that ask for any hit then step through these.
        if bvh.tables.lens()[0] <= MOST_WIDENED {
            bvh.wide = bvh.tables.widened();
        }
        let primitives = prims.iter().map(ExactSizeIterator::len).sum();
        if used != primitives {
            return Err(format!("its leaves hold {used} primitives; expected {primitives}"));
        }
        let [nodes, triangle_blocks] = bvh.tables.lens();
        bvh.stats = BvhStats {
            quality: Some(options.quality),
            primitives,
            nodes,
            leaf_blocks: triangle_blocks + bvh.spheres.len(),
            depth,
            sah_cost: facts.sah_cost,
            bytes: bvh.bytes(),
            bytes_per_primitive: bvh.bytes() as f64 / primitives.max(1) as f64,
            build_seconds: facts.build_seconds,
            ..BvhStats::default()
        };
        Ok(bvh)
    }
}

/// Nodes of a loaded tree up to which they are widened.
const MOST_WIDENED: usize = 1 << 20;

/// The rows that lie in these bytes of a file.
fn mapped<T: Pod + Send + Sync>(file: &Arc<MappedFile>, bytes: Range<usize>) -> Result<Buffer<T>, String> {
    Buffer::mapped(file, bytes.start, bytes.len() / size_of::<T>())
        .ok_or_else(|| "a section lies outside the file".to_owned())
}

/// Checks that the nodes are one tree, and tells how deep it is.
struct CheckNodes;

impl TreeKernel for CheckNodes {
    type Output = Result<u32, String>;

    fn run<N: Node, B: TriangleBlock, I: Intersect>(self, tree: Tree<'_, N, B>) -> Result<u32, String> {
        // The level of each node that has a parent so far; the root's is 1.
        let mut levels = vec![0u8; tree.nodes.len()];
        if let Some(root) = levels.first_mut() {
            *root = 1;
        }
        for (index, node) in tree.nodes.iter().enumerate() {
            let level = levels[index];
            if level == 0 {
                return Err(format!("node {index} has no parent before it"));
            }
            if !node.empty_slots_are_harmless() {
                return Err(format!("node {index} has a box for no child"));
            }
            for (child, _) in tree.children(index) {
                if child.is_leaf() {
                    let blocks = if child.is_spheres() { tree.spheres.len() } else { tree.triangles.len() };
                    if child.blocks().end > blocks {
                        return Err(format!("node {index} names leaf blocks {:?} of {blocks}", child.blocks()));
                    }
                    continue;
                }
                let below = child.node();
                if below <= index || below >= levels.len() || levels[below] != 0 {
                    return Err(format!("node {index} names node {below} as its child"));
                }
                if u32::from(level) == MAX_DEPTH {
                    return Err(format!("it is deeper than {MAX_DEPTH} levels"));
                }
                levels[below] = level + 1;
            }
        }
        Ok(levels.into_iter().max().unwrap_or(0).into())
    }
}

/// Checks the leaf blocks.
#[derive(Clone, Copy)]
struct Lanes<'a> {
    shapes: &'a Shapes,
    /// What the tree should hold.
    prims: &'a [Range<u32>],
}

impl Lanes<'_> {
    /// How many lanes of a tree are used; or which block is wrong.
    fn check(self, bvh: &Bvh4) -> Result<usize, String> {
        Ok(self.check_triangles(bvh)? + self.check_spheres(bvh)?)
    }

    fn check_triangles(self, bvh: &Bvh4) -> Result<usize, String> {
        let kind = 0..self.shapes.triangles.len() as u32;
        match &bvh.tables {
            Tables::Full(_, blocks) | Tables::Grid(_, _, blocks) => check_all("triangle", blocks, |block| {
                let unused = |lane: usize| block.corners.iter().flatten().all(|corner| corner[lane].is_nan());
                self.used(&kind, &block.prim, &block.geom, unused)
            }),
            Tables::Compact(_, _, blocks) => check_all("triangle", blocks, |block| {
                let geom = std::array::from_fn(|lane| block.geom(lane));
                self.used(&kind, block.prims(), &geom, |lane| block.is_unused(lane))
            }),
        }
    }

    fn check_spheres(self, bvh: &Bvh4) -> Result<usize, String> {
        let kind = self.shapes.triangles.len() as u32..self.shapes.prim_count() as u32;
        check_all("sphere", &bvh.spheres, |block| {
            let unused = |lane: usize| block.center(lane).to_array().iter().all(|coordinate| coordinate.is_nan());
            self.used(&kind, &block.prim, &block.geom, unused)
        })
    }

    /// How many lanes of a block are used; `None` if one names a primitive that is not of this kind, not of its geometry, or not to be in
    /// the tree, or is unused and could be hit all the same.
    fn used(
        self,
        kind: &Range<u32>,
        prim: &[u32; 4],
        geom: &[u32; 4],
        unused: impl Fn(usize) -> bool,
    ) -> Option<usize> {
        let mut used = 0;
        for (lane, (&prim, &geom)) in prim.iter().zip(geom).enumerate() {
            if prim == MISS {
                if !unused(lane) {
                    return None;
                }
                continue;
            }
            let geometry = self.shapes.geometries.get(geom as usize)?;
            let own = prim.checked_sub(geometry.first_prim).is_some_and(|offset| offset < geometry.prim_count);
            if !own || !kind.contains(&prim) || !self.expects(prim) {
                return None;
            }
            used += 1;
        }
        Some(used)
    }

    /// Whether the tree should hold a primitive.
    fn expects(self, prim: u32) -> bool {
        let run = self.prims.partition_point(|run| run.end <= prim);
        self.prims.get(run).is_some_and(|run| run.start <= prim)
    }
}

/// Adds up the lanes in use of all blocks, or tells which is wrong.
fn check_all<T: Sync>(what: &str, blocks: &[T], lanes: impl Fn(&T) -> Option<usize> + Sync) -> Result<usize, String> {
    let lanes = blocks.par_iter().enumerate().map(|(index, block)| {
        lanes(block).ok_or_else(|| format!("{what} block {index} names primitives that the tree should not hold"))
    });
    lanes.try_reduce(|| 0, |a, b| Ok(a + b))
}
