//! Meshes over a rectangle of parameters, open or closed to a ring in both directions.

use glam::Vec3;
use rayon::prelude::*;

/// A grid of cells of two triangles each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// Cells in the first direction.
    pub columns: u32,
    /// Cells in the second direction.
    pub rows: u32,
    /// Both directions close to rings; otherwise the grid has four edges.
    pub closed: bool,
}

impl Grid {
    /// A grid of about `triangles` triangles and `aspect` columns a row, of all such near that shape the one whose
    /// number of triangles is nearest. A closed one has at least 18 triangles, an open one 12.
    pub fn new(triangles: u64, aspect: f64, closed: bool) -> Grid {
        let cells = (triangles / 2).max(if closed { 9 } else { 6 });
        let least = if closed { 3 } else { 1 };
        let ideal = (cells as f64 / aspect).sqrt();
        let low = ((ideal * 0.75) as u64).max(least);
        let high = ((ideal * 1.35).ceil() as u64).max(low);
        let columns_for = |rows: u64| ((cells as f64 / rows as f64).round() as u64).max(least);
        let rows = (low..=high)
            .min_by_key(|&rows| (rows * columns_for(rows)).abs_diff(cells))
            .expect("the range of rows is not empty");
        Grid { columns: columns_for(rows) as u32, rows: rows as u32, closed }
    }

    fn vertex_columns(&self) -> u32 {
        if self.closed { self.columns } else { self.columns + 1 }
    }

    fn vertex_rows(&self) -> u32 {
        if self.closed { self.rows } else { self.rows + 1 }
    }

    /// Positions and unit normals, `surface` giving both by column and row of the vertex.
    pub fn vertices(&self, surface: impl Fn(u32, u32) -> (Vec3, Vec3) + Sync) -> (Vec<Vec3>, Vec<Vec3>) {
        let width = self.vertex_columns();
        let (mut positions, mut normals) = (Vec::new(), Vec::new());
        (0..width * self.vertex_rows())
            .into_par_iter()
            .map(|index| surface(index % width, index / width))
            .unzip_into_vecs(&mut positions, &mut normals);
        (positions, normals)
    }

    /// Triangles, counter-clockwise where column and row increase to the right and upwards.
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        let (width, height) = (self.vertex_columns(), self.vertex_rows());
        let mut triangles = Vec::new();
        (0..2 * self.columns * self.rows)
            .into_par_iter()
            .map(|index| {
                let (column, row) = (index / 2 % self.columns, index / 2 / self.columns);
                let at = |right: u32, up: u32| (column + right) % width + (row + up) % height * width;
                if index.is_multiple_of(2) { [at(0, 0), at(1, 0), at(1, 1)] } else { [at(0, 0), at(1, 1), at(0, 1)] }
            })
            .collect_into_vec(&mut triangles);
        triangles
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_come_within_a_percent_or_two() {
        for closed in [false, true] {
            for aspect in [1.0, 3.0, 12.0] {
                for triangles in [100u64, 999, 1000, 12_345, 1_000_000, 29_999_999] {
                    let grid = Grid::new(triangles, aspect, closed);
                    let made = 2 * u64::from(grid.columns) * u64::from(grid.rows);
                    assert!(made.abs_diff(triangles) * 50 <= triangles, "{triangles}: {made}");
                }
            }
        }
    }

    #[test]
    fn the_smallest_grids_are_whole() {
        for aspect in [1.0, 12.0] {
            let torus = Grid::new(12, aspect, true);
            assert_eq!((torus.columns, torus.rows), (3, 3));
            assert_eq!(Grid::new(12, aspect, false).triangles().len(), 12);
        }
    }
}
