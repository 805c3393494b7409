//! Dense symmetric matrices for products with a few vectors. Where they are large, the products are
//! bound by the memory that they read: only the lower triangle is read then, in blocks that stay in
//! a cache for both their products.

use faer::linalg::matmul::matmul;
use faer::prelude::ReborrowMut;
use faer::traits::{ComplexField, math_utils::one};
use faer::{Accum, Mat, MatMut, MatRef, Par};
use std::ops::Range;

/// Number of rows and columns of a block of a large matrix: 144 kB in single precision.
const BLOCK: usize = 192;
/// Most rows of a matrix that is one block: it stays in a cache as it is.
const ONE_BLOCK: usize = 1200;

/// Rows and columns of the blocks of a lower triangle, column of blocks by column of blocks.
fn lower_blocks(size: usize) -> impl Iterator<Item = [Range<usize>; 2]> {
    let block = if size <= ONE_BLOCK {
        size.max(1)
    } else {
        BLOCK
    };
    let places = move |first: usize| first..size.min(first + block);
    let columns = (0..size).step_by(block);
    columns.flat_map(move |column| {
        let rows = (column..size).step_by(block);
        rows.map(move |row| [places(row), places(column)])
    })
}

/// Computes y += a x with a symmetric a, of which the lower triangle alone is read where it is large,
/// on two threads.
pub fn add_symmetric_product(a: MatRef<'_, f64>, x: MatRef<'_, f64>, mut y: MatMut<'_, f64>) {
    let blocks: Vec<[Range<usize>; 2]> = lower_blocks(a.nrows()).collect();
    let add = |places: &[Range<usize>; 2], y: MatMut<'_, f64>| {
        let [rows, columns] = places.clone();
        add_block(a.get(rows, columns), places.clone(), x, y);
    };
    match &blocks[..] {
        [] => {}
        [whole] => add(whole, y),
        many => y += sum_in_halves(many.split_at(many.len() / 2), y.shape(), add),
    }
}

/// Products x^T A x of a symmetric A with each column of x; A is read as by [`add_symmetric_product`].
pub fn quadratic_forms(a: MatRef<'_, f64>, x: MatRef<'_, f64>) -> Vec<f64> {
    let mut moved = Mat::zeros(x.nrows(), x.ncols());
    add_symmetric_product(a, x, moved.as_mut());
    let columns = x.col_iter().zip(moved.col_iter());
    columns.map(|(x, moved)| x.transpose() * moved).collect()
}

