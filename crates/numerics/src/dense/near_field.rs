//! Near field of a dense symmetric matrix: its blocks of 3 x 3 that are not small beside the diagonal,
//! in single precision, for products with a few vectors.

use faer::{Mat, MatRef};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::ops::Range;

/// Number of columns that are multiplied together: a vector of the processor.
const LANES: usize = 8;

/// Block of 3 x 3, by rows.
type PairBlock = [f32; 9];

/// Blocks of 3 x 3 of a symmetric matrix, by rows of blocks.
#[derive(Debug)]
pub struct NearField {
    /// First block of each row of blocks, and the number of blocks.
    starts: Vec<usize>,
    /// Column of each block, counted in blocks.
    columns: Vec<u32>,
    blocks: Vec<PairBlock>,
}

impl NearField {
    /// Blocks of rows and columns `indices` of `matrix`, three by three, whose lower triangle is read
    /// where `indices` ascend. A block A_ij is among them where the Frobenius norm of
    /// `A_ii^-1/2 A_ij A_jj^-1/2`, with diagonals alone, is above `least`, and where i = j.
    pub fn new(matrix: MatRef<'_, f64>, indices: &[usize], least: f64) -> Self {
        let count = indices.len() / 3;
        let diagonal = |&i: &usize| matrix[(i, i)].abs().sqrt();
        let roots: Vec<f64> = indices.iter().map(diagonal).collect();
        let on_and_below = |column: usize| -> Vec<(usize, PairBlock)> {
            let block = |row: usize| {
                let place = |k: usize| [3 * row + k / 3, 3 * column + k % 3];
                let values: [f64; 9] = std::array::from_fn(|k| {
                    let [i, j] = place(k).map(|at| indices[at]);
                    matrix[(i.max(j), i.min(j))]
                });
                let scaled = values.iter().enumerate().map(|(k, value)| {
                    let [i, j] = place(k);
                    (value / (roots[i] * roots[j])).powi(2)
                });
                let is_near = row == column || scaled.sum::<f64>() > least * least;
                is_near.then(|| (row, values.map(|v| v as f32)))
            };
            (column..count).filter_map(block).collect()
        };
        let lower: Vec<_> = (0..count).into_par_iter().map(on_and_below).collect();
        let mut rows: Vec<Vec<(u32, PairBlock)>> = vec![Vec::new(); count];
        // By ascending columns: first those left of the diagonal.
        for (column, below) in lower.iter().enumerate() {
            for (row, block) in below {
                rows[*row].push((column as u32, *block));
            }
        }
        for (row, right) in lower.iter().enumerate() {
            let mirrored = right.iter().filter(|(column, _)| *column != row);
            rows[row].extend(mirrored.map(|(column, block)| {
                let transposed = std::array::from_fn(|k| block[3 * (k % 3) + k / 3]);
                (*column as u32, transposed)
            }));
        }
        let ends = rows.iter().scan(0, |end, row| {
            *end += row.len();
            Some(*end)
        });
        let starts = std::iter::once(0).chain(ends).collect();
        let (columns, blocks) = rows.into_iter().flatten().unzip();
        Self {
            starts,
            columns,
            blocks,
        }
    }

    /// Number of blocks.
    pub fn blocks(&self) -> usize {
        self.blocks.len()
    }

    /// Product with x.
    pub fn times(&self, x: MatRef<'_, f32>) -> Mat<f32> {
        let mut y = Mat::zeros(x.nrows(), x.ncols());
        for first in (0..x.ncols()).step_by(LANES) {
            let columns = first..x.ncols().min(first + LANES);
            if columns.len() == 1 {
                self.columns_times::<1>(x, columns, &mut y);
            } else {
                self.columns_times::<LANES>(x, columns, &mut y);
            }
        }
        y
    }

