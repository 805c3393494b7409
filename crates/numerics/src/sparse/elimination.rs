//! Multifrontal elimination (Duff, Reid, ACM Trans. Math. Softw. 9 (1983) 302-325) of the inner
//! unknowns of a positive definite matrix, on all threads, if asked for with the derivative of
//! [`super::condense`].

use std::sync::Mutex;

use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use faer::prelude::{IntoConst, Reborrow, ReborrowMut};
use faer::{Accum, Mat, MatMut, MatRef, Par};
use nalgebra_sparse::CscMatrix;

use super::fronts::{
    BadPivot, ChildContribution, Contribution, Pivots, Tree, factor_front, mirror, schur_complement,
};
use super::symbolic::Symbolic;
use crate::dense::parallel::in_rows;

/// Elimination of the unknowns of an analysis, which come first in the matrices: the stiffness, and
/// the mass where its derivative is asked for, both triangles stored.
pub(super) struct Plan<'a> {
    symbolic: &'a Symbolic,
    matrices: &'a [&'a CscMatrix<f64>],
    /// Elimination tree; `None` where nothing is eliminated.
    tree: Option<Tree<'a>>,
}

impl<'a> Plan<'a> {
    pub fn new(symbolic: &'a Symbolic, matrices: &'a [&'a CscMatrix<f64>]) -> Self {
        let parts = symbolic.supernodal().zip(matrices.first());
        let tree = parts.map(|(supernodes, stiffness)| Tree::new(supernodes, symbolic, stiffness));
        Self {
            symbolic,
            matrices,
            tree,
        }
    }

    /// Approximate number of bytes at the peak, including the factor and the remaining matrices.
    /// Branches that are eliminated in parallel are assumed to reach their peaks at once.
    pub fn needed_bytes(&self) -> u64 {
        let left: usize = self.left().map(|order| order.pow(2)).sum();
        let need = |tree| Need {
            tree,
            matrices: self.matrices.len(),
        };
        let fronts = self.tree.as_ref().map_or(0, |tree| {
            need(tree).of_branches(&tree.roots, rayon::current_num_threads())
        });
        8 * (self.symbolic.factor_entries() + left + fronts) as u64
    }

    /// Writes the factor into `values` and returns the rest of each matrix on the other unknowns.
    pub fn eliminate(&self, values: &mut [f64]) -> Result<Vec<Mat<f64>>, EliminationError> {
        let mut sums: Vec<Mat<f64>> = self.left().map(|order| Mat::zeros(order, order)).collect();
        if let Some(tree) = &self.tree {
            let slots = slots(tree, values);
            let elimination = Elimination {
                tree,
                matrices: self.matrices,
                slots,
            };
            let roots: Vec<Contributions> =
                tree.branches(&tree.roots, |s| elimination.eliminate(s))?;
            for (&root, contributions) in tree.roots.iter().zip(roots) {
                for (sum, contribution) in sums.iter_mut().zip(contributions) {
                    contribution.add_to(sum, &tree.boundary[root]);
                }
            }
        }
        let interior = self.symbolic.unknowns();
        for (sum, matrix) in sums.iter_mut().zip(self.matrices) {
            for j in 0..sum.ncols() {
                let column = matrix.col(interior + j);
                for (&i, v) in column.row_indices().iter().zip(column.values()) {
                    if let Some(i) = i.checked_sub(interior).filter(|&i| i >= j) {
                        sum[(i, j)] += v;
                    }
                }
            }
            mirror(sum.as_mut());
        }
        Ok(sums)
    }

    /// Number of unknowns of each matrix that are not eliminated.
    fn left(&self) -> impl Iterator<Item = usize> {
        let all = self.matrices.iter().map(|matrix| matrix.ncols());
        all.map(|all| all - self.symbolic.unknowns())
    }
}

/// Counter of the numbers in fronts and contributions.
struct Need<'a> {
    tree: &'a Tree<'a>,
    matrices: usize,
}

