//! Every triangle and every sphere against every ray: for scenes of so few that a tree gains nothing.
//!
//! 64 rays of one class at a time, a ray a lane; a triangle's corners stand in all lanes. No node, no stack, and the same
//! instructions for all rays, whichever way they go.

use super::Tree;
use super::bins::{Bins, RAYS};
use super::leaf::{count_block, count_vectors};
use crate::bvh::closest::closer;
use crate::bvh::columns::{RayColumns, TraversalCounts};
use crate::bvh::intersect::{Intersect, RayLanes};
use crate::bvh::node::Node;
use crate::bvh::ray::{Hit, MISS};
use crate::bvh::rays4::{Rays4, transposed};
use crate::bvh::sphere;
use crate::bvh::sphere4::Sphere4;
use crate::bvh::tri4::Tri4;
use crate::simd::wide::{MOST_LANES, Wide, Words};

/// One component of all rays, and room for the widest vector beyond the last.
type Column = [f32; RAYS + MOST_LANES];

/// Rays that the triangle test reads the same rows of a block for.
struct Rays {
    /// What the triangle test takes, a column a word: origin and one more, direction and `t_max`.
    words: [[Column; 4]; 2],
    /// The same, ray by ray.
    quads: [[Words; 2]; RAYS],
    /// Origins and directions as they are.
    origin: [Column; 3],
    direction: [Column; 3],
    /// The closest hits so far; their `t` is where the ray ends.
    closest: [Hit; RAYS],
    t_min: Column,
    rows: [u32; RAYS],
    len: usize,
    /// Rays that may still hit something.
    alive: u64,
}

/// Traces all rays, and calls `finish` with the row and the hit of each, in no particular order. `ANY`: the first hit found
/// ends a ray, rather than the closest. `SPHERES`: there are some. `COUNT`: count what is tested.
#[inline(always)]
pub fn trace<W: Wide, N: Node, I: Intersect, const ANY: bool, const SPHERES: bool, const COUNT: bool>(
    wide: W,
    tree: &Tree<'_, N>,
    rays: RayColumns<'_>,
    mut finish: impl FnMut(usize, Hit),
) -> TraversalCounts {
    let mut counts = TraversalCounts { rays: rays.len() as u64, ..Default::default() };
    let mut bins = Bins::new();
    let zero = [0.0; RAYS + MOST_LANES];
    let mut at_hand = Rays {
        words: [[zero; 4]; 2],
        quads: [[[0; 4]; 2]; RAYS],
        origin: [zero; 3],
        direction: [zero; 3],
        closest: [Hit::NONE; RAYS],
        t_min: zero,
        rows: [0; RAYS],
        len: 0,
        alive: 0,
    };
    while let Some((rows, len)) = bins.next::<I>(&rays) {
        at_hand.load::<I>(&rays, rows, len);
        for block in tree.triangles {
            if COUNT {
                at_hand.count::<W>(&mut counts, &block.prim);
            }
            at_hand.triangles::<W, I, ANY>(wide, block);
        }
        if SPHERES {
            for block in tree.spheres {
                if COUNT {
                    at_hand.count::<W>(&mut counts, &block.prim);
                }
                at_hand.spheres::<W, ANY>(wide, block, &rays);
            }
        }
        for (row, hit) in rows[..len].iter().zip(&at_hand.closest) {
            finish(*row as usize, if hit.prim == MISS { Hit::NONE } else { *hit });
        }
    }
    counts
}

impl Rays {
    /// Sets the first `len` rows up.
    #[inline(always)]
    fn load<I: Intersect>(&mut self, rays: &RayColumns<'_>, rows: [u32; RAYS], len: usize) {
        self.alive = 0;
        for quad in (0..RAYS).step_by(4) {
            let [i, j, k, l] = [0, 1, 2, 3].map(|ray| rows[quad + ray] as usize);
            // Rows ascend, but for those that stand in for missing ones.
            let consecutive = quad + 4 <= len && l == i + 3;
            let four = if consecutive { Rays4::load(rays, i) } else { Rays4::at(rays, [i, j, k, l]) };
            let [a, b] = I::prepare4(&four);
            for (columns, words) in self.words.iter_mut().zip([a, b]) {
                for (column, words) in columns.iter_mut().zip(words) {
                    words.write_to_slice(&mut column[quad..]);
                }
            }
            let (a, b) = (transposed(a), transposed(b));
            for axis in 0..3 {
                four.origin[axis].write_to_slice(&mut self.origin[axis][quad..]);
                four.direction[axis].write_to_slice(&mut self.direction[axis][quad..]);
            }
            four.t_min.write_to_slice(&mut self.t_min[quad..]);
            let t_max = four.t_max.to_array();
            for ray in 0..4 {
                self.quads[quad + ray] = [a[ray], b[ray]];
                self.closest[quad + ray] = Hit { t: t_max[ray], ..Hit::NONE };
            }
            self.alive |= u64::from(four.traceable()) << quad;
        }
        self.alive &= u64::MAX >> (RAYS - len);
        self.rows = rows;
        self.len = len;
    }

