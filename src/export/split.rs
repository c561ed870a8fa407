//! A mesh with every triangle split into N × N, computed vertex by vertex, so that the whole need not fit in memory.

use crate::scene::description::SceneDescription;
use crate::scene::procedural::noise::fractal;
use glam::Vec3;
use rayon::prelude::*;

/// Waves of noise on each mean edge of the coarse mesh: one, two and four.
const OCTAVES: u32 = 3;
/// Height of an octave to that of the one before.
const GAIN: f32 = 0.5;
/// Bound on the height of all octaves together; each one's values lie within ±1.
const HEIGHT: f32 = 1.75;

/// All meshes of a scene as one.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Unit vertex normals, one a position, or none.
    pub normals: Vec<Vec3>,
    /// Three vertex indices a triangle.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Takes the meshes of a scene. Normals are kept if all meshes have them. `None` if there are more than 2³¹ − 1
    /// vertices.
    pub fn of(description: SceneDescription) -> Option<Mesh> {
        let mut all = Mesh::default();
        for (number, mut mesh) in description.meshes.into_iter().enumerate() {
            let first = all.positions.len();
            i32::try_from(first + mesh.positions.len()).ok()?;
            if mesh.normals.is_empty() || all.normals.len() < first {
                all.normals.clear();
            } else {
                all.normals.append(&mut mesh.normals);
            }
            if number == 0 {
                // The first is taken whole: most scenes have one.
                (all.positions, all.triangles) = (mesh.positions, mesh.triangles);
            } else {
                all.positions.append(&mut mesh.positions);
                all.triangles.extend(mesh.triangles.iter().map(|t| t.map(|i| i + first as u32)));
            }
        }
        Some(all)
    }

    /// Mean length of the triangles' sides; 0 if there are none.
    fn mean_edge(&self) -> f32 {
        let side = |a: u32, b: u32| f64::from(self.positions[a as usize].distance(self.positions[b as usize]));
        // Added up in order, as floating point sums depend on it.
        let sum: f64 = self.triangles.iter().map(|&[a, b, c]| side(a, b) + side(b, c) + side(c, a)).sum();
        (sum / (3 * self.triangles.len()).max(1) as f64) as f32
    }
}

/// A mesh split and displaced. Its vertices are those of the coarse mesh, then `n − 1` on each of its edges, then those
/// inside its triangles; triangles keep their order and their winding.
///
/// Triangles that shared an edge share the vertices on it, and a vertex moves by a function of its position alone. So a
/// closed mesh stays closed, also where it holds together by equal positions rather than by common vertices.
#[derive(Debug)]
pub struct Split {
    mesh: Mesh,
    n: u32,
    /// Each edge once, its smaller vertex index in the upper half; ascending.
    edges: Vec<u64>,
    /// The edges of each triangle, from its first to its second vertex and so on.
    triangle_edges: Vec<[u32; 3]>,
    /// What stands inside a triangle: steps towards its second and third vertex.
    inner: Vec<[u32; 2]>,
    /// The corners of the small triangles, as steps of the same kind.
    pattern: Vec<[[u32; 2]; 3]>,
    /// Waves of noise a unit of length, and how far they move a vertex at most.
    noise: Option<(f32, f32)>,
}

impl Split {
    /// Prepares to split every triangle into `n × n`. Vertices move by up to `noise` times the mean edge of `mesh`.
    ///
    /// `Err` with the number of vertices or triangles if it exceeds 2³¹ − 1.
    pub fn new(mut mesh: Mesh, n: u32, noise: f32) -> Result<Split, u64> {
        let most = i32::MAX as u64;
        let triangles = mesh.triangles.len() as u64 * u64::from(n).pow(2);
        // Before any table grows with n.
        if triangles > most {
            return Err(triangles);
        }
        let mean = mesh.mean_edge();
        let noise = (noise > 0.0 && mean > 0.0).then(|| (1.0 / mean, noise * mean / HEIGHT));
        if n > 1 || noise.is_some() {
            mesh.normals = Vec::new();
        }
        let (mut edges, mut triangle_edges) = (Vec::new(), Vec::new());
        if n > 1 {
            edges = mesh.triangles.par_iter().flat_map_iter(|&t| sides(t)).collect();
            edges.par_sort_unstable();
            edges.dedup();
            let number = |edge: u64| edges.partition_point(|&e| e < edge) as u32;
            triangle_edges = mesh.triangles.par_iter().map(|&t| sides(t).map(number)).collect();
        }
        let inner = (1..n).flat_map(|j| (1..n - j).map(move |i| [i, j])).collect();
        let upright = (0..n).flat_map(|j| (0..n - j).map(move |i| [[i, j], [i + 1, j], [i, j + 1]]));
        let turned = (1..n).flat_map(|j| (1..=n - j).map(move |i| [[i, j - 1], [i, j], [i - 1, j]]));
        let pattern = upright.chain(turned).collect();
        let split = Split { mesh, n, edges, triangle_edges, inner, pattern, noise };
        match split.vertex_count() {
            vertices if vertices > most => Err(vertices),
            _ => Ok(split),
        }
    }

