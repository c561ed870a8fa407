//! One interface to the tree and to the oracle.

use std::time::Instant;

use super::aabb::Aabb;
use super::brute::Brute;
use super::build::Tell;
use super::bvh4::Bvh4;
use super::columns::{HitColumnsMut, Query, RayColumns, TraversalCounts};
use super::double::Double;
use super::parted::Parted;
use super::single_ray::SingleRay;
use super::stats::BvhStats;
use super::stored::Stored;
use super::traverse::Traversal;
use crate::error::Result;
use crate::options::{self, AccelOptions, Intersection, Precision};
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
    /// The same, beside a few primitives.
    Parted(Box<Parted>),
    /// Every primitive, with the time that copying them took, in seconds.
    Brute(Brute, f64),
    /// A tree in double precision, or every primitive.
    Double(Double),
}

impl Accel {
    /// Builds the structure asked for. It keeps no reference to `shapes`.
    pub fn build(shapes: &Shapes, options: &AccelOptions) -> Result<Accel> {
        Accel::build_watched(shapes, options, &|_, _| {})
    }

    /// As [`Accel::build`], and tells how far it has come.
    pub fn build_watched(shapes: &Shapes, options: &AccelOptions, tell: Tell) -> Result<Accel> {
        if options.is_four_wide()
            && let Some(parted) = Parted::build(shapes, options, tell)?
        {
            return Ok(Accel::Parted(Box::new(parted)));
        }
        if options.precision == Precision::F64 {
            return Ok(Accel::Double(match options.kind {
                options::Accel::Bvh => Double::build(shapes),
                options::Accel::Brute => Double::list(shapes),
            }));
        }
        match options.kind {
            options::Accel::Bvh => Ok(Accel::Bvh(Bvh4::build_watched(shapes, options, tell)?)),
            options::Accel::Brute => {
                let start = Instant::now();
                let brute = Brute::build(shapes, options.intersection);
                Ok(Accel::Brute(brute, start.elapsed().as_secs_f64()))
            }
        }
    }

    /// Takes the four-wide tree from a file, as [`Accel::build`] would make it; or tells what is wrong with the file.
    pub(crate) fn load(
        stored: Stored<'_>,
        shapes: &Shapes,
        options: &AccelOptions,
    ) -> std::result::Result<Accel, String> {
        if let Some(parted) = Parted::load(stored, shapes, options)? {
            return Ok(Accel::Parted(Box::new(parted)));
        }
        let all = 0..shapes.prim_count() as u32;
        Bvh4::load(stored, &[all], shapes, options).map(Accel::Bvh)
    }

    /// The four-wide tree, over all primitives or all but those beside it: what a file can keep.
    pub fn tree(&self) -> Option<&Bvh4> {
        match self {
            Accel::Bvh(bvh) => Some(bvh),
            Accel::Parted(parted) => Some(parted.rest()),
            Accel::Brute(..) | Accel::Double(_) => None,
        }
    }

    /// How large a node is, and why; `None` for the oracle.
    pub fn node_format(&self) -> Option<(&'static str, &'static str)> {
        match self {
            Accel::Double(double) if double.is_tree() => {
                Some(("56-byte", "positions and boxes are in double precision, as asked"))
            }
            _ => self.tree().map(Bvh4::node_format),
        }
    }

    /// How many primitives stand beside the tree, each tested against every ray.
    pub fn beside(&self) -> usize {
        match self {
            Accel::Parted(parted) => parted.few(),
            Accel::Bvh(_) | Accel::Brute(..) | Accel::Double(_) => 0,
        }
    }

    /// How large a block of triangles is, and why; `None` if there are no blocks.
    pub fn leaf_format(&self) -> Option<(&'static str, &'static str)> {
        self.tree().map(Bvh4::leaf_format)
    }

    /// Bytes of a node, and of a block of triangles, or a primitive in double precision; 0 for the oracle, which has neither.
    pub fn row_bytes(&self) -> [usize; 2] {
        match self {
            Accel::Double(_) => Double::row_bytes(),
            _ => self.tree().map_or([0; 2], Bvh4::row_bytes),
        }
    }

