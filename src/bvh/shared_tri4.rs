//! The compact leaf block: triangles that share corners.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::block::TriangleBlock;
use super::ray::MISS;
use crate::simd::wide::{Wide, Words};

/// Up to four triangles of up to eight vertices, as structure of arrays: two cache lines.
///
/// Four neighbours in a mesh have six to eight vertices in all, which [`super::tri4::Tri4`] writes down twelve times. Here each stands once, with all its
/// bits, and three numbers a triangle say which are its corners: so tests compute with the very same numbers, and hits are the same to
/// the bit.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct SharedTri4 {
    /// The vertices' x; unused ones are NaN on all axes.
    x: [f32; VERTICES],
    /// Their y.
    y: [f32; VERTICES],
    /// First the corner, then the triangle: the numbers of vertices, in three bits. Unused lanes have unused vertices, which no test lets
    /// through. The other five bits of a triangle's bytes, the first corner's lowest, say how far its geometry is behind the first.
    corners: [[u8; 4]; 3],
    /// The first geometry.
    geom: u32,
    /// Primitives; [`MISS`] in unused lanes.
    prim: [u32; 4],
    /// The vertices' z. Each axis begins on 32 bytes, so that it lies in one cache line.
    z: [f32; VERTICES],
}

/// Vertices that a block has room for.
const VERTICES: usize = 8;
/// Bits of a corner's number.
const BITS: u32 = 3;
/// Geometries of a block's triangles, from the first to the last, stay below this.
pub const GEOMETRIES: u32 = 1 << (3 * (8 - BITS));

const _: () = assert!(size_of::<SharedTri4>() == 128);

impl SharedTri4 {
    /// How many of the first of these triangles, each with its geometry, one block holds: at least one, and two if their geometries are
    /// not [`GEOMETRIES`] apart.
    #[inline]
    pub fn fitting(triangles: impl Iterator<Item = ([Vec3; 3], u32)>) -> usize {
        let mut vertices = Vertices::default();
        let (mut fitting, mut first, mut last) = (0, u32::MAX, 0);
        for (number, (corners, geom)) in triangles.take(4).enumerate() {
            (first, last) = (first.min(geom), last.max(geom));
            if last - first >= GEOMETRIES || vertices.add(corners).is_none() {
                break;
            }
            // Where a lane is unused, so must be a vertex.
            if number == 3 || vertices.len < VERTICES {
                fitting = number + 1;
            }
        }
        fitting
    }

    /// A block of these triangles, by primitive, geometry and corners; as many as [`SharedTri4::fitting`] says.
    pub fn new(triangles: impl Iterator<Item = (u32, u32, [Vec3; 3])> + Clone) -> SharedTri4 {
        let mut vertices = Vertices::default();
        let mut corners = [[VERTICES as u8 - 1; 4]; 3];
        let mut prim = [MISS; 4];
        let first = triangles.clone().map(|(_, geom, _)| geom).min().unwrap_or(MISS);
        for (lane, (number, geom, positions)) in triangles.enumerate() {
            let vertices = vertices.add(positions).expect("no more triangles than fit");
            for (corner, row) in corners.iter_mut().enumerate() {
                let behind = (geom - first) >> (corner as u32 * (8 - BITS));
                row[lane] = vertices[corner] | (behind << BITS) as u8;
            }
            prim[lane] = number;
        }
        let [x, y, z] = [vertices.axis(0), vertices.axis(1), vertices.axis(2)];
        SharedTri4 { x, y, corners, geom: first, prim, z }
    }

    /// Whether no test can let a lane through.
    pub fn is_unused(&self, lane: usize) -> bool {
        (0..3).all(|corner| [0, 3, 6].into_iter().all(|row| self.coordinate(row, corner, lane).is_nan()))
    }

    /// The coordinates of all vertices on an axis: of four tables, the third is something else.
    #[inline(always)]
    fn axis(&self, row: usize) -> &[f32; VERTICES] {
        let tables: &[[f32; VERTICES]; 4] = bytemuck::cast_ref(self);
        &tables[row >> 1 & 3]
    }

    /// The numbers of the corners, with other bits above them, and the first geometry.
    #[inline(always)]
    fn numbers(&self) -> &Words {
        let quads: &[Words; 8] = bytemuck::cast_ref(self);
        &quads[4]
    }
}

impl TriangleBlock for SharedTri4 {
    #[inline(always)]
    fn prims(&self) -> &[u32; 4] {
        &self.prim
    }

