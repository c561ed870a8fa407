//! What the kernels need of a node, whatever its format.

use bytemuck::Pod;
use glam::{Vec3, Vec4};

use super::aabb::Aabb;
use super::rays4::Rays4;
use crate::simd::wide::{Wide, Words};

/// How much earlier than computed a box may be entered: 32 half-ulps. See [`super::traverse::slab`].
pub const SLACK: f32 = 1.0 / (1 << 19) as f32;

/// A node of four children.
pub trait Node: Pod + Send + Sync {
    /// What all nodes of a tree share: the space in which their planes are numbers.
    type Frame: Copy + Send + Sync + std::fmt::Debug;

    /// Whether rays in flight step through nodes of eight children, made of these.
    const WIDENED: bool;

    /// A point in that space.
    fn point(frame: &Self::Frame, point: Vec3) -> Vec3;

    /// The reciprocal of a direction in that space, given that in the world; finite.
    fn scale(frame: &Self::Frame, scale: Vec3) -> Vec3;

    /// The planes in that space: first the side, then the axis, then the child.
    fn planes(&self) -> [[Vec4; 3]; 2];

    /// The children, as references; those of empty slots may be any, and no ray meets them.
    fn children(&self) -> &Words;

    /// The box of a child in the world, or `None` for an empty slot.
    fn child_box(&self, frame: &Self::Frame, lane: usize) -> Option<Aabb>;

    /// Whether no ray can come to harm in the slots that [`Node::child_box`] calls empty: they have no box, or one that leads where
    /// another slot leads too.
    fn empty_slots_are_harmless(&self) -> bool;

    /// Four rays as [`Node::enter`] needs them, a column a word: of the first quad `t_max` and of the second `t_min` are
    /// last. And one bit for each ray that [`Node::enter`] is sure to miss nothing for.
    fn slab<W: Wide>(wide: W, frame: &Self::Frame, rays: &Rays4) -> ([[Vec4; 4]; 2], u32);

    /// Where rays enter and leave the boxes of the children of a node each, both limited to the ray.
    fn enter<'a, W: Wide>(
        wide: W,
        node: impl Fn(usize) -> &'a Self + Copy,
        slab: impl Fn(usize, usize) -> &'a Words + Copy,
    ) -> (W::Lanes, W::Lanes);

    /// Planes as [`Node::enter_box`] takes them.
    fn lane_numbers<W: Wide>(wide: W, planes: Vec4) -> Vec4;

    /// The same of one box for a ray a lane: its near and far planes by axis, from [`Node::lane_numbers`]; `slab` by word, as
    /// [`Node::slab`] gives it.
    fn enter_box<W: Wide>(wide: W, near: [f32; 3], far: [f32; 3], slab: &[W::Lanes; 8]) -> (W::Lanes, W::Lanes);
}

/// Where rays enter and leave a box, given where they cross the nearer and the farther planes of each axis; both limited to the
/// ray.
#[inline(always)]
pub fn overlap<W: Wide>(
    wide: W,
    [x, y, z]: [(W::Lanes, W::Lanes); 3],
    t_min: W::Lanes,
    t_max: W::Lanes,
) -> (W::Lanes, W::Lanes) {
    let entry = wide.max(wide.max(x.0, y.0), wide.max(z.0, t_min));
    let exit = wide.min(wide.min(x.1, y.1), wide.min(z.1, t_max));
    (entry, exit)
}
