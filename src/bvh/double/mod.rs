//! The tree in double precision, for `--precision f64`: plain, binary, one ray after another.
//!
//! Rays start at the sum of two numbers an axis, boxes and corners are `f64`, and so are distances until the answer is
//! rounded. The nodes of the other trees, with their planes in single precision, would not do, not even conservatively: where a unit in the last place is as large
//! as the thing to be seen, all its boxes are the same, and a ray that meets one meets every triangle in it.
//!
//! Two things decide what is hit: [`triangle`] and [`crate::bvh::sphere`]. The tree decides only what is tested; without one ([`Double::list`]) all
//! is, and hits are the same to the bit.

mod build;
pub mod triangle;

use super::Aabb;
use super::columns::{HitColumnsMut, RayColumns, TraversalCounts};
use super::ray::{Hit, MISS, Ray};
use super::sphere;
use super::stats::BvhStats;
pub use build::peak_bytes;
use glam::DVec3;
use triangle::{Crossing, Sheared};

/// How much earlier than computed a box may be entered: 32 half-ulps, as [`SLACK`](super::node::SLACK) of the other trees. Planes, origins and
/// reciprocals are `f64`, so a distance errs by a few half-ulps of `f64`, and so does the shear of the triangle test.
const SLACK: f64 = 1.0 / (1u64 << 48) as f64;

/// Smallest direction component that counts, relative to the largest. Boxes are larger than what they hold by 2⁻⁴⁹ of their size, so a ray in a
/// face of a primitive stays inside its box for 2²⁵¹ times its size.
const STEEPEST: f64 = 1.0 / (1u128 << 100) as f64 / (1u128 << 100) as f64 / (1u128 << 100) as f64;

/// A node. Its first child stands behind it.
#[derive(Clone, Copy, Debug)]
struct Node {
    min: DVec3,
    max: DVec3,
    /// Of a leaf the first primitive; else how far behind the node its second child stands.
    first: u32,
    /// How many primitives the leaf has; 0 in inner nodes.
    count: u32,
}

/// A primitive in a leaf.
#[derive(Clone, Copy, Debug)]
struct Primitive {
    shape: Shape,
    prim: u32,
    geom: u32,
}

#[derive(Clone, Copy, Debug)]
enum Shape {
    Triangle([DVec3; 3]),
    Sphere { center: DVec3, radius: f64 },
}

/// A tree over triangles and spheres, or a list of them.
#[derive(Clone, Debug)]
pub struct Double {
    /// The root first, then depth-first.
    nodes: Vec<Node>,
    /// In the order of the leaves.
    primitives: Vec<Primitive>,
    bounds: Aabb,
    stats: BvhStats,
}

/// Nodes that a ray has yet to visit, each with where it enters them. Kept from ray to ray.
pub type Pending = Vec<(f64, u32)>;

impl Double {
    /// The box of all primitives, rounded outwards.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Figures.
    pub fn stats(&self) -> BvhStats {
        self.stats
    }

    /// Whether it is more than a list.
    pub fn is_tree(&self) -> bool {
        self.stats.quality.is_some()
    }

    /// Bytes of a node, and of a primitive.
    pub fn row_bytes() -> [usize; 2] {
        [size_of::<Node>(), size_of::<Primitive>()]
    }

    /// The boxes of one level, as [`super::Bvh4::boxes_at_depth`].
    pub fn boxes_at_depth(&self, depth: u32) -> Vec<Aabb> {
        let mut level: Vec<usize> = (0..self.nodes.len().min(1)).collect();
        for _ in 0..depth {
            let inner = level.into_iter().filter(|&node| self.nodes[node].count == 0);
            level = inner.flat_map(|node| [node + 1, node + self.nodes[node].first as usize]).collect();
        }
        level.into_iter().map(|node| build::rounded(self.nodes[node].min, self.nodes[node].max)).collect()
    }

    /// The closest hit of each ray. Counts rays, and what was visited if `count`.
    pub fn closest_hits(&self, rays: RayColumns<'_>, hits: HitColumnsMut<'_>, count: bool) -> TraversalCounts {
        let rays = rays.trimmed();
        let mut hits = hits.trimmed(rays.len());
        self.all::<false>(rays, count, |row, hit| hits.set(row, hit))
    }

    /// Whether each ray hits anything. Counts rays, and what was visited if `count`.
    pub fn any_hits(&self, rays: RayColumns<'_>, occluded: &mut [bool], count: bool) -> TraversalCounts {
        let rays = rays.trimmed();
        let occluded = &mut occluded[..rays.len()];
        self.all::<true>(rays, count, |row, hit| occluded[row] = hit.is_some())
    }

