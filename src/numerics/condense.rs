//! Static condensation in the course of a Cholesky factorisation.
//!
//! Unknowns in two parts, interior i and boundary b; with the constraint modes Psi = -K_ii^-1 K_ib,
//!
//! ```text
//! K = K_bb + K_bi Psi                                             (the Schur complement of K_ii)
//! M = M_bb + M_bi Psi + Psi^T M_ib + Psi^T M_ii Psi               (Guyan's mass)
//! ```
//!
//! M is the derivative of the Schur complement of K + s M by s at s = 0. So both come out of one
//! multifrontal elimination (Duff, Reid, ACM Trans. Math. Softw. 9 (1983) 302-325) that carries, beside
//! each frontal matrix, its derivative: eliminating the unknowns 1 of the front `[F_11 F_21^T; F_21 F_22]`
//! with derivative D,
//!
//! ```text
//! F_22 := F_22 - F_21 F_11^-1 F_21^T
//! D_22 := D_22 - G P - (G P)^T      P = F_11^-1 F_21^T    G = D_21 - P^T T    T + T^T = D_11
//! ```
//!
//! with T lower triangular. No constraint mode is ever formed. The boundary takes part as rows below the
//! interior ones of each front ([`super::fronts`]), so the factor of K_ii is the one an ordinary factorisation gives.

use std::sync::Mutex;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{
    LltRegularization, cholesky_in_place, cholesky_in_place_scratch,
};
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, Mat, MatMut, MatRef, Par, Spec};
use nalgebra_sparse::CscMatrix;

use super::factor::{Cholesky, FactorError, Symbolic, zeros};
use super::fronts::{Left, Lower, Tree, in_rows, mirror, remainder};
use super::pool::Pool;
use super::sparse::submatrix;

/// K_ii = L L^T, and what is left on the boundary.
#[derive(Debug)]
pub struct Condensed {
    pub factor: Cholesky,
    /// Boundary x boundary, symmetric to the last bit.
    pub stiffness: Mat<f64>,
    /// Likewise.
    pub mass: Mat<f64>,
}

/// Condenses symmetric matrices (both triangles stored) whose first `interior` unknowns, in nodes of
/// three, are eliminated. M has no entry where K has none.
///
/// # Errors
/// Those of [`Symbolic::analyse`] and [`Symbolic::cholesky`] for K_ii; [`FactorError::PatternDiffers`]
/// where the mass couples what the stiffness does not.
pub fn condense(
    stiffness: &CscMatrix<f64>,
    mass: &CscMatrix<f64>,
    interior: usize,
) -> Result<Condensed, FactorError> {
    let inner: Vec<usize> = (0..interior).collect();
    let k_ii = submatrix(stiffness, &inner, &inner);
    let symbolic = Symbolic::analyse(&k_ii)?;
    symbolic.check(&k_ii)?;
    let mut values = zeros(symbolic.factor_entries(), interior)?;
    let boundary = stiffness.ncols() - interior;
    let Some(supernodal) = symbolic.supernodal() else {
        // Nothing is inside.
        let whole: Vec<usize> = (0..boundary).collect();
        return Ok(Condensed {
            factor: symbolic.factored(values, &k_ii)?,
            stiffness: super::sparse::dense(&submatrix(stiffness, &whole, &whole)),
            mass: super::sparse::dense(&submatrix(mass, &whole, &whole)),
        });
    };
    let tree = Tree::new(supernodal, &symbolic, stiffness);
    let slots = slots(&tree, &mut values);
    let pool = Pool::default();
    let elimination = Elimination {
        tree: &tree,
        pool: &pool,
        matrices: [stiffness, mass],
        interior,
        slots,
    };
    let condensed = elimination.run(boundary);
    drop(elimination);
    drop(pool);
    match condensed {
        Ok([stiffness, mass]) => Ok(Condensed {
            factor: symbolic.factored(values, &k_ii)?,
            stiffness,
            mass,
        }),
        Err(Stopped::Pattern) => Err(FactorError::PatternDiffers),
        Err(Stopped::Pivot) => {
            drop(values);
            // Found again by the plain factorisation, which says where and why.
            symbolic.cholesky(&k_ii)?;
            Err(FactorError::PatternDiffers)
        }
    }
}

enum Stopped {
    Pivot,
    Pattern,
}

/// The place of each supernode in the values of the factor.
fn slots<'v>(tree: &Tree<'_>, mut values: &'v mut [f64]) -> Vec<Mutex<&'v mut [f64]>> {
    let starts = tree.supernodes.col_ptr_for_val();
    (0..tree.children.len())
        .map(|s| {
            let (slot, rest) = std::mem::take(&mut values).split_at_mut(starts[s + 1] - starts[s]);
            values = rest;
            Mutex::new(slot)
        })
        .collect()
}

