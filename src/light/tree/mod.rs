//! A tree of emitters: picks one in proportion to a bound of the light that it sends to a point.
//!
//! Conty Estevez & Kulla, *Importance Sampling of Many Lights with Adaptive Tree Splitting*, 2018; with the importance of Pharr, Jakob &
//! Humphreys, *Physically Based Rendering* (4th ed.), §12.6.3. Here nodes have four children, whose importance is computed four at a time.
//! An emitter is a part of a light: a parallelogram, a sphere, or one triangle of a mesh.

mod bounds;
mod build;

use super::shape::LightShape;
use super::{Light, luminance};
use crate::sampling::lanes::{Lanes, V3};
use bounds::LightBounds;
use build::{Binary, Item};
use glam::{Vec3, Vec4};
use std::f32::consts::PI;
use std::fmt;

/// Up to four groups of emitters, one a lane. Places are in units of the radius of all emitters, from their middle.
#[derive(Clone, Copy)]
struct Node {
    center: V3<Vec4>,
    /// Square of the radius of the bounding sphere.
    radius2: Vec4,
    axis: V3<Vec4>,
    cos: Vec4,
    sin: Vec4,
    /// Share of the power; 0 in lanes without a group.
    power: Vec4,
    /// The node that opens the group, or `EMITTER` and the emitter.
    link: [u32; 4],
}

/// The bit of a link that leads to an emitter.
const EMITTER: u32 = 1 << 31;

/// No place in the tree.
const NOWHERE: u32 = u32::MAX;

/// The tree.
#[derive(Clone)]
pub struct LightTree {
    nodes: Vec<Node>,
    /// Where each node hangs: four times its parent, and the lane.
    parents: Vec<u32>,
    /// Where each emitter hangs; `NOWHERE` if it emits nothing.
    places: Vec<u32>,
    /// Light and part of each emitter.
    emitters: Vec<[u32; 2]>,
    /// First emitter of each light.
    first: Vec<u32>,
    center: Vec3,
    scale: f32,
}

/// What the tree picks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Picked {
    /// Number of the light.
    pub light: usize,
    /// Which part of it.
    pub part: u32,
    /// Probability.
    pub probability: f32,
}

impl LightTree {
    /// The tree of all parts of `lights` that emit.
    pub fn new(lights: &[Light]) -> LightTree {
        let emitters: Vec<[u32; 2]> =
            lights.iter().enumerate().flat_map(|(i, l)| (0..l.parts()).map(move |part| [i as u32, part])).collect();
        let first = lights.iter().scan(0, |next, light| Some(std::mem::replace(next, *next + light.parts())));
        let total: f64 = lights.iter().map(|light| f64::from(light.power())).sum();
        let mut items: Vec<Item> = emitters
            .iter()
            .enumerate()
            .map(|(i, &[light, part])| Item {
                bounds: bounds_of(&lights[light as usize], part, total),
                emitter: i as u32,
            })
            .filter(|item| item.bounds.power > 0.0)
            .collect();
        let mut tree = LightTree {
            nodes: Vec::new(),
            parents: Vec::new(),
            places: vec![NOWHERE; emitters.len()],
            first: first.collect(),
            emitters,
            center: Vec3::ZERO,
            scale: 1.0,
        };
        if items.is_empty() {
            return tree;
        }
        let root = build::binary(&mut items, 0);
        drop(items);
        tree.center = root.bounds().center();
        tree.scale = 1.0 / root.bounds().radius().max(f32::MIN_POSITIVE);
        match root {
            Binary::Inner(_, children) => tree.add(Binary::open(*children), NOWHERE),
            leaf => tree.add(vec![leaf], NOWHERE),
        };
        tree
    }

