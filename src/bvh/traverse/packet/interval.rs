//! What the rays of a packet have in common.

use crate::bvh::node::{Node, SLACK};
use crate::bvh::rays4::Rays4;
use glam::{BVec4A, Vec3, Vec4};

/// Bounds of origins and of reciprocal directions, in the space of the nodes. They tell for the four children of a node at
/// once which of them no ray can meet (interval arithmetic, after Boulos, Wald and Shirley, "Geometric and Arithmetic
/// Culling Methods for Entire Ray Packets", 2006).
pub struct Interval {
    /// By axis: the origins from which the near planes are nearest, and from which the far planes are farthest.
    origin: [[Vec4; 3]; 2],
    /// By axis: reciprocals of the smallest and the largest direction.
    scale: [[Vec4; 3]; 2],
    t_min: Vec4,
}

/// Where an axis bounds nothing: an origin so far before the near planes, and so far behind the far ones.
const ANYWHERE: f32 = f32::INFINITY;

/// Bounds of origins and directions in the world, lanes still apart.
pub struct Bounds {
    origins: [[Vec4; 3]; 2],
    directions: [[Vec4; 3]; 2],
    t_min: Vec4,
}

impl Bounds {
    /// Of nothing.
    pub const NONE: Bounds = Bounds {
        origins: [[Vec4::INFINITY; 3], [Vec4::NEG_INFINITY; 3]],
        directions: [[Vec4::INFINITY; 3], [Vec4::NEG_INFINITY; 3]],
        t_min: Vec4::INFINITY,
    };

    /// Of four rays more, those of `among`.
    #[inline(always)]
    pub fn add(&mut self, rays: &Rays4, among: u32) {
        if among != 0b1111 {
            return self.add_some(rays, among);
        }
        for axis in 0..3 {
            self.origins[0][axis] = self.origins[0][axis].min(rays.origin[axis]);
            self.origins[1][axis] = self.origins[1][axis].max(rays.origin[axis]);
            self.directions[0][axis] = self.directions[0][axis].min(rays.direction[axis]);
            self.directions[1][axis] = self.directions[1][axis].max(rays.direction[axis]);
        }
        self.t_min = self.t_min.min(rays.t_min);
    }

    /// The first of them in place of the others.
    #[cold]
    fn add_some(&mut self, rays: &Rays4, among: u32) {
        if among != 0 {
            let one = |lanes: Vec4| Vec4::splat(lanes[among.trailing_zeros() as usize]);
            let among = BVec4A::new(among & 1 != 0, among & 2 != 0, among & 4 != 0, among & 8 != 0);
            let some = |lanes: Vec4| Vec4::select(among, lanes, one(lanes));
            let (origin, direction) = (rays.origin.map(some), rays.direction.map(some));
            self.add(&Rays4 { origin, direction, t_max: rays.t_max, t_min: some(rays.t_min) }, 0b1111);
        }
    }
}

impl Interval {
    /// Of nothing.
    pub const NONE: Interval =
        Interval { origin: [[Vec4::ZERO; 3]; 2], scale: [[Vec4::ZERO; 3]; 2], t_min: Vec4::ZERO };

    /// Of rays within these bounds. On the axes in `negative` they go backwards, on the others forwards.
    #[inline(always)]
    pub fn new<N: Node>(frame: &N::Frame, bounds: &Bounds, negative: [bool; 3]) -> Interval {
        let least = |v: [Vec4; 3]| Vec3::from_array(v.map(Vec4::min_element));
        let most = |v: [Vec4; 3]| Vec3::from_array(v.map(Vec4::max_element));
        let (low, high) = (least(bounds.directions[0]), most(bounds.directions[1]));
        let (from, to) = (N::point(frame, least(bounds.origins[0])), N::point(frame, most(bounds.origins[1])));
        let scales = [N::scale(frame, low.recip()), N::scale(frame, high.recip())];
        // Far enough from 0 that no reciprocal was limited.
        let flattest = low.abs().max(high.abs()).max_element() * 1e-6;
        let mut interval = Interval { t_min: Vec4::splat(bounds.t_min.min_element()), ..Interval::NONE };
        for axis in 0..3 {
            let backwards = negative[axis];
            let (origin, scale) = if low[axis] > flattest || high[axis] < -flattest {
                let ends = if backwards { [from[axis], to[axis]] } else { [to[axis], from[axis]] };
                (ends, [scales[0][axis], scales[1][axis]])
            } else if backwards {
                ([-ANYWHERE, ANYWHERE], [-1.0; 2])
            } else {
                ([ANYWHERE, -ANYWHERE], [1.0; 2])
            };
            for side in 0..2 {
                interval.origin[side][axis] = Vec4::splat(origin[side]);
                interval.scale[side][axis] = Vec4::splat(scale[side]);
            }
        }
        interval
    }

    /// No ray enters the children of a node earlier, nor leaves them later. Takes the near and the far planes of the children by
    /// axis.
    #[inline(always)]
    pub fn enter(&self, near: [Vec4; 3], far: [Vec4; 3]) -> (Vec4, Vec4) {
        let near = |axis: usize| {
            let offset = near[axis] - self.origin[0][axis];
            (offset * self.scale[0][axis]).min(offset * self.scale[1][axis])
        };
        let far = |axis: usize| {
            let offset = far[axis] - self.origin[1][axis];
            (offset * self.scale[0][axis]).max(offset * self.scale[1][axis])
        };
        let entry = near(0).max(near(1)).max(near(2).max(self.t_min)) * (1.0 - SLACK);
        let exit = far(0).min(far(1)).min(far(2).min(Vec4::splat(f32::MAX)));
        (entry, exit)
    }
}