    #[inline(always)]
    fn geom(&self, lane: usize) -> u32 {
        let behind = |corner: usize| u32::from(self.corners[corner][lane] >> BITS) << (corner as u32 * (8 - BITS));
        self.geom.wrapping_add(behind(0) | behind(1) | behind(2))
    }

    #[inline(always)]
    fn coordinate(&self, row: usize, corner: usize, lane: usize) -> f32 {
        // The masks spare bounds checks.
        self.axis(row)[usize::from(self.corners[corner][lane & 3] & 7)]
    }

    #[inline(always)]
    fn corners<'a, W: Wide>(
        wide: W,
        block: impl Fn(usize) -> &'a Self + Copy,
        row: impl Fn(usize, u32) -> usize + Copy,
    ) -> [[W::Lanes; 3]; 3] {
        let corners = wide.bytes(wide.gather(|ray| block(ray).numbers()));
        let x = wide.pick(|ray| block(ray).axis(row(ray, 0)), corners);
        let y = wide.pick(|ray| block(ray).axis(row(ray, 1)), corners);
        let z = wide.pick(|ray| block(ray).axis(row(ray, 2)), corners);
        [[x[0], y[0], z[0]], [x[1], y[1], z[1]], [x[2], y[2], z[2]]]
    }

    #[inline(always)]
    fn corners_for_all<W: Wide>(&self, wide: W, rows: [usize; 3]) -> [[W::Lanes; 3]; 3] {
        let corners = wide.bytes(wide.repeat(self.numbers()));
        let x = wide.pick_from_one(self.axis(rows[0]), corners);
        let y = wide.pick_from_one(self.axis(rows[1]), corners);
        let z = wide.pick_from_one(self.axis(rows[2]), corners);
        [[x[0], y[0], z[0]], [x[1], y[1], z[1]], [x[2], y[2], z[2]]]
    }
}

/// The vertices of some triangles, each once.
struct Vertices {
    /// By axis, their bits.
    axes: [[u32; VERTICES]; 3],
    len: usize,
}

impl Default for Vertices {
    fn default() -> Vertices {
        Vertices { axes: [[f32::NAN.to_bits(); VERTICES]; 3], len: 0 }
    }
}

impl Vertices {
    /// The numbers of the corners of one more triangle; `None` if there is no room. Those are the same whose bits are, whatever the
    /// indices in the mesh.
    #[inline]
    fn add(&mut self, corners: [Vec3; 3]) -> Option<[u8; 3]> {
        let mut numbers = [0; 3];
        for (number, corner) in numbers.iter_mut().zip(corners) {
            let [x, y, z] = corner.to_array().map(f32::to_bits);
            // All at once: where it is found is anybody's guess.
            let [xs, ys, zs] = &self.axes;
            let same =
                (0..VERTICES).fold(0, |same, i| same | u32::from((xs[i] == x) & (ys[i] == y) & (zs[i] == z)) << i);
            let vertex = (same | 1 << self.len).trailing_zeros() as usize;
            if vertex == self.len {
                for (axis, bits) in self.axes.iter_mut().zip([x, y, z]) {
                    *axis.get_mut(vertex)? = bits;
                }
                self.len += 1;
            }
            *number = vertex as u8;
        }
        Some(numbers)
    }