/// Sum of what blocks add to zeros of this shape: that of the first and that of the second blocks on a
/// thread each. There are two sums whatever the number of threads.
fn sum_in_halves<T: ComplexField, B: Sync>(
    (first, second): (&[B], &[B]),
    (rows, columns): (usize, usize),
    add: impl Fn(&B, MatMut<'_, T>) + Sync,
) -> Mat<T> {
    let sum = |blocks: &[B]| {
        let mut y = Mat::zeros(rows, columns);
        blocks.iter().for_each(|block| add(block, y.as_mut()));
        y
    };
    let (first, second) = rayon::join(|| sum(first), || sum(second));
    first + second
}

/// Adds to y what a block of a symmetric matrix and its mirror image make of x.
fn add_block<T: ComplexField>(
    block: MatRef<'_, T>,
    [rows, columns]: [Range<usize>; 2],
    x: MatRef<'_, T>,
    mut y: MatMut<'_, T>,
) {
    let mut add = |to: Range<usize>, a, from: Range<usize>| {
        let y = y.rb_mut().get_mut(to, ..);
        matmul(y, Accum::Add, a, x.get(from, ..), one::<T>(), Par::Seq);
    };
    add(rows.clone(), block, columns.clone());
    if rows != columns {
        add(columns, block.transpose(), rows);
    }
}

/// Lower triangle of a symmetric matrix, by blocks.
#[derive(Debug)]
pub struct PackedSymmetric {
    /// Blocks of the lower triangle, column of blocks by column of blocks.
    blocks: Vec<PackedBlock>,
    /// Entries of all blocks, each by columns.
    entries: Vec<f32>,
    /// First block of the second half of the work.
    middle: usize,
}

#[derive(Debug)]
struct PackedBlock {
    /// Rows and columns.
    places: [Range<usize>; 2],
    /// Index of the first entry of the block in `entries`.
    start: usize,
}

impl PackedSymmetric {
    /// Packs rows and columns `indices` of `matrix`, whose lower triangle is read where `indices`
    /// ascend.
    pub fn new(matrix: MatRef<'_, f64>, indices: &[usize]) -> Self {
        let size = indices.len();
        let count = lower_blocks(size).map(|[rows, columns]| rows.len() * columns.len());
        let mut entries = Vec::with_capacity(count.sum());
        let mut blocks = vec![];
        for places in lower_blocks(size) {
            let start = entries.len();
            let [rows, columns] = places.clone().map(|of| &indices[of]);
            for &j in columns {
                entries.extend(rows.iter().map(|&i| matrix[(i, j)] as f32));
            }
            blocks.push(PackedBlock { places, start });
        }
        let middle = blocks.partition_point(|block| block.start < entries.len() / 2);
        Self {
            blocks,
            entries,
            middle,
        }
    }

    /// Returns `true` if the matrix is so small that it stays in a cache, in one block.
    pub fn is_one_block(&self) -> bool {
        self.blocks.len() <= 1
    }

    /// Computes y = A x, x and y of as many rows as A.
    pub fn times(&self, x: MatRef<'_, f32>, mut y: MatMut<'_, f32>) {
        let halves = self.blocks.split_at(self.middle);
        y.copy_from(sum_in_halves(halves, y.shape(), |block, y| {
            let places = block.places.clone();
            let [rows, columns] = places.each_ref().map(|of| of.len());
            let entries = &self.entries[block.start..block.start + rows * columns];
            let block = MatRef::from_column_major_slice(entries, rows, columns);
            add_block(block, places, x, y);
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_product_with_the_chosen_rows_and_columns() {
        let n = ONE_BLOCK + 50;
        let full = Mat::from_fn(n, n, |i, j| ((i + j) as f64).sin() + ((i * j) as f64).cos());
        // In blocks, in one block, and in one of a few rows.
        for step in [1, 2, 200] {
            let indices: Vec<usize> = (0..n).step_by(step).collect();
            let blocks = PackedSymmetric::new(full.as_ref(), &indices);
            let m = indices.len();
            let x = Mat::from_fn(m, 7, |i, j| ((i + 3 * j) as f32).cos());
            let mut y = Mat::zeros(m, 7);
            blocks.times(x.as_ref(), y.as_mut());
            for i in 0..m {
                for c in 0..7 {
                    let exact: f64 = (0..m)
                        .map(|j| full[(indices[i], indices[j])] * f64::from(x[(j, c)]))
                        .sum();
                    assert!((f64::from(y[(i, c)]) - exact).abs() < 2e-3);
                }
            }
        }
    }

    #[test]
    fn a_large_symmetric_matrix_is_read_by_its_lower_triangle() {
        for n in [ONE_BLOCK, ONE_BLOCK + 70] {
            let full = Mat::from_fn(n, n, |i, j| ((i + j) as f64).sin() + ((i * j) as f64).cos());
            let is_read = |i: usize, j: usize| n <= ONE_BLOCK || i / BLOCK >= j / BLOCK;
            let half = Mat::from_fn(n, n, |i, j| {
                if is_read(i, j) {
                    full[(i, j)]
                } else {
                    f64::NAN
                }
            });
            let x = Mat::from_fn(n, 3, |i, j| ((i + 5 * j) as f64).cos());
            let exact = crate::dense::product(full.as_ref(), x.as_ref());
            let mut product = Mat::zeros(n, 3);
            add_symmetric_product(half.as_ref(), x.as_ref(), product.as_mut());
            let off = &product - &exact;
            assert!(off.norm_max() < 1e-10, "{n}: {}", off.norm_max());
            let forms = quadratic_forms(half.as_ref(), x.as_ref());
            for (j, form) in forms.iter().enumerate() {
                let exact = x.col(j).transpose() * exact.col(j);
                assert!(
                    (form - exact).abs() < 1e-9 * exact.abs().max(1.0),
                    "{n}, {j}"
                );
            }
            assert_eq!(forms.len(), 3);
        }
    }
}