    /// How many vertices there are.
    pub fn vertex_count(&self) -> u64 {
        let on_edges = self.edges.len() as u64 * u64::from(self.n - 1);
        self.mesh.positions.len() as u64 + on_edges + self.mesh.triangles.len() as u64 * self.inner.len() as u64
    }

    /// How many triangles there are.
    pub fn triangle_count(&self) -> u64 {
        self.mesh.triangles.len() as u64 * u64::from(self.n).pow(2)
    }

    /// The unit normals; none if the mesh had none, or they are no longer true.
    pub fn normals(&self) -> &[Vec3] {
        &self.mesh.normals
    }

    /// Position of vertex `index`.
    pub fn vertex(&self, index: usize) -> Vec3 {
        let position = self.flat(index);
        let Some((frequency, height)) = self.noise else { return position };
        let moved = |seed| fractal(position * frequency, seed, OCTAVES, GAIN).value;
        position + height * Vec3::new(moved(1), moved(2), moved(3))
    }

    /// Where vertex `index` lies on the coarse mesh.
    fn flat(&self, index: usize) -> Vec3 {
        let positions = &self.mesh.positions;
        let Some(index) = index.checked_sub(positions.len()) else { return positions[index] };
        let between = self.n as usize - 1;
        if index < self.edges.len() * between {
            let edge = self.edges[index / between];
            let step = (index % between) as u32 + 1;
            let ends = [(edge >> 32) as usize, edge as u32 as usize].map(|end| positions[end]);
            return self.between(ends, step);
        }
        let index = index - self.edges.len() * between;
        let [a, b, c] = self.mesh.triangles[index / self.inner.len()].map(|i| positions[i as usize].as_dvec3());
        let [i, j] = self.inner[index % self.inner.len()].map(f64::from);
        ((a * (f64::from(self.n) - i - j) + b * i + c * j) / f64::from(self.n)).as_vec3()
    }

    /// The point `step` of n steps from the first to the second end: the same bits from either end.
    fn between(&self, [from, to]: [Vec3; 2], step: u32) -> Vec3 {
        let first = from.to_array().iter().zip(&to.to_array()).find_map(|(a, b)| {
            let order = a.total_cmp(b);
            order.is_ne().then_some(order)
        });
        let (from, to, step) =
            if first.is_some_and(|order| order.is_gt()) { (to, from, self.n - step) } else { (from, to, step) };
        let (from, to) = (from.as_dvec3(), to.as_dvec3());
        ((from * f64::from(self.n - step) + to * f64::from(step)) / f64::from(self.n)).as_vec3()
    }

    /// Vertex indices of triangle `index`.
    pub fn triangle(&self, index: usize) -> [u32; 3] {
        let coarse = index / self.pattern.len();
        self.pattern[index % self.pattern.len()].map(|steps| self.index(coarse, steps))
    }

    /// The vertex of a triangle at so many steps towards its second and third vertex.
    fn index(&self, triangle: usize, [i, j]: [u32; 2]) -> u32 {
        let n = self.n;
        let corners = self.mesh.triangles[triangle];
        match (i, j) {
            (0, 0) => corners[0],
            _ if i == n => corners[1],
            _ if j == n => corners[2],
            (_, 0) => self.on_edge(triangle, 0, i),
            _ if i + j == n => self.on_edge(triangle, 1, j),
            (0, _) => self.on_edge(triangle, 2, n - j),
            _ => {
                // Rows j = 1, 2, … hold n − 2, n − 3, … vertices.
                let row = (j - 1) * (n - 1) - j * (j - 1) / 2;
                let first = self.mesh.positions.len() + self.edges.len() * (n as usize - 1);
                (first + triangle * self.inner.len() + (row + i - 1) as usize) as u32
            }
        }
    }

