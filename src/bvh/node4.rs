//! The inner node of the four-wide tree.

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};

use super::aabb::Aabb;
use super::child::Child;
use super::node::{Node, SLACK, overlap};
use super::rays4::Rays4;
use crate::simd::wide::{Wide, Words};

/// Four children and their boxes: two cache lines.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct Node4 {
    /// `planes[0]` the low, `planes[1]` the high planes of the boxes; then the axis; then the child.
    pub planes: [[Vec4; 3]; 2],
    /// What the boxes hold, largest box first; empty slots last.
    pub children: [Child; 4],
    /// Room for what later kernels keep here.
    spare: [u32; 4],
}

const _: () = assert!(size_of::<Node4>() == 128);

impl Node4 {
    /// A node of up to four children. The boxes of empty slots lie at infinity, where no ray arrives.
    pub fn new(children: &[(Child, Aabb)]) -> Node4 {
        let mut node = Node4 { planes: [[Vec4::INFINITY; 3]; 2], children: [Child::EMPTY; 4], spare: [0; 4] };
        for (lane, &(child, aabb)) in children.iter().enumerate() {
            node.children[lane] = child;
            for axis in 0..3 {
                node.planes[0][axis][lane] = aabb.min[axis];
                node.planes[1][axis][lane] = aabb.max[axis];
            }
        }
        node
    }
}

impl Node for Node4 {
    type Frame = ();
    const WIDENED: bool = false;

    #[inline(always)]
    fn point((): &(), point: Vec3) -> Vec3 {
        point
    }

    #[inline(always)]
    fn scale((): &(), scale: Vec3) -> Vec3 {
        scale
    }

    #[inline(always)]
    fn planes(&self) -> [[Vec4; 3]; 2] {
        self.planes
    }

    #[inline(always)]
    fn children(&self) -> &Words {
        bytemuck::cast_ref(&self.children)
    }

    fn child_box(&self, (): &(), lane: usize) -> Option<Aabb> {
        let corner = |side: usize| Vec3::from_array(std::array::from_fn(|axis| self.planes[side][axis][lane]));
        (self.children[lane] != Child::EMPTY).then(|| Aabb { min: corner(0), max: corner(1) })
    }

    fn empty_slots_are_harmless(&self) -> bool {
        let nowhere = |lane: usize| self.planes.iter().flatten().all(|plane| plane[lane] == f32::INFINITY);
        (0..4).all(|lane| self.children[lane] != Child::EMPTY || nowhere(lane))
    }

    #[inline(always)]
    fn slab<W: Wide>(_: W, (): &(), rays: &Rays4) -> ([[Vec4; 4]; 2], u32) {
        let ([ox, oy, oz], [sx, sy, sz]) = (rays.origin, rays.scale());
        ([[sx, sy, sz, rays.t_max], [ox, oy, oz, rays.t_min]], 0b1111)
    }

    #[inline(always)]
    fn enter<'a, W: Wide>(
        wide: W,
        node: impl Fn(usize) -> &'a Self + Copy,
        slab: impl Fn(usize, usize) -> &'a Words + Copy,
    ) -> (W::Lanes, W::Lanes) {
        let (scale, origin) = (wide.gather(|ray| slab(ray, 0)), wide.gather(|ray| slab(ray, 1)));
        let x = pair::<W, 0>(wide, node, wide.spread::<0>(origin), wide.spread::<0>(scale));
        let y = pair::<W, 1>(wide, node, wide.spread::<1>(origin), wide.spread::<1>(scale));
        let z = pair::<W, 2>(wide, node, wide.spread::<2>(origin), wide.spread::<2>(scale));
        let (entry, exit) = overlap(wide, [x, y, z], wide.spread::<3>(origin), wide.spread::<3>(scale));
        (wide.mul(entry, wide.splat(1.0 - SLACK)), exit)
    }

    #[inline(always)]
    fn lane_numbers<W: Wide>(_: W, planes: Vec4) -> Vec4 {
        planes
    }

    #[inline(always)]
    fn enter_box<W: Wide>(wide: W, near: [f32; 3], far: [f32; 3], slab: &[W::Lanes; 8]) -> (W::Lanes, W::Lanes) {
        let [sx, sy, sz, t_max, ox, oy, oz, t_min] = *slab;
        let x = (cross(wide, near[0], ox, sx), cross(wide, far[0], ox, sx));
        let y = (cross(wide, near[1], oy, sy), cross(wide, far[1], oy, sy));
        let z = (cross(wide, near[2], oz, sz), cross(wide, far[2], oz, sz));
        let (entry, exit) = overlap(wide, [x, y, z], t_min, t_max);
        (wide.mul(entry, wide.splat(1.0 - SLACK)), exit)
    }
}

/// Where rays cross a plane.
#[inline(always)]
fn cross<W: Wide>(wide: W, plane: f32, origin: W::Lanes, scale: W::Lanes) -> W::Lanes {
    wide.mul(wide.sub(wide.splat(plane), origin), scale)
}

/// Where rays cross the nearer and the farther planes of an axis. (No closure: those with vectors in them must be inlined.)
#[inline(always)]
fn pair<'a, W: Wide, const AXIS: usize>(
    wide: W,
    node: impl Fn(usize) -> &'a Node4,
    origin: W::Lanes,
    scale: W::Lanes,
) -> (W::Lanes, W::Lanes) {
    let low = wide.gather(|ray| bytemuck::cast_ref(&node(ray).planes[0][AXIS]));
    let high = wide.gather(|ray| bytemuck::cast_ref(&node(ray).planes[1][AXIS]));
    let (low, high) = (wide.mul(wide.sub(low, origin), scale), wide.mul(wide.sub(high, origin), scale));
    (wide.min(low, high), wide.max(low, high))
}
