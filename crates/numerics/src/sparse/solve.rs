//! Solves with a supernodal Cholesky factor, many right-hand sides at a time.
//!
//! The numbers of one unknown, in all columns of a block, are adjacent: contributions of a
//! supernode to another one are moved in whole rows, and each supernode is one product of dense
//! matrices. Independent branches of the elimination tree are shared among the threads, as are the
//! rows of the large supernodes above them, so that a block reads the factor once for both threads.
//! The branches, and the order in which their contributions are added, do not depend on the number
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
/// A branch is not divided if its part of the factor is smaller than one over this.
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

/// Branches of the tree that are each solved by one task, and the supernodes above them.
struct Plan<'a> {
    factor: Factor<'a>,
    branches: Vec<Branch<'a>>,
    above: Vec<usize>,
}

/// Consecutive supernodes, of which the last is an ancestor of all the others.
struct Branch<'a> {
    supernodes: Range<usize>,
    unknowns: Range<usize>,
    /// Unknowns above the branch that it couples to.
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
        let (begin, end) = (symbolic.supernode_begin(), symbolic.supernode_end());
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
        let (mut branches, mut above) = (Vec::new(), Vec::new());
        let mut next = count;
        while let Some(root) = next.checked_sub(1) {
            let start = first[root];
            if start == root || values[root + 1] - values[start] <= smallest {
                branches.push(Branch {
                    supernodes: start..next,
                    unknowns: begin[start]..end[root],
                    pattern: factor.pattern(root),
                });
                next = start;
            } else {
                above.push(root);
                next = root;
            }
        }
        branches.reverse();
        above.reverse();
        Self {
            factor,
            branches,
            above,
        }
    }

    fn solve(&self, mut rhs: MatMut<'_, f64>) {
        let width = rhs.ncols();
        let mut x = vec![0.0; rhs.nrows() * width];
        self.gather(rhs.rb(), &mut x);
        let mut carried: Vec<Vec<f64>> = self
            .branches
            .iter()
            .map(|branch| vec![0.0; branch.pattern.len() * width])
            .collect();
        self.each_branch(&mut x, &mut carried, width, |branch, x, carried| {
            self.branch_forward(branch, x, carried, width);
        });
        for (branch, carried) in self.branches.iter().zip(&carried) {
            for (&row, from) in branch.pattern.iter().zip(carried.chunks_exact(width)) {
                subtract(&mut x[row * width..(row + 1) * width], from);
            }
        }
        self.above_forward(&mut x, width);
        self.above_backward(&mut x, width);
        for (branch, carried) in self.branches.iter().zip(&mut carried) {
            for (&row, into) in branch.pattern.iter().zip(carried.chunks_exact_mut(width)) {
                into.copy_from_slice(&x[row * width..(row + 1) * width]);
            }
        }
        self.each_branch(&mut x, &mut carried, width, |branch, x, carried| {
            self.branch_backward(branch, x, carried, width);
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

    /// Runs the branches in parallel, each on its own rows of `x` and on the values carried to or
    /// from the rows above.
    fn each_branch(
        &self,
        x: &mut [f64],
        carried: &mut [Vec<f64>],
        width: usize,
        run: impl Fn(&Branch<'_>, &mut [f64], &mut [f64]) + Sync,
    ) {
        let mut tasks = Vec::with_capacity(self.branches.len());
        let (mut left, mut at) = (x, 0);
        for (branch, carried) in self.branches.iter().zip(carried) {
            let (_, rest) =
                std::mem::take(&mut left).split_at_mut((branch.unknowns.start - at) * width);
            let (own, rest) = rest.split_at_mut(branch.unknowns.len() * width);
            (left, at) = (rest, branch.unknowns.end);
            tasks.push((branch, own, carried));
        }
        tasks
            .into_par_iter()
            .for_each(|(branch, own, carried)| run(branch, own, carried));
    }

    fn branch_forward(
        &self,
        branch: &Branch<'_>,
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
            let mut above = Rows::of(branch.pattern);
            for (start, rows) in chunks(supernode.pattern) {
                let product = &mut product[..rows.len() * width];
                let below = supernode.below.subrows(start, rows.len());
                times_transposed(rows_mut(product, width), own.rb(), below);
                for (&row, from) in rows.iter().zip(product.chunks_exact(width)) {
                    if row < branch.unknowns.end {
                        let at = (row - supernode.unknowns.end) * width;
                        subtract(&mut later[at..at + width], from);
                    } else {
                        let at = above.position(row) * width;
                        add(&mut carried[at..at + width], from);
                    }
                }
            }
        }
    }

    fn branch_backward(&self, branch: &Branch<'_>, x: &mut [f64], carried: &[f64], width: usize) {
        let base = branch.unknowns.start;
        let mut gathered = vec![0.0; ROWS * width];
        for s in branch.supernodes.clone().rev() {
            let supernode = self.factor.supernode(s);
            let (own, later) = split(x, &supernode.unknowns, base, width);
            let mut own = rows_mut(own, width);
            let mut above = Rows::of(branch.pattern);
            for (start, rows) in chunks(supernode.pattern) {
                let gathered = &mut gathered[..rows.len() * width];
                for (&row, into) in rows.iter().zip(gathered.chunks_exact_mut(width)) {
                    into.copy_from_slice(if row < branch.unknowns.end {
                        let at = (row - supernode.unknowns.end) * width;
                        &later[at..at + width]
                    } else {
                        let at = above.position(row) * width;
                        &carried[at..at + width]
                    });
                }
                let below = supernode.below.subrows(start, rows.len());
                let gathered = rows_ref(gathered, width);
                matmul(own.rb_mut(), Accum::Add, gathered, below, -1.0, Par::Seq);
            }
            supernode.solve_upper(own);
        }
    }

    fn above_forward(&self, x: &mut [f64], width: usize) {
        for &s in &self.above {
            let supernode = self.factor.supernode(s);
            let (own, later) = split(x, &supernode.unknowns, 0, width);
            let mut own = rows_mut(own, width);
            supernode.solve_lower(own.rb_mut());
            let mut product = vec![0.0; supernode.pattern.len() * width];
            if product.is_empty() {
                continue;
            }
            let own = own.rb();
            rows_mut(&mut product, width)
                .par_col_chunks_mut(ROWS)
                .enumerate()
                .for_each(|(chunk, product)| {
                    let below = supernode.below.subrows(chunk * ROWS, product.ncols());
                    times_transposed(product, own, below);
                });
            for (&row, from) in supernode.pattern.iter().zip(product.chunks_exact(width)) {
                let at = (row - supernode.unknowns.end) * width;
                subtract(&mut later[at..at + width], from);
            }
        }
    }

    fn above_backward(&self, x: &mut [f64], width: usize) {
        for &s in self.above.iter().rev() {
            let supernode = self.factor.supernode(s);
            let (own, later) = split(x, &supernode.unknowns, 0, width);
            let mut own = rows_mut(own, width);
            let gathered: Vec<f64> = supernode
                .pattern
                .iter()
                .flat_map(|&row| {
                    let at = (row - supernode.unknowns.end) * width;
                    later[at..at + width].iter().copied()
                })
                .collect();
            if !gathered.is_empty() {
                let gathered = rows_ref(&gathered, width);
                own.rb_mut()
                    .par_col_chunks_mut(ROWS)
                    .zip(supernode.below.par_col_chunks(ROWS))
                    .for_each(|(own, below)| {
                        matmul(own, Accum::Add, gathered, below, -1.0, Par::Seq);
                    });
            }
            supernode.solve_upper(own);
        }
    }
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

/// Positions in an ascending list, queried in ascending order.
struct Rows<'a> {
    list: &'a [usize],
    at: usize,
}

impl<'a> Rows<'a> {
    fn of(list: &'a [usize]) -> Self {
        Self { list, at: 0 }
    }

    fn position(&mut self, row: usize) -> usize {
        if self.list[self.at] != row {
            self.at += self.list[self.at..].partition_point(|&r| r < row);
        }
        let found = self.at;
        self.at = (found + 1).min(self.list.len() - 1);
        found
    }
}

#[cfg(test)]
mod tests {
    use crate::sparse::{Symbolic, times};
    use dovetail_testkit::lattice::{Lattice, scattered};
    use dovetail_testkit::threads::on_threads;
    use faer::Mat;

    #[test]
    fn branches_and_what_is_above_them_solve_and_threads_change_no_bit() {
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
                    on_threads(threads, || factor.solve_in_place(x.as_mut()));
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
