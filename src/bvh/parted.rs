//! A few primitives beside a tree of all others.
//!
//! Scenes often are one mesh in a room: walls, a floor, a lamp. As wide as the scene, these make every box that they are in as large as it,
//! and every ray crosses the tree's upper nodes to meet one of them behind the mesh. Tested by themselves, all of them against every
//! ray ([`Traversal::List`]), they cost less than those nodes do, and the rays that pass beside the mesh, or end before it, never come to its
//! tree.
//!
//! One tree → parted: time of the whole render (480 × 360, AVX-512, two threads), and
//! Mray/s a thread of its queues for the closest hit and for any, by `comber profile`:
//!
//! | | render, ms | closest hit | any hit |
//! |---|--:|--:|--:|
//! | CBbunny, 64 samples | 4785 → 3668 | 9.9 → 13.3 | 12.2 → 24.3 |
//! | the dragon in the Cornell box, 16 samples | 1410 → 1088 | 7.7 → 10.8 | 9.7 → 15.6 |
//!
//! A file of the cache holds the tree alone: what stands beside it follows from the scene ([`Parts`]) and is built anew.

use super::aabb::Aabb;
use super::build::{self, Tell};
use super::bvh4::Bvh4;
use super::closest::closer;
use super::columns::{HitColumnsMut, Query, RayColumns, TraversalCounts};
use super::parts::Parts;
use super::ray::{Hit, Ray};
use super::some_rays::{Ends, ROWS, SomeRays};
use super::stats::BvhStats;
use super::stored::Stored;
use super::traverse::{Stack, Traversal};
use crate::error::Result;
use crate::options::AccelOptions;
use crate::scene::shapes::Shapes;
use crate::simd::Tier;

/// The two parts.
#[derive(Clone, Debug)]
pub struct Parted {
    few: Bvh4,
    rest: Bvh4,
}

impl Parted {
    /// Builds both, if the scene is of that kind.
    pub fn build(shapes: &Shapes, options: &AccelOptions, tell: Tell) -> Result<Option<Parted>> {
        let Some(parts) = Parts::of(shapes) else { return Ok(None) };
        let rest = Bvh4::build_of(shapes, &parts.rest, options, tell)?;
        Ok(Some(Parted { few: few(shapes, &parts, options)?, rest }))
    }

    /// Takes the tree from a file, and builds what stands beside it; or tells what is wrong with the file.
    pub(super) fn load(
        stored: Stored<'_>,
        shapes: &Shapes,
        options: &AccelOptions,
    ) -> std::result::Result<Option<Parted>, String> {
        let Some(parts) = Parts::of(shapes) else { return Ok(None) };
        let rest = Bvh4::load(stored, &parts.rest, shapes, options)?;
        // It decides which rays come to the tree.
        if rest.bounds() != parts.tree {
            return Err("its box is not that of the primitives it should hold".into());
        }
        let few = few(shapes, &parts, options).map_err(|error| error.to_string())?;
        Ok(Some(Parted { few, rest }))
    }

    /// The tree of all but a few.
    pub fn rest(&self) -> &Bvh4 {
        &self.rest
    }

    /// How many are tested by themselves.
    pub fn few(&self) -> usize {
        self.few.stats().primitives
    }

    /// The box of all primitives.
    pub fn bounds(&self) -> Aabb {
        self.few.bounds().union(self.rest.bounds())
    }

    /// Figures of both; the cost is that of a ray that meets the scene's box.
    pub fn stats(&self) -> BvhStats {
        let (few, rest) = (self.few.stats(), self.rest.stats());
        let primitives = few.primitives + rest.primitives;
        let bytes = few.bytes + rest.bytes;
        let scale = build::area_scale(&self.bounds());
        let share = self.rest.bounds().half_area(scale) / self.bounds().half_area(scale);
        BvhStats {
            primitives,
            nodes: few.nodes + rest.nodes,
            leaf_blocks: few.leaf_blocks + rest.leaf_blocks,
            // Below the boxes of the parts.
            depth: 1 + few.depth.max(rest.depth),
            sah_cost: few.sah_cost + f64::from(share) * rest.sah_cost,
            bytes,
            bytes_per_primitive: bytes as f64 / primitives as f64,
            build_seconds: few.build_seconds + rest.build_seconds,
            ..rest
        }
    }

