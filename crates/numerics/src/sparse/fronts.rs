//! Frontal matrices of a multifrontal elimination: the tree of the supernodes, and the contribution
//! of one front to the next. Independent branches, and fixed blocks of the large fronts, are shared
//! among the threads. The summands and their order do not depend on the number of threads.

use std::sync::atomic::{AtomicBool, Ordering};

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::{ldlt::factor as ldlt, llt::factor as llt};
use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_unit_lower_triangular_in_place,
};
use faer::prelude::{Reborrow, ReborrowMut};
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use faer::{Accum, MatMut, MatRef, Par, Spec};
use nalgebra_sparse::CscMatrix;
use rayon::iter::{IntoParallelIterator, IntoParallelRefIterator, ParallelIterator};

use super::symbolic::Symbolic;
use crate::dense::parallel::{run_column_blocks, run_row_blocks};

/// Number of rows or columns of a front that one task takes.
const BLOCK: usize = 256;
/// Branches of the tree with less work than this (multiplications) are not worth a task.
const BRANCH: f64 = 3e7;

/// Elimination tree by supernodes, with the boundary rows of each.
pub(super) struct Tree<'a> {
    pub supernodes: &'a SymbolicSupernodalCholesky<usize>,
    pub new_to_old: &'a [usize],
    pub old_to_new: &'a [usize],
    pub children: Vec<Vec<usize>>,
    pub roots: Vec<usize>,
    /// Boundary unknowns in each front, ascending.
    pub boundary: Vec<Vec<usize>>,
    /// Approximate number of multiplications of the branch below and at each supernode.
    work: Vec<f64>,
}

impl<'a> Tree<'a> {
    pub fn new(
        supernodes: &'a SymbolicSupernodalCholesky<usize>,
        symbolic: &'a Symbolic,
        stiffness: &CscMatrix<f64>,
    ) -> Self {
        let (new_to_old, old_to_new) = symbolic.permutation();
        let (count, interior) = (supernodes.n_supernodes(), new_to_old.len());
        let mut owner = vec![0; interior];
        for s in 0..count {
            owner[supernodes.supernode_begin()[s]..supernodes.supernode_end()[s]].fill(s);
        }
        let mut tree = Self {
            supernodes,
            new_to_old,
            old_to_new,
            children: vec![Vec::new(); count],
            roots: Vec::new(),
            boundary: vec![Vec::new(); count],
            work: vec![0.0; count],
        };
        for s in 0..count {
            let columns = tree.columns(s);
            let mut rows = Vec::new();
            for j in columns.clone() {
                let entries = stiffness.col(new_to_old[j]);
                let outside = entries.row_indices().iter();
                rows.extend(outside.filter_map(|&i| i.checked_sub(interior)));
            }
            for &child in &tree.children[s] {
                rows.extend_from_slice(&tree.boundary[child]);
            }
            rows.sort_unstable();
            rows.dedup();
            let pattern = supernodes.supernode(s).pattern();
            let height = (columns.len() + pattern.len() + rows.len()) as f64;
            let below: f64 = tree.children[s].iter().map(|&c| tree.work[c]).sum();
            tree.work[s] = below + columns.len() as f64 * height * height;
            tree.boundary[s] = rows;
            match pattern.first() {
                Some(&row) => tree.children[owner[row]].push(s),
                None => tree.roots.push(s),
            }
        }
        tree
    }

    pub fn columns(&self, s: usize) -> std::ops::Range<usize> {
        self.supernodes.supernode_begin()[s]..self.supernodes.supernode_end()[s]
    }

    /// Row of a front (its columns, its pattern, its boundary) that belongs to an interior unknown,
    /// given in the new order.
    pub fn row(&self, s: usize, unknown: usize) -> Option<usize> {
        let columns = self.columns(s);
        if unknown < columns.end {
            return unknown.checked_sub(columns.start);
        }
        let pattern = self.supernodes.supernode(s).pattern();
        Some(columns.len() + pattern.binary_search(&unknown).ok()?)
    }

