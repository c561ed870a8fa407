//! Which formats the nodes and the leaves get.

use rayon::prelude::*;

use super::collapse::{BLOCK_COST, NODE_COST};
use crate::bvh::aabb::Aabb;
use crate::bvh::bvh4::Tables;
use crate::bvh::child::Child;
use crate::bvh::grid_node4::{Grid, GridNode4};
use crate::bvh::node::Node;
use crate::bvh::node4::Node4;
use crate::error::{Error, Result};
use crate::options::{AccelOptions, Intersection, LeafFormat, NodeFormat};
use crate::scene::shapes::Shapes;
use crate::system::Buffer;

/// Most that the grid may add to the cost of the tree, by making boxes larger, before full nodes are preferred.
///
/// Compact nodes ÷ full ones, Mray/s of rays in flight (AVX-512), on grids too coarse on purpose: lucy100k with 8 % more leaves a ray, D 1.40, D2
/// 1.45, S 1.41; 28.9 million triangles, a leaf block four steps wide, D 1.20, S 1.08, D2 0.99.
const MOST_GROWTH: f64 = 1.15;

/// Nodes in one of their formats.
pub enum Nodes {
    /// Planes in single precision.
    Full(Buffer<Node4>),
    /// Planes on a grid.
    Grid(Buffer<GridNode4>, Grid),
}

/// Triangles from which leaves are compact if nothing else was asked for: no cache holds much of such a tree, and what is waited for is memory.
///
/// Compact leaves ÷ full ones, Mray/s of rays in flight (AVX-512), S, D, D2: 28.9 million triangles (1.7 GiB with full leaves) 1.22, 1.15, 1.29; coral
/// of 10 million (0.6 GiB) 1.00, 1.01, 0.99, of 3 million 0.9 to 1.04; the dragon (57 MiB) 1.04, 0.99, 0.99.
const COMPACT_FROM: usize = 1 << 24;

/// Whether leaves are to be compact, and why.
pub fn leaves(options: &AccelOptions, shapes: &Shapes) -> Result<(bool, &'static str)> {
    let impossible = match (options.intersection, options.nodes) {
        (Intersection::Fast, _) => Some("the fast test needs full ones"),
        (_, NodeFormat::Full) => Some("full leaves go with full nodes"),
        _ => None,
    };
    match (options.leaves, impossible) {
        (LeafFormat::Full, _) => Ok((false, "full leaves were asked for")),
        (LeafFormat::Auto, Some(why)) => Ok((false, why)),
        (_, Some(why)) => Err(Error::Options(format!("--leaves compact: {why}"))),
        (LeafFormat::Compact, None) => Ok((true, "compact leaves were asked for")),
        (LeafFormat::Limited, None) => Ok((true, "full leaves would not fit in the memory that there is")),
        (LeafFormat::Auto, None) if shapes.triangles.len() >= COMPACT_FROM && is_connected(shapes) => {
            Ok((true, "so many triangles wait for memory, of which compact leaves take less"))
        }
        (LeafFormat::Auto, None) => Ok((false, "there is memory for full leaves, which take fewer instructions")),
    }
}

