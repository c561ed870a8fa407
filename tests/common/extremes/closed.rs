//! Paths inside closed meshes: every ray must hit something, and never what it left.
//!
//! A ray that hits nothing is judged by the number of times that the mesh winds round its origin, which is cheap only because it is rare: if the
//! origin lies inside, farther from the surface than the bound, the mesh leaks.

use super::judged::{departing, leave};
use super::oracle::{self, BOUND, distance, truthful, winding};
use super::scenes::{Aim, Place, aimed, onwards, place_solid, target, towards};
use super::solids::Solid;
use super::subjects::{self, Subject};
use super::tally::{Row, Tally};
use crate::common::rays::Random;
use comber::bvh::ray::{Hit, MISS, Ray};
use comber::peer::embree::library::Device;
use comber::scene::Scene;
use comber::scene::origin::Origin;
use comber::scene::shapes::Shapes;
use glam::{DVec3, Vec3};
use std::sync::Arc;

/// Most paths that advance together.
const PATHS: u64 = 2048;
/// Steps that paths make at least, rather than being many.
const STEPS: u64 = 8;
/// Rays of a path before it starts anew, on average.
const LENGTH: usize = 16;
/// Batches between those that are asked for any hit as well.
const ANY: usize = 4;

/// About `count` rays of each subject that `choose` takes, by number.
pub fn cell(solid: &Solid, at: Place, count: u64, seed: u64, subjects: impl Fn(&Shapes) -> Vec<Subject>) -> Vec<Row> {
    let scene = Scene { shapes: place_solid(solid, at), ..Scene::default() };
    let shapes = &scene.shapes;
    let all = (0..shapes.triangles.len() as u32).flat_map(|prim| shapes.corners_in_double(prim));
    let (low, high) = all.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(a, b), p| (a.min(p), b.max(p)));
    let row = |subject: Subject| {
        let mut walk = Walk {
            solid,
            at,
            scene: &scene,
            low,
            high,
            random: Random(seed ^ (subject.number() as u64) << 56),
            tally: Tally::default(),
        };
        walk.run(&subject, count);
        Row {
            case: solid.name,
            scale: at.scale,
            distance: at.distance,
            fine: at.fine,
            subject: subject.number(),
            walk: false,
            tally: walk.tally,
        }
    };
    subjects(shapes).into_iter().map(row).collect()
}

/// All subjects that can be asked.
pub fn everyone(at: Place, embree: Option<&Arc<Device>>) -> impl Fn(&Shapes) -> Vec<Subject> {
    move |shapes| subjects::all(shapes, at, embree)
}

/// comber's watertight test, on nodes of both formats.
pub fn watertight(shapes: &Shapes) -> Vec<Subject> {
    [0, 1].into_iter().filter_map(|number| subjects::comber(shapes, number)).collect()
}

/// A ray of a path, what it left, and on which side.
#[derive(Clone, Copy)]
struct Path {
    ray: Ray,
    from: u32,
    side: i32,
}

struct Walk<'a> {
    solid: &'a Solid,
    at: Place,
    scene: &'a Scene,
    /// The box around the mesh.
    low: DVec3,
    high: DVec3,
    random: Random,
    tally: Tally,
}

