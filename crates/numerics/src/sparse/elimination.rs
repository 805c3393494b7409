//! Multifrontal elimination (Duff, Reid, ACM Trans. Math. Softw. 9 (1983) 302-325) of the inner
//! unknowns of a positive definite matrix, on all threads, if asked for with the derivative of
//! [`super::condense`].

use std::sync::Mutex;

use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use faer::prelude::{IntoConst, Reborrow, ReborrowMut};
use faer::{Accum, Mat, MatMut, Par};
use nalgebra_sparse::CscMatrix;

use super::fronts::{
    BadPivot, ChildContribution, Contribution, Pivots, Tree, factor_front, mirror, schur_complement,
};
use super::symbolic::Symbolic;
use crate::dense::parallel::{run_column_blocks, run_row_blocks};

/// Number of columns of a remaining matrix that are filled at once.
const COLUMNS: usize = 1024;

/// Elimination of the unknowns of an analysis, which come first in the matrices: the stiffness, and
/// the mass where its derivative is asked for, both triangles stored.
pub(super) struct EliminationPlan<'a> {
    symbolic: &'a Symbolic,
    matrices: &'a [&'a CscMatrix<f64>],
    /// Elimination tree; `None` where nothing is eliminated.
    tree: Option<Tree<'a>>,
}

impl<'a> EliminationPlan<'a> {
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
        let left: usize = self.remaining_unknowns().map(|order| order.pow(2)).sum();
        let need = |tree| Need {
            tree,
            matrices: self.matrices.len(),
        };
        let threads = rayon::current_num_threads();
        let fronts = self.tree.as_ref();
        let fronts = fronts.map_or(0, |tree| need(tree).branches_need(&tree.roots, threads));
        8 * (self.symbolic.factor_entries() + fronts.max(left)) as u64
    }

    /// Writes the factor into `values` and returns the rest of each matrix on the other unknowns.
    pub fn eliminate(&self, values: &mut [f64]) -> Result<Vec<Mat<f64>>, EliminationError> {
        let mut from_roots: Vec<_> = self.matrices.iter().map(|_| Vec::new()).collect();
        if let Some(tree) = &self.tree {
            let slots = slots(tree, values);
            let elimination = FrontElimination {
                tree,
                matrices: self.matrices,
                slots,
            };
            let roots: Vec<Contributions> =
                tree.branches(&tree.roots, |s| elimination.eliminate(s))?;
            for (&root, contributions) in tree.roots.iter().zip(roots) {
                for (of_matrix, contribution) in from_roots.iter_mut().zip(contributions) {
                    of_matrix.push(ChildContribution {
                        contribution,
                        rows: tree.boundary[root].clone(),
                    });
                }
            }
        }
        // One after the other: the contributions of a matrix are gone before the next one is made.
        let parts = self.matrices.iter().zip(from_roots);
        Ok(parts
            .map(|(matrix, roots)| self.rest(matrix, roots))
            .collect())
    }

    /// Part of a matrix on the unknowns that are not eliminated, with the contributions of the roots
    /// of the tree, whose memory goes as the columns are filled.
    fn rest(&self, matrix: &CscMatrix<f64>, mut roots: Vec<ChildContribution>) -> Mat<f64> {
        let interior = self.symbolic.unknowns();
        let order = matrix.ncols() - interior;
        let mut rest = Mat::with_capacity(order, order);
        for first in (0..order).step_by(COLUMNS) {
            let end = order.min(first + COLUMNS);
            rest.resize_with(order, end, |_, _| 0.0);
            run_column_blocks(rest.get_mut(.., first..end), |start, columns| {
                let start = first + start;
                let mut columns = columns.get_mut(start.., ..);
                for root in &roots {
                    root.add_to_columns(start, &mut columns);
                }
                for j in 0..columns.ncols() {
                    let entries = matrix.col(interior + start + j);
                    for (&i, v) in entries.row_indices().iter().zip(entries.values()) {
                        if let Some(i) = i.checked_sub(interior + start).filter(|&i| i >= j) {
                            columns[(i, j)] += v;
                        }
                    }
                }
            });
            roots.iter_mut().for_each(|root| root.give_up(end));
        }
        mirror(rest.as_mut());
        rest
    }

    /// Number of unknowns of each matrix that are not eliminated.
    fn remaining_unknowns(&self) -> impl Iterator<Item = usize> {
        let sizes = self.matrices.iter().map(|matrix| matrix.ncols());
        sizes.map(|sizes| sizes - self.symbolic.unknowns())
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
    fn branches_need(&self, at: &[usize], threads: usize) -> usize {
        if threads > 1 && self.tree.is_shared(at) {
            let each = threads.div_ceil(at.len());
            return at.iter().map(|&s| self.branch_need(s, each)).sum();
        }
        let (mut peak, mut kept) = (0, 0);
        for &s in at {
            peak = peak.max(kept + self.branch_need(s, threads));
            kept += self.contributions(s);
        }
        peak
    }

    fn branch_need(&self, s: usize, threads: usize) -> usize {
        let tree = self.tree;
        let children = &tree.children[s];
        let below = self.branches_need(children, threads);
        let handed_on: usize = children.iter().map(|&c| self.contributions(c)).sum();
        let (width, rows) = (tree.columns(s).len(), tree.rows_below(s));
        let front = (width + rows) * width;
        // The front of the mass is made when the children's contributions to the stiffness are gone.
        let contribution = Contribution::size(rows);
        let of_stiffness = front + handed_on + contribution;
        let of_mass = match self.matrices {
            1 => 0,
            _ => 2 * front + handed_on / 2 + 2 * contribution,
        };
        below.max(of_stiffness).max(of_mass)
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

struct FrontElimination<'a> {
    tree: &'a Tree<'a>,
    matrices: &'a [&'a CscMatrix<f64>],
    slots: Vec<Mutex<&'a mut [f64]>>,
}

