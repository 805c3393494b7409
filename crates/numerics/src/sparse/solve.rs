//! Solves with a supernodal Cholesky factor, many right-hand sides at a time.
//!
//! The numbers of one unknown, in all columns of a block, are adjacent: contributions of a
//! supernode to another one are moved in whole rows, and each supernode is one product of dense
//! matrices. Independent subtrees of the elimination tree are shared among the threads, as are the
//! rows of the large supernodes above them, so that a block reads the factor once for all threads.
//! The subtrees, and the order in which their contributions are added, do not depend on the number
//! of threads.

use std::ops::Range;

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::prelude::{Reborrow, ReborrowMut};
use faer::sparse::linalg::cholesky::supernodal::SupernodalLltRef;
use faer::{Accum, MatMut, MatRef, Par};
use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};
use rayon::slice::{ParallelSlice, ParallelSliceMut};

/// Most columns solved together.
const WIDEST_BLOCK: usize = 64;
/// Number of rows of a supernode multiplied together: the result stays in the cache until it is
/// added.
const ROWS: usize = 256;
/// Number of columns of the right-hand sides that are moved together, and of rows that one task
/// moves.
const TILE: usize = 16;
const TASK: usize = 4096;
/// Number of columns of a large supernode that one task takes on the way back.
const COLUMNS: usize = 64;
/// A subtree is not divided if its part of the factor is smaller than one over this.
const BRANCH: usize = 16;

/// Factor `L L^T`, with the place of each unknown of the factor in the right-hand sides.
#[derive(Clone, Copy)]
pub(super) struct Factor<'a> {
    pub supernodes: SupernodalLltRef<'a, usize, f64>,
    pub new_to_old: &'a [usize],
}

impl Factor<'_> {
    /// Replaces each column of `rhs` by the solution, on all threads.
    pub fn solve(self, rhs: MatMut<'_, f64>) {
        let columns = rhs.ncols();
        if rhs.nrows() == 0 || columns == 0 {
            return;
        }
        let plan = Plan::new(self);
        let width = columns.div_ceil(columns.div_ceil(WIDEST_BLOCK));
        rhs.par_col_chunks_mut(width)
            .for_each(|block| plan.solve(block));
    }
}

/// Elimination tree, cut into subtrees that are each solved by one task and the supernodes above
/// them.
struct Plan<'a> {
    factor: Factor<'a>,
    roots: Vec<Subtree<'a>>,
}

/// Consecutive supernodes, of which the last is an ancestor of all the others.
struct Subtree<'a> {
    /// Supernodes that are solved one after the other: all of them, or the last one where there are
    /// `children`.
    supernodes: Range<usize>,
    /// Smaller subtrees below the last supernode, in their order.
    children: Vec<Subtree<'a>>,
    /// Unknowns of all supernodes.
    unknowns: Range<usize>,
    /// Unknowns above that it couples to.
    pattern: &'a [usize],
}

/// One supernode: its columns of L, square on top, and the unknowns of the rows below.
struct Supernode<'a> {
    unknowns: Range<usize>,
    pivots: MatRef<'a, f64>,
    below: MatRef<'a, f64>,
    pattern: &'a [usize],
}

impl Supernode<'_> {
    /// Solves with L on the own rows of right-hand sides, given as columns.
    fn solve_lower(&self, own: MatMut<'_, f64>) {
        solve_lower_triangular_in_place(self.pivots, own.transpose_mut(), Par::Seq);
    }

    /// Solves with L^T, like [`Supernode::solve_lower`].
    fn solve_upper(&self, own: MatMut<'_, f64>) {
        solve_upper_triangular_in_place(self.pivots.transpose(), own.transpose_mut(), Par::Seq);
    }
}

