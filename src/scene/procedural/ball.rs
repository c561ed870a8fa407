//! Closed meshes around the origin, of exactly as many triangles as asked for, with nearly equilateral triangles.
//!
//! Rings of vertices at constant latitude, their sizes in proportion to their circumference, are sewn together:
//! between rings of *a* and *b* vertices lie *a* + *b* triangles, and a pole closes the first and the last ring with
//! one triangle an edge. So *R* rings of sizes *kᵢ* make 2 Σ *kᵢ* triangles.

use glam::Vec3;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Which vertices and triangles a ball has; positions are for the caller to choose by direction.
pub struct Ball {
    /// For each ring, the number of its first vertex; at the end that of the south pole. Vertex 0 is the north pole.
    first_vertex: Vec<u32>,
}

impl Ball {
    /// The ball of `triangles` triangles, rounded down to an even number; `triangles` is at least 12.
    pub fn new(triangles: u64) -> Ball {
        let vertices = triangles / 2;
        // The side of an equilateral triangle with this share of the unit sphere, and the height of its band.
        let side = (16.0 * PI / (3f64.sqrt() * triangles as f64)).sqrt();
        let bands = PI / (side * 3f64.sqrt() / 2.0);
        let rings = (bands.round() as u64 - 1).clamp(2, vertices / 3);
        // Three a ring, and the rest by circumference; rounding the running total keeps the sum exact.
        let spare = (vertices - 3 * rings) as f64;
        let latitude = |ring: u64| PI * (ring + 1) as f64 / (rings + 1) as f64;
        let whole: f64 = (0..rings).map(|ring| latitude(ring).sin()).sum();
        let mut first_vertex = vec![1u32];
        let mut share = 0.0;
        for ring in 0..rings {
            share += latitude(ring).sin();
            first_vertex.push((1 + 3 * (ring + 1) + (spare * (share / whole)).round() as u64) as u32);
        }
        Ball { first_vertex }
    }

    fn rings(&self) -> usize {
        self.first_vertex.len() - 1
    }

    fn south_pole(&self) -> u32 {
        self.first_vertex[self.rings()]
    }

    fn ring_size(&self, ring: usize) -> u32 {
        self.first_vertex[ring + 1] - self.first_vertex[ring]
    }

    /// Unit direction of vertex `index`.
    fn direction(&self, index: u32) -> Vec3 {
        if index == 0 {
            return Vec3::Y;
        }
        if index == self.south_pole() {
            return Vec3::NEG_Y;
        }
        let ring = self.first_vertex.partition_point(|&first| first <= index) - 1;
        let around = 2.0 * PI * f64::from(index - self.first_vertex[ring]) / f64::from(self.ring_size(ring));
        let down = PI * (ring + 1) as f64 / (self.rings() + 1) as f64;
        Vec3::new((down.sin() * around.cos()) as f32, down.cos() as f32, (down.sin() * around.sin()) as f32)
    }

    /// Positions and unit normals, `surface` giving both by direction.
    pub fn vertices(&self, surface: impl Fn(Vec3) -> (Vec3, Vec3) + Sync) -> (Vec<Vec3>, Vec<Vec3>) {
        let (mut positions, mut normals) = (Vec::new(), Vec::new());
        (0..self.south_pole() + 1)
            .into_par_iter()
            .map(|index| surface(self.direction(index)))
            .unzip_into_vecs(&mut positions, &mut normals);
        (positions, normals)
    }

    /// Triangles, counter-clockwise seen from outside.
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        let mut triangles = Vec::new();
        (0..2 * (self.south_pole() - 1))
            .into_par_iter()
            .map(|index| self.triangle(index))
            .collect_into_vec(&mut triangles);
        triangles
    }

    /// Triangle `index`: every ring's vertex 𝑖 owns the edge to vertex 𝑖 + 1, with one triangle above and one below.
    fn triangle(&self, index: u32) -> [u32; 3] {
        let owner = 1 + index / 2;
        let ring = self.first_vertex.partition_point(|&first| first <= owner) - 1;
        let (first, size) = (self.first_vertex[ring], self.ring_size(ring));
        let i = owner - first;
        let next = first + (i + 1) % size;
        if index.is_multiple_of(2) {
            let apex = match ring {
                0 => 0,
                _ => {
                    let above = self.ring_size(ring - 1);
                    self.first_vertex[ring - 1] + edges_before_or_with(i, size, above) % above
                }
            };
            [apex, next, owner]
        } else {
            let apex = match ring + 1 {
                below if below == self.rings() => self.south_pole(),
                below => {
                    let size_below = self.ring_size(below);
                    self.first_vertex[below] + edges_before(i, size, size_below) % size_below
                }
            };
            [owner, next, apex]
        }
    }
}

/// How many edges of a ring of `other` have their middle at a smaller angle than edge `i` of a ring of `size`.
fn edges_before(i: u32, size: u32, other: u32) -> u32 {
    let (i, size, other) = (u64::from(i), u64::from(size), u64::from(other));
    (((2 * i + 1) * other - 1) / size).div_ceil(2) as u32
}

/// As [`edges_before`], or at the same angle: of two rings, the upper one's edge comes first.
fn edges_before_or_with(i: u32, size: u32, other: u32) -> u32 {
    let (i, size, other) = (u64::from(i), u64::from(size), u64::from(other));
    ((2 * i + 1) * other / size).div_ceil(2) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_even_number_of_triangles_can_be_had() {
        for triangles in (12..2000).step_by(2) {
            let ball = Ball::new(triangles);
            assert_eq!(ball.triangles().len() as u64, triangles);
            assert!((0..ball.rings()).all(|ring| ball.ring_size(ring) >= 3), "{triangles}");
        }
        assert_eq!(Ball::new(13).triangles().len(), 12);
    }

    #[test]
    fn triangles_are_nearly_equilateral() {
        let ball = Ball::new(20_000);
        let (positions, _) = ball.vertices(|d| (d, d));
        let worst = ball.triangles().into_iter().map(|t| {
            let [a, b, c] = t.map(|i| positions[i as usize]);
            let (ab, bc, ca) = (a.distance(b), b.distance(c), c.distance(a));
            ab.max(bc).max(ca) / ab.min(bc).min(ca)
        });
        assert!(worst.fold(0.0, f32::max) < 2.5);
    }
}