    /// Adds a node and all below it; returns its number.
    fn add(&mut self, groups: Vec<Binary>, parent: u32) -> u32 {
        let number = self.nodes.len() as u32;
        self.nodes.push(Node::new(groups.iter().map(Binary::bounds), self.center, self.scale));
        self.parents.push(parent);
        for (lane, group) in groups.into_iter().enumerate() {
            let place = 4 * number + lane as u32;
            let link = match group {
                Binary::Inner(_, children) => self.add(Binary::open(*children), place),
                Binary::Leaf(item) => {
                    self.places[item.emitter as usize] = place;
                    EMITTER | item.emitter
                }
            };
            self.nodes[number as usize].link[lane] = link;
        }
        number
    }

    /// Emitters of all lights.
    pub fn emitters(&self) -> usize {
        self.emitters.len()
    }

    /// Bytes it takes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..])
            + size_of_val(&self.parents[..])
            + size_of_val(&self.places[..])
            + size_of_val(&self.emitters[..])
            + size_of_val(&self.first[..])
    }

    /// Picks an emitter for a point `from` of a surface with unit `normal`; `None` where no light can come from any of them. One
    /// number in [0, 1) is enough: what a choice leaves of it serves the next. It has to have more digits than a
    /// level uses up, hence double precision.
    #[inline(always)]
    pub fn pick(&self, from: V3<f32>, normal: V3<f32>, mut u: f64) -> Option<Picked> {
        let (at, normal) = self.seen(from, normal);
        let mut node = self.nodes.first()?;
        let mut probability = 1.0;
        loop {
            let weights = node.importance(at, normal).to_array();
            let two = weights[0] + weights[1];
            let sums = [weights[0], two, two + weights[2], two + weights[2] + weights[3]];
            let total = sums[3];
            if !(total > 0.0 && total.is_finite()) {
                return None;
            }
            let target = u * f64::from(total);
            let lane = usize::from(target >= f64::from(sums[0]))
                + usize::from(target >= f64::from(sums[1]))
                + usize::from(target >= f64::from(sums[2]));
            let below = if lane == 0 { 0.0 } else { f64::from(sums[lane - 1]) };
            u = ((target - below) / (f64::from(sums[lane]) - below)).min(1.0 - f64::EPSILON);
            probability *= weights[lane] / total;
            let link = node.link[lane];
            if link & EMITTER != 0 {
                let [light, part] = self.emitters[(link & !EMITTER) as usize];
                return Some(Picked { light: light as usize, part, probability });
            }
            node = &self.nodes[link as usize];
        }
    }

    /// The probability with which [`LightTree::pick`] picks a part of a light.
    #[inline(always)]
    pub fn probability(&self, light: usize, part: u32, from: V3<f32>, normal: V3<f32>) -> f32 {
        let (at, normal) = self.seen(from, normal);
        let mut place = self.places[(self.first[light] + part) as usize];
        let mut probability = if place == NOWHERE { 0.0 } else { 1.0 };
        while place != NOWHERE && probability > 0.0 {
            let (node, lane) = ((place / 4) as usize, (place % 4) as usize);
            let weights = self.nodes[node].importance(at, normal).to_array();
            let total = weights[0] + weights[1] + weights[2] + weights[3];
            probability *= if total > 0.0 && total.is_finite() { weights[lane] / total } else { 0.0 };
            place = self.parents[node];
        }
        probability
    }

    /// A point and a normal, as nodes are tested with.
    #[inline(always)]
    fn seen(&self, from: V3<f32>, normal: V3<f32>) -> (V3<Vec4>, V3<Vec4>) {
        let at = (from - self.center.into()) * self.scale;
        (V3::splat(at.into()), V3::splat(normal.into()))
    }
}

impl fmt::Debug for LightTree {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "LightTree of {} emitters in {} nodes", self.emitters.len(), self.nodes.len())
    }
}

