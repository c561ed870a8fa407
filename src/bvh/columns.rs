//! Batches of rays and hits, as columns, and what a batch counts.

use glam::Vec3;
use serde::Serialize;
use std::ops::Range;

use super::ray::{Hit, Ray};
use crate::measure::lanes::Lanes;

/// What is asked of rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Query {
    /// The closest hit.
    Closest,
    /// Whether there is any hit.
    Any,
}

/// Rays, one a row. All columns have the same length.
#[derive(Clone, Copy, Debug)]
pub struct RayColumns<'a> {
    /// Origin, x.
    pub ox: &'a [f32],
    /// Origin, y.
    pub oy: &'a [f32],
    /// Origin, z.
    pub oz: &'a [f32],
    /// Direction, x.
    pub dx: &'a [f32],
    /// Direction, y.
    pub dy: &'a [f32],
    /// Direction, z.
    pub dz: &'a [f32],
    /// Nearest `t` that does not count yet; `None`: 0 for all rays.
    pub t_min: Option<&'a [f32]>,
    /// Farthest `t` that counts; `None`: infinite for all rays.
    pub t_max: Option<&'a [f32]>,
    /// What single precision leaves of the origins; `None`: nothing. Only the tree in double precision looks at it.
    pub low: Option<[&'a [f32]; 3]>,
}

impl<'a> RayColumns<'a> {
    /// How many rays.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.ox.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.ox.is_empty()
    }

    /// The same columns, each cut to the common length once, so that the rows below it need no checks.
    ///
    /// # Panics
    /// If a column is shorter than `ox`.
    #[inline(always)]
    pub(super) fn trimmed(self) -> RayColumns<'a> {
        let n = self.len();
        RayColumns {
            ox: &self.ox[..n],
            oy: &self.oy[..n],
            oz: &self.oz[..n],
            dx: &self.dx[..n],
            dy: &self.dy[..n],
            dz: &self.dz[..n],
            t_min: self.t_min.map(|t| &t[..n]),
            t_max: self.t_max.map(|t| &t[..n]),
            low: self.low.map(|low| low.map(|axis| &axis[..n])),
        }
    }

    /// Some of the rows.
    pub fn rows(self, rows: Range<usize>) -> RayColumns<'a> {
        RayColumns {
            ox: &self.ox[rows.clone()],
            oy: &self.oy[rows.clone()],
            oz: &self.oz[rows.clone()],
            dx: &self.dx[rows.clone()],
            dy: &self.dy[rows.clone()],
            dz: &self.dz[rows.clone()],
            t_min: self.t_min.map(|t| &t[rows.clone()]),
            t_max: self.t_max.map(|t| &t[rows.clone()]),
            low: self.low.map(|low| low.map(|axis| &axis[rows.clone()])),
        }
    }

    /// One row.
    #[inline(always)]
    pub fn ray(&self, row: usize) -> Ray {
        Ray {
            origin: Vec3::new(self.ox[row], self.oy[row], self.oz[row]),
            direction: Vec3::new(self.dx[row], self.dy[row], self.dz[row]),
            t_min: self.t_min.map_or(0.0, |t| t[row]),
            t_max: self.t_max.map_or(f32::INFINITY, |t| t[row]),
            low: self.low.map_or(Vec3::ZERO, |[x, y, z]| Vec3::new(x[row], y[row], z[row])),
        }
    }
}

/// Closest hits, one a row: the columns of [`Hit`].
#[derive(Debug)]
pub struct HitColumnsMut<'a> {
    /// Distance in units of the ray's direction; infinite for a miss.
    pub t: &'a mut [f32],
    /// Barycentric weight of the second corner.
    pub u: &'a mut [f32],
    /// Barycentric weight of the third corner.
    pub v: &'a mut [f32],
    /// Primitive.
    pub prim: &'a mut [u32],
    /// Geometry.
    pub geom: &'a mut [u32],
}

impl<'a> HitColumnsMut<'a> {
    /// The first `n` rows.
    ///
    /// # Panics
    /// If a column is shorter.
    #[inline(always)]
    pub(super) fn trimmed(self, n: usize) -> HitColumnsMut<'a> {
        HitColumnsMut {
            t: &mut self.t[..n],
            u: &mut self.u[..n],
            v: &mut self.v[..n],
            prim: &mut self.prim[..n],
            geom: &mut self.geom[..n],
        }
    }

    /// The same columns, for a while.
    pub(super) fn reborrow(&mut self) -> HitColumnsMut<'_> {
        HitColumnsMut { t: self.t, u: self.u, v: self.v, prim: self.prim, geom: self.geom }
    }

    /// Reads one row.
    #[inline(always)]
    pub(super) fn get(&self, row: usize) -> Hit {
        Hit { t: self.t[row], u: self.u[row], v: self.v[row], prim: self.prim[row], geom: self.geom[row] }
    }

    /// Writes one row.
    #[inline(always)]
    pub fn set(&mut self, row: usize, hit: Hit) {
        self.t[row] = hit.t;
        self.u[row] = hit.u;
        self.v[row] = hit.v;
        self.prim[row] = hit.prim;
        self.geom[row] = hit.geom;
    }
}

/// Events of a batch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct TraversalCounts {
    /// Rays traced. The other counts are 0 unless the batch was asked to count.
    pub rays: u64,
    /// Nodes whose four children were tested.
    pub node_visits: u64,
    /// Leaf blocks tested.
    pub leaf_visits: u64,
    /// Primitives tested: the lanes in use in those blocks.
    pub primitive_tests: u64,
    /// Vectors of box tests.
    pub box_lanes: Lanes,
    /// Vectors of primitive tests.
    pub primitive_lanes: Lanes,
}

impl std::ops::AddAssign for TraversalCounts {
    fn add_assign(&mut self, other: TraversalCounts) {
        self.rays += other.rays;
        self.node_visits += other.node_visits;
        self.leaf_visits += other.leaf_visits;
        self.primitive_tests += other.primitive_tests;
        self.box_lanes += other.box_lanes;
        self.primitive_lanes += other.primitive_lanes;
    }
}
