//! Building: fragments → binary tree ([`bvh2`]) → plan of the four-wide tree ([`collapse`]) → nodes and leaf
//! blocks ([`emit`]). The result is the same for any number of threads.

mod binning;
mod bvh2;
mod collapse;
mod emit;
mod format;
mod fragment;

use std::time::Instant;

use rayon::prelude::*;

use super::Bvh4;
use super::aabb::Aabb;
use super::child::Child;
use super::stats::BvhStats;
use crate::error::{Error, Result};
use crate::options::AccelOptions;
use crate::scene::shapes::Shapes;
use bvh2::Builder;
use collapse::Collapse;
use emit::Skeleton;

impl Bvh4 {
    /// Builds the tree over all primitives; an error if there are more than references can address.
    pub fn build(shapes: &Shapes, options: &AccelOptions) -> Result<Bvh4> {
        let start = Instant::now();
        let prims = shapes.prim_count();
        // In the worst case each primitive has a block of its own.
        if prims >= Child::MAX_INDEX as usize {
            return Err(Error::Scene(format!(
                "{prims} primitives: the BVH addresses at most {}",
                Child::MAX_INDEX as usize - 1
            )));
        }
        let (mut fragments, bounds) = fragment::fragments(shapes);
        let mut bvh = Bvh4 { bounds, intersection: options.intersection, ..Bvh4::default() };
        if prims > 0 {
            let triangles = shapes.triangles.len() as u32;
            let scale = area_scale(&bounds);
            let binary = Builder { triangles, scale }.build(&mut fragments);
            let plan = Collapse::plan(&binary, &fragments, triangles, scale);
            let order: Vec<u32> = fragments.par_iter().map(|fragment| fragment.prim).collect();
            drop(fragments);
            let skeleton = Skeleton::new(&binary, &plan);
            drop((binary, plan));
            bvh.triangles = emit::triangle_blocks(&skeleton.triangles, &order, shapes);
            bvh.spheres = emit::sphere_blocks(&skeleton.spheres, &order, shapes);
            bvh.stats.depth = skeleton.depth;
            (bvh.nodes, bvh.stats.sah_cost) = format::store(&skeleton.nodes, options, scale)?;
        }
        bvh.stats = BvhStats {
            primitives: prims,
            nodes: bvh.nodes.len(),
            leaf_blocks: bvh.triangles.len() + bvh.spheres.len(),
            bytes: bvh.bytes(),
            bytes_per_primitive: bvh.bytes() as f64 / prims.max(1) as f64,
            build_seconds: start.elapsed().as_secs_f64(),
            ..bvh.stats
        };
        Ok(bvh)
    }
}

/// Brings the scene to size 1, so that areas neither overflow nor vanish.
fn area_scale(bounds: &Aabb) -> f32 {
    let size = (bounds.max - bounds.min).max_element();
    if size > 0.0 { (1.0 / size).clamp(f32::MIN_POSITIVE, f32::MAX) } else { 1.0 }
}
