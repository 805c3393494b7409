//! Frontal matrices of a multifrontal elimination: the tree of the supernodes, and what one front does to the
//! next. Independent branches, and fixed blocks of the large fronts, are shared among the threads; what is
//! added to what, and in which order, does not depend on their number.

use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::prelude::ReborrowMut;
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use nalgebra_sparse::CscMatrix;
use rayon::iter::{IndexedParallelIterator, IntoParallelRefIterator, ParallelIterator};

use super::factor::Symbolic;

/// Rows or columns of a front that one task takes.
const BLOCK: usize = 256;
/// Branches of the tree with less work than this (multiplications) are not worth a task.
const BRANCH: f64 = 3e7;

/// The elimination tree by supernodes, with the boundary rows of each.
pub(super) struct Tree<'a> {
    pub supernodes: &'a SymbolicSupernodalCholesky<usize>,
    pub new_to_old: &'a [usize],
    pub old_to_new: &'a [usize],
    pub children: Vec<Vec<usize>>,
    pub roots: Vec<usize>,
    /// Boundary unknowns in each front, ascending.
    pub boundary: Vec<Vec<usize>>,
    /// Multiplications of the branch below and at each supernode, about.
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

    /// Row of a front (its columns, its pattern, its boundary) at which an interior unknown, in the
    /// new order, stands.
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

    /// Rows of the front of `s` for the rows left by its child: ascending.
    pub fn rows_of_child(&self, s: usize, child: usize) -> Option<Vec<usize>> {
        let pattern = self.supernodes.supernode(child).pattern();
        let inner = pattern.iter().map(|&i| self.row(s, i));
        let outer = self.boundary[child].iter();
        inner
            .chain(outer.map(|&i| self.boundary_row(s, i)))
            .collect()
    }

    /// What each of the supernodes `at` gives, side by side where that is worth it.
    pub fn branches<T: Send, E: Send>(
        &self,
        at: &[usize],
        eliminate: impl Fn(usize) -> Result<T, E> + Sync + Send,
    ) -> Result<Vec<T>, E> {
        let worthwhile = at.iter().filter(|&&s| self.work[s] > BRANCH).count() > 1;
        if worthwhile {
            at.par_iter().map(|&s| eliminate(s)).collect()
        } else {
            at.iter().map(|&s| eliminate(s)).collect()
        }
    }

    /// Adds the entries of the matrix itself in the columns of a supernode, on and below the diagonal,
    /// to its front; `None` where the tree has no place for one.
    pub fn add_entries(
        &self,
        s: usize,
        matrix: &CscMatrix<f64>,
        front: &mut Mat<f64>,
    ) -> Option<()> {
        let interior = self.new_to_old.len();
        for (local, column) in self.columns(s).enumerate() {
            let entries = matrix.col(self.new_to_old[column]);
            for (&i, v) in entries.row_indices().iter().zip(entries.values()) {
                let row = match i.checked_sub(interior) {
                    Some(boundary) => self.boundary_row(s, boundary),
                    None if self.old_to_new[i] < column => continue,
                    None => self.row(s, self.old_to_new[i]),
                };
                front[(row?, local)] += v;
            }
        }
        Some(())
    }
}

/// Adds what a child left on the rows `rows` (ascending) of its parent's front: to the parent's own
/// columns, and to what it will leave. Lower triangles.
pub(super) fn take(
    front: &mut Mat<f64>,
    rest: &mut Mat<f64>,
    left: MatRef<'_, f64>,
    rows: &[usize],
) {
    let width = front.ncols();
    let first = rows.partition_point(|&row| row < width);
    for j in 0..first {
        let column = front.col_as_slice_mut(rows[j]);
        let Some(left) = left.col(j).try_as_col_major() else {
            continue;
        };
        for (&row, v) in rows[j..].iter().zip(&left.as_slice()[j..]) {
            column[row] += v;
        }
    }
    let shifted: Vec<usize> = rows[first..].iter().map(|row| row - width).collect();
    extend(rest.as_mut(), first, left, &shifted);
}

/// Adds the columns of `from` from the `first` on, and the rows from there on, to the rows and columns
/// `rows` (ascending) of `into`: lower triangles.
pub(super) fn extend(into: MatMut<'_, f64>, first: usize, from: MatRef<'_, f64>, rows: &[usize]) {
    let add = |start: usize, mut block: MatMut<'_, f64>| {
        let from_column = rows.partition_point(|&row| row < start);
        let to_column = rows.partition_point(|&row| row < start + block.ncols());
        for j in from_column..to_column {
            let column = from.col(first + j).try_as_col_major();
            let Some(column) = column else { continue };
            let mut target = block.rb_mut().col_mut(rows[j] - start);
            for (&row, v) in rows[j..].iter().zip(&column.as_slice()[first + j..]) {
                target[row] += v;
            }
        }
    };
    if rows.len() <= 2 * BLOCK {
        add(0, into);
    } else {
        into.par_col_chunks_mut(BLOCK)
            .enumerate()
            .for_each(|(chunk, block)| add(chunk * BLOCK, block));
    }
}

/// `c -= a b^T`, lower triangle.
pub(super) fn subtract_lower(c: MatMut<'_, f64>, a: MatRef<'_, f64>, b: MatRef<'_, f64>) {
    let block = |start: usize, mut c: MatMut<'_, f64>| {
        let width = c.ncols();
        let b = b.get(start..start + width, ..);
        let (_, column) = c.rb_mut().split_at_row_mut(start);
        let (corner, below) = column.split_at_row_mut(width);
        triangular::matmul(
            corner,
            BlockStructure::TriangularLower,
            Accum::Add,
            a.get(start..start + width, ..),
            BlockStructure::Rectangular,
            b.transpose(),
            BlockStructure::Rectangular,
            -1.0,
            Par::Seq,
        );
        if below.nrows() > 0 {
            matmul(
                below,
                Accum::Add,
                a.get(start + width.., ..),
                b.transpose(),
                -1.0,
                Par::Seq,
            );
        }
    };
    if c.ncols() == 0 || a.ncols() == 0 {
    } else if c.ncols() <= 2 * BLOCK {
        block(0, c);
    } else {
        c.par_col_chunks_mut(BLOCK)
            .enumerate()
            .for_each(|(chunk, c)| block(chunk * BLOCK, c));
    }
}

/// Blocks of rows, with the first row of each, on all threads.
pub(super) fn in_rows(a: MatMut<'_, f64>, each: impl Fn(usize, MatMut<'_, f64>) + Sync) {
    if a.nrows() == 0 || a.ncols() == 0 {
    } else if a.nrows() <= 2 * BLOCK {
        each(0, a);
    } else {
        a.par_row_chunks_mut(BLOCK)
            .enumerate()
            .for_each(|(chunk, rows)| each(chunk * BLOCK, rows));
    }
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