/// Why leaves have the format that they got, if `chosen` was that they were to be compact or not.
pub fn leaves_why(tables: &Tables, (compact, why): (bool, &'static str)) -> &'static str {
    if tables.is_compact() == compact { why } else { "full leaves go with full nodes, which suit this scene" }
}

/// Whether leaves that were left to choose may be compact to save memory.
pub fn may_be_limited(options: &AccelOptions, shapes: &Shapes) -> bool {
    let is_free = options.leaves == LeafFormat::Auto && options.nodes != NodeFormat::Full;
    is_free && options.is_four_wide() && options.intersection == Intersection::Watertight && is_connected(shapes)
}

/// Whether neighbours share corners, so that most compact blocks will be full: a closed mesh has half as many vertices as triangles, and
/// one of pairs that share an edge has two.
fn is_connected(shapes: &Shapes) -> bool {
    shapes.positions.len() <= shapes.triangles.len() / 4 * 3
}

/// The nodes in the format asked for, and the SAH cost of the tree as it then is. `scale` keeps areas finite.
///
/// The fast triangle test finds hits on slivers that lie beside their boxes. Which of them a ray finds depends on the order
/// of its visits, and so on the last bit of every box test: with compact nodes that bit differs between instruction sets.
pub fn store(full: &[Node4], options: &AccelOptions, scale: f32) -> Result<(Nodes, f64)> {
    let cost = sah_cost(full, &(), scale);
    let compact_leaves = options.leaves.is_compact();
    let format = match (options.intersection, options.nodes) {
        (Intersection::Fast, NodeFormat::Compact) => {
            return Err(Error::Options(
                "--nodes compact needs --intersection watertight: the fast test would find other hits on other processors"
                    .into(),
            ));
        }
        (Intersection::Fast, _) => NodeFormat::Full,
        (Intersection::Watertight, NodeFormat::Auto) if compact_leaves => NodeFormat::Compact,
        (Intersection::Watertight, format) => format,
    };
    if format != NodeFormat::Full {
        if let Some((grid, nodes)) = on_grid(full) {
            let grown = sah_cost(&nodes, &grid, scale);
            if format == NodeFormat::Compact || grown <= cost * MOST_GROWTH {
                return Ok((Nodes::Grid(nodes, grid), grown));
            }
        } else if compact_leaves {
            return Err(Error::Options(
                "the size of this scene does not suit compact nodes, which compact leaves need: use --leaves full"
                    .into(),
            ));
        } else if format == NodeFormat::Compact {
            return Err(Error::Options(
                "the size of this scene does not suit compact nodes: use --nodes auto or --nodes full".into(),
            ));
        }
    }
    Ok((Nodes::Full(Buffer::from_slice(full)), cost))
}

/// All nodes on the grid of their box.
fn on_grid(full: &[Node4]) -> Option<(Grid, Buffer<GridNode4>)> {
    let grid = Grid::around(&root_box(full.first()?, &()))?;
    if !full.par_iter().all(|node| grid.node(node).is_some()) {
        return None;
    }
    // Each has its node, as was just seen.
    let nodes = full.par_iter().map(|node| grid.node(node).unwrap_or(bytemuck::Zeroable::zeroed()));
    Some((grid, Buffer::from_par_iter(nodes)))
}

fn root_box<N: Node>(root: &N, frame: &N::Frame) -> Aabb {
    (0..4).filter_map(|lane| root.child_box(frame, lane)).fold(Aabb::EMPTY, Aabb::union)
}

/// Expected cost of a ray that meets the root's box: nodes visited plus blocks tested, weighted as in the collapse. The same
/// for any number of threads: chunks are summed in order.
fn sah_cost<N: Node>(nodes: &[N], frame: &N::Frame, scale: f32) -> f64 {
    const CHUNK: usize = 1 << 14;
    let Some(root) = nodes.first() else { return 0.0 };
    let root = f64::from(root_box(root, frame).half_area(scale));
    let chunks: Vec<f64> = nodes
        .par_chunks(CHUNK)
        .map(|chunk| chunk.iter().map(|node| children_cost(node, frame, scale)).sum::<f64>())
        .collect();
    let cost = root * f64::from(NODE_COST) + chunks.iter().sum::<f64>();
    if root > 0.0 { cost / root } else { 0.0 }
}

/// Area times cost of a node's children.
fn children_cost<N: Node>(node: &N, frame: &N::Frame, scale: f32) -> f64 {
    (0..4)
        .filter_map(|lane| Some((node.child_box(frame, lane)?, Child::from_bits(node.children()[lane]))))
        .map(|(aabb, child)| {
            let own = if child.is_leaf() { child.blocks().len() as f32 * BLOCK_COST } else { NODE_COST };
            f64::from(aabb.half_area(scale) * own)
        })
        .sum()
}