impl<'a> Factor<'a> {
    fn supernode(self, s: usize) -> Supernode<'a> {
        let supernode = self.supernodes.supernode(s);
        let columns = supernode.val();
        let (pivots, below) = columns.split_at_row(columns.ncols());
        let start = supernode.start();
        Supernode {
            unknowns: start..start + columns.ncols(),
            pivots,
            below,
            pattern: self.pattern(s),
        }
    }

    fn pattern(self, s: usize) -> &'a [usize] {
        self.supernodes.symbolic().supernode(s).pattern()
    }
}

impl<'a> Plan<'a> {
    fn new(factor: Factor<'a>) -> Self {
        let symbolic = factor.supernodes.symbolic();
        let end = symbolic.supernode_end();
        let count = symbolic.n_supernodes();
        let values = symbolic.col_ptr_for_val();
        let smallest = values[count] / BRANCH;
        // In a postorder the branch below a supernode is the run of supernodes that ends with it.
        let mut first: Vec<usize> = (0..count).collect();
        let mut members = vec![1; count];
        for s in 0..count {
            debug_assert_eq!(members[s], s + 1 - first[s], "no postorder");
            if let Some(row) = factor.pattern(s).first() {
                let parent = end.partition_point(|e| e <= row);
                first[parent] = first[parent].min(first[s]);
                members[parent] += members[s];
            }
        }
        let tree = Postorder {
            factor,
            first,
            smallest,
        };
        Self {
            factor,
            roots: tree.subtrees(0..count),
        }
    }

    fn solve(&self, mut rhs: MatMut<'_, f64>) {
        let width = rhs.ncols();
        let mut x = vec![0.0; rhs.nrows() * width];
        self.gather(rhs.rb(), &mut x);
        parts(&self.roots, 0, &mut x, width)
            .into_par_iter()
            .for_each(|(root, x)| {
                self.forward(root, x, width);
                self.backward(root, x, &[], width);
            });
        self.scatter(&x, rhs.rb_mut());
    }

    /// Copies the right-hand sides to the order of the factor, row by row.
    fn gather(&self, rhs: MatRef<'_, f64>, x: &mut [f64]) {
        let width = rhs.ncols();
        x.par_chunks_mut(TASK * width)
            .zip(self.factor.new_to_old.par_chunks(TASK))
            .for_each(|(rows, places)| {
                for start in (0..width).step_by(TILE) {
                    let columns = columns_of(rhs.subcols(start, TILE.min(width - start)));
                    for (row, &old) in rows.chunks_exact_mut(width).zip(places) {
                        for (v, column) in row[start..].iter_mut().zip(&columns) {
                            *v = column[old];
                        }
                    }
                }
            });
    }

    fn scatter(&self, x: &[f64], rhs: MatMut<'_, f64>) {
        let width = rhs.ncols();
        rhs.par_col_chunks_mut(TILE)
            .enumerate()
            .for_each(|(tile, rhs)| {
                let mut columns: Vec<&mut [f64]> = rhs
                    .col_iter_mut()
                    .filter_map(|column| Some(column.try_as_col_major_mut()?.as_slice_mut()))
                    .collect();
                for (row, &old) in x.chunks_exact(width).zip(self.factor.new_to_old) {
                    for (v, column) in row[tile * TILE..].iter().zip(&mut columns) {
                        column[old] = *v;
                    }
                }
            });
    }

