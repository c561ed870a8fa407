//! The leaf block of spheres.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::ray::MISS;
use crate::scene::shapes::Sphere;

/// Four spheres, as structure of arrays.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(32))]
pub struct Sphere4 {
    /// Centres: the axis, then the sphere. Unused lanes are NaN, which no test lets through.
    pub center: [[f32; 4]; 3],
    /// Radii.
    pub radius: [f32; 4],
    /// Primitives; [`MISS`] in unused lanes.
    pub prim: [u32; 4],
    /// Geometries; [`MISS`] in unused lanes.
    pub geom: [u32; 4],
}

const _: () = assert!(size_of::<Sphere4>() == 96);

impl Sphere4 {
    /// No sphere.
    pub const EMPTY: Sphere4 =
        Sphere4 { center: [[f32::NAN; 4]; 3], radius: [f32::NAN; 4], prim: [MISS; 4], geom: [MISS; 4] };

    /// The centre in one lane.
    #[inline(always)]
    pub fn center(&self, lane: usize) -> Vec3 {
        Vec3::new(self.center[0][lane], self.center[1][lane], self.center[2][lane])
    }

    /// Fills one lane.
    pub fn set(&mut self, lane: usize, sphere: &Sphere, prim: u32, geom: u32) {
        for (axis, row) in self.center.iter_mut().enumerate() {
            row[lane] = sphere.center[axis];
        }
        self.radius[lane] = sphere.radius;
        self.prim[lane] = prim;
        self.geom[lane] = geom;
    }
}
