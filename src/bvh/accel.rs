//! One interface to the tree and to the oracle.

use std::time::Instant;

use super::aabb::Aabb;
use super::brute::Brute;
use super::bvh4::Bvh4;
use super::columns::{HitColumnsMut, RayColumns, TraversalCounts};
use super::ray::{Hit, Ray};
use super::stats::BvhStats;
use crate::error::Result;
use crate::options;
use crate::scene::shapes::Shapes;
use crate::simd::Tier;

/// What answers ray queries.
///
/// Rays whose origin, direction or `t_max` is not a number, whose direction is zero (no component reaches 2⁻⁶⁰) or
/// whose `t_max` is not above 0 hit nothing. Coordinates are good up to about 1e18.
#[derive(Clone, Debug)]
pub enum Accel {
    /// The four-wide tree.
    Bvh(Bvh4),
    /// Every primitive, with the time that copying them took, in seconds.
    Brute(Brute, f64),
}

impl Accel {
    /// Builds the structure of the given kind. It keeps no reference to `shapes`.
    pub fn build(shapes: &Shapes, kind: options::Accel) -> Result<Accel> {
        match kind {
            options::Accel::Bvh => Ok(Accel::Bvh(Bvh4::build(shapes)?)),
            options::Accel::Brute => {
                let start = Instant::now();
                let brute = Brute::build(shapes);
                Ok(Accel::Brute(brute, start.elapsed().as_secs_f64()))
            }
        }
    }

    /// The closest hit of each ray. Counts rays only.
    pub fn closest_hits(&self, tier: Tier, rays: RayColumns<'_>, hits: HitColumnsMut<'_>) -> TraversalCounts {
        match self {
            Accel::Bvh(bvh) => bvh.closest_hits(tier, rays, hits),
            Accel::Brute(..) => self.closest_hits_counted(tier, rays, hits),
        }
    }

    /// The closest hit of each ray, counting what was visited.
    pub fn closest_hits_counted(&self, tier: Tier, rays: RayColumns<'_>, hits: HitColumnsMut<'_>) -> TraversalCounts {
        match self {
            Accel::Bvh(bvh) => bvh.closest_hits_counted(tier, rays, hits),
            Accel::Brute(brute, _) => {
                let mut hits = hits.trimmed(rays.len());
                let mut counts = TraversalCounts::default();
                for row in 0..rays.len() {
                    hits.set(row, brute.closest_hit(&rays.ray(row), &mut counts));
                }
                counts
            }
        }
    }

    /// Whether each ray hits anything. Counts rays only.
    pub fn any_hits(&self, tier: Tier, rays: RayColumns<'_>, occluded: &mut [bool]) -> TraversalCounts {
        match self {
            Accel::Bvh(bvh) => bvh.any_hits(tier, rays, occluded),
            Accel::Brute(..) => self.any_hits_counted(tier, rays, occluded),
        }
    }

    /// Whether each ray hits anything, counting what was visited.
    pub fn any_hits_counted(&self, tier: Tier, rays: RayColumns<'_>, occluded: &mut [bool]) -> TraversalCounts {
        match self {
            Accel::Bvh(bvh) => bvh.any_hits_counted(tier, rays, occluded),
            Accel::Brute(brute, _) => {
                let mut counts = TraversalCounts::default();
                for (row, occluded) in occluded[..rays.len()].iter_mut().enumerate() {
                    *occluded = brute.any_hit(&rays.ray(row), &mut counts);
                }
                counts
            }
        }
    }

    /// How many nodes the closest-hit traversal of each ray visits; for the oracle, how many primitives it tests.
    pub fn cost_columns(&self, tier: Tier, rays: RayColumns<'_>, visits: &mut [u32]) {
        match self {
            Accel::Bvh(bvh) => bvh.cost_columns(tier, rays, visits),
            Accel::Brute(brute, _) => {
                for (row, visits) in visits[..rays.len()].iter_mut().enumerate() {
                    let mut counts = TraversalCounts::default();
                    brute.closest_hit(&rays.ray(row), &mut counts);
                    *visits = counts.primitive_tests as u32;
                }
            }
        }
    }

    /// The closest hit of one ray, for callers that have no batch; adds to `counts`.
    pub fn closest_hit(&self, ray: &Ray, counts: &mut TraversalCounts) -> Hit {
        match self {
            Accel::Bvh(bvh) => bvh.closest_hit(ray, counts),
            Accel::Brute(brute, _) => brute.closest_hit(ray, counts),
        }
    }

    /// Whether one ray hits anything, for callers that have no batch; adds to `counts`.
    pub fn any_hit(&self, ray: &Ray, counts: &mut TraversalCounts) -> bool {
        match self {
            Accel::Bvh(bvh) => bvh.any_hit(ray, counts),
            Accel::Brute(brute, _) => brute.any_hit(ray, counts),
        }
    }

    /// The box of all primitives; empty if there are none.
    pub fn bounds(&self) -> Aabb {
        match self {
            Accel::Bvh(bvh) => bvh.bounds(),
            Accel::Brute(brute, _) => brute.bounds(),
        }
    }

    /// Figures of the structure.
    pub fn stats(&self) -> BvhStats {
        match self {
            Accel::Bvh(bvh) => bvh.stats(),
            Accel::Brute(brute, build_seconds) => {
                let primitives = brute.prim_count();
                BvhStats {
                    primitives,
                    bytes: brute.bytes(),
                    bytes_per_primitive: brute.bytes() as f64 / primitives.max(1) as f64,
                    build_seconds: *build_seconds,
                    ..BvhStats::default()
                }
            }
        }
    }

    /// The boxes of one level of the tree: 0 is the whole scene, 1 the root's children, and so on. The oracle has
    /// level 0 alone.
    pub fn boxes_at_depth(&self, depth: u32) -> Vec<Aabb> {
        match self {
            Accel::Bvh(bvh) => bvh.boxes_at_depth(depth),
            Accel::Brute(brute, _) if depth == 0 && brute.prim_count() > 0 => vec![brute.bounds()],
            Accel::Brute(..) => Vec::new(),
        }
    }
}
