//! Testing every primitive: the oracle for the BVH, and a show of what it gains.

use glam::Vec3;

use super::aabb::Aabb;
use super::closest::Closest;
use super::columns::TraversalCounts;
use super::ray::{Hit, Ray};
use super::watertight::ShearedRay;
use super::{moller_trumbore, sphere, watertight};
use crate::options::Intersection;
use crate::scene::shapes::{Shapes, Sphere};

/// All primitives, in order.
#[derive(Clone, Debug)]
pub struct Brute {
    triangles: Vec<[Vec3; 3]>,
    spheres: Vec<Sphere>,
    /// The geometry of each primitive.
    geometries: Vec<u32>,
    bounds: Aabb,
    intersection: Intersection,
}

impl Brute {
    /// Copies the primitives.
    pub fn build(shapes: &Shapes, intersection: Intersection) -> Brute {
        let triangles: Vec<_> = (0..shapes.triangles.len() as u32).map(|prim| shapes.corners(prim)).collect();
        let bounds = triangles.iter().map(|&corners| Aabb::around(corners));
        let bounds = bounds.chain(shapes.spheres.iter().map(Aabb::of_sphere)).fold(Aabb::EMPTY, Aabb::union);
        Brute {
            triangles,
            spheres: shapes.spheres.clone(),
            geometries: (0..shapes.prim_count() as u32).map(|prim| shapes.geometry_of(prim)).collect(),
            bounds,
            intersection,
        }
    }

    /// The box of all primitives.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// The triangle test.
    pub fn intersection(&self) -> Intersection {
        self.intersection
    }

    /// How many primitives.
    pub fn prim_count(&self) -> usize {
        self.geometries.len()
    }

    /// Memory of the tables.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.triangles[..]) + size_of_val(&self.spheres[..]) + size_of_val(&self.geometries[..])
    }

    /// The closest hit.
    pub fn closest_hit(&self, ray: &Ray, counts: &mut TraversalCounts) -> Hit {
        counts.rays += 1;
        if !ray.is_traceable() {
            return Hit::NONE;
        }
        counts.primitive_tests += self.geometries.len() as u64;
        let mut closest = Closest::new(ray);
        let sheared = ShearedRay::new(ray);
        for (prim, &corners) in self.triangles.iter().enumerate() {
            let crossing = match self.intersection {
                Intersection::Watertight => watertight::scalar(&sheared, corners),
                Intersection::Fast => moller_trumbore::scalar(ray.origin, ray.direction, corners),
            };
            if let Some(crossing) = crossing {
                closest.offer(Hit {
                    t: crossing.t,
                    u: crossing.u,
                    v: crossing.v,
                    prim: prim as u32,
                    geom: self.geometries[prim],
                });
            }
        }
        for (sphere, prim) in self.spheres.iter().zip(self.triangles.len()..) {
            if let Some(t) = sphere::intersect(ray, sphere.center, sphere.radius, closest.t_max()) {
                closest.offer(Hit { t, u: 0.0, v: 0.0, prim: prim as u32, geom: self.geometries[prim] });
            }
        }
        closest.hit()
    }

    /// Whether anything is hit.
    pub fn any_hit(&self, ray: &Ray, counts: &mut TraversalCounts) -> bool {
        self.closest_hit(ray, counts).is_some()
    }
}
