//! Shift-invert Lanczos about zero in blocks (Grimes, Lewis, Simon, SIAM J. Matrix Anal. Appl. 15
//! (1994) 228-272, without their shifts and restarts), for factors that are read from memory at
//! each solve. A pass over the factor advances a whole block, and both threads take part.
//!
//! With A = K^-1 M and V orthonormal in the product of M, A V = V T + V' R E^T, T block
//! tridiagonal. T s = theta s gives the mode V s with omega^2 = 1 / theta, its residual |R E^T s|.
//! The basis is kept orthonormal in full. A multiple mode is found as often as the block is wide;
//! the Sturm count of `sturm.rs` shows if a mode that no block reached is missing.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, Mat, MatMut, MatRef, Par};
use nalgebra_sparse::CscMatrix;
use rayon::iter::{IndexedParallelIterator, ParallelIterator};

use super::arpack::start_entry;
use super::dense::largest_first;
use super::sturm::{TRIES, certified_of_tries};
use super::{EigenError, Modes};
use crate::dense::parallel::product;
use crate::memory::ask_for;
use crate::sparse::{Cholesky, symmetric_product};

/// Number of columns of a block.
const BLOCK: usize = 8;
/// Residual over theta at which a mode has converged.
const CONVERGED: f64 = 1e-9;
/// A column shorter than this, relative to the longest of all blocks, counts as a part of the
/// basis.
const DEPENDENT: f64 = 1e-12;
/// Fraction of the square of a column that must lie outside the others' span for it to be made
/// orthogonal to them in one step. The first of two rounds may leave an error of rounding over
/// this.
const INDEPENDENT: f64 = 1e-10;
/// Number of rows that one task takes.
const ROWS: usize = 8192;

/// The `count` lowest modes; see [`super::lowest_modes`], which sends small problems elsewhere.
///
/// The basis begins with the modes that are `known`, the lowest ones.
///
/// # Errors
/// [`EigenError::Basis`], [`EigenError::Residual`], [`EigenError::Missing`] after three tries with
/// other start vectors and more room; errors of the factorisation of K - sigma M.
pub fn lowest_modes(
    stiffness: &CscMatrix<f64>,
    mass: &CscMatrix<f64>,
    count: usize,
    factor: &Cholesky,
    known: &Modes,
) -> Result<Modes, EigenError> {
    certified_of_tries(stiffness, mass, count, factor, |wanted, attempt| {
        let wanted = wanted.min(stiffness.nrows());
        Ok(lanczos(mass, factor, wanted, attempt, known)?.0)
    })
}