    pub fn boundary_row(&self, s: usize, unknown: usize) -> Option<usize> {
        let above = self.columns(s).len() + self.supernodes.supernode(s).pattern().len();
        Some(above + self.boundary[s].binary_search(&unknown).ok()?)
    }

    /// Rows of the front of `s` for the remaining rows of its child, ascending.
    fn rows_of_child(&self, s: usize, child: usize) -> Option<Vec<usize>> {
        let pattern = self.supernodes.supernode(child).pattern();
        let inner = pattern.iter().map(|&i| self.row(s, i));
        let outer = self.boundary[child].iter();
        inner
            .chain(outer.map(|&i| self.boundary_row(s, i)))
            .collect()
    }

    /// Number of rows of the front of `s` below its own.
    pub fn rows_below(&self, s: usize) -> usize {
        self.supernodes.supernode(s).pattern().len() + self.boundary[s].len()
    }

    /// Returns `true` if the branches at these supernodes are eliminated in parallel.
    pub fn is_shared(&self, at: &[usize]) -> bool {
        at.iter().filter(|&&s| self.work[s] > BRANCH).count() > 1
    }

    /// Results of the supernodes `at`, computed in parallel where that is worthwhile.
    pub fn branches<T: Send, E: Send>(
        &self,
        at: &[usize],
        eliminate: impl Fn(usize) -> Result<T, E> + Sync + Send,
    ) -> Result<Vec<T>, E> {
        if self.is_shared(at) {
            at.par_iter().map(|&s| eliminate(s)).collect()
        } else {
            at.iter().map(|&s| eliminate(s)).collect()
        }
    }

    /// Front of a supernode: the contributions of its children, and the entries of a sum of
    /// matrices, each with a factor. `None` where the tree has no place for an entry.
    pub fn front(
        &self,
        s: usize,
        terms: &[(f64, &CscMatrix<f64>)],
        contributions: impl IntoIterator<Item = Contribution>,
    ) -> Option<Front> {
        let placed = |(&child, contribution)| {
            let rows = self.rows_of_child(s, child)?;
            Some(ChildContribution { contribution, rows })
        };
        let children = self.children[s].iter().zip(contributions);
        let children: Vec<_> = children.map(placed).collect::<Option<_>>()?;
        let width = self.columns(s).len();
        let height = width + self.rows_below(s);
        let mut values = vec![0.0; height * width];
        let columns = MatMut::from_column_major_slice_mut(&mut values, height, width);
        let complete = AtomicBool::new(true);
        run_column_blocks(columns, |start, mut columns| {
            // Pages that are first read, as a sum is, are mapped twice.
            columns.fill(0.0);
            let mut columns = columns.get_mut(start.., ..);
            for child in &children {
                child.add_to_columns(start, &mut columns);
            }
            for &(factor, matrix) in terms {
                if self
                    .add_entries(s, factor, matrix, start, &mut columns)
                    .is_none()
                {
                    complete.store(false, Ordering::Relaxed);
                }
            }
        });
        complete.into_inner().then_some(Front {
            values,
            width,
            children,
        })
    }

    /// Adds a factor times the entries of a matrix, on and below the diagonal, to the columns of a
    /// supernode's front from number `above` on, given from the row of that number down. `None`
    /// where the tree has no place for an entry.
    fn add_entries(
        &self,
        s: usize,
        factor: f64,
        matrix: &CscMatrix<f64>,
        above: usize,
        columns: &mut MatMut<'_, f64>,
    ) -> Option<()> {
        let interior = self.new_to_old.len();
        let first = self.columns(s).start + above;
        for local in 0..columns.ncols() {
            let column = first + local;
            let entries = matrix.col(self.new_to_old[column]);
            for (&i, v) in entries.row_indices().iter().zip(entries.values()) {
                let row = match i.checked_sub(interior) {
                    Some(boundary) => self.boundary_row(s, boundary),
                    None if self.old_to_new[i] < column => continue,
                    None => self.row(s, self.old_to_new[i]),
                };
                columns[(row? - above, local)] += factor * v;
            }
        }
        Some(())
    }
}

