//! The compact inner node: planes as 16-bit numbers on a grid around the scene.

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3, Vec4};

use super::aabb::Aabb;
use super::child::Child;
use super::node::{Node, overlap};
use super::node4::Node4;
use super::rays4::Rays4;
use crate::simd::floats;
use crate::simd::wide::{Wide, Words};

/// Four children and their boxes: one cache line.
///
/// Boxes are rounded outwards, and widened by a step of the grid more: that covers the rounding of the box test, which on
/// every axis errs by less than 0.95 steps for rays from within [`FAR`] of the grid. By term, in steps: 0.57 where 2²³ is
/// added ([`Wide::grid_low`]); 0.1 for the origin on the grid, which is rounded three times; 0.14 for the distances, whose scale is, and
/// which are themselves; 0.14 for those of the triangle test, which must be found in the box.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct GridNode4 {
    /// By axis, then the four low planes before the four high ones.
    planes: [[[u16; 4]; 2]; 3],
    /// References; empty slots repeat the first.
    children: Words,
}

const _: () = assert!(size_of::<GridNode4>() == 64);

/// The grid of a tree: `point = origin + step · number`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Grid {
    origin: Vec3,
    step: Vec3,
    /// Steps a unit: the reciprocal of `step`, rounded; what encoding and rays are scaled by.
    per_unit: Vec3,
}

/// The largest number.
const LAST: f32 = 65535.0;
/// How far from the grid's origin a ray may start, in steps, on each axis: eight times the grid.
const FAR: f32 = (1u32 << 19) as f32;
impl Grid {
    /// The grid around a scene. `None` if its size does not suit single precision.
    pub fn around(bounds: &Aabb) -> Option<Grid> {
        let extent = bounds.max - bounds.min;
        let largest = extent.max_element();
        // Rays may start so many grids away, also from flat scenes.
        let extent = extent.max(Vec3::splat(0.5 * largest));
        // Two steps to spare on either side.
        let step = extent / (LAST - 6.0);
        let per_unit = step.recip();
        let grid = Grid { origin: bounds.min - 2.0 * step, step, per_unit };
        grid.is_sound().then_some(grid)
    }

    /// Whether all of it is in the range of single precision, with room to compute.
    pub fn is_sound(&self) -> bool {
        let fine = |v: Vec3| v.is_finite() && v.min_element() > 1e-30 && v.max_element() < 1e30;
        fine(self.step) && fine(self.per_unit) && self.origin.is_finite()
    }

    /// How large the box between these planes is, by axis.
    pub fn size(&self, planes: [[u16; 2]; 3]) -> [f32; 3] {
        let steps = Vec3::from_array(planes.map(|[low, high]| f32::from(high) - f32::from(low)));
        (self.step * steps).to_array()
    }

    /// Rounds a node's boxes outwards. `None` if one does not lie on the grid.
    pub fn node(&self, node: &Node4) -> Option<GridNode4> {
        let boxes: [Option<Aabb>; 4] = std::array::from_fn(|lane| node.child_box(&(), lane));
        let mut planes = [[[GridNode4::EMPTY; 4]; 2]; 3];
        for (lane, aabb) in boxes.iter().enumerate() {
            let Some(aabb) = aabb else { continue };
            let number = |point: Vec3| (point.as_dvec3() - self.origin.as_dvec3()) * self.per_unit.as_dvec3();
            let (low, high) = (number(aabb.min).floor() - 1.0, number(aabb.max).ceil() + 1.0);
            if !(low.cmpge(DVec3::ZERO).all() && high.cmplt(DVec3::splat(LAST.into())).all()) {
                return None;
            }
            for axis in 0..3 {
                planes[axis][0][lane] = low[axis] as u16;
                planes[axis][1][lane] = high[axis] as u16;
            }
        }
        let children = node.children.map(|child| if child == Child::EMPTY { node.children[0] } else { child });
        Some(GridNode4 { planes, children: children.map(Child::bits) })
    }
}

impl GridNode4 {
    /// The planes of empty slots: a point that no box of the grid contains.
    pub const EMPTY: u16 = u16::MAX;

    /// Of four children and their planes, first the axis, then the side.
    #[cfg(test)]
    pub fn of(children: [(Child, [[u16; 2]; 3]); 4]) -> GridNode4 {
        let planes = |axis: usize| [0, 1].map(|side| children.map(|(_, planes)| planes[axis][side]));
        GridNode4 { planes: [planes(0), planes(1), planes(2)], children: children.map(|(child, _)| child.bits()) }
    }

    /// The planes of a child, first the axis, then the side; `None` for an empty slot.
    pub fn numbers(&self, lane: usize) -> Option<[[u16; 2]; 3]> {
        let numbers = self.planes.map(|axis| axis.map(|side| side[lane]));
        (numbers[0][0] != Self::EMPTY).then_some(numbers)
    }

    /// The planes of an axis, as vectors take them.
    #[inline(always)]
    fn words(&self, axis: usize) -> &Words {
        bytemuck::cast_ref(&self.planes[axis])
    }
}

impl Node for GridNode4 {
    type Frame = Grid;
    const WIDENED: bool = true;

    #[inline(always)]
    fn point(grid: &Grid, point: Vec3) -> Vec3 {
        (point - grid.origin) * grid.per_unit
    }