    /// Solves with L on the rows `x` of a subtree. Returns what is to be subtracted from the rows of
    /// its pattern.
    fn forward(&self, subtree: &Subtree<'_>, x: &mut [f64], width: usize) -> Vec<f64> {
        let mut carried = vec![0.0; subtree.pattern.len() * width];
        if subtree.children.is_empty() {
            self.branch_forward(subtree, x, &mut carried, width);
            return carried;
        }
        let supernode = self.factor.supernode(subtree.supernodes.start);
        let own_start = supernode.unknowns.start;
        let (below, own) = x.split_at_mut((own_start - subtree.unknowns.start) * width);
        let from_children: Vec<Vec<f64>> =
            parts(&subtree.children, subtree.unknowns.start, below, width)
                .into_par_iter()
                .map(|(child, x)| self.forward(child, x, width))
                .collect();
        for (child, from) in subtree.children.iter().zip(&from_children) {
            let mut above = RowsAbove::new(subtree, width);
            above.hand_on(child.pattern, from, (own_start, own), &mut carried);
        }
        let mut own = rows_mut(own, width);
        supernode.solve_lower(own.rb_mut());
        if !carried.is_empty() {
            let own = own.rb();
            rows_mut(&mut carried, width)
                .par_col_chunks_mut(ROWS)
                .enumerate()
                .for_each(|(chunk, carried)| {
                    let rows = carried.ncols();
                    let below = supernode.below.subrows(chunk * ROWS, rows);
                    matmul(carried, Accum::Add, own, below.transpose(), 1.0, Par::Seq);
                });
        }
        carried
    }

    /// Solves with L^T on the rows `x` of a subtree, given the solution on its pattern.
    fn backward(&self, subtree: &Subtree<'_>, x: &mut [f64], solved: &[f64], width: usize) {
        if subtree.children.is_empty() {
            self.branch_backward(subtree, x, solved, width);
            return;
        }
        let supernode = self.factor.supernode(subtree.supernodes.start);
        let own_start = supernode.unknowns.start;
        let (below, own) = x.split_at_mut((own_start - subtree.unknowns.start) * width);
        {
            let mut own = rows_mut(own, width);
            if !solved.is_empty() {
                let solved = rows_ref(solved, width);
                own.rb_mut()
                    .par_col_chunks_mut(COLUMNS)
                    .zip(supernode.below.par_col_chunks(COLUMNS))
                    .for_each(|(own, below)| {
                        matmul(own, Accum::Add, solved, below, -1.0, Par::Seq);
                    });
            }
            supernode.solve_upper(own);
        }
        let own = &*own;
        parts(&subtree.children, subtree.unknowns.start, below, width)
            .into_par_iter()
            .for_each(|(child, x)| {
                let mut on_pattern = vec![0.0; child.pattern.len() * width];
                let mut above = RowsAbove::new(subtree, width);
                above.collect(child.pattern, (own_start, own), solved, &mut on_pattern);
                self.backward(child, x, &on_pattern, width);
            });
    }

    fn branch_forward(
        &self,
        branch: &Subtree<'_>,
        x: &mut [f64],
        carried: &mut [f64],
        width: usize,
    ) {
        let base = branch.unknowns.start;
        let mut product = vec![0.0; ROWS * width];
        for s in branch.supernodes.clone() {
            let supernode = self.factor.supernode(s);
            let (own, later) = split(x, &supernode.unknowns, base, width);
            let mut own = rows_mut(own, width);
            supernode.solve_lower(own.rb_mut());
            let mut above = RowsAbove::new(branch, width);
            for (start, rows) in chunks(supernode.pattern) {
                let product = &mut product[..rows.len() * width];
                let below = supernode.below.subrows(start, rows.len());
                times_transposed(rows_mut(product, width), own.rb(), below);
                above.hand_on(rows, product, (supernode.unknowns.end, later), carried);
            }
        }
    }

    fn branch_backward(&self, branch: &Subtree<'_>, x: &mut [f64], solved: &[f64], width: usize) {
        let base = branch.unknowns.start;
        let mut gathered = vec![0.0; ROWS * width];
        for s in branch.supernodes.clone().rev() {
            let supernode = self.factor.supernode(s);
            let (own, later) = split(x, &supernode.unknowns, base, width);
            let mut own = rows_mut(own, width);
            let mut above = RowsAbove::new(branch, width);
            for (start, rows) in chunks(supernode.pattern) {
                let gathered = &mut gathered[..rows.len() * width];
                above.collect(rows, (supernode.unknowns.end, later), solved, gathered);
                let below = supernode.below.subrows(start, rows.len());
                let gathered = rows_ref(gathered, width);
                matmul(own.rb_mut(), Accum::Add, gathered, below, -1.0, Par::Seq);
            }
            supernode.solve_upper(own);
        }
    }
}