/// Contribution block: the Schur complement that a front adds to its parent. Its lower triangle is
/// stored in panels of [`BLOCK`] columns, each from its diagonal block down. This takes half of the
/// memory, and one task computes one panel. The panels stand in the order from the last to the first,
/// so that those of the first columns can be given up before the others.
pub(super) struct Contribution {
    order: usize,
    values: Vec<f64>,
}

impl Contribution {
    fn zeros(order: usize) -> Self {
        Self {
            order,
            values: vec![0.0; Self::size(order)],
        }
    }

    /// Number of values in a block of this order.
    pub fn size(order: usize) -> usize {
        let (panels, last) = (order / BLOCK, order % BLOCK);
        BLOCK * (panels * order - BLOCK * (panels * panels.saturating_sub(1) / 2)) + last * last
    }

    /// Column j from the diagonal down.
    fn column(&self, j: usize) -> &[f64] {
        let (panel, within) = (j / BLOCK, j % BLOCK);
        let height = self.order - panel * BLOCK;
        let first = Self::size(height.saturating_sub(BLOCK)) + within * height;
        &self.values[first + within..first + height]
    }

    fn panels_mut(&mut self) -> Vec<(usize, MatMut<'_, f64>)> {
        let mut left: &mut [f64] = &mut self.values;
        (0..self.order)
            .step_by(BLOCK)
            .map(|start| {
                let (height, width) = (self.order - start, BLOCK.min(self.order - start));
                let before = left.len() - height * width;
                let (rest, panel) = std::mem::take(&mut left).split_at_mut(before);
                left = rest;
                (
                    start,
                    MatMut::from_column_major_slice_mut(panel, height, width),
                )
            })
            .collect()
    }

    /// Gives the memory of the panels back that have none but the first `columns` columns.
    fn give_up(&mut self, columns: usize) {
        let panels = columns / BLOCK;
        let left = Self::size(self.order.saturating_sub(panels * BLOCK));
        if columns >= self.order {
            self.values = Vec::new();
        } else if left < self.values.len() {
            self.values.truncate(left);
            self.values.shrink_to_fit();
        }
    }
}

/// Columns of a front that are eliminated, with its own rows first, and the contributions of its
/// children.
pub(super) struct Front {
    values: Vec<f64>,
    width: usize,
    pub children: Vec<ChildContribution>,
}

impl Front {
    pub fn columns(&mut self) -> MatMut<'_, f64> {
        let rows = self.values.len() / self.width;
        MatMut::from_column_major_slice_mut(&mut self.values, rows, self.width)
    }
}

/// Factorisation of the own rows of a front.
#[derive(Clone, Copy)]
pub(super) enum Pivots {
    /// Cholesky factor L L^T.
    Positive,
    /// Factor L D L^T, with D in the place of the unit diagonal.
    Signed,
}

/// Error of a pivot that is not positive, or zero.
pub(super) struct BadPivot;

/// Factors the own rows of a front and solves the rows below with L, in place: these are then F_21
/// L^-T.
pub(super) fn factor_front(front: MatMut<'_, f64>, pivots: Pivots) -> Result<(), BadPivot> {
    let width = front.ncols();
    let (mut own, below) = front.split_at_row_mut(width);
    let solve = match pivots {
        Pivots::Positive => {
            let params = Spec::default();
            let scratch = llt::cholesky_in_place_scratch::<f64>(width, Par::Seq, params);
            llt::cholesky_in_place(
                own.rb_mut(),
                llt::LltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut MemBuffer::new(scratch)),
                params,
            )
            .map_err(|_| BadPivot)?;
            solve_lower_triangular_in_place
        }
        Pivots::Signed => {
            let params = Spec::default();
            let scratch = ldlt::cholesky_in_place_scratch::<f64>(width, Par::Seq, params);
            ldlt::cholesky_in_place(
                own.rb_mut(),
                ldlt::LdltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut MemBuffer::new(scratch)),
                params,
            )
            .map_err(|_| BadPivot)?;
            solve_unit_lower_triangular_in_place
        }
    };
    let own = own.rb();
    run_row_blocks(below, |_, rows| solve(own, rows.transpose_mut(), Par::Seq));
    Ok(())
}

