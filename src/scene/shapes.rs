//! Everything a ray can hit, as component tables.
//!
//! A *primitive* is a triangle or a sphere, known by one number: triangles are `0..triangles.len()`, spheres
//! follow. A *geometry* is a run of primitives that share a material; its number is what hit records carry.

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};

/// A sphere.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Sphere {
    /// Centre, world space.
    pub center: Vec3,
    /// Radius, above 0.
    pub radius: f32,
}

/// A sphere in double precision.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SphereInDouble {
    /// Centre, world space.
    pub center: DVec3,
    /// Radius, above 0.
    pub radius: f64,
}

/// A run of primitives with one material.
#[derive(Clone, Debug, PartialEq)]
pub struct Geometry {
    /// For messages and reports.
    pub name: String,
    /// First primitive.
    pub first_prim: u32,
    /// How many primitives.
    pub prim_count: u32,
    /// Index into the scene's materials.
    pub material: u32,
    /// Index into the scene's lights, or [`NO_LIGHT`].
    pub light: u32,
}

/// The `light` of a geometry that does not emit.
pub const NO_LIGHT: u32 = u32::MAX;

/// The tables.
#[derive(Clone, Debug, Default)]
pub struct Shapes {
    /// Vertex positions, world space.
    pub positions: Vec<Vec3>,
    /// Unit vertex normals, one a position; empty when the scene is shaded flat. A zero normal means "flat here".
    pub normals: Vec<Vec3>,
    /// Vertex indices of each triangle; counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Spheres.
    pub spheres: Vec<Sphere>,
    /// The positions in double precision, if any of them is not exact in single precision and that was asked for; else empty.
    pub double: Vec<DVec3>,
    /// The spheres in double precision, as [`Shapes::double`].
    pub spheres_double: Vec<SphereInDouble>,
    /// Runs of primitives, ascending by `first_prim`, without gaps.
    pub geometries: Vec<Geometry>,
}

impl Shapes {
    /// Number of primitives of both kinds.
    pub fn prim_count(&self) -> usize {
        self.triangles.len() + self.spheres.len()
    }

    /// The three corners of triangle `prim`.
    #[inline(always)]
    pub fn corners(&self, prim: u32) -> [Vec3; 3] {
        self.triangles[prim as usize].map(|i| self.positions[i as usize])
    }

    /// The three corners of triangle `prim`, as exactly as they are known.
    #[inline(always)]
    pub fn corners_in_double(&self, prim: u32) -> [DVec3; 3] {
        let vertices = self.triangles[prim as usize].map(|i| i as usize);
        match self.double.is_empty() {
            true => vertices.map(|i| self.positions[i].as_dvec3()),
            false => vertices.map(|i| self.double[i]),
        }
    }

    /// Centre and radius of a sphere by its number among spheres, as exactly as they are known.
    #[inline(always)]
    pub fn sphere_in_double(&self, number: usize) -> (DVec3, f64) {
        match self.spheres_double.get(number) {
            Some(sphere) => (sphere.center, sphere.radius),
            None => (self.spheres[number].center.as_dvec3(), self.spheres[number].radius.into()),
        }
    }

    /// The geometry that primitive `prim` belongs to.
    #[inline]
    pub fn geometry_of(&self, prim: u32) -> u32 {
        (self.geometries.partition_point(|g| g.first_prim <= prim) - 1) as u32
    }
}
