//! A dense symmetric matrix for products with a few vectors, which are bound by the memory that they read: single
//! precision, the lower triangle alone, in tiles that stay in the first cache for both their products.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};

/// Rows and columns of a tile: 36 kB.
const TILE: usize = 96;

/// The lower triangle by tiles.
#[derive(Debug)]
pub struct SymmetricTiles {
    size: usize,
    /// Tiles of the lower triangle, column of tiles by column of tiles.
    tiles: Vec<Tile>,
    /// Entries of all tiles, each by columns.
    entries: Vec<f32>,
    /// The first tile of the second half of the work.
    middle: usize,
}

#[derive(Debug)]
struct Tile {
    row: usize,
    column: usize,
    /// In `entries`.
    start: usize,
}

impl SymmetricTiles {
    /// Rows and columns `indices` of `matrix`, whose lower triangle is read where `indices` ascend.
    pub fn of(matrix: MatRef<'_, f64>, indices: &[usize]) -> Self {
        let size = indices.len();
        let mut tiles = vec![];
        let mut entries = Vec::with_capacity(size * (size + TILE) / 2 + TILE * TILE);
        for column in (0..size).step_by(TILE) {
            for row in (column..size).step_by(TILE) {
                let start = entries.len();
                tiles.push(Tile { row, column, start });
                for &j in &indices[column..size.min(column + TILE)] {
                    let rows = &indices[row..size.min(row + TILE)];
                    entries.extend(rows.iter().map(|&i| matrix[(i, j)] as f32));
                }
            }
        }
        let middle = tiles.partition_point(|tile| tile.start < entries.len() / 2);
        Self {
            size,
            tiles,
            entries,
            middle,
        }
    }

    /// y = A x, x and y of `size` rows.
    pub fn times(&self, x: MatRef<'_, f32>, mut y: MatMut<'_, f32>) {
        // Two sums, whatever the number of threads.
        let (mut first, mut second) = (Mat::zeros(0, 0), Mat::zeros(0, 0));
        let (tiles, others) = self.tiles.split_at(self.middle);
        rayon::join(
            || first = self.sum(tiles, x),
            || second = self.sum(others, x),
        );
        y.copy_from(first + second);
    }

    fn sum(&self, tiles: &[Tile], x: MatRef<'_, f32>) -> Mat<f32> {
        let mut y = Mat::zeros(self.size, x.ncols());
        for &Tile { row, column, start } in tiles {
            let rows = row..self.size.min(row + TILE);
            let columns = column..self.size.min(column + TILE);
            let entries = &self.entries[start..start + rows.len() * columns.len()];
            let tile = MatRef::from_column_major_slice(entries, rows.len(), columns.len());
            let mut add = |to: std::ops::Range<usize>, a, from| {
                let y = y.get_mut(to, ..);
                matmul(y, Accum::Add, a, x.get(from, ..), 1.0, Par::Seq);
            };
            add(rows.clone(), tile, columns.clone());
            if row != column {
                add(columns, tile.transpose(), rows);
            }
        }
        y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_product_with_the_chosen_rows_and_columns() {
        let n = 3 * TILE + 50;
        let full = Mat::from_fn(n, n, |i, j| ((i + j) as f64).sin() + ((i * j) as f64).cos());
        for step in [1, 2, 200] {
            let indices: Vec<usize> = (0..n).step_by(step).collect();
            let tiles = SymmetricTiles::of(full.as_ref(), &indices);
            let m = indices.len();
            let x = Mat::from_fn(m, 7, |i, j| ((i + 3 * j) as f32).cos());
            let mut y = Mat::zeros(m, 7);
            tiles.times(x.as_ref(), y.as_mut());
            for i in 0..m {
                for c in 0..7 {
                    let exact: f64 = (0..m)
                        .map(|j| full[(indices[i], indices[j])] * f64::from(x[(j, c)]))
                        .sum();
                    assert!((f64::from(y[(i, c)]) - exact).abs() < 1e-3);
                }
            }
        }
    }
}