    fn all<const ANY: bool>(
        &self,
        rays: RayColumns<'_>,
        count: bool,
        mut finish: impl FnMut(usize, Hit),
    ) -> TraversalCounts {
        let mut pending = Pending::new();
        let mut counts = TraversalCounts::default();
        for row in 0..rays.len() {
            finish(row, self.hit::<ANY>(&rays.ray(row), &mut pending, &mut counts));
        }
        let visited = if count { counts } else { TraversalCounts::default() };
        TraversalCounts { rays: rays.len() as u64, ..visited }
    }

    /// The closest hit of a ray; with `ANY`, any hit, of which only that there is one means something.
    pub fn hit<const ANY: bool>(&self, ray: &Ray, pending: &mut Pending, counts: &mut TraversalCounts) -> Hit {
        pending.clear();
        if !ray.is_traceable() || self.nodes.is_empty() {
            return Hit::NONE;
        }
        let line = Line::new(ray);
        let mut closest = Closest::new(ray);
        pending.push((0.0, 0));
        while let Some((entry, index)) = pending.pop() {
            // Equal distances may still win by primitive, so they are visited.
            if entry > closest.t {
                continue;
            }
            let node = &self.nodes[index as usize];
            if node.count == 0 {
                counts.node_visits += 1;
                let children = [index + 1, index + node.first];
                let [near, far] = children.map(|child| line.enter(&self.nodes[child as usize], closest.t));
                match (near, far) {
                    (Some(a), Some(b)) if b < a => pending.extend([(a, children[0]), (b, children[1])]),
                    (Some(a), Some(b)) => pending.extend([(b, children[1]), (a, children[0])]),
                    (Some(a), None) => pending.push((a, children[0])),
                    (None, Some(b)) => pending.push((b, children[1])),
                    (None, None) => {}
                }
                continue;
            }
            counts.leaf_visits += 1;
            counts.primitive_tests += u64::from(node.count);
            for primitive in &self.primitives[node.first as usize..][..node.count as usize] {
                line.test(primitive, &mut closest);
            }
            if ANY && closest.prim != MISS {
                break;
            }
        }
        closest.hit()
    }
}

/// A ray as the tests need it.
struct Line {
    origin: DVec3,
    direction: DVec3,
    /// Reciprocal of the direction, finite.
    scale: DVec3,
    sheared: Sheared,
    t_min: f64,
}

impl Line {
    fn new(ray: &Ray) -> Line {
        let origin = ray.origin.as_dvec3() + ray.low.as_dvec3();
        let direction = ray.direction.as_dvec3();
        let magnitude = direction.abs();
        let magnitude = magnitude.max(DVec3::splat(magnitude.max_element() * STEEPEST));
        Line {
            origin,
            direction,
            scale: magnitude.recip().copysign(direction),
            sheared: Sheared::new(origin, direction),
            t_min: f64::from(ray.t_min.max(0.0)),
        }
    }

    /// Where the ray enters a box, if it does before `t_max`. The argument stands in [`super::traverse::slab`].
    #[inline(always)]
    fn enter(&self, node: &Node, t_max: f64) -> Option<f64> {
        let (low, high) = ((node.min - self.origin) * self.scale, (node.max - self.origin) * self.scale);
        let entry = low.min(high).max_element().max(self.t_min) * (1.0 - SLACK);
        let exit = low.max(high).min_element().min(t_max);
        (entry <= exit).then_some(entry)
    }

    /// Offers what the ray hits of a primitive.
    #[inline(always)]
    fn test(&self, primitive: &Primitive, closest: &mut Closest) {
        let crossing = match primitive.shape {
            Shape::Triangle(corners) => triangle::cross(&self.sheared, corners),
            Shape::Sphere { center, radius } => sphere::roots(self.origin - center, self.direction, radius)
                .and_then(|roots| sphere::first(roots, self.t_min, closest.t))
                .map(|t| Crossing { t, u: 0.0, v: 0.0 }),
        };
        if let Some(crossing) = crossing {
            closest.offer(crossing, primitive, self.t_min);
        }
    }
}

/// The closest hit so far, by the rule of [`super::closest`], its distance in `f64`.
struct Closest {
    t: f64,
    u: f64,
    v: f64,
    prim: u32,
    geom: u32,
}

impl Closest {
    fn new(ray: &Ray) -> Closest {
        Closest { t: f64::from(ray.t_max.min(f32::MAX)), u: 0.0, v: 0.0, prim: MISS, geom: MISS }
    }

    #[inline(always)]
    fn offer(&mut self, Crossing { t, u, v }: Crossing, &Primitive { prim, geom, .. }: &Primitive, t_min: f64) {
        if t > t_min && (t < self.t || (t == self.t && prim < self.prim)) {
            *self = Closest { t, u, v, prim, geom };
        }
    }

    fn hit(&self) -> Hit {
        match self.prim {
            MISS => Hit::NONE,
            prim => Hit { t: self.t as f32, u: self.u as f32, v: self.v as f32, prim, geom: self.geom },
        }
    }
}

#[cfg(test)]
mod tests;