/// What a branch of the tree leaves to its parent: K and M on the rows below its last columns.
type Rest<'a> = [Lower<'a>; 2];

struct Elimination<'a> {
    tree: &'a Tree<'a>,
    pool: &'a Pool,
    matrices: [&'a CscMatrix<f64>; 2],
    interior: usize,
    slots: Vec<Mutex<&'a mut [f64]>>,
}

impl<'a> Elimination<'a> {
    /// K and M condensed on the boundary.
    fn run(&self, boundary: usize) -> Result<[Mat<f64>; 2], Stopped> {
        let roots: Vec<Rest> = self
            .tree
            .branches(&self.tree.roots, |s| self.eliminate(s))?;
        let mut sums = [(); 2].map(|()| Mat::zeros(boundary, boundary));
        for (&root, rests) in self.tree.roots.iter().zip(roots) {
            for (sum, rest) in sums.iter_mut().zip(rests) {
                rest.add_to(sum, &self.tree.boundary[root]);
            }
        }
        for (sum, matrix) in sums.iter_mut().zip(self.matrices) {
            for j in 0..boundary {
                let column = matrix.col(self.interior + j);
                for (&i, v) in column.row_indices().iter().zip(column.values()) {
                    if let Some(i) = i.checked_sub(self.interior).filter(|&i| i >= j) {
                        sum[(i, j)] += v;
                    }
                }
            }
            mirror(sum.as_mut());
        }
        Ok(sums)
    }

    fn eliminate(&self, s: usize) -> Result<Rest<'a>, Stopped> {
        let (tree, pool) = (self.tree, self.pool);
        let left = tree.branches(&tree.children[s], |s| self.eliminate(s))?;
        let mut children = [(); 2].map(|()| Vec::with_capacity(left.len()));
        for (&child, rests) in tree.children[s].iter().zip(left) {
            let rows = tree.rows_of_child(s, child).ok_or(Stopped::Pattern)?;
            for (children, rest) in children.iter_mut().zip(rests) {
                let rows = rows.clone();
                children.push(Left { rest, rows });
            }
        }
        let width = tree.columns(s).len();
        let inner = tree.supernodes.supernode(s).pattern().len();
        let below = inner + tree.boundary[s].len();
        let mut fronts = [(); 2].map(|()| pool.zeros((width + below) * width));
        let [mut stiffness, mut mass] = fronts
            .each_mut()
            .map(|front| MatMut::from_column_major_slice_mut(front, width + below, width));
        for (front, (matrix, children)) in [&mut stiffness, &mut mass]
            .into_iter()
            .zip(self.matrices.iter().zip(&children))
        {
            for child in children {
                child.add_to_front(front);
            }
            tree.add_entries(s, matrix, front).ok_or(Stopped::Pattern)?;
        }
        factor_front(stiffness.rb_mut(), width)?;
        {
            let mut slot = self.slots[s].lock().unwrap_or_else(|e| e.into_inner());
            let slot = MatMut::from_column_major_slice_mut(*slot, width + inner, width);
            { slot }.copy_from(stiffness.rb().subrows(0, width + inner));
        }
        let factor = stiffness.rb();
        let lower = factor.get(width.., ..);
        let [stiffness_children, mass_children] = children;
        let stiffness_rest = remainder(pool, width, lower, lower, &stiffness_children);
        drop(stiffness_children);
        let mass_rest = condense_mass(pool, factor, mass, &mass_children);
        Ok([stiffness_rest, mass_rest])
    }
}

/// Cholesky factor of the first `width` rows, and the rows below solved with it, in place.
fn factor_front(front: MatMut<'_, f64>, width: usize) -> Result<(), Stopped> {
    let (mut pivots, below) = front.split_at_row_mut(width);
    let params = Spec::default();
    let scratch = cholesky_in_place_scratch::<f64>(width, Par::Seq, params);
    cholesky_in_place(
        pivots.rb_mut(),
        LltRegularization::default(),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        params,
    )
    .map_err(|_| Stopped::Pivot)?;
    let pivots = pivots.rb();
    in_rows(below, |_, rows| {
        solve_lower_triangular_in_place(pivots, rows.transpose_mut(), Par::Seq);
    });
    Ok(())
}