/// Contribution block of a child, and the rows of its parent's front for its rows (ascending).
pub(super) struct ChildContribution {
    pub contribution: Contribution,
    pub rows: Vec<usize>,
}

impl ChildContribution {
    /// Number of columns of the block that are in columns of its parent's front before `end`.
    fn columns_before(&self, end: usize) -> usize {
        self.rows.partition_point(|&row| row < end)
    }

    /// Gives memory back that has nothing but columns of the parent's front before `end`.
    pub fn give_up(&mut self, end: usize) {
        self.contribution.give_up(self.columns_before(end));
    }

    /// Adds the block to the columns of its parent's front from number `above` on, given from the
    /// row of that number down.
    pub fn add_to_columns(&self, above: usize, columns: &mut MatMut<'_, f64>) {
        let end = above + columns.ncols();
        for j in self.columns_before(above)..self.columns_before(end) {
            let column = columns.rb_mut().col_mut(self.rows[j] - above);
            let Some(into) = column.try_as_col_major_mut() else {
                continue;
            };
            let into = into.as_slice_mut();
            for (&row, v) in self.rows[j..].iter().zip(self.contribution.column(j)) {
                into[row - above] += v;
            }
        }
    }
}

/// Contribution block of a front of `width` columns: the contributions of its children below them,
/// minus the sum of the products a b^T, which is symmetric.
pub(super) fn schur_complement(
    width: usize,
    products: &[(MatRef<'_, f64>, MatRef<'_, f64>)],
    children: &[ChildContribution],
) -> Contribution {
    let order = products.first().map_or(0, |(a, _)| a.nrows());
    let mut contribution = Contribution::zeros(order);
    let compute = |(start, mut panel): (usize, MatMut<'_, f64>)| {
        let columns = panel.ncols();
        let mut accumulate = Accum::Replace;
        for (a, b) in products {
            let b = b.get(start..start + columns, ..);
            let (corner, below) = panel.rb_mut().split_at_row_mut(columns);
            triangular::matmul(
                corner,
                BlockStructure::TriangularLower,
                accumulate,
                a.get(start..start + columns, ..),
                BlockStructure::Rectangular,
                b.transpose(),
                BlockStructure::Rectangular,
                -1.0,
                Par::Seq,
            );
            if below.nrows() > 0 {
                let a = a.get(start + columns.., ..);
                matmul(below, accumulate, a, b.transpose(), -1.0, Par::Seq);
            }
            accumulate = Accum::Add;
        }
        for child in children {
            child.add_to_columns(width + start, &mut panel);
        }
    };
    let panels = contribution.panels_mut();
    if panels.len() <= 2 {
        panels.into_iter().for_each(compute);
    } else {
        panels.into_par_iter().for_each(compute);
    }
    contribution
}

/// Copies the lower triangle to the upper one, in tiles.
pub(super) fn mirror(mut a: MatMut<'_, f64>) {
    const TILE: usize = 32;
    let n = a.nrows();
    for first in (0..n).step_by(TILE) {
        for start in (first..n).step_by(TILE) {
            for j in first..n.min(first + TILE) {
                for i in start.max(j + 1)..n.min(start + TILE) {
                    a[(j, i)] = a[(i, j)];
                }
            }
        }
    }
}
