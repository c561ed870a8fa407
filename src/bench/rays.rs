//! A set of rays: what is traced, in which order, in which batches.

use crate::bvh::ray::Ray;
use crate::bvh::{Query, RayColumns};
use std::ops::Range;

/// Rays in columns of `f32`, one a row, world space.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rays {
    /// Origin x, y, z; direction x, y, z.
    pub columns: [Vec<f32>; 6],
    /// Farthest distance that counts, of each ray; `None`: infinite for all.
    pub t_max: Option<Vec<f32>>,
}

impl Rays {
    /// How many.
    pub fn len(&self) -> usize {
        self.columns[0].len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Adds a ray; its `t_max` counts if the set has distances or it is the first of a set with a finite one.
    pub fn push(&mut self, ray: Ray) {
        if ray.t_max.is_finite() && self.t_max.is_none() {
            self.t_max = Some(vec![f32::INFINITY; self.len()]);
        }
        for (column, value) in
            self.columns.iter_mut().zip([ray.origin, ray.direction].map(|v| v.to_array()).as_flattened())
        {
            column.push(*value);
        }
        if let Some(t_max) = &mut self.t_max {
            t_max.push(ray.t_max);
        }
    }

    /// All of them.
    pub fn all(&self) -> RayColumns<'_> {
        let [ox, oy, oz, dx, dy, dz] = self.columns.each_ref().map(Vec::as_slice);
        RayColumns { ox, oy, oz, dx, dy, dz, t_max: self.t_max.as_deref() }
    }
}

/// Rays that are traced together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Batch {
    /// How many.
    pub rays: u32,
    /// Neighbours go the same way.
    pub coherent: bool,
}

/// A named set.
#[derive(Clone, Debug, PartialEq)]
pub struct RaySet {
    /// Short, as in `D2`.
    pub name: String,
    /// What is asked.
    pub query: Query,
    /// The rays.
    pub rays: Rays,
    /// How they are handed to comber's kernels, in order; together as many as there are rays.
    pub batches: Vec<Batch>,
}

impl RaySet {
    /// A set in batches of `wave` rays.
    pub fn in_waves(name: &str, query: Query, rays: Rays, wave: usize, coherent: bool) -> RaySet {
        let n = rays.len();
        let batch = |start: usize| Batch { rays: (n - start).min(wave) as u32, coherent };
        RaySet { name: name.into(), query, batches: (0..n).step_by(wave).map(batch).collect(), rays }
    }

    /// The batches, as rows.
    pub fn spans(&self) -> Vec<(Range<usize>, bool)> {
        let mut start = 0;
        let span = |batch: &Batch| {
            let rows = start..start + batch.rays as usize;
            start = rows.end;
            (rows, batch.coherent)
        };
        self.batches.iter().map(span).collect()
    }

    /// Every `step`-th batch.
    pub fn thinned(&self, step: usize) -> RaySet {
        let mut rays = Rays { t_max: self.rays.t_max.as_ref().map(|_| Vec::new()), ..Rays::default() };
        let mut batches = Vec::new();
        for (rows, coherent) in self.spans().into_iter().step_by(step.max(1)) {
            batches.push(Batch { rays: rows.len() as u32, coherent });
            for (to, from) in rays.columns.iter_mut().zip(&self.rays.columns) {
                to.extend_from_slice(&from[rows.clone()]);
            }
            if let (Some(to), Some(from)) = (&mut rays.t_max, &self.rays.t_max) {
                to.extend_from_slice(&from[rows]);
            }
        }
        RaySet { name: self.name.clone(), query: self.query, rays, batches }
    }
}