/// The derivative's part of an elimination: what the children left, less G P + (G P)^T.
fn condense_mass<'p>(
    pool: &'p Pool,
    factor: MatRef<'_, f64>,
    mass: MatMut<'_, f64>,
    children: &[Left<'_>],
) -> Lower<'p> {
    let width = factor.ncols();
    let (pivots, below) = factor.split_at_row(width);
    let height = below.nrows();
    // [P^T G] and, columns swapped, [G P^T].
    let mut sides = [(); 2].map(|()| pool.stale(height * 2 * width));
    let [mut left, mut right] = sides
        .each_mut()
        .map(|side| MatMut::from_column_major_slice_mut(side, height, 2 * width));
    let (mut p, mut g) = left.rb_mut().split_at_col_mut(width);
    p.copy_from(below);
    in_rows(p.rb_mut(), |_, rows| {
        solve_upper_triangular_in_place(pivots.transpose(), rows.transpose_mut(), Par::Seq);
    });
    let (mut half, lower) = mass.split_at_row_mut(width);
    for j in 0..width {
        half[(j, j)] *= 0.5;
    }
    g.copy_from(lower);
    let p = p.rb();
    in_rows(g.rb_mut(), |start, rows| {
        let p = p.get(start..start + rows.nrows(), ..);
        triangular::matmul(
            rows,
            BlockStructure::Rectangular,
            Accum::Add,
            p,
            BlockStructure::Rectangular,
            half.rb(),
            BlockStructure::TriangularLower,
            -1.0,
            Par::Seq,
        );
    });
    right.rb_mut().subcols_mut(0, width).copy_from(g.rb());
    right.rb_mut().subcols_mut(width, width).copy_from(p);
    remainder(pool, width, left.rb(), right.rb(), children)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::lattice::Lattice;
    use crate::numerics::sparse::{dense, sum};
    use faer::linalg::solvers::Solve;

    /// A cantilever; whichever of its unknowns stand last will be the boundary.
    fn matrices(shape: [usize; 3]) -> (CscMatrix<f64>, CscMatrix<f64>) {
        Lattice {
            shape,
            stiffness: 3e7,
            mass: 0.2,
            irregularity: 0.4,
        }
        .cantilever()
    }

    /// By constraint modes, dense.
    fn exact(k: &CscMatrix<f64>, m: &CscMatrix<f64>, interior: usize) -> [Mat<f64>; 2] {
        let (k, m) = (dense(k), dense(m));
        let (i, b) = (0..interior, interior..k.nrows());
        let llt = k.get(i.clone(), i.clone()).llt(faer::Side::Lower);
        let psi = -llt.unwrap().solve(k.get(i.clone(), b.clone()));
        let stiffness = k.get(b.clone(), b.clone()) + k.get(b.clone(), i.clone()) * &psi;
        let half = m.get(b.clone(), i.clone()) * &psi;
        let mass = m.get(b.clone(), b)
            + &half
            + half.transpose()
            + psi.transpose() * (m.get(i.clone(), i) * &psi);
        [stiffness, mass]
    }

    #[test]
    fn it_is_the_condensation_by_constraint_modes() {
        // The last one has fronts of several blocks.
        for (shape, boundary) in [([6, 4, 3], 30), ([9, 5, 4], 99), ([9, 14, 14], 1176)] {
            let (k, m) = matrices(shape);
            // A mass that couples the axes too, on the pattern of K.
            let m = sum(&m, 1e-9, &k);
            let interior = k.nrows() - boundary;
            let found = condense(&k, &m, interior).unwrap();
            let [stiffness, mass] = exact(&k, &m, interior);
            let error = |a: &Mat<f64>, b: &Mat<f64>| (a - b).norm_max() / b.norm_max();
            assert!(error(&found.stiffness, &stiffness) < 1e-13);
            assert!(error(&found.mass, &mass) < 1e-13);
            assert_eq!(found.mass, found.mass.transpose().to_owned());
            let rhs = Mat::from_fn(interior, 3, |i, j| ((3 * i + j) as f64).sin());
            let mut x = rhs.clone();
            found.factor.solve_in_place(x.as_mut());
            let inner: Vec<usize> = (0..interior).collect();
            let back = dense(&submatrix(&k, &inner, &inner)) * &x;
            assert!((back - &rhs).norm_max() < 1e-10);
        }
    }

    #[test]
    fn threads_change_no_bit() {
        let (k, m) = matrices([9, 14, 14]);
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| condense(&k, &m, k.nrows() - 1176).unwrap())
        };
        let (one, three) = (run(1), run(3));
        assert_eq!(one.stiffness, three.stiffness);
        assert_eq!(one.mass, three.mass);
        let solved = |condensed: &Condensed| {
            let mut x = Mat::from_fn(k.nrows() - 1176, 1, |i, _| (i as f64).cos());
            condensed.factor.solve_in_place(x.as_mut());
            x
        };
        assert_eq!(solved(&one), solved(&three));
    }

    #[test]
    fn a_mass_the_stiffness_has_no_place_for_is_refused() {
        let (k, _) = matrices([6, 4, 3]);
        let n = k.nrows();
        let mut far = nalgebra_sparse::CooMatrix::new(n, n);
        far.push(0, n - 1, 1.0);
        far.push(n - 1, 0, 1.0);
        let found = condense(&k, &CscMatrix::from(&far), n - 3);
        assert!(matches!(found, Err(FactorError::PatternDiffers)));
    }
}
