//! Building: fragments → binary tree ([`top_down`]) → better places for its large nodes ([`reinsertion`]) → plan of the
//! four-wide tree ([`collapse`]) → nodes and leaf blocks ([`emit`]). The result is the same for any number of threads.
//!
//! | quality | binary tree | reinsertion |
//! |---|---|---|
//! | fast | cut by a Morton curve ([`morton`]) down to 32 primitives, by binned SAH below | of the 1024 largest nodes |
//! | default | binned SAH | of the 1024 largest nodes |
//! | best | binned SAH | of all nodes, until there is nothing to gain |
//!
//! Tried, and left out:
//! - Clustering along the curve (PLOC, Meister and Bittner 2018), from leaves of up to four: costs 1.11 times the default
//!   on the dragon where `fast` has 1.10, with a fifth more leaf blocks, in the time that the default takes.
//! - Leaves of single primitives before reinsertion, for `best`: cost −1.5 % on lucy100k, +1.3 % on cubes, and 17 % more
//!   leaf blocks.
//! - Pricing a side of a split at (blocks)^0.8: cost and visits −1 %, for two roots a bin.
//! - Splitting large primitives. A box around a part of a triangle need not hold the point at which the triangle's test
//!   says it is hit: for triangles seen edge-on, that point is anywhere along the triangle. Hits would depend on the tree.

mod binning;
mod bvh2;
mod collapse;
mod course;
mod emit;
pub(super) mod format;
mod fragment;
mod linked;
mod memory;
mod morton;
mod packing;
mod partition;
mod reinsertion;
#[cfg(test)]
mod tests;
mod top_down;

use std::ops::Range;
use std::time::Instant;

use rayon::prelude::*;

pub use fragment::tight_bounds;
pub use memory::peak_bytes;

use super::Bvh4;
use super::aabb::Aabb;
use super::bvh4::Tables;
use super::child::Child;
use super::stats::{BvhStats, PhaseSeconds};
use crate::error::{Error, Result};
use crate::options::{AccelOptions, LeafFormat, Quality, Simd};
use crate::scene::shapes::Shapes;
use crate::simd::Tier;
use bvh2::Binary;
use collapse::Collapse;
pub use course::Tell;
use course::{Course, Step};
use emit::Skeleton;
use format::Nodes;
use fragment::Fragment;
use morton::Curve;
use packing::Packing;
use top_down::TopDown;

impl Bvh4 {
    /// Builds the tree over all primitives; an error if there are more than references can address.
    pub fn build(shapes: &Shapes, options: &AccelOptions) -> Result<Bvh4> {
        Bvh4::build_watched(shapes, options, &|_, _| {})
    }

    /// As [`Bvh4::build`], and tells how far it has come.
    pub fn build_watched(shapes: &Shapes, options: &AccelOptions, tell: Tell) -> Result<Bvh4> {
        let all = 0..u32::try_from(shapes.prim_count()).unwrap_or(u32::MAX);
        Bvh4::build_of(shapes, &[all], options, tell)
    }

    /// As [`Bvh4::build_watched`], over some of the primitives, which keep their numbers.
    pub(super) fn build_of(shapes: &Shapes, prims: &[Range<u32>], options: &AccelOptions, tell: Tell) -> Result<Bvh4> {
        let start = Instant::now();
        let all = shapes.prim_count();
        // In the worst case each primitive has a block of its own.
        if all >= Child::MAX_INDEX as usize {
            return Err(Error::Scene(format!(
                "{all} primitives: the BVH addresses at most {}",
                Child::MAX_INDEX as usize - 1
            )));
        }
        let count = prims.iter().map(ExactSizeIterator::len).sum();
        let bounds = tight_bounds(shapes, prims);
        let mut bvh = match count {
            0 => Bvh4::default(),
            _ => Build {
                shapes,
                prims,
                bounds,
                scale: area_scale(&bounds),
                options: *options,
                tier: Tier::detect(Simd::Auto)?,
                clock: Clock(start),
                phases: PhaseSeconds::default(),
                course: Course::new(tell, count, options.quality),
            }
            .run()?,
        };
        let [nodes, triangle_blocks] = bvh.tables.lens();
        bvh.stats = BvhStats {
            quality: Some(options.quality),
            primitives: count,
            nodes,
            leaf_blocks: triangle_blocks + bvh.spheres.len(),
            bytes: bvh.bytes(),
            bytes_per_primitive: bvh.bytes() as f64 / count.max(1) as f64,
            build_seconds: start.elapsed().as_secs_f64(),
            ..bvh.stats
        };
        Ok(bvh)
    }
}