    /// The vertex `step` steps along a side of a triangle, in the direction in which the triangle winds.
    fn on_edge(&self, triangle: usize, side: usize, step: u32) -> u32 {
        let corners = self.mesh.triangles[triangle];
        let edge = self.triangle_edges[triangle][side];
        let step = if corners[side] <= corners[(side + 1) % 3] { step } else { self.n - step };
        self.mesh.positions.len() as u32 + edge * (self.n - 1) + step - 1
    }
}

/// The sides of a triangle as keys: the smaller index in the upper half.
fn sides([a, b, c]: [u32; 3]) -> [u64; 3] {
    [(a, b), (b, c), (c, a)].map(|(a, b)| u64::from(a.min(b)) << 32 | u64::from(a.max(b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> Mesh {
        Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
            triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
            normals: vec![Vec3::X; 4],
        }
    }

    fn triangles(split: &Split) -> Vec<[u32; 3]> {
        (0..split.triangle_count() as usize).map(|i| split.triangle(i)).collect()
    }

    fn area([a, b, c]: [Vec3; 3]) -> Vec3 {
        (b - a).cross(c - a)
    }

    #[test]
    fn small_triangles_tile_the_large_ones_and_wind_like_them() {
        for n in 1..=9 {
            let split = Split::new(tetrahedron(), n, 0.0).unwrap();
            // Euler: V − E + F = 2, and a closed mesh has three edges to two triangles.
            assert_eq!(2 * split.vertex_count(), split.triangle_count() + 4, "{n}");
            let triangles = triangles(&split);
            let mut seen = vec![false; split.vertex_count() as usize];
            triangles.iter().flatten().for_each(|&v| seen[v as usize] = true);
            assert!(seen.iter().all(|&seen| seen), "every vertex is used");
            for (coarse, small) in tetrahedron().triangles.iter().zip(triangles.chunks((n * n) as usize)) {
                let whole = area(coarse.map(|i| tetrahedron().positions[i as usize]));
                for corners in small {
                    let part = area(corners.map(|i| split.vertex(i as usize))) * (n * n) as f32;
                    assert!(part.distance(whole) < 1e-4, "{n}: {part} {whole}");
                }
            }
        }
    }

    #[test]
    fn normals_are_kept_as_long_as_they_are_true() {
        assert_eq!(Split::new(tetrahedron(), 1, 0.0).unwrap().normals().len(), 4);
        assert!(Split::new(tetrahedron(), 1, 0.1).unwrap().normals().is_empty());
        assert!(Split::new(tetrahedron(), 2, 0.0).unwrap().normals().is_empty());
    }

    #[test]
    fn noise_moves_equal_positions_alike_and_within_its_bound() {
        // The same tetrahedron without common vertices, its second half numbered the other way round.
        let mesh = tetrahedron();
        let mut positions: Vec<Vec3> =
            mesh.triangles.iter().flatten().map(|&i| mesh.positions[i as usize] * 0.37 + 0.11).collect();
        positions[6..].reverse();
        let loose = Mesh { positions, triangles: vec![[0, 1, 2], [3, 4, 5], [11, 10, 9], [8, 7, 6]], ..mesh };
        let (split, flat) = (Split::new(loose.clone(), 5, 0.2).unwrap(), Split::new(loose, 5, 0.0).unwrap());
        let mut edges = std::collections::HashMap::new();
        let bits = |v: u32| split.vertex(v as usize).to_array().map(f32::to_bits);
        for [a, b, c] in triangles(&split) {
            for (a, b) in [(a, b), (b, c), (c, a)] {
                *edges.entry((bits(a), bits(b))).or_insert(0) += 1;
                *edges.entry((bits(b), bits(a))).or_insert(0) -= 1;
            }
        }
        assert!(edges.values().all(|&sum| sum == 0), "each edge runs once in each direction");
        let moved: Vec<f32> = (0..60).map(|v| split.vertex(v).distance(flat.vertex(v))).collect();
        assert!(moved.iter().all(|&d| d <= 0.2 * 0.5 * 3f32.sqrt()) && moved.iter().any(|&d| d > 0.0), "{moved:?}");
    }

    #[test]
    fn numbers_that_do_not_fit_are_refused() {
        assert_eq!(Split::new(tetrahedron(), 30_000, 0.0).unwrap_err(), 3_600_000_000);
    }
}
