//! Where rays cross the triangles that they may hit, for many pairs of them at once.
//!
//! Kernels find candidates by a test in single precision; few are left of each triangle, and settled one by one each costs its
//! branches and waits for its own divisions. Here they wait for each other, as columns, a pair a row, and are computed in one loop
//! without branches. The arithmetic is [`Intersect::meet`], which settles them one by one elsewhere: the same bits.

use crate::bvh::intersect::Intersect;
use crate::bvh::ray::Hit;

/// Pairs there is room for.
pub const PAIRS: usize = 128;

/// One number of each pair.
type Column = [f32; PAIRS];

/// Rays, each with a triangle that it may hit.
pub struct Crossings {
    len: usize,
    /// What the caller calls the ray.
    ray: [u8; PAIRS],
    prim: [u32; PAIRS],
    geom: [u32; PAIRS],
    /// Along the ray's axes ([`Intersect::axes`]), as everything here.
    origin: [Column; 3],
    direction: [Column; 3],
    /// First the axis, then the corner.
    corners: [[Column; 3]; 3],
}

/// A triangle and who it is.
#[derive(Clone, Copy, Debug)]
pub struct Triangle {
    /// First the axis, then the corner.
    pub corners: [[f32; 3]; 3],
    /// Its primitive.
    pub prim: u32,
    /// Its geometry.
    pub geom: u32,
}

impl Crossings {
    /// None.
    pub fn new() -> Crossings {
        let zero = [0.0; PAIRS];
        Crossings {
            len: 0,
            ray: [0; PAIRS],
            prim: [0; PAIRS],
            geom: [0; PAIRS],
            origin: [zero; 3],
            direction: [zero; 3],
            corners: [[zero; 3]; 3],
        }
    }

    /// How many more there is room for.
    #[inline(always)]
    pub fn room(&self) -> usize {
        PAIRS - self.len
    }

    /// One more pair: there must be room. Any numbers do, what is not finite among them. `origins` and `directions` are columns, first by
    /// the axis.
    #[inline(always)]
    pub fn push<I: Intersect, const RAYS: usize>(
        &mut self,
        ray: usize,
        [origins, directions]: [&[[f32; RAYS]; 3]; 2],
        triangle: &Triangle,
    ) {
        let row = self.len % PAIRS;
        self.len += 1;
        (self.ray[row], self.prim[row], self.geom[row]) = (ray as u8, triangle.prim, triangle.geom);
        let [x, y, z] = directions.each_ref().map(|axis| axis[ray]);
        for (to, axis) in I::axes([x, y, z]).into_iter().enumerate() {
            self.origin[to][row] = origins[axis][ray];
            self.direction[to][row] = directions[axis][ray];
            for corner in 0..3 {
                self.corners[to][corner][row] = triangle.corners[axis][corner];
            }
        }
    }

    /// Tells of each ray that crosses its triangle, whether or not between its ends, and forgets all.
    #[inline(always)]
    pub fn settle<I: Intersect>(&mut self, mut crosses: impl FnMut(usize, Hit)) {
        let (mut t, mut u, mut v) = ([0.0; PAIRS], [0.0; PAIRS], [0.0; PAIRS]);
        let len = self.len.min(PAIRS);
        for row in 0..len {
            let at = |columns: &[Column; 3]| [columns[0][row], columns[1][row], columns[2][row]];
            let [x, y, z] = &self.corners;
            let (crossing, does) = I::meet(at(&self.origin), at(&self.direction), [at(x), at(y), at(z)]);
            // What is not a number is beyond all ends.
            t[row] = if does { crossing.t } else { f32::NAN };
            (u[row], v[row]) = (crossing.u, crossing.v);
        }
        for row in 0..len {
            let hit = Hit { t: t[row], u: u[row], v: v[row], prim: self.prim[row], geom: self.geom[row] };
            crosses(self.ray[row].into(), hit);
        }
        self.len = 0;
    }
}
