//! Dense symmetric matrix for products with a few vectors, which are bound by the memory that they
//! read. It has single precision and only the lower triangle, packed in blocks that stay in the
//! first cache for both their products.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};

/// Number of rows and columns of a block: 36 kB.
const BLOCK: usize = 96;

/// Lower triangle of a symmetric matrix, by blocks.
#[derive(Debug)]
pub struct PackedSymmetric {
    size: usize,
    /// Blocks of the lower triangle, column of blocks by column of blocks.
    blocks: Vec<Block>,
    /// Entries of all blocks, each by columns.
    entries: Vec<f32>,
    /// First block of the second half of the work.
    middle: usize,
}

#[derive(Debug)]
struct Block {
    row: usize,
    column: usize,
    /// Index of the first entry of the block in `entries`.
    start: usize,
}

impl PackedSymmetric {
    /// Packs rows and columns `indices` of `matrix`, whose lower triangle is read where `indices`
    /// ascend.
    pub fn of(matrix: MatRef<'_, f64>, indices: &[usize]) -> Self {
        let size = indices.len();
        let mut blocks = vec![];
        let mut entries = Vec::with_capacity(size * (size + BLOCK) / 2 + BLOCK * BLOCK);
        for column in (0..size).step_by(BLOCK) {
            for row in (column..size).step_by(BLOCK) {
                let start = entries.len();
                blocks.push(Block { row, column, start });
                for &j in &indices[column..size.min(column + BLOCK)] {
                    let rows = &indices[row..size.min(row + BLOCK)];
                    entries.extend(rows.iter().map(|&i| matrix[(i, j)] as f32));
                }
            }
        }
        let middle = blocks.partition_point(|block| block.start < entries.len() / 2);
        Self {
            size,
            blocks,
            entries,
            middle,
        }
    }

    /// Computes y = A x, x and y of `size` rows.
    pub fn times(&self, x: MatRef<'_, f32>, mut y: MatMut<'_, f32>) {
        // Two sums, whatever the number of threads.
        let (mut first, mut second) = (Mat::zeros(0, 0), Mat::zeros(0, 0));
        let (blocks, others) = self.blocks.split_at(self.middle);
        rayon::join(
            || first = self.sum(blocks, x),
            || second = self.sum(others, x),
        );
        y.copy_from(first + second);
    }

    fn sum(&self, blocks: &[Block], x: MatRef<'_, f32>) -> Mat<f32> {
        let mut y = Mat::zeros(self.size, x.ncols());
        for &Block { row, column, start } in blocks {
            let rows = row..self.size.min(row + BLOCK);
            let columns = column..self.size.min(column + BLOCK);
            let entries = &self.entries[start..start + rows.len() * columns.len()];
            let block = MatRef::from_column_major_slice(entries, rows.len(), columns.len());
            let mut add = |to: std::ops::Range<usize>, a, from| {
                let y = y.get_mut(to, ..);
                matmul(y, Accum::Add, a, x.get(from, ..), 1.0, Par::Seq);
            };
            add(rows.clone(), block, columns.clone());
            if row != column {
                add(columns, block.transpose(), rows);
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
        let n = 3 * BLOCK + 50;
        let full = Mat::from_fn(n, n, |i, j| ((i + j) as f64).sin() + ((i * j) as f64).cos());
        for step in [1, 2, 200] {
            let indices: Vec<usize> = (0..n).step_by(step).collect();
            let blocks = PackedSymmetric::of(full.as_ref(), &indices);
            let m = indices.len();
            let x = Mat::from_fn(m, 7, |i, j| ((i + 3 * j) as f32).cos());
            let mut y = Mat::zeros(m, 7);
            blocks.times(x.as_ref(), y.as_mut());
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
