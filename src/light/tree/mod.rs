//! A tree of emitters: picks one in proportion to a bound of the light that it sends to a point.
//!
//! Conty Estevez & Kulla, *Importance Sampling of Many Lights with Adaptive Tree Splitting*, 2018; with the importance of Pharr, Jakob &
//! Humphreys, *Physically Based Rendering* (4th ed.), §12.6.3. Here nodes have four children, whose importance is computed at once (`node.rs`).
//! An emitter is a part of a light: a parallelogram, a sphere, or one triangle of a mesh.

mod bounds;
mod build;
mod node;

use super::shape::LightShape;
use super::{Light, luminance};
use crate::sampling::v3::V3;
use bounds::LightBounds;
use build::{Binary, Item};
use glam::Vec3;
use node::{Asking, Node};
use std::f32::consts::PI;
use std::fmt;

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
    pub fn pick(&self, from: V3, normal: V3, mut u: f64) -> Option<Picked> {
        let asking = self.asking(from, normal);
        let mut node = self.nodes.first()?;
        let mut probability = 1.0;
        loop {
            let weights = node.importance(&asking);
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
    pub fn probability(&self, light: usize, part: u32, from: V3, normal: V3) -> f32 {
        let asking = self.asking(from, normal);
        let mut place = self.places[(self.first[light] + part) as usize];
        let mut probability = if place == NOWHERE { 0.0 } else { 1.0 };
        while place != NOWHERE && probability > 0.0 {
            let (node, lane) = ((place / 4) as usize, (place % 4) as usize);
            let weights = self.nodes[node].importance(&asking);
            let total = weights[0] + weights[1] + weights[2] + weights[3];
            probability *= if total > 0.0 && total.is_finite() { weights[lane] / total } else { 0.0 };
            place = self.parents[node];
        }
        probability
    }

    /// A point and a normal, as nodes are tested with.
    #[inline(always)]
    fn asking(&self, from: V3, normal: V3) -> Asking {
        Asking::new((from - self.center.into()) * self.scale, normal)
    }
}

impl fmt::Debug for LightTree {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "LightTree of {} emitters in {} nodes", self.emitters.len(), self.nodes.len())
    }
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
