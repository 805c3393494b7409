//! Linear equations with a border: further unknowns, and as many further equations. Their part on the
//! pairs that move, where the others stick throughout.

use super::balance::Balance;
use dovetail_numerics::vector::{axpy, dot};
use faer::Mat;

/// Border of a linear system: further unknowns, such as the parameter of a curve, and as many
/// further equations.
pub(crate) struct Border {
    /// Derivative of the residual with respect to each further unknown.
    pub columns: Vec<Vec<f64>>,
    /// Coefficients of the other unknowns in each further equation.
    pub rows: Vec<Vec<f64>>,
    /// Coefficients of the further unknowns in each further equation.
    pub corner: Vec<Vec<f64>>,
}

impl Border {
    /// Border of the unknowns `columns` of each block of n.
    pub(crate) fn restricted(&self, n: usize, columns: &[usize]) -> Self {
        let restricted = |all: &[Vec<f64>]| all.iter().map(|v| restrict(v, n, columns)).collect();
        Self {
            columns: restricted(&self.columns),
            rows: restricted(&self.rows),
            corner: self.corner.clone(),
        }
    }

    /// Matrix with its columns and rows around `inner`.
    pub(crate) fn around(&self, inner: &Mat<f64>) -> Mat<f64> {
        let (own, further) = (inner.nrows(), self.columns.len());
        let mut out = Mat::zeros(own + further, own + further);
        for j in 0..own {
            let (into, below) = out.col_as_slice_mut(j).split_at_mut(own);
            into.copy_from_slice(inner.col_as_slice(j));
            below
                .iter_mut()
                .zip(&self.rows)
                .for_each(|(o, row)| *o = row[j]);
        }
        for (j, column) in self.columns.iter().enumerate() {
            let (into, below) = out.col_as_slice_mut(own + j).split_at_mut(own);
            into.copy_from_slice(column);
            below
                .iter_mut()
                .zip(&self.corner)
                .for_each(|(o, corner)| *o = corner[j]);
        }
        out
    }

    /// Solves the further equations for the further unknowns, where the other unknowns are zero.
    pub(crate) fn further_unknowns(&self, right: &[f64]) -> Vec<f64> {
        eliminated(self.corner.clone(), right.to_vec())
    }

    /// Right-hand sides of the further equations that are left beside z for the other unknowns.
    pub(crate) fn remaining_right_sides(&self, z: &[f64], right: &[f64]) -> Vec<f64> {
        let equations = right.iter().zip(&self.rows);
        equations.map(|(right, row)| right - dot(row, z)).collect()
    }
}

/// Solves a small system by elimination with row pivots.
pub(crate) fn eliminated(mut matrix: Vec<Vec<f64>>, mut right: Vec<f64>) -> Vec<f64> {
    let size = right.len();
    for step in 0..size {
        let larger = |a: &usize, b: &usize| {
            let [a, b] = [a, b].map(|row| matrix[*row][step].abs());
            a.total_cmp(&b)
        };
        let pivot = (step..size).max_by(larger).unwrap_or(step);
        matrix.swap(step, pivot);
        right.swap(step, pivot);
        for row in step + 1..size {
            let factor = matrix[row][step] / matrix[step][step];
            let (above, below) = matrix.split_at_mut(row);
            axpy(-factor, &above[step], &mut below[0]);
            right[row] -= factor * right[step];
        }
    }
    for row in (0..size).rev() {
        let known = dot(&matrix[row][row + 1..], &right[row + 1..]);
        right[row] = (right[row] - known) / matrix[row][row];
    }
    right
}

/// Linear equations J x = right, whose last entries belong to the border where there is one.
#[derive(Clone, Copy)]
pub(crate) struct Equations<'a> {
    pub border: Option<&'a Border>,
    pub right: &'a [f64],
}

/// Right-hand side that is left on the unknowns `columns`, and that of the border, once the other
/// pairs, which stick throughout, are solved for: eps x = right. Writes that x; on `columns` and the
/// border it is zero. `unbalanced` is (I - D) of forces on all pairs, on `columns`.
pub(crate) fn remaining_right_side(
    balance: &Balance,
    columns: &[usize],
    equations: Equations<'_>,
    x: &mut [f64],
    unbalanced: impl Fn(&[f64]) -> Vec<f64>,
) -> Vec<f64> {
    let Equations { border, right } = equations;
    let (n, width) = (
        balance.unknowns_per_block(),
        balance.setting.fourier.width(),
    );
    let unknowns = n * width;
    x[unknowns..].fill(0.0);
    for (i, (x, right)) in x[..unknowns].iter_mut().zip(right).enumerate() {
        *x = right / balance.eps_at(i);
    }
    // The others, a: J_aa x_a = right_a - (I - D) Lambda_as x_s.
    for &c in columns {
        (0..width).for_each(|h| x[h * n + c] = 0.0);
    }
    let mut rhs = restrict(&right[..unknowns], n, columns);
    if x[..unknowns].iter().any(|&d| d != 0.0) {
        let mut forces = vec![0.0; unknowns];
        balance.apply_stiffness(&x[..unknowns], &mut forces);
        for (r, moved) in rhs.iter_mut().zip(unbalanced(&forces)) {
            *r -= moved;
        }
    }
    if let Some(border) = border {
        rhs.extend(border.remaining_right_sides(&x[..unknowns], &right[unknowns..]));
    }
    rhs
}

/// Entries of the columns `columns`, block by block.
pub(crate) fn restrict(v: &[f64], n: usize, columns: &[usize]) -> Vec<f64> {
    v.chunks_exact(n)
        .flat_map(|block| columns.iter().map(|&c| block[c]))
        .collect()
}

/// Writes the values of the unknowns `columns`, block by block, into a vector of all pairs.
pub(crate) fn put_back(values: &[f64], n: usize, columns: &[usize], x: &mut [f64]) {
    if columns.is_empty() {
        return;
    }
    for (x, values) in x
        .chunks_exact_mut(n)
        .zip(values.chunks_exact(columns.len()))
    {
        columns.iter().zip(values).for_each(|(c, v)| x[*c] = *v);
    }
}