    #[inline(always)]
    fn scale(grid: &Grid, scale: Vec3) -> Vec3 {
        // Finite still when multiplied by what a grid measures.
        (scale * grid.step).clamp(Vec3::splat(-1e30), Vec3::splat(1e30))
    }

    #[inline(always)]
    fn planes(&self) -> [[Vec4; 3]; 2] {
        let [x, y, z] = [floats(&self.planes[0]), floats(&self.planes[1]), floats(&self.planes[2])];
        [[x[0], y[0], z[0]], [x[1], y[1], z[1]]]
    }

    #[inline(always)]
    fn children(&self) -> &Words {
        &self.children
    }

    fn child_box(&self, grid: &Grid, lane: usize) -> Option<Aabb> {
        let numbers = self.numbers(lane)?;
        let corner = |side: usize| grid.origin + grid.step * Vec3::from_array(numbers.map(|axis| axis[side].into()));
        Some(Aabb { min: corner(0), max: corner(1) })
    }

    fn empty_slots_are_harmless(&self) -> bool {
        let is_empty = |lane: usize| self.planes[0][0][lane] == Self::EMPTY;
        !is_empty(0) && (1..4).all(|lane| !is_empty(lane) || self.children[lane] == self.children[0])
    }

    #[inline(always)]
    fn slab<W: Wide>(wide: W, grid: &Grid, rays: &Rays4) -> ([[Vec4; 4]; 2], u32) {
        let scale = rays.scale();
        let scale: [Vec4; 3] = std::array::from_fn(|axis| scale[axis] * grid.step[axis]);
        let origin: [Vec4; 3] =
            std::array::from_fn(|axis| (rays.origin[axis] - Vec4::splat(grid.origin[axis])) * grid.per_unit[axis]);
        // Along an axis that the ray hardly moves on, planes are crossed so far away that no other plane is as far; and yet
        // 2²⁴ times as far is a number.
        let [x, y, z] = scale.map(Vec4::abs);
        let least = x.min(y).min(z);
        let most = least * (1u64 << 40) as f32;
        let [x, y, z]: [Vec4; 3] = [x, y, z].map(|magnitude| magnitude.min(most));
        let [x, y, z] = [x.copysign(scale[0]), y.copysign(scale[1]), z.copysign(scale[2])];
        let near = |v: Vec4| v.abs().cmple(Vec4::splat(FAR));
        let suits = near(origin[0])
            & near(origin[1])
            & near(origin[2])
            & least.cmpge(Vec4::splat(1e-20))
            & least.cmple(Vec4::splat(1e12));
        // Rays that hit nothing in any tree may be traced all the same.
        let suits = suits | rays.t_max.cmplt(Vec4::ZERO);
        let offset = |origin: Vec4, scale: Vec4| wide.grid_offset(origin, scale);
        let offsets = [offset(origin[0], x), offset(origin[1], y), offset(origin[2], z), rays.t_min];
        ([[x, y, z, rays.t_max], offsets], suits.bitmask())
    }

    #[inline(always)]
    fn enter<'a, W: Wide>(
        wide: W,
        node: impl Fn(usize) -> &'a Self + Copy,
        slab: impl Fn(usize, usize) -> &'a Words + Copy,
    ) -> (W::Lanes, W::Lanes) {
        let (scale, offset) = (wide.gather(|ray| slab(ray, 0)), wide.gather(|ray| slab(ray, 1)));
        let x = wide.gather(|ray| node(ray).words(0));
        let x = pair(wide, x, wide.spread::<0>(scale), wide.spread::<0>(offset));
        let y = wide.gather(|ray| node(ray).words(1));
        let y = pair(wide, y, wide.spread::<1>(scale), wide.spread::<1>(offset));
        let z = wide.gather(|ray| node(ray).words(2));
        let z = pair(wide, z, wide.spread::<2>(scale), wide.spread::<2>(offset));
        // From 0 on rather than from `t_min`: what comes before that is told from what counts when it is hit.
        overlap(wide, [x, y, z], wide.splat(0.0), wide.spread::<3>(scale))
    }

    #[inline(always)]
    fn lane_numbers<W: Wide>(wide: W, planes: Vec4) -> Vec4 {
        wide.grid_numbers(planes)
    }

    #[inline(always)]
    fn enter_box<W: Wide>(wide: W, near: [f32; 3], far: [f32; 3], slab: &[W::Lanes; 8]) -> (W::Lanes, W::Lanes) {
        let [sx, sy, sz, t_max, ox, oy, oz, t_min] = *slab;
        let x = (wide.grid(near[0], sx, ox), wide.grid(far[0], sx, ox));
        let y = (wide.grid(near[1], sy, oy), wide.grid(far[1], sy, oy));
        let z = (wide.grid(near[2], sz, oz), wide.grid(far[2], sz, oz));
        overlap(wide, [x, y, z], t_min, t_max)
    }
}

/// Where rays cross the nearer and the farther planes of an axis.
#[inline(always)]
fn pair<W: Wide>(wide: W, planes: W::Lanes, scale: W::Lanes, offset: W::Lanes) -> (W::Lanes, W::Lanes) {
    let (low, high) = (wide.grid_low(planes, scale, offset), wide.grid_high(planes, scale, offset));
    (wide.min(low, high), wide.max(low, high))
}