/// Supernodes in a postorder: the subtree of each one is the run of supernodes from `first` to it.
struct Postorder<'a> {
    factor: Factor<'a>,
    first: Vec<usize>,
    /// Number of values of the factor up to which a subtree is not divided.
    smallest: usize,
}

impl<'a> Postorder<'a> {
    /// Subtrees that make up a run of supernodes.
    fn subtrees(&self, run: Range<usize>) -> Vec<Subtree<'a>> {
        let mut subtrees = Vec::new();
        let mut next = run.end;
        while next > run.start {
            let root = next - 1;
            subtrees.push(self.subtree(root));
            next = self.first[root];
        }
        subtrees.reverse();
        subtrees
    }

    fn subtree(&self, root: usize) -> Subtree<'a> {
        let symbolic = self.factor.supernodes.symbolic();
        let values = symbolic.col_ptr_for_val();
        let first = self.first[root];
        let is_divided = first < root && values[root + 1] - values[first] > self.smallest;
        Subtree {
            supernodes: if is_divided { root } else { first }..root + 1,
            children: if is_divided {
                self.subtrees(first..root)
            } else {
                Vec::new()
            },
            unknowns: symbolic.supernode_begin()[first]..symbolic.supernode_end()[root],
            pattern: self.factor.pattern(root),
        }
    }
}

/// Subtrees that follow each other, each with its own rows of `x`, which begins with the unknown
/// `start`.
fn parts<'t, 'a, 'x>(
    subtrees: &'t [Subtree<'a>],
    start: usize,
    x: &'x mut [f64],
    width: usize,
) -> Vec<(&'t Subtree<'a>, &'x mut [f64])> {
    let (mut left, mut at) = (x, start);
    subtrees
        .iter()
        .map(|subtree| {
            debug_assert_eq!(subtree.unknowns.start, at, "no gap");
            let (own, rest) =
                std::mem::take(&mut left).split_at_mut(subtree.unknowns.len() * width);
            (left, at) = (rest, subtree.unknowns.end);
            (subtree, own)
        })
        .collect()
}

fn columns_of(a: MatRef<'_, f64>) -> Vec<&[f64]> {
    a.col_iter()
        .filter_map(|column| Some(column.try_as_col_major()?.as_slice()))
        .collect()
}

/// Rows of a supernode as the columns of a matrix, one number per right-hand side.
fn rows_mut(rows: &mut [f64], width: usize) -> MatMut<'_, f64> {
    let unknowns = rows.len() / width;
    MatMut::from_column_major_slice_mut(rows, width, unknowns)
}

fn rows_ref(rows: &[f64], width: usize) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(rows, width, rows.len() / width)
}

/// Splits off the rows of some unknowns from all later ones; `x` begins with unknown `base`.
fn split<'x>(
    x: &'x mut [f64],
    unknowns: &Range<usize>,
    base: usize,
    width: usize,
) -> (&'x mut [f64], &'x mut [f64]) {
    x[(unknowns.start - base) * width..].split_at_mut(unknowns.len() * width)
}

fn chunks(pattern: &[usize]) -> impl Iterator<Item = (usize, &[usize])> {
    (0..).step_by(ROWS).zip(pattern.chunks(ROWS))
}

fn times_transposed(product: MatMut<'_, f64>, x: MatRef<'_, f64>, below: MatRef<'_, f64>) {
    let below = below.transpose();
    matmul(product, Accum::Replace, x, below, 1.0, Par::Seq);
}

fn subtract(into: &mut [f64], from: &[f64]) {
    for (into, v) in into.iter_mut().zip(from) {
        *into -= v;
    }
}