/// The `wanted` lowest modes, and the final number of vectors of the basis.
fn lanczos(
    mass: &CscMatrix<f64>,
    factor: &Cholesky,
    wanted: usize,
    attempt: usize,
    known: &Modes,
) -> Result<(Modes, usize), EigenError> {
    let n = mass.nrows();
    let room = ((6 * wanted + 10 * BLOCK) << attempt).min(n);
    let needed = 2 * 8 * (n * (room + BLOCK)) as u64;
    ask_for(needed).map_err(|source| EigenError::TooLittleMemory {
        unknowns: n,
        source,
    })?;
    let mut basis = Basis::of(known, wanted, room + BLOCK, mass);
    let start = Mat::from_fn(n, BLOCK.min(n), |i, j| start_entry(i + j * n, attempt));
    let mut next = symmetric_product(mass, start.as_ref());
    factor.solve_in_place(next.as_mut());
    project_out(basis.spanned(), &mut next);
    let mut longest = 0.0;
    let (mut weighted, _) = orthonormalise(mass, basis.spanned(), &mut next, &mut longest);
    loop {
        let columns = basis.vectors.ncols();
        basis.extend(&next, &weighted);
        let end = basis.vectors.ncols();
        next = weighted;
        factor.solve_in_place(next.as_mut());
        // Repeated in `orthonormalise`.
        let shares = project_out(basis.spanned(), &mut next);
        let corner = basis.projected.get_mut(columns..end, columns..end);
        { corner }.copy_from(shares.get(columns..end, ..));
        let remainder;
        (weighted, remainder) = orthonormalise(mass, basis.spanned(), &mut next, &mut longest);
        let beyond = end..end + next.ncols();
        let mut below = basis.projected.get_mut(beyond, columns..end);
        below.copy_from(&remainder);
        let (theta, shares) = largest_first(basis.projected.get(..end, ..end).to_owned())?;
        let last = product(remainder.as_ref(), shares.get(columns..end, ..));
        let found = wanted.min(end);
        let converged = (0..found)
            .take_while(|&i| last.col(i).norm_l2() <= CONVERGED * theta[i])
            .count();
        if converged == wanted {
            let shares = shares.get(.., ..wanted);
            let mut vectors = Mat::zeros(n, wanted);
            subtract(basis.spanned()[0], (-shares).as_ref(), vectors.as_mut());
            let omega2 = theta[..wanted].iter().map(|x| x.recip()).collect();
            return Ok((Modes { omega2, vectors }, end));
        }
        if next.ncols() == 0 {
            // An invariant space without the rest of the modes: continue in another one.
            let fresh = |i, j| start_entry(i + j * n, TRIES + end);
            next = Mat::from_fn(n, BLOCK.min(n - end), fresh);
            // Unknowns without mass follow the others, as in the first block.
            next = symmetric_product(mass, next.as_ref());
            factor.solve_in_place(next.as_mut());
            project_out(basis.spanned(), &mut next);
            project_out(basis.spanned(), &mut next);
            weighted = orthonormalise(mass, basis.spanned(), &mut next, &mut longest).0;
        }
        // No direction has a length, as with masses whose products leave the range of f64.
        if next.ncols() == 0 || end + next.ncols() > room {
            return Err(EigenError::Basis {
                converged,
                wanted,
                columns: end,
            });
        }
    }
}

/// Basis that is orthonormal in the product of the mass.
struct Basis {
    /// Vectors V.
    vectors: Mat<f64>,
    /// Products M V.
    weighted: Mat<f64>,
    /// Lower triangle of T.
    projected: Mat<f64>,
}

impl Basis {
    /// Basis of the lowest of the `known` modes, with room for `most` columns.
    fn of(known: &Modes, wanted: usize, most: usize, mass: &CscMatrix<f64>) -> Self {
        let n = mass.nrows();
        let columns = known.count().min(wanted);
        let mut basis = Self {
            vectors: Mat::with_capacity(n, most),
            weighted: Mat::with_capacity(n, most),
            projected: Mat::zeros(most, most),
        };
        let vectors = known.vectors.get(.., ..columns).to_owned();
        basis.extend(&vectors, &symmetric_product(mass, vectors.as_ref()));
        for (j, omega2) in known.omega2[..columns].iter().enumerate() {
            basis.projected[(j, j)] = omega2.recip();
        }
        basis
    }

    /// Appends vectors with their products by the mass.
    fn extend(&mut self, vectors: &Mat<f64>, weighted: &Mat<f64>) {
        for (into, new) in [(&mut self.vectors, vectors), (&mut self.weighted, weighted)] {
            let before = into.ncols();
            let columns = before + new.ncols();
            into.resize_with(new.nrows(), columns, |i, j| new[(i, j - before)]);
        }
    }

    /// Vectors, and their products by the mass.
    fn spanned(&self) -> [MatRef<'_, f64>; 2] {
        [self.vectors.as_ref(), self.weighted.as_ref()]
    }
}