    /// The boxes of one level: 0 is the whole scene, 1 the box of each part, and then what these hold.
    pub fn boxes_at_depth(&self, depth: u32) -> Vec<Aabb> {
        match depth.checked_sub(1) {
            None => vec![self.bounds()],
            Some(depth) => [&self.few, &self.rest].map(|part| part.boxes_at_depth(depth)).concat(),
        }
    }

    /// The closest hit of each ray.
    pub fn closest_hits(
        &self,
        way: Traversal,
        tier: Tier,
        rays: RayColumns<'_>,
        hits: HitColumnsMut<'_>,
        count: bool,
    ) -> TraversalCounts {
        let rays = rays.trimmed();
        let mut hits = hits.trimmed(rays.len());
        let mut counts = self.few.closest_hits(beside(way), tier, rays, hits.reborrow(), count);
        let mut some = SomeRays::new();
        let (mut t, mut u, mut v) = ([0.0; ROWS], [0.0; ROWS], [0.0; ROWS]);
        let (mut prim, mut geom) = ([0; ROWS], [0; ROWS]);
        let mut next = 0;
        while next < rays.len() {
            next = some.fill(tier, rays, next, &self.rest.bounds(), Ends::Hits(hits.t));
            let found = HitColumnsMut { t: &mut t, u: &mut u, v: &mut v, prim: &mut prim, geom: &mut geom };
            counts += self.rest.closest_hits(way, tier, some.columns(), found, count);
            for (i, row) in some.rows().enumerate() {
                let hit = Hit { t: t[i], u: u[i], v: v[i], prim: prim[i], geom: geom[i] };
                // The ray ended at its hit beside the tree: what is as far is still to be told apart.
                if closer(&hit, 0.0, &hits.get(row)) {
                    hits.set(row, hit);
                }
            }
        }
        TraversalCounts { rays: rays.len() as u64, ..counts }
    }

    /// Whether each ray hits anything.
    pub fn any_hits(
        &self,
        way: Traversal,
        tier: Tier,
        rays: RayColumns<'_>,
        occluded: &mut [bool],
        count: bool,
    ) -> TraversalCounts {
        let rays = rays.trimmed();
        let occluded = &mut occluded[..rays.len()];
        let mut counts = self.few.any_hits(beside(way), tier, rays, occluded, count);
        let mut some = SomeRays::new();
        let mut found = [false; ROWS];
        let mut next = 0;
        while next < rays.len() {
            next = some.fill(tier, rays, next, &self.rest.bounds(), Ends::Occluded(occluded));
            counts += self.rest.any_hits(way, tier, some.columns(), &mut found, count);
            for (row, &found) in some.rows().zip(&found) {
                occluded[row] = found;
            }
        }
        TraversalCounts { rays: rays.len() as u64, ..counts }
    }

    /// The closest hit of one ray, for callers that have no batch.
    #[inline(always)]
    pub fn closest_hit(&self, ray: &Ray, stack: &mut Stack) -> Hit {
        let beside = self.few.closest_hit(ray, stack);
        let hit = self.rest.closest_hit(&Ray { t_max: ray.t_max.min(beside.t), ..*ray }, stack);
        if closer(&hit, 0.0, &beside) { hit } else { beside }
    }

    /// Whether one ray hits anything, for callers that have no batch.
    #[inline(always)]
    pub fn any_hit(&self, ray: &Ray, stack: &mut Stack) -> bool {
        self.few.any_hit(ray, stack) || self.rest.any_hit(ray, stack)
    }

    /// What one ray visits on the way to its answer.
    pub fn visits(&self, query: Query, ray: &Ray, stack: &mut Stack) -> TraversalCounts {
        let (beside, mut counts) = self.few.visits(query, ray, stack);
        if query == Query::Closest || !beside.is_some() {
            counts += self.rest.visits(query, &Ray { t_max: ray.t_max.min(beside.t), ..*ray }, stack).1;
        }
        TraversalCounts { rays: 1, ..counts }
    }
}

/// What stands beside the tree.
fn few(shapes: &Shapes, parts: &Parts, options: &AccelOptions) -> Result<Bvh4> {
    Bvh4::build_of(shapes, &parts.few, options, &|_, _| {})
}

/// The way past the few. The control goes one by one there, too.
fn beside(way: Traversal) -> Traversal {
    match way {
        Traversal::Single => Traversal::Single,
        Traversal::InFlight | Traversal::Packet | Traversal::List => Traversal::List,
    }
}