impl Need<'_> {
    /// Numbers at the peak of branches that `threads` threads eliminate; their contributions are
    /// kept.
    fn of_branches(&self, at: &[usize], threads: usize) -> usize {
        if threads > 1 && self.tree.is_shared(at) {
            let each = threads.div_ceil(at.len());
            return at.iter().map(|&s| self.of_branch(s, each)).sum();
        }
        let (mut peak, mut kept) = (0, 0);
        for &s in at {
            peak = peak.max(kept + self.of_branch(s, threads));
            kept += self.contributions(s);
        }
        peak
    }

    fn of_branch(&self, s: usize, threads: usize) -> usize {
        let tree = self.tree;
        let children = &tree.children[s];
        let below = self.of_branches(children, threads);
        let handed_on: usize = children.iter().map(|&c| self.contributions(c)).sum();
        let (width, rows) = (tree.columns(s).len(), tree.rows_below(s));
        let fronts = self.matrices * (width + rows) * width;
        // With a mass: P and G twice, and the children's contributions to the stiffness are gone.
        let own = match self.matrices {
            1 => handed_on + self.contributions(s),
            _ => (handed_on / 2 + self.contributions(s) + 4 * rows * width)
                .max(handed_on + self.contributions(s) / 2),
        };
        below.max(fronts + own)
    }

    /// Numbers in the contributions of a supernode.
    fn contributions(&self, s: usize) -> usize {
        self.matrices * Contribution::size(self.tree.rows_below(s))
    }
}

/// Reason why an elimination ended early.
pub(super) enum EliminationError {
    NotPositiveDefinite,
    /// A matrix has an entry where the analysed pattern has none.
    PatternDiffers,
}

/// Part of the factor's values that belongs to each supernode.
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

/// Contribution blocks of a branch of the tree to its parent: K and M on the rows below its last
/// columns.
type Contributions = Vec<Contribution>;

struct Elimination<'a> {
    tree: &'a Tree<'a>,
    matrices: &'a [&'a CscMatrix<f64>],
    slots: Vec<Mutex<&'a mut [f64]>>,
}

impl<'a> Elimination<'a> {
    fn eliminate(&self, s: usize) -> Result<Contributions, EliminationError> {
        let tree = self.tree;
        let branches = tree.branches(&tree.children[s], |s| self.eliminate(s))?;
        // By matrix instead of by child.
        let mut left: Vec<Vec<Contribution>> = self.matrices.iter().map(|_| Vec::new()).collect();
        for contributions in branches {
            for (left, contribution) in left.iter_mut().zip(contributions) {
                left.push(contribution);
            }
        }
        let mut fronts = Vec::new();
        for (matrix, left) in self.matrices.iter().zip(left) {
            let front = tree.front(s, &[(1.0, matrix)], left);
            fronts.push(front.ok_or(EliminationError::PatternDiffers)?);
        }
        let width = tree.columns(s).len();
        let inner = tree.supernodes.supernode(s).pattern().len();
        let mut fronts = fronts.into_iter();
        let Some(mut stiffness) = fronts.next() else {
            return Ok(Vec::new());
        };
        factor_front(stiffness.columns(), Pivots::Positive)
            .map_err(|BadPivot| EliminationError::NotPositiveDefinite)?;
        let own_children = std::mem::take(&mut stiffness.children);
        let factor = stiffness.columns().into_const();
        {
            let mut slot = self.slots[s].lock().unwrap_or_else(|e| e.into_inner());
            let slot = MatMut::from_column_major_slice_mut(*slot, width + inner, width);
            { slot }.copy_from(factor.subrows(0, width + inner));
        }
        let lower = factor.get(width.., ..);
        let mut contributions = vec![schur_complement(width, lower, lower, &own_children)];
        drop(own_children);
        if let Some(mut mass) = fronts.next() {
            let children = std::mem::take(&mut mass.children);
            contributions.push(condense_mass(factor, mass.columns(), &children));
        }
        Ok(contributions)
    }
}

/// Derivative's part of an elimination: the contributions of the children, minus G P + (G P)^T.
fn condense_mass(
    factor: MatRef<'_, f64>,
    mass: MatMut<'_, f64>,
    children: &[ChildContribution],
) -> Contribution {
    let width = factor.ncols();
    let (pivots, below) = factor.split_at_row(width);
    let height = below.nrows();
    // [P^T G] and, columns swapped, [G P^T].
    let mut sides = [(); 2].map(|()| vec![0.0; height * 2 * width]);
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
    schur_complement(width, left.rb(), right.rb(), children)
}
