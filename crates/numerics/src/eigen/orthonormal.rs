//! Columns that are orthonormal in the product of the mass, on all threads. The sums do not depend on the
//! number of threads.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, Mat, MatMut, MatRef, Par};
use nalgebra_sparse::CscMatrix;
use rayon::iter::{IndexedParallelIterator, ParallelIterator};

use crate::dense::parallel::product;
use crate::sparse::symmetric_product;

/// A column shorter than this, relative to the longest of all blocks, counts as a part of the
/// basis.
const DEPENDENT: f64 = 1e-12;
/// Fraction of the square of a column that must lie outside the others' span for it to be made
/// orthogonal to them in one step. The first of two rounds may leave an error of rounding over
/// this.
const INDEPENDENT: f64 = 1e-10;
/// Number of rows of one task.
pub(super) const ROWS: usize = 8192;

/// Makes the columns of `u`, already orthogonal to `basis` except for rounding, orthonormal in the
/// product of the mass. Those that depend on the others are dropped. Returns M u and R, old u = new
/// u R.
pub(super) fn orthonormalise(
    mass: &CscMatrix<f64>,
    basis: [MatRef<'_, f64>; 2],
    u: &mut Mat<f64>,
    longest: &mut f64,
) -> (Mat<f64>, Mat<f64>) {
    let mut remainder = Mat::<f64>::identity(u.ncols(), u.ncols());
    let mut weighted = symmetric_product(mass, u.as_ref());
    for round in 0..2 {
        if round > 0 {
            // A short column has been stretched, and its part in the basis with it.
            project_out(basis, u);
            weighted = symmetric_product(mass, u.as_ref());
        }
        let shortest = if round == 0 { *longest } else { 0.0 };
        if let Some(own) = whiten(u, &mut weighted, DEPENDENT * shortest) {
            if round == 0 {
                *longest = (0..own.ncols()).fold(*longest, |most, j| own[(j, j)].max(most));
            }
            remainder = product(own.as_ref(), remainder.as_ref());
            continue;
        }
        let (mut independent, mut own) = (Vec::new(), Mat::<f64>::zeros(u.ncols(), u.ncols()));
        for j in 0..u.ncols() {
            for (place, &i) in independent.iter().enumerate() {
                let share = dot(&weighted, i, u, j);
                own[(place, j)] = share;
                minus(u, j, share, i);
                minus(&mut weighted, j, share, i);
            }
            let length = dot(&weighted, j, u, j).max(0.0).sqrt();
            let bound = if round == 0 {
                *longest = length.max(*longest);
                DEPENDENT * *longest
            } else {
                0.0
            };
            if length > bound {
                own[(independent.len(), j)] = length;
                independent.push(j);
                for a in [&mut *u, &mut weighted] {
                    a.col_as_slice_mut(j).iter_mut().for_each(|v| *v /= length);
                }
            }
        }
        if independent.len() < u.ncols() {
            let chosen = |a: &Mat<f64>| {
                Mat::from_fn(a.nrows(), independent.len(), |i, j| a[(i, independent[j])])
            };
            (*u, weighted) = (chosen(u), chosen(&weighted));
        }
        remainder = product(own.get(..independent.len(), ..), remainder.as_ref());
    }
    (weighted, remainder)
}

/// Makes the columns of `u`, and `weighted` = M u, orthonormal by the Cholesky factor of u^T M u.
/// Returns R, old u = new u R. `None`, without a change, where a column depends on the others too
/// closely for that, or its independent part is shorter than `shortest`.
fn whiten(u: &mut Mat<f64>, weighted: &mut Mat<f64>, shortest: f64) -> Option<Mat<f64>> {
    let width = u.ncols();
    let mut l = gram(u.as_ref(), weighted.as_ref());
    for j in 0..width {
        let whole = l[(j, j)];
        for p in 0..j {
            let share = l[(j, p)];
            for i in j..width {
                l[(i, j)] -= share * l[(i, p)];
            }
        }
        let pivot = l[(j, j)];
        let independent = pivot > INDEPENDENT * whole && pivot.sqrt() > shortest;
        if !independent {
            return None;
        }
        for i in j..width {
            l[(i, j)] /= pivot.sqrt();
        }
    }
    for a in [u, weighted] {
        a.par_row_chunks_mut(ROWS).for_each(|rows| {
            solve_lower_triangular_in_place(l.as_ref(), rows.transpose_mut(), Par::Seq);
        });
    }
    Some(Mat::from_fn(width, width, |i, j| {
        if i <= j { l[(j, i)] } else { 0.0 }
    }))
}

/// Removes from `u` its part in the basis, which is given with its product by the mass. Returns the
/// coefficients of that part.
pub(super) fn project_out([basis, weighted]: [MatRef<'_, f64>; 2], u: &mut Mat<f64>) -> Mat<f64> {
    let shares = gram(weighted, u.as_ref());
    subtract(basis, shares.as_ref(), u.as_mut());
    shares
}

/// Product of column i of a and column j of b, on the calling thread.
fn dot(a: &Mat<f64>, i: usize, b: &Mat<f64>, j: usize) -> f64 {
    const LANES: usize = 16;
    let mut sums = [0.0; LANES];
    let (a, b) = (a.col_as_slice(i), b.col_as_slice(j));
    for (a, b) in a.chunks(LANES).zip(b.chunks(LANES)) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += a * b;
        }
    }
    sums.iter().sum()
}

/// Subtracts a share of column i from column j, i < j.
fn minus(a: &mut Mat<f64>, j: usize, share: f64, i: usize) {
    let (left, mut right) = a.as_mut().split_at_col_mut(j);
    let from = left.rb().col(i).try_as_col_major();
    let into = right.rb_mut().col_mut(0).try_as_col_major_mut();
    if let (Some(from), Some(into)) = (from, into) {
        for (into, from) in into.as_slice_mut().iter_mut().zip(from.as_slice()) {
            *into -= share * from;
        }
    }
}

/// Product a^T b, summed over fixed blocks of rows in their order.
fn gram(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let mut sum = Mat::zeros(a.ncols(), b.ncols());
    if a.nrows() == 0 || a.ncols() == 0 || b.ncols() == 0 {
        return sum;
    }
    let parts: Vec<Mat<f64>> = a
        .par_row_chunks(ROWS)
        .zip(b.par_row_chunks(ROWS))
        .map(|(a, b)| {
            let mut part = Mat::zeros(a.ncols(), b.ncols());
            matmul(&mut part, Accum::Replace, a.transpose(), b, 1.0, Par::Seq);
            part
        })
        .collect();
    for part in &parts {
        sum += part;
    }
    sum
}

/// Computes `u -= a shares`.
pub(super) fn subtract(a: MatRef<'_, f64>, shares: MatRef<'_, f64>, u: MatMut<'_, f64>) {
    if a.nrows() == 0 || a.ncols() == 0 || u.ncols() == 0 {
        return;
    }
    u.par_row_chunks_mut(ROWS)
        .zip(a.par_row_chunks(ROWS))
        .for_each(|(u, a)| matmul(u, Accum::Add, a, shares, -1.0, Par::Seq));
}