/// Makes the columns of `u`, already orthogonal to `basis` except for rounding, orthonormal in the
/// product of the mass. Those that depend on the others are dropped. Returns M u and R, old u = new
/// u R.
fn orthonormalise(
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
        let own = l[(j, j)];
        let independent = own > INDEPENDENT * whole && own.sqrt() > shortest;
        if !independent {
            return None;
        }
        for i in j..width {
            l[(i, j)] /= own.sqrt();
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
fn project_out([basis, weighted]: [MatRef<'_, f64>; 2], u: &mut Mat<f64>) -> Mat<f64> {
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
fn subtract(a: MatRef<'_, f64>, shares: MatRef<'_, f64>, u: MatMut<'_, f64>) {
    if a.nrows() == 0 || a.ncols() == 0 || u.ncols() == 0 {
        return;
    }
    u.par_row_chunks_mut(ROWS)
        .zip(a.par_row_chunks(ROWS))
        .for_each(|(u, a)| matmul(u, Accum::Add, a, shares, -1.0, Par::Seq));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eigen::{assert_like_dense, cantilever};
    use dovetail_testkit::lattice::Lattice;
    use dovetail_testkit::threads::on_threads;

    #[test]
    fn modes_that_are_known_are_not_iterated_for_again() {
        // With and without pairs of equal modes, of which the known ones may hold one.
        for irregularity in [0.6, 0.0] {
            let (k, m, factor) = cantilever([12, 6, 6], irregularity);
            let none = Modes::none(k.nrows());
            for count in [1, 15] {
                let known = lowest_modes(&k, &m, count, &factor, &none).unwrap();
                let modes = lowest_modes(&k, &m, 2 * count, &factor, &known).unwrap();
                assert_like_dense(&k, &m, &modes, 2 * count);
            }
            let basis = |known: &Modes| lanczos(&m, &factor, 30, 0, known).unwrap().1;
            let known = lowest_modes(&k, &m, 24, &factor, &none).unwrap();
            let (anew, further) = (basis(&none), basis(&known) - 24);
            assert!(further + 2 * BLOCK <= anew, "{further} {anew}");
        }
    }

    #[test]
    fn a_space_that_ends_is_spanned() {
        // All modes: the blocks run out of directions.
        let (k, m, factor) = cantilever([3, 2, 2], 0.1);
        let modes = lowest_modes(&k, &m, 24, &factor, &Modes::none(24)).unwrap();
        assert_like_dense(&k, &m, &modes, 24);
        // Three eigenvalues, each as often as `times`; a block of start vectors spans 48 directions
        // at most.
        let spring = |i: usize| [1.0, 4.0, 9.0][i];
        let lowest = |times: usize, count: usize| {
            let m = CscMatrix::identity(3 * times);
            let mut k = m.clone();
            for (i, v) in k.values_mut().iter_mut().enumerate() {
                *v = spring(i % 3);
            }
            let none = Modes::none(3 * times);
            lowest_modes(&k, &m, count, &Cholesky::factor(&k).unwrap(), &none)
        };
        for (times, count) in [(12, 24), (20, 60)] {
            let modes = lowest(times, count).unwrap();
            for (i, w2) in modes.omega2.iter().enumerate() {
                assert!((w2 / spring(i / times) - 1.0).abs() < 1e-10, "{i} {w2}");
            }
        }
        // More of one kind than a block is wide: noticed.
        let missed = lowest(20, 20);
        assert!(
            matches!(missed, Err(EigenError::Missing { expected, found, .. }) if found < expected),
            "{missed:?}"
        );
    }

    /// Products of these masses leave the range of f64: no direction has a length.
    #[test]
    fn masses_that_are_next_to_nothing_end_in_an_error() {
        let lattice = Lattice::new([9, 4, 4], 4e7, 1e-200, 0.6);
        let (k, m) = lattice.cantilever();
        let (send, receive) = std::sync::mpsc::channel();
        std::thread::spawn(move || {
            let factor = Cholesky::factor(&k).unwrap();
            let none = Modes::none(k.nrows());
            send.send(lowest_modes(&k, &m, 4, &factor, &none)).unwrap();
        });
        let ended = receive.recv_timeout(std::time::Duration::from_secs(60));
        let found = ended.expect("it ends");
        assert!(matches!(found, Err(EigenError::Basis { .. })), "{found:?}");
    }

    #[test]
    fn threads_change_no_bit() {
        let (k, m, factor) = cantilever([30, 14, 12], 0.6);
        let run = |threads: usize| {
            on_threads(threads, || {
                lowest_modes(&k, &m, 4, &factor, &Modes::none(k.nrows())).unwrap()
            })
        };
        let (one, three) = (run(1), run(3));
        assert!(k.nrows() > ROWS);
        assert_eq!(one.omega2, three.omega2);
        assert_eq!(one.vectors, three.vectors);
    }
}