    /// Product with some columns of x, at most N.
    fn columns_times<const N: usize>(
        &self,
        x: MatRef<'_, f32>,
        columns: Range<usize>,
        y: &mut Mat<f32>,
    ) {
        let mut packed = vec![[0.0_f32; N]; x.nrows()];
        for (lane, column) in columns.clone().enumerate() {
            for (packed, v) in packed.iter_mut().zip(x.col(column).iter()) {
                packed[lane] = *v;
            }
        }
        let mut out = vec![[0.0_f32; N]; x.nrows()];
        let rows = self.starts.len() - 1;
        let middle = self.starts[..rows].partition_point(|start| *start < self.blocks() / 2);
        let (first, second) = out.split_at_mut(3 * middle);
        let of_rows = |rows: Range<usize>, out: &mut [[f32; N]]| {
            let x = &packed;
            Arch::new().dispatch(Rows {
                of: self,
                rows,
                x,
                out,
            });
        };
        rayon::join(
            || of_rows(0..middle, first),
            || of_rows(middle..rows, second),
        );
        for (lane, column) in columns.enumerate() {
            for (y, out) in y.col_as_slice_mut(column).iter_mut().zip(&out) {
                *y = out[lane];
            }
        }
    }
}

/// Product of some rows of blocks with N columns, with the widest vectors of the processor.
struct Rows<'a, const N: usize> {
    of: &'a NearField,
    rows: Range<usize>,
    x: &'a [[f32; N]],
    out: &'a mut [[f32; N]],
}

impl<const N: usize> WithSimd for Rows<'_, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { of, rows, x, out } = self;
        for (row, out) in rows.zip(out.chunks_exact_mut(3)) {
            let mut sums = [[0.0_f32; N]; 3];
            let range = of.starts[row]..of.starts[row + 1];
            for (block, column) in of.blocks[range.clone()].iter().zip(&of.columns[range]) {
                let x = &x[3 * *column as usize..][..3];
                for (sum, by) in sums.iter_mut().zip(block.chunks_exact(3)) {
                    for (by, x) in by.iter().zip(x) {
                        sum.iter_mut().zip(x).for_each(|(s, x)| *s += by * x);
                    }
                }
            }
            out.copy_from_slice(&sums);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_product_with_the_blocks_that_couple() {
        let n = 3 * 40;
        // Blocks couple by the distance of their numbers, and rows have units of their own.
        let unit = |i: usize| 1.0 + (i % 7) as f64;
        let entry = |i: usize, j: usize| {
            let apart = (i / 3).abs_diff(j / 3) as f64;
            let own = if i == j { 1.0 } else { 0.1 };
            own * (-apart).exp() * unit(i) * unit(j)
        };
        let full = Mat::from_fn(n, n, entry);
        let indices: Vec<usize> = (0..n).filter(|i| (i / 3) % 4 != 1).collect();
        let m = indices.len();
        for columns in [1, 3, 8, 11] {
            let near = NearField::new(full.as_ref(), &indices, 1e-3);
            let x = Mat::from_fn(m, columns, |i, j| ((i + 3 * j) as f32).cos());
            let y = near.times(x.as_ref());
            let mut blocks = 0;
            let mut exact = Mat::<f64>::zeros(m, columns);
            for (row, column) in (0..m / 3).flat_map(|i| (0..m / 3).map(move |j| (i, j))) {
                let apart = (indices[3 * row] / 3).abs_diff(indices[3 * column] / 3) as f64;
                let norm = if apart == 0.0 {
                    1.0
                } else {
                    0.3 * (-apart).exp()
                };
                if norm <= 1e-3 {
                    continue;
                }
                blocks += 1;
                for (i, j) in (0..9).map(|k| (3 * row + k / 3, 3 * column + k % 3)) {
                    for c in 0..columns {
                        exact[(i, c)] += full[(indices[i], indices[j])] * f64::from(x[(j, c)]);
                    }
                }
            }
            assert_eq!(near.blocks(), blocks);
            for (i, c) in (0..m).flat_map(|i| (0..columns).map(move |c| (i, c))) {
                assert!(
                    (f64::from(y[(i, c)]) - exact[(i, c)]).abs() < 1e-3,
                    "{i} {c}"
                );
            }
        }
    }
}