    /// Tests all rays against a block of triangles.
    #[inline(always)]
    fn triangles<W: Wide, I: Intersect, const ANY: bool>(&mut self, wide: W, block: &Tri4) {
        let rows = block.rows();
        let [x, y, z] = [0, 1, 2].map(|axis| I::first_row(&self.quads[0][0], axis));
        for lane in (0..4).filter(|&lane| block.prim[lane] != MISS) {
            let corners = [
                [splat(wide, rows, x, lane), splat(wide, rows, y, lane), splat(wide, rows, z, lane)],
                [splat(wide, rows, x + 1, lane), splat(wide, rows, y + 1, lane), splat(wide, rows, z + 1, lane)],
                [splat(wide, rows, x + 2, lane), splat(wide, rows, y + 2, lane), splat(wide, rows, z + 2, lane)],
            ];
            for first in (0..self.len).step_by(4 * W::RAYS) {
                let [[ox, oy, oz, _], [dx, dy, dz, t_max]] = &self.words;
                let rays = RayLanes {
                    origin: [load(wide, ox, first), load(wide, oy, first), load(wide, oz, first)],
                    direction: [load(wide, dx, first), load(wide, dy, first), load(wide, dz, first)],
                    t_max: load(wide, t_max, first),
                };
                let candidates = wide.bits(I::test(wide, &rays, corners));
                let mut rest = u64::from(candidates) << first & self.alive;
                while rest != 0 {
                    let ray = rest.trailing_zeros() as usize % RAYS;
                    rest &= rest - 1;
                    if let Some(crossing) = I::crossing(&self.quads[ray], block, lane) {
                        let (prim, geom) = (block.prim[lane], block.geom[lane]);
                        self.offer::<ANY>(ray, Hit { t: crossing.t, u: crossing.u, v: crossing.v, prim, geom });
                    }
                }
            }
        }
    }

    /// Tests all rays against a block of spheres.
    #[inline(always)]
    fn spheres<W: Wide, const ANY: bool>(&mut self, wide: W, block: &Sphere4, rays: &RayColumns<'_>) {
        for lane in (0..4).filter(|&lane| block.prim[lane] != MISS) {
            let (center, radius) = (block.center(lane), block.radius[lane]);
            for first in (0..self.len).step_by(4 * W::RAYS) {
                let may = near_sphere(wide, &self.origin, &self.direction, first, (center.to_array(), radius));
                let mut rest = u64::from(may) << first & self.alive;
                while rest != 0 {
                    let ray = rest.trailing_zeros() as usize % RAYS;
                    rest &= rest - 1;
                    let whole = rays.ray(self.rows[ray] as usize);
                    if let Some(t) = sphere::intersect(&whole, center, radius, self.closest[ray].t) {
                        self.offer::<ANY>(
                            ray,
                            Hit { t, u: 0.0, v: 0.0, prim: block.prim[lane], geom: block.geom[lane] },
                        );
                    }
                }
            }
        }
    }

    /// Takes the hit if it comes before the closest so far. A ray that asks for any hit is then done.
    #[inline(always)]
    fn offer<const ANY: bool>(&mut self, ray: usize, hit: Hit) {
        if closer(&hit, self.t_min[ray], &self.closest[ray]) {
            self.closest[ray] = hit;
            (self.words[1][3][ray], self.quads[ray][1][3]) = (hit.t, hit.t.to_bits());
            if ANY {
                self.alive &= !(1 << ray);
            }
        }
    }

    /// Counts a block.
    fn count<W: Wide>(&self, counts: &mut TraversalCounts, prims: &[u32; 4]) {
        count_block(counts, prims, self.alive.count_ones());
        count_vectors(&mut counts.primitive_lanes, self.len, W::RAYS);
    }
}

/// Which rays may hit a sphere: their lines come near enough to its centre, and it does not lie behind them. One bit a lane.
///
/// Distance by the cross product, which errs by less than 2⁻²¹ |l| |d|; all bounds are wider than that by far. A comparison
/// with what is not a number lets the ray through.
#[inline(always)]
fn near_sphere<W: Wide>(
    wide: W,
    origin: &[Column; 3],
    direction: &[Column; 3],
    first: usize,
    (center, radius): ([f32; 3], f32),
) -> u32 {
    let lx = wide.sub(wide.splat(center[0]), load(wide, &origin[0], first));
    let ly = wide.sub(wide.splat(center[1]), load(wide, &origin[1], first));
    let lz = wide.sub(wide.splat(center[2]), load(wide, &origin[2], first));
    let dx = load(wide, &direction[0], first);
    let dy = load(wide, &direction[1], first);
    let dz = load(wide, &direction[2], first);
    let (l, d) = ([lx, ly, lz], [dx, dy, dz]);
    let cross = [
        wide.sub(wide.mul(ly, dz), wide.mul(lz, dy)),
        wide.sub(wide.mul(lz, dx), wide.mul(lx, dz)),
        wide.sub(wide.mul(lx, dy), wide.mul(ly, dx)),
    ];
    let (squared, long) = (dot(wide, l, l), dot(wide, d, d));
    let r2 = wide.splat(radius * radius * 1.0001);
    let reach = wide.mul(long, wide.add(r2, wide.mul(squared, wide.splat(1e-5))));
    let wide_off = wide.below(reach, dot(wide, cross, cross));
    let behind =
        wide.both(wide.below(dot(wide, l, d), wide.splat(0.0)), wide.below(r2, wide.mul(squared, wide.splat(0.9999))));
    let all = u32::MAX >> (32 - 4 * W::RAYS);
    !wide.bits(wide.either(wide_off, behind)) & all
}

/// A vector of rays from a column.
#[inline(always)]
fn load<W: Wide>(wide: W, column: &Column, first: usize) -> W::Lanes {
    wide.load(column[first % RAYS..].first_chunk().expect("there is room beyond the last ray"))
}

/// One number of a block in all lanes.
#[inline(always)]
fn splat<W: Wide>(wide: W, rows: &[Words; 12], row: usize, lane: usize) -> W::Lanes {
    wide.splat(f32::from_bits(rows[row % 12][lane]))
}

#[inline(always)]
fn dot<W: Wide>(wide: W, a: [W::Lanes; 3], b: [W::Lanes; 3]) -> W::Lanes {
    wide.add(wide.add(wide.mul(a[0], b[0]), wide.mul(a[1], b[1])), wide.mul(a[2], b[2]))
}