    /// The triangle test.
    pub fn intersection(&self) -> Intersection {
        match self {
            Accel::Brute(brute, _) => brute.intersection(),
            _ => self.tree().map_or(Intersection::Watertight, |tree| tree.intersection),
        }
    }

    /// How exactly it knows what it holds.
    pub fn precision(&self) -> Precision {
        match self {
            Accel::Bvh(_) | Accel::Parted(_) | Accel::Brute(..) => Precision::F32,
            Accel::Double(_) => Precision::F64,
        }
    }

    /// The way through the tree that suits rays of which neighbours go the same way (`coherent`), or do not.
    pub fn suited(&self, query: Query, coherent: bool) -> Traversal {
        self.tree().map_or(Traversal::Single, |tree| tree.suited(query, coherent))
    }

    /// The closest hit of each ray. Counts rays only.
    pub fn closest_hits(
        &self,
        way: Traversal,
        tier: Tier,
        rays: RayColumns<'_>,
        hits: HitColumnsMut<'_>,
    ) -> TraversalCounts {
        self.trace_closest(way, tier, rays, hits, false)
    }

    /// The closest hit of each ray, counting what was visited.
    pub fn closest_hits_counted(
        &self,
        way: Traversal,
        tier: Tier,
        rays: RayColumns<'_>,
        hits: HitColumnsMut<'_>,
    ) -> TraversalCounts {
        self.trace_closest(way, tier, rays, hits, true)
    }

    fn trace_closest(
        &self,
        way: Traversal,
        tier: Tier,
        rays: RayColumns<'_>,
        hits: HitColumnsMut<'_>,
        count: bool,
    ) -> TraversalCounts {
        match self {
            Accel::Bvh(bvh) => bvh.closest_hits(way, tier, rays, hits, count),
            Accel::Parted(parted) => parted.closest_hits(way, tier, rays, hits, count),
            Accel::Double(double) => double.closest_hits(rays, hits, count),
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
    pub fn any_hits(&self, way: Traversal, tier: Tier, rays: RayColumns<'_>, occluded: &mut [bool]) -> TraversalCounts {
        self.trace_any(way, tier, rays, occluded, false)
    }

    /// Whether each ray hits anything, counting what was visited.
    pub fn any_hits_counted(
        &self,
        way: Traversal,
        tier: Tier,
        rays: RayColumns<'_>,
        occluded: &mut [bool],
    ) -> TraversalCounts {
        self.trace_any(way, tier, rays, occluded, true)
    }

    fn trace_any(
        &self,
        way: Traversal,
        tier: Tier,
        rays: RayColumns<'_>,
        occluded: &mut [bool],
        count: bool,
    ) -> TraversalCounts {
        match self {
            Accel::Bvh(bvh) => bvh.any_hits(way, tier, rays, occluded, count),
            Accel::Parted(parted) => parted.any_hits(way, tier, rays, occluded, count),
            Accel::Double(double) => double.any_hits(rays, occluded, count),
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
    pub fn cost_columns(&self, rays: RayColumns<'_>, visits: &mut [u32]) {
        let mut single = self.single();
        for (row, visits) in visits[..rays.len()].iter_mut().enumerate() {
            *visits = single.cost(&rays.ray(row)) as u32;
        }
    }

    /// Queries for callers that have no batch.
    pub fn single(&self) -> SingleRay<'_> {
        SingleRay::new(self)
    }

    /// The box of all primitives; empty if there are none.
    pub fn bounds(&self) -> Aabb {
        match self {
            Accel::Bvh(bvh) => bvh.bounds(),
            Accel::Parted(parted) => parted.bounds(),
            Accel::Brute(brute, _) => brute.bounds(),
            Accel::Double(double) => double.bounds(),
        }
    }

    /// Figures of the structure.
    pub fn stats(&self) -> BvhStats {
        match self {
            Accel::Bvh(bvh) => bvh.stats(),
            Accel::Parted(parted) => parted.stats(),
            Accel::Double(double) => double.stats(),
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
            Accel::Parted(parted) => parted.boxes_at_depth(depth),
            Accel::Double(double) => double.boxes_at_depth(depth),
            Accel::Brute(brute, _) if depth == 0 && brute.prim_count() > 0 => vec![brute.bounds()],
            Accel::Brute(..) => Vec::new(),
        }
    }
}
