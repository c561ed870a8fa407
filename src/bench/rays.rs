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

    /// Adds `rays`; distances count as in [`Rays::push`].
    pub fn extend(&mut self, rays: RayColumns<'_>) {
        if rays.t_max.is_some() && self.t_max.is_none() {
            self.t_max = Some(vec![f32::INFINITY; self.len()]);
        }
        let columns = [rays.ox, rays.oy, rays.oz, rays.dx, rays.dy, rays.dz];
        for (to, from) in self.columns.iter_mut().zip(columns) {
            to.extend_from_slice(from);
        }
        if let Some(to) = &mut self.t_max {
            match rays.t_max {
                Some(from) => to.extend_from_slice(from),
                None => to.resize(self.columns[0].len(), f32::INFINITY),
            }
        }
    }

    /// All of them.
    pub fn all(&self) -> RayColumns<'_> {
        let [ox, oy, oz, dx, dy, dz] = self.columns.each_ref().map(Vec::as_slice);
        RayColumns { ox, oy, oz, dx, dy, dz, t_min: None, t_max: self.t_max.as_deref(), low: None }
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
        let mut rays = Rays::default();
        let mut batches = Vec::new();
        for (rows, coherent) in self.spans().into_iter().step_by(step.max(1)) {
            batches.push(Batch { rays: rows.len() as u32, coherent });
            rays.extend(self.rays.all().rows(rows));
        }
        RaySet { name: self.name.clone(), query: self.query, rays, batches }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn ray(x: f32, t_max: f32) -> Ray {
        Ray { t_max, ..Ray::new(Vec3::splat(x), Vec3::Z) }
    }

    #[test]
    fn distances_appear_with_the_first_ray_that_has_one() {
        let mut rays = Rays::default();
        rays.push(ray(0.0, f32::INFINITY));
        assert_eq!(rays.t_max, None);
        rays.push(ray(1.0, 5.0));
        rays.push(ray(2.0, f32::INFINITY));
        let mut again = Rays::default();
        again.extend(rays.all().rows(0..1));
        again.extend(rays.all().rows(1..3));
        for rays in [&rays, &again] {
            assert_eq!(
                (0..3).map(|row| rays.all().ray(row)).collect::<Vec<_>>(),
                [ray(0.0, f32::INFINITY), ray(1.0, 5.0), ray(2.0, f32::INFINITY)]
            );
        }
    }

    #[test]
    fn a_thinned_set_has_whole_batches() {
        let mut rays = Rays::default();
        (0..25).for_each(|i| rays.push(ray(i as f32, f32::INFINITY)));
        let set = RaySet::in_waves("X", Query::Closest, rays, 10, true);
        assert_eq!(set.batches.iter().map(|batch| batch.rays).collect::<Vec<_>>(), [10, 10, 5]);
        let thin = set.thinned(2);
        let rows: Vec<f32> = (0..10).chain(20..25).map(|i| i as f32).collect();
        assert_eq!(thin.rays.columns[1], rows);
        assert_eq!(thin.spans(), [(0..10, true), (10..15, true)]);
    }
}