impl Walk<'_> {
    fn run(&mut self, subject: &Subject, count: u64) {
        let mut paths: Vec<Path> = (0..PATHS.min(count.div_ceil(STEPS))).map(|_| self.start()).collect();
        // Not the same kernels first in every cell.
        let mut turn = self.random.below(1 << 16);
        while self.tally.rays < count {
            let rays: Vec<Ray> = paths.iter().map(|path| path.ray).collect();
            let hits = subject.closest(&rays, &self.scene.shapes, turn);
            self.tally.rays += paths.len() as u64;
            self.tally.traced += paths.len() as u64;
            if turn.is_multiple_of(ANY) {
                self.tally.traced += paths.len() as u64;
                for (hit, occluded) in hits.iter().zip(subject.any(&rays, turn / ANY)) {
                    self.tally.misses += u64::from(hit.is_some() && !occluded);
                }
            }
            for (path, hit) in paths.iter_mut().zip(&hits) {
                *path = self.settle(*path, hit, subject, turn);
            }
            turn += 1;
        }
    }

    /// Judges a ray, and gives the next of its path.
    fn settle(&mut self, Path { ray, from, side }: Path, hit: &Hit, subject: &Subject, turn: usize) -> Path {
        let (shapes, kernel) = (&self.scene.shapes, || subject.kernel(turn));
        self.tally.left += u64::from(from != MISS);
        if !hit.is_some() {
            self.nothing(&ray, from, kernel);
            return self.start();
        }
        if hit.prim == from && oracle::returns(&ray, hit, shapes, side) {
            return self.start();
        }
        let tally = &mut self.tally;
        if hit.prim == from {
            tally.self_hits += 1;
            tally.fail(|| format!("self-hit: {}: {ray:?} {hit:?}", kernel()));
            return self.start();
        }
        if !truthful(&ray, hit.t, shapes, hit.prim) {
            tally.false_hits += 1;
            tally.fail(|| format!("false hit: {}: {ray:?} {hit:?} {:?}", kernel(), shapes.corners_in_double(hit.prim)));
        }
        if self.random.below(LENGTH) == 0 {
            return self.start();
        }
        let point = leave(self.scene, subject.starts(&ray), &ray, hit);
        let normal = Vec3::from(point.geometric);
        let side = oracle::side_of_start(&ray, shapes, hit.prim);
        if self.random.below(3) == 0 {
            // On to a vertex or an edge, exactly as rounded.
            let aim = [Aim::Vertex, Aim::Edge, Aim::Interior][self.random.below(3)];
            let corners = shapes.corners_in_double(self.random.below(shapes.triangles.len()) as u32);
            let next = onwards(point.origin, target(corners, aim, &mut self.random));
            if let Some(next) = next.filter(|ray| ray.direction.dot(normal) > 0.0 && ray.is_traceable()) {
                return Path { ray: next, from: hit.prim, side };
            }
        }
        match departing(&point, &mut self.random) {
            Some(next) => Path { ray: next, from: hit.prim, side },
            None => self.start(),
        }
    }

    /// A ray that hit nothing: a miss, unless its origin is not inside.
    fn nothing(&mut self, ray: &Ray, from: u32, kernel: impl Fn() -> String) {
        let (origin, shapes) = (oracle::origin(ray), &self.scene.shapes);
        // Most that are outside are so beyond the box.
        let boxed = (origin.cmpgt(self.low) & origin.cmplt(self.high)).all();
        let winding = if boxed { winding(origin, shapes) } else { 0.0 };
        // Fine positions are nowhere as coarse as single precision makes them: the size of the mesh counts alone.
        let reach = if self.at.fine { self.at.scale } else { self.at.scale.max(origin.abs().element_sum()) };
        let near = |prim: u32| distance(origin, shapes.corners_in_double(prim)) <= BOUND * reach;
        // Not a number where the origin lies on the surface.
        let inside = winding.abs() > 0.5;
        if !inside {
            self.tally.outside += 1;
        } else if (0..shapes.triangles.len() as u32).any(near) {
            self.tally.grazed += 1;
        } else {
            self.tally.misses += 1;
            self.tally.fail(|| format!("miss: {}: {ray:?} from {from}, winding {winding}", kernel()));
        }
    }

    /// A ray from inside: anywhere, at a vertex, at an edge, or along an axis.
    fn start(&mut self) -> Path {
        let shapes = &self.scene.shapes;
        loop {
            let origin = self.at.put(self.solid.inside(&mut self.random));
            let ray = match self.random.below(6) {
                0 => towards(self.at, origin, origin + self.random.vector().as_dvec3() * self.at.scale),
                1 => aimed(shapes, Aim::Axes, self.at, &mut self.random)
                    .map(|ray| Ray::leaving(Origin::double(self.at.round(origin)), ray.direction.into())),
                kind => {
                    let aim = [Aim::Vertex, Aim::Edge, Aim::Edge, Aim::Interior][kind - 2];
                    let corners = shapes.corners_in_double(self.random.below(shapes.triangles.len()) as u32);
                    towards(self.at, origin, target(corners, aim, &mut self.random))
                }
            };
            if let Some(ray) = ray.filter(Ray::is_traceable) {
                return Path { ray, from: MISS, side: 0 };
            }
        }
    }
}