fn add(into: &mut [f64], from: &[f64]) {
    for (into, v) in into.iter_mut().zip(from) {
        *into += v;
    }
}

/// Rows above a subtree, queried in ascending order.
struct RowsAbove<'a> {
    /// Rows of the subtree's pattern.
    list: &'a [usize],
    at: usize,
    /// First unknown that is not in the subtree.
    end: usize,
    width: usize,
}

impl<'a> RowsAbove<'a> {
    fn new(subtree: &Subtree<'a>, width: usize) -> Self {
        Self {
            list: subtree.pattern,
            at: 0,
            end: subtree.unknowns.end,
            width,
        }
    }

    /// Subtracts `from`, given by `rows`, from the rows of the subtree, of which `within` begins with
    /// this unknown. What belongs to rows above is added to `carried`.
    fn hand_on(
        &mut self,
        rows: &[usize],
        from: &[f64],
        (first, within): (usize, &mut [f64]),
        carried: &mut [f64],
    ) {
        for (&row, from) in rows.iter().zip(from.chunks_exact(self.width)) {
            if row < self.end {
                let at = (row - first) * self.width;
                subtract(&mut within[at..at + self.width], from);
            } else {
                let at = self.position(row) * self.width;
                add(&mut carried[at..at + self.width], from);
            }
        }
    }

    /// Copies `rows` from `within`, which begins with this unknown, and from `solved`, the rows above.
    fn collect(
        &mut self,
        rows: &[usize],
        (first, within): (usize, &[f64]),
        solved: &[f64],
        into: &mut [f64],
    ) {
        for (&row, into) in rows.iter().zip(into.chunks_exact_mut(self.width)) {
            into.copy_from_slice(if row < self.end {
                let at = (row - first) * self.width;
                &within[at..at + self.width]
            } else {
                let at = self.position(row) * self.width;
                &solved[at..at + self.width]
            });
        }
    }

    fn position(&mut self, row: usize) -> usize {
        if self.list[self.at] != row {
            self.at += self.list[self.at..].partition_point(|&r| r < row);
        }
        let position = self.at;
        self.at = (position + 1).min(self.list.len() - 1);
        position
    }
}

#[cfg(test)]
mod tests {
    use crate::sparse::{Symbolic, times};
    use dovetail_testkit::lattice::{Lattice, scattered};
    use dovetail_testkit::threads::run_on_threads;
    use faer::Mat;

    #[test]
    fn subtrees_and_what_is_above_them_solve_and_threads_change_no_bit() {
        // The second one has supernodes of several chunks of rows, below and above the branches.
        for shape in [[9, 5, 4], [12, 18, 18]] {
            let lattice = Lattice::new(shape, 3e7, 0.2, 0.4);
            let (k, _) = lattice.cantilever();
            let n = k.nrows();
            let factor = Symbolic::analyse(&k).unwrap().cholesky(&k).unwrap();
            for columns in [1, 7, 130] {
                let b = Mat::from_fn(n, columns, |i, j| scattered(i + n * j));
                let solved = |threads: usize| {
                    let mut x = b.clone();
                    run_on_threads(threads, || factor.solve_in_place(x.as_mut()));
                    x
                };
                let x = solved(1);
                let error = (times(&k, x.as_ref()) - &b).norm_l2() / b.norm_l2();
                assert!(error < 1e-11, "{columns}: {error}");
                assert_eq!(x, solved(3));
            }
            let mut one = vec![1.0; n];
            let mut same = Mat::from_fn(n, 1, |_, _| 1.0);
            factor.solve_vector(&mut one);
            factor.solve_in_place(same.as_mut());
            let largest = one.iter().fold(0.0f64, |m, v| m.max(v.abs()));
            let mut pairs = one.iter().zip(same.col_as_slice(0));
            assert!(pairs.all(|(a, b)| (a - b).abs() < 1e-9 * largest));
        }
    }
}