/// What the steps of a build share.
struct Build<'a> {
    shapes: &'a Shapes,
    /// Which of its primitives.
    prims: &'a [Range<u32>],
    /// Their box.
    bounds: Aabb,
    /// Scales boxes so that their areas neither overflow nor vanish.
    scale: f32,
    options: AccelOptions,
    tier: Tier,
    clock: Clock,
    phases: PhaseSeconds,
    course: Course<'a>,
}

impl Build<'_> {
    fn run(mut self) -> Result<Bvh4> {
        let (compact, why) = format::leaves(&self.options, self.shapes)?;
        let binary = self.binary();
        let packing = if compact { Packing::Shared(self.shapes) } else { Packing::Fours };
        let plan = Collapse::plan(&binary, self.shapes.triangles.len() as u32, self.scale, packing);
        self.phases.collapse = self.clock.lap();
        self.course.add_all(Step::Collapse);
        let mut skeleton = Skeleton::new(&binary, &plan);
        let order = binary.order;
        drop((binary.nodes, plan));
        if self.options.leaves == LeafFormat::Limited {
            memory::check_compact_blocks(skeleton.triangles.len(), self.shapes.triangles.len())?;
        }
        // Before the leaves, which then take the memory that full nodes give back.
        let full = std::mem::take(&mut skeleton.nodes);
        let (nodes, sah_cost) = format::store(&full, &self.options, self.scale)?;
        drop(full);
        self.course.add_parts(Step::Emit, 0..1, 2);
        let triangles = || emit::triangle_blocks(&skeleton.triangles, &order, self.shapes);
        let tables = match nodes {
            Nodes::Full(nodes) => Tables::Full(nodes, triangles()),
            Nodes::Grid(nodes, grid) if compact => {
                Tables::Compact(nodes, grid, emit::shared_blocks(&skeleton.triangles, &order, self.shapes))
            }
            Nodes::Grid(nodes, grid) => Tables::Grid(nodes, grid, triangles()),
        };
        let mut bvh = Bvh4 {
            leaves_why: format::leaves_why(&tables, (compact, why)),
            wide: tables.widened(),
            tables,
            spheres: emit::sphere_blocks(&skeleton.spheres, &order, self.shapes),
            bounds: self.bounds,
            intersection: self.options.intersection,
            ..Bvh4::default()
        };
        bvh.stats.depth = skeleton.depth;
        bvh.stats.sah_cost = sah_cost;
        self.course.add_parts(Step::Emit, 1..2, 2);
        self.phases.emit = self.clock.lap();
        bvh.stats.phase_seconds = self.phases;
        Ok(bvh)
    }

    /// The binary tree that suits the quality.
    fn binary(&mut self) -> Binary {
        let Build { shapes, prims, scale, tier, .. } = *self;
        let curve = (self.options.quality == Quality::Fast).then(|| Curve::new(shapes, prims, &self.bounds));
        let mut fragments = match &curve {
            Some(curve) => curve.fragments(shapes),
            None => fragment::fragments(shapes, prims),
        };
        self.course.add_all(Step::Fragments);
        self.phases.fragments = self.clock.lap();
        let builder = TopDown { triangles: shapes.triangles.len() as u32, scale, tier, course: &self.course };
        let nodes = builder.build(&mut fragments, curve.as_ref().map(Curve::whole));
        drop(curve);
        let order = fragments.par_iter().map(Fragment::prim).collect();
        drop(fragments);
        self.phases.binary = self.clock.lap();
        let effort = match self.options.quality {
            Quality::Fast | Quality::Default => &reinsertion::LITTLE,
            Quality::Best => &reinsertion::MUCH,
        };
        let binary = reinsertion::improve(Binary { nodes, order }, effort, scale, tier, &self.course);
        self.phases.reinsertion = self.clock.lap();
        binary
    }
}

/// Tells how long each phase took.
struct Clock(Instant);

impl Clock {
    /// Seconds since the last call.
    fn lap(&mut self) -> f64 {
        let last = std::mem::replace(&mut self.0, Instant::now());
        (self.0 - last).as_secs_f64()
    }
}

/// Brings the scene to size 1, so that areas neither overflow nor vanish.
pub(super) fn area_scale(bounds: &Aabb) -> f32 {
    let size = (bounds.max - bounds.min).max_element();
    if size > 0.0 { (1.0 / size).clamp(f32::MIN_POSITIVE, f32::MAX) } else { 1.0 }
}