impl Node {
    fn new<'a>(groups: impl Iterator<Item = &'a LightBounds>, middle: Vec3, scale: f32) -> Node {
        let mut lanes = [[0.0f32; 10]; 4];
        for (lane, group) in lanes.iter_mut().zip(groups) {
            let center = (group.center() - middle) * scale;
            // A little more, so that rounding excludes nothing.
            let radius = group.radius() * scale * 1.0001 + 1e-6;
            let (sin, cos) = crate::sampling::angle::sin_cos((group.angle + 1e-4).min(PI));
            let Vec3 { x, y, z } = group.axis;
            *lane = [center.x, center.y, center.z, radius * radius, x, y, z, cos, sin, group.power];
        }
        let of = |field: usize| Vec4::from_array(lanes.map(|lane| lane[field]));
        Node {
            center: V3::new(of(0), of(1), of(2)),
            radius2: of(3),
            axis: V3::new(of(4), of(5), of(6)),
            cos: of(7),
            sin: of(8),
            power: of(9),
            link: [NOWHERE; 4],
        }
    }

    /// Power over squared distance, times bounds of the cosines at the light and at the surface; 0 only where nothing arrives.
    #[inline(always)]
    fn importance(&self, at: V3<Vec4>, normal: V3<Vec4>) -> Vec4 {
        let (zero, one) = (Vec4::ZERO, Vec4::ONE);
        let way = at - self.center;
        let squared = way.dot(way);
        let away = way * (one / Lanes::sqrt(Lanes::max(squared, Vec4::splat(f32::MIN_POSITIVE))));
        // The angle that the bounding sphere fills; from inside, all.
        let sin2 = self.radius2 / squared;
        let outside = Lanes::lt(sin2, one);
        let fill = [
            Lanes::select(outside, Lanes::sqrt(sin2), zero),
            Lanes::select(outside, Lanes::sqrt(Lanes::max(one - sin2, zero)), -one),
        ];
        let cos_light = away.dot(self.axis);
        let [_, cos_light] = less(less([root(cos_light), cos_light], [self.sin, self.cos]), fill);
        let cos_surface = -away.dot(normal);
        let [_, cos_surface] = less([root(cos_surface), cos_surface], fill);
        let bound = Lanes::max(cos_light, zero) * Lanes::max(cos_surface, zero);
        self.power * bound / Lanes::max(squared, self.radius2)
    }
}

/// √(1 − x²).
#[inline(always)]
fn root(x: Vec4) -> Vec4 {
    Lanes::sqrt(Lanes::max(Vec4::ONE - x * x, Vec4::ZERO))
}

/// Sine and cosine of a − b, or of 0 where b is the larger; both from 0 to π.
#[inline(always)]
fn less([sin_a, cos_a]: [Vec4; 2], [sin_b, cos_b]: [Vec4; 2]) -> [Vec4; 2] {
    let larger = Lanes::gt(cos_a, cos_b);
    let sin = Lanes::select(larger, Vec4::ZERO, sin_a * cos_b - cos_a * sin_b);
    let cos = Lanes::select(larger, Vec4::ONE, cos_a * cos_b + sin_a * sin_b);
    [sin, cos]
}

/// Bounds of one emitter, its power as a share of `total`.
fn bounds_of(light: &Light, part: u32, total: f64) -> LightBounds {
    let box_of = |points: &[Vec3]| {
        points.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &p| (low.min(p), high.max(p)))
    };
    let ((low, high), axis, angle, area) = match &light.shape {
        LightShape::Parallelogram(p) => {
            let opposite = p.corner + p.side_u + p.side_v;
            let corners = [p.corner, p.corner + p.side_u, p.corner + p.side_v, opposite];
            (box_of(&corners), p.normal, 0.0, p.area)
        }
        LightShape::Mesh(mesh) => {
            let triangle = &mesh.triangles[part as usize];
            (box_of(&triangle.corners), triangle.normal, 0.0, triangle.area)
        }
        LightShape::Sphere(s) => ((s.center - s.radius, s.center + s.radius), Vec3::Z, PI, light.area()),
    };
    let power = f64::from(area) * f64::from(luminance(light.radiance)) / total;
    LightBounds { low, high, axis, angle, power: if power.is_finite() { power as f32 } else { 0.0 } }
}