impl<'a> FrontElimination<'a> {
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
        let mut parts = self.matrices.iter().zip(left);
        let front = |(matrix, left): (&&CscMatrix<f64>, Vec<Contribution>)| {
            let front = tree.front(s, &[(1.0, *matrix)], left);
            front.ok_or(EliminationError::PatternDiffers)
        };
        let Some(mut stiffness) = parts.next().map(front).transpose()? else {
            return Ok(Vec::new());
        };
        factor_front(stiffness.columns(), Pivots::Positive)
            .map_err(|BadPivot| EliminationError::NotPositiveDefinite)?;
        let width = tree.columns(s).len();
        let inner = tree.supernodes.supernode(s).pattern().len();
        let children = std::mem::take(&mut stiffness.children);
        let factor = stiffness.columns().into_const();
        {
            let mut slot = self.slots[s].lock().unwrap_or_else(|e| e.into_inner());
            let slot = MatMut::from_column_major_slice_mut(*slot, width + inner, width);
            run_column_blocks(slot, |start, mut slot| {
                slot.copy_from(factor.get(..width + inner, start..start + slot.ncols()));
            });
        }
        let lower = factor.get(width.., ..);
        let mut contributions = vec![schur_complement(width, &[(lower, lower)], &children)];
        drop(children);
        if let Some(mut mass) = parts.next().map(front).transpose()? {
            let children = std::mem::take(&mut mass.children);
            let (factor, mass) = (stiffness.columns(), mass.columns());
            contributions.push(condense_mass(factor, mass, &children));
        }
        Ok(contributions)
    }
}

/// Derivative's part of an elimination: the contributions of the children, minus G P + (G P)^T.
/// The rows below the pivots become P^T in the factor and G in the mass.
fn condense_mass(
    factor: MatMut<'_, f64>,
    mass: MatMut<'_, f64>,
    children: &[ChildContribution],
) -> Contribution {
    let width = factor.ncols();
    let (pivots, mut p) = factor.split_at_row_mut(width);
    let pivots = pivots.into_const();
    run_row_blocks(p.rb_mut(), |_, rows| {
        solve_upper_triangular_in_place(pivots.transpose(), rows.transpose_mut(), Par::Seq);
    });
    let p = p.into_const();
    let (mut half, mut g) = mass.split_at_row_mut(width);
    for j in 0..width {
        half[(j, j)] *= 0.5;
    }
    run_row_blocks(g.rb_mut(), |start, rows| {
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
    let g = g.into_const();
    schur_complement(width, &[(g, p), (p, g)], children)
}