    /// Their coordinates on an axis.
    fn axis(&self, axis: usize) -> [f32; VERTICES] {
        self.axes[axis].map(f32::from_bits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::tri4::Tri4;
    use crate::simd::Tier;
    use crate::simd::wide::{MOST_LANES, WideKernel};
    use proptest::prelude::*;

    /// Triangles of so many vertices, any corner any of them.
    fn triangles(vertices: usize) -> impl Strategy<Value = Vec<[Vec3; 3]>> {
        let coordinate = prop_oneof![-10f32..10.0, Just(0.0f32), Just(-0.0f32), Just(1.0f32)];
        let vertex = proptest::array::uniform3(coordinate).prop_map(Vec3::from_array);
        let vertices = proptest::collection::vec(vertex, vertices);
        let corners = proptest::collection::vec(proptest::array::uniform3(any::<proptest::sample::Index>()), 1..=4);
        (vertices, corners).prop_map(|(vertices, corners)| {
            corners.iter().map(|corners| corners.map(|corner| *corner.get(&vertices))).collect()
        })
    }

    /// Geometries as far apart as a block can tell, in any order.
    fn geom(lane: usize) -> u32 {
        [100 + GEOMETRIES - 1, 100, 131, 1123][lane]
    }

    fn blocks(triangles: &[[Vec3; 3]]) -> (SharedTri4, Tri4) {
        let numbered = triangles.iter().enumerate().map(|(lane, &corners)| (40 + lane as u32, geom(lane), corners));
        let fitting = SharedTri4::fitting(numbered.clone().map(|(_, geom, corners)| (corners, geom)));
        let mut full = Tri4::EMPTY;
        for (lane, (prim, geom, corners)) in numbered.clone().take(fitting).enumerate() {
            full.set(lane, corners, prim, geom);
        }
        (SharedTri4::new(numbered.take(fitting)), full)
    }

    /// All lanes of all corners, for each ray another block and other axes, and for all the same.
    struct Corners<'a, B>(&'a [B; 4], [[usize; 3]; 4]);

    impl<B: TriangleBlock> WideKernel for Corners<'_, B> {
        type Output = (usize, Vec<[u32; 4]>);

        #[inline(always)]
        fn run<W: Wide>(self, wide: W) -> Self::Output {
            let Corners(blocks, rows) = self;
            let mut quads = Vec::with_capacity(2 * 9 * MOST_LANES / 4);
            let each = B::corners(wide, |ray| &blocks[ray], |ray, axis| rows[ray][axis as usize]);
            let all = blocks[1].corners_for_all(wide, rows[1]);
            for corner in 0..3 {
                for axis in 0..3 {
                    wide.scatter(each[corner][axis], |_, words| quads.push(words));
                    wide.scatter(all[corner][axis], |_, words| quads.push(words));
                }
            }
            (W::RAYS, quads)
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..Default::default() })]
        #[test]
        fn corners_are_those_of_full_blocks(four in proptest::array::uniform4((3usize..13).prop_flat_map(triangles))) {
            let blocks = four.each_ref().map(|triangles| blocks(triangles));
            let (shared, full) = (blocks.map(|(shared, _)| shared), blocks.map(|(_, full)| full));
            for (shared, full) in shared.iter().zip(&full) {
                prop_assert_eq!(shared.prims(), full.prims());
                for lane in 0..4 {
                    let used = full.prims()[lane] != MISS;
                    prop_assert_eq!(shared.is_unused(lane), !used);
                    prop_assert!(!used || shared.geom(lane) == full.geom(lane));
                    for (row, corner) in [0, 3, 6].into_iter().flat_map(|row| [(row, 0), (row, 1), (row, 2)]) {
                        let [a, b] = [shared.coordinate(row, corner, lane), full.coordinate(row, corner, lane)];
                        prop_assert!(a.to_bits() == b.to_bits());
                    }
                }
            }
            let rows = [[0, 3, 6], [3, 6, 0], [6, 0, 3], [3, 6, 0]];
            for tier in Tier::available() {
                let (rays, quads) = tier.run_wide(Corners(&shared, rows));
                prop_assert_eq!((rays, &quads), (rays, &tier.run_wide(Corners(&full, rows)).1), "{}", tier.name());
                prop_assert_eq!(quads.len(), 18 * rays);
            }
        }

        #[test]
        fn as_many_fit_as_have_room(triangles in (3usize..13).prop_flat_map(triangles)) {
            let fitting = SharedTri4::fitting(triangles.iter().map(|&corners| (corners, 0)));
            let vertices = |count: usize| {
                let mut all: Vec<[u32; 3]> =
                    triangles[..count].iter().flatten().map(|v| v.to_array().map(f32::to_bits)).collect();
                all.sort_unstable();
                all.dedup();
                all.len()
            };
            let fits = |count: usize| vertices(count) <= if count == 4 { 8 } else { 7 };
            let most = (1..=triangles.len()).filter(|&count| fits(count)).max();
            prop_assert_eq!(Some(fitting), most);
            prop_assert!(fitting >= triangles.len().min(2));
        }
    }

    #[test]
    fn geometries_may_be_some_way_apart() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let fitting = |geoms: [u32; 4]| SharedTri4::fitting(geoms.into_iter().map(|geom| (corners, geom)));
        assert_eq!(fitting([7; 4]), 4);
        assert_eq!(fitting([5, 4, 4 + GEOMETRIES - 1, 4]), 4);
        assert_eq!(fitting([5, 5, 5 + GEOMETRIES, 5]), 2);
        assert_eq!(fitting([MISS, 0, 0, 0]), 1);
        assert_eq!(SharedTri4::fitting(std::iter::empty()), 0);
    }
}
