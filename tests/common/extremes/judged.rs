//! The grid of loose triangles and spheres: every ray judged by every primitive, exactly.

use super::oracle::{self, Crossing, bound};
use super::scenes::{Case, Place, aimed, place};
use super::subjects::{self, Subject};
use super::tally::{Row, Tally};
use crate::common::rays::Random;
use comber::bvh::ray::{Hit, Ray};
use comber::peer::embree::library::Device;
use comber::sampling::v3::V3;
use comber::scene::Scene;
use comber::scene::origin::Origin;
use comber::scene::surface::SurfacePoint;
use comber::transport;
use glam::Vec3;
use std::sync::Arc;

/// Rays of a batch.
const BATCH: usize = 512;
/// Largest coordinate of a ray's origin: comber is good up to about 10¹⁸, and Embree's assertions end the process beyond 1.8 · 10¹⁸.
const LARGEST: f32 = 1e18;

/// A cell of the grid: about `count` rays by all subjects that can be asked.
pub fn cell(case: &Case, at: Place, count: u64, seed: u64, embree: Option<&Arc<Device>>) -> Vec<Row> {
    let mut random = Random(seed);
    let scene = Scene { shapes: place(case, at, &mut random), ..Scene::default() };
    let shapes = &scene.shapes;
    let subjects = subjects::all(shapes, at, embree);
    let mut tallies = vec![Tally::default(); subjects.len()];
    // Not the same kernels first in every cell.
    let first = (seed >> 40) as usize;
    for turn in first..first + count.div_ceil(BATCH as u64) as usize {
        let mut rays = Vec::new();
        // Where f32 has hardly any points left, origins and targets coincide often.
        for _ in 0..4 * BATCH {
            if rays.len() < BATCH
                && let Some(ray) = aimed(shapes, case.aim, at, &mut random).filter(Ray::is_traceable)
                && ray.origin.abs().max_element() <= LARGEST
            {
                rays.push(ray);
            }
        }
        if rays.is_empty() {
            break;
        }
        judge(&scene, &subjects, &rays, turn, &mut random, &mut tallies);
    }
    let row = |(subject, tally): (&Subject, Tally)| Row {
        case: case.name,
        scale: at.scale,
        distance: at.distance,
        fine: at.fine,
        subject: subject.number(),
        walk: false,
        tally,
    };
    subjects.iter().zip(tallies).map(row).collect()
}

/// Traces a batch by all subjects, and rays that leave what it hit.
pub fn judge(
    scene: &Scene,
    subjects: &[Subject],
    rays: &[Ray],
    turn: usize,
    random: &mut Random,
    tallies: &mut [Tally],
) {
    let shapes = &scene.shapes;
    let mut truth: Vec<Vec<Crossing>> = vec![Vec::new(); rays.len()];
    for (ray, crossings) in rays.iter().zip(&mut truth) {
        oracle::crossings(ray, shapes, crossings);
    }
    for (subject, tally) in subjects.iter().zip(tallies) {
        let hits = subject.closest(rays, shapes, turn);
        let occluded = subject.any(rays, turn);
        let told = |what: &str, ray: &Ray, hit: &Hit| format!("{what}: {}: {ray:?} {hit:?}", subject.kernel(turn));
        tally.rays += rays.len() as u64;
        tally.traced += 2 * rays.len() as u64;
        let mut leaving = Vec::new();
        let mut left = Vec::new();
        for (row, hit) in hits.iter().enumerate() {
            let (ray, truth) = (&rays[row], &truth[row]);
            let seen = if hit.is_some() { f64::from(hit.t) } else { f64::INFINITY };
            let missed = |c: &Crossing| c.certain && seen > c.t + 2.0 * c.slack;
            if truth.iter().any(missed) || (!occluded[row] && truth.iter().any(|c| c.certain)) {
                tally.misses += 1;
                tally.fail(|| format!("{} {truth:?}", told("miss", ray, hit)));
            } else if !hit.is_some() && !truth.is_empty() {
                tally.grazed += 1;
            }
            // Occlusion is false where the closest hit is, or where there is none at all and nothing near.
            let near = |prim: u32| oracle::passes(ray, shapes, prim) <= bound(ray, shapes, prim);
            let lie = hit.is_some() && !oracle::truthful(ray, hit.t, shapes, hit.prim);
            let shade = occluded[row] && !hit.is_some() && truth.is_empty();
            if lie || (shade && !(0..shapes.prim_count() as u32).any(near)) {
                tally.false_hits += 1;
                let prim = hit.prim as usize;
                let corners = (prim < shapes.triangles.len()).then(|| shapes.corners_in_double(hit.prim));
                tally.fail(|| format!("{} {truth:?} {corners:?}", told("false hit", ray, hit)));
            } else if hit.is_some() {
                let point = leave(scene, subject.starts(ray), ray, hit);
                if !Vec3::from(point.geometric).is_finite() {
                    tally.left += 1;
                    tally.self_hits += 1;
                    tally.fail(|| told("no normal", ray, hit));
                } else if let Some(ray) = departing(&point, random) {
                    leaving.push(ray);
                    left.push((*hit, oracle::side_of_start(&rays[row], shapes, hit.prim)));
                }
            }
        }
        if leaving.is_empty() {
            continue;
        }
        tally.left += left.len() as u64;
        for ((ray, again), (from, side)) in leaving.iter().zip(subject.closest(&leaving, shapes, turn)).zip(&left) {
            if again.prim == from.prim && !oracle::returns(ray, &again, shapes, *side) {
                tally.self_hits += 1;
                tally.fail(|| format!("{} from {from:?}", told("self-hit", ray, &again)));
            }
        }
    }
}

/// Where rays leave a hit, as the renderer has it for rays that start like this.
pub fn leave(scene: &Scene, from: Origin, ray: &Ray, hit: &Hit) -> SurfacePoint<Origin> {
    transport::surface_at(scene, hit, from, ray.direction.into())
}

/// A ray that leaves a surface: one in four 89.9999° from the normal, the others anyhow.
pub fn departing(point: &SurfacePoint<Origin>, random: &mut Random) -> Option<Ray> {
    let normal = Vec3::from(point.geometric);
    let normal = normal.as_dvec3();
    let mut direction = random.vector().as_dvec3().try_normalize()?;
    if random.below(4) == 0 {
        let rise = std::f64::consts::FRAC_PI_2 - 89.9999f64.to_radians();
        direction = normal.cross(direction).try_normalize()? + normal * rise;
    } else if direction.dot(normal) < 0.0 {
        direction = -direction;
    }
    let direction = direction.as_vec3();
    // As the renderer has it: what rounding has put below the horizon does not leave.
    let leaves = V3::from(direction).dot(point.geometric) > 0.0;
    leaves.then(|| Ray::leaving(point.origin, direction.into())).filter(Ray::is_traceable)
}
