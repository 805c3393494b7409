//! Shift-invert Lanczos about zero in blocks (Grimes, Lewis, Simon, SIAM J. Matrix Anal. Appl. 15
//! (1994) 228-272, without their shifts and restarts), for factors that are read from memory at
//! each solve. A pass over the factor advances a whole block, and both threads take part.
//!
//! With A = K^-1 M and V orthonormal in the product of M, A V = V T + V' R E^T, T block
//! tridiagonal. T s = theta s gives the mode V s with omega^2 = 1 / theta, its residual |R E^T s|.
//! The basis is kept orthonormal in full. A multiple mode is found as often as the block is wide.
//! Modes that are known already are not in V, but V is orthogonal to them. The eigenvalues of T then
//! keep digits that rounding of the largest theta of the known modes would cost. `sturm.rs` finds
//! which modes are missing.

use faer::{Mat, MatRef};
use nalgebra_sparse::CscMatrix;

use super::dense::largest_first;
use super::iteration::{FoundModes, start_entry};
use super::orthonormal::{orthonormalise, project_out, subtract};
use super::{EigenError, Modes};
use crate::dense::parallel::product;
use crate::memory::check_available;
use crate::sparse::{Cholesky, symmetric_product};

/// Least number of columns of a block.
pub(super) const BLOCK: usize = 8;
/// Residual over theta at which a mode has converged.
const CONVERGED: f64 = 1e-9;
/// Ratio of theta to the largest one below which a mode needs an iteration of its own: rounding of the
/// largest theta would cost too many of its digits.
const SEPARATE: f64 = 1e-7;

/// Task of one iteration.
pub(super) struct IterationTask<'a> {
    /// Lowest modes that are known, of unit modal mass.
    pub known: &'a Modes,
    /// Number of modes wanted, with the known ones.
    pub wanted: usize,
    /// Number of columns of a block.
    pub width: usize,
    /// Number of the start vectors.
    pub seed: usize,
    /// Factor on the number of vectors that the basis has room for.
    pub room: usize,
}

impl<'a> IterationTask<'a> {
    /// First search for a number of modes.
    pub fn first(known: &'a Modes, wanted: usize) -> Self {
        Self {
            known,
            wanted,
            width: BLOCK,
            seed: 0,
            room: 1,
        }
    }
}

/// The lowest modes that are wanted. [`FoundModes`] has the reasons for fewer.
pub(super) fn lanczos(
    mass: &CscMatrix<f64>,
    factor: &Cholesky,
    search: &IterationTask<'_>,
) -> Result<FoundModes, EigenError> {
    let &IterationTask {
        known,
        wanted,
        width,
        ..
    } = search;
    let n = mass.nrows();
    let room = ((6 * wanted + 10 * width) * search.room).min(n);
    let needed = 2 * 8 * (n * (room + width)) as u64;
    check_available(needed).map_err(|source| EigenError::TooLittleMemory {
        unknowns: n,
        source,
    })?;
    let mut basis = Basis::new(known, wanted, room + width, mass);
    let mut longest = 0.0;
    let mut next = fresh_block(mass, factor, &basis, width, search.seed);
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
        let ritz = basis.ritz(columns, &remainder, wanted)?;
        if ritz.converged == wanted || ritz.is_apart() {
            return Ok(basis.converged_modes(known, &ritz, false));
        }
        if next.ncols() == 0 {
            // An invariant space without the rest of the modes: continue in another one.
            next = fresh_block(
                mass,
                factor,
                &basis,
                width.min(n - end),
                search.seed + end + 3,
            );
            weighted = orthonormalise(mass, basis.spanned(), &mut next, &mut longest).0;
            let all_converged = ritz.converged == ritz.lowest.len();
            if next.ncols() == 0 && all_converged && end > 0 {
                return Ok(basis.converged_modes(known, &ritz, true));
            }
        }
        // No direction has a length, as with masses whose products leave the range of f64.
        if next.ncols() == 0 || end + next.ncols() > room {
            if ritz.converged > basis.known.len() {
                return Ok(basis.converged_modes(known, &ritz, false));
            }
            return Err(EigenError::Basis {
                converged: ritz.converged,
                wanted,
                columns: end,
            });
        }
    }
}

/// Vectors K^-1 M v without their part in the basis: unknowns without mass follow the others in them.
fn fresh_block(
    mass: &CscMatrix<f64>,
    factor: &Cholesky,
    basis: &Basis<'_>,
    width: usize,
    seed: usize,
) -> Mat<f64> {
    let n = mass.nrows();
    let start = Mat::from_fn(n, width.min(n), |i, j| start_entry(i + j * n, seed));
    let mut next = symmetric_product(mass, start.as_ref());
    factor.solve_in_place(next.as_mut());
    project_out(basis.spanned(), &mut next);
    next
}

/// Basis that is orthonormal in the product of the mass.
struct Basis<'a> {
    /// Lowest of the known modes, which are the first vectors.
    known: &'a [f64],
    /// Vectors V.
    vectors: Mat<f64>,
    /// Products M V.
    weighted: Mat<f64>,
    /// Lower triangle of T. The rows and columns of the known modes are not used.
    projected: Mat<f64>,
}

/// Origin of a mode of the basis.
#[derive(Clone, Copy)]
enum Origin {
    /// Known mode of this number.
    Known(usize),
    /// Eigenvector of T of this number.
    New(usize),
}

/// Modes of the basis.
struct Ritz {
    /// Eigenvalues of T, the largest first, with one vector per column.
    theta: Vec<f64>,
    vectors: Mat<f64>,
    /// The lowest modes that are wanted, or fewer.
    lowest: Vec<Origin>,
    /// Number of the first of them that have converged.
    converged: usize,
}

impl Ritz {
    /// Modes of which `known` have these omega^2. `last` are the residuals R E^T s.
    fn new(
        known: &[f64],
        (theta, vectors): (Vec<f64>, Mat<f64>),
        last: &Mat<f64>,
        wanted: usize,
    ) -> Self {
        let (mut of_known, mut of_new) = (0, 0);
        let mut lowest = Vec::with_capacity(wanted);
        while lowest.len() < wanted {
            let origin = match (known.get(of_known), theta.get(of_new)) {
                (None, None) => break,
                (Some(omega2), theta) if theta.is_none_or(|theta| omega2 * theta <= 1.0) => {
                    of_known += 1;
                    Origin::Known(of_known - 1)
                }
                _ => {
                    of_new += 1;
                    Origin::New(of_new - 1)
                }
            };
            lowest.push(origin);
        }
        let has_converged = |origin: &&Origin| match **origin {
            Origin::Known(_) => true,
            Origin::New(i) => last.col(i).norm_l2() <= CONVERGED * theta[i],
        };
        Self {
            converged: lowest.iter().take_while(has_converged).count(),
            theta,
            vectors,
            lowest,
        }
    }

    /// Returns `true` if the modes left are so far above those that have converged that they need an
    /// iteration of its own.
    fn is_apart(&self) -> bool {
        match self.lowest.get(self.converged) {
            Some(Origin::New(next)) => *next > 0 && self.theta[*next] < SEPARATE * self.theta[0],
            _ => false,
        }
    }
}

impl<'a> Basis<'a> {
    /// Basis of the lowest of the `known` modes, with room for `most` columns.
    fn new(known: &'a Modes, wanted: usize, most: usize, mass: &CscMatrix<f64>) -> Self {
        let n = mass.nrows();
        let columns = known.count().min(wanted);
        let most = most + columns;
        let mut basis = Self {
            known: &known.omega2[..columns],
            vectors: Mat::with_capacity(n, most),
            weighted: Mat::with_capacity(n, most),
            projected: Mat::zeros(most, most),
        };
        let vectors = known.vectors.get(.., ..columns).to_owned();
        basis.extend(&vectors, &symmetric_product(mass, vectors.as_ref()));
        basis
    }

    /// Modes in the basis, whose vectors from number `columns` on are the last block. `remainder` is
    /// R.
    fn ritz(
        &self,
        columns: usize,
        remainder: &Mat<f64>,
        wanted: usize,
    ) -> Result<Ritz, EigenError> {
        let (first, end) = (self.known.len(), self.vectors.ncols());
        let (theta, vectors) =
            largest_first(self.projected.get(first..end, first..end).to_owned())?;
        let shares = vectors.get(columns - first..end - first, ..);
        let last = product(remainder.as_ref(), shares);
        Ok(Ritz::new(self.known, (theta, vectors), &last, wanted))
    }

    /// The modes that have converged.
    fn converged_modes(&self, known: &Modes, ritz: &Ritz, exhausted: bool) -> FoundModes {
        let lowest = &ritz.lowest[..ritz.converged];
        let new = lowest
            .iter()
            .filter(|origin| matches!(origin, Origin::New(_)));
        let shares = ritz.vectors.get(.., ..new.count());
        let mut new = Mat::zeros(self.vectors.nrows(), shares.ncols());
        let vectors = self.vectors.get(.., self.known.len()..);
        subtract(vectors, (-shares).as_ref(), new.as_mut());
        let omega2 = lowest.iter().map(|origin| match *origin {
            Origin::Known(i) => known.omega2[i],
            Origin::New(i) => ritz.theta[i].recip(),
        });
        let omega2 = omega2.collect();
        let vectors = match self.known {
            [] => new,
            _ => {
                let mut columns = Mat::zeros(new.nrows(), lowest.len());
                for (mut into, origin) in columns.col_iter_mut().zip(lowest) {
                    into.copy_from(match *origin {
                        Origin::Known(i) => known.vectors.col(i),
                        Origin::New(i) => new.col(i),
                    });
                }
                columns
            }
        };
        FoundModes {
            modes: Modes { omega2, vectors },
            columns: self.vectors.ncols(),
            exhausted,
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eigen::orthonormal::ROWS;
    use crate::eigen::{LastModes, assert_like_dense, cantilever, modes_by_blocks as lowest_modes};
    use dovetail_testkit::lattice::Lattice;
    use dovetail_testkit::threads::run_on_threads;

    #[test]
    fn modes_that_are_known_are_not_iterated_for_again() {
        // With and without pairs of equal modes, of which the known ones may hold one.
        for irregularity in [0.6, 0.0] {
            let (k, m, factor) = cantilever([12, 6, 6], irregularity);
            let none = Modes::none(k.nrows());
            for count in [1, 15] {
                let known = lowest_modes(&k, &m, count, &factor, &none, LastModes::Given).unwrap();
                let modes =
                    lowest_modes(&k, &m, 2 * count, &factor, &known, LastModes::Given).unwrap();
                assert_like_dense(&k, &m, &modes, 2 * count);
            }
            let basis = |known: &Modes| {
                let search = IterationTask::first(known, 30);
                lanczos(&m, &factor, &search).unwrap().columns
            };
            let known = lowest_modes(&k, &m, 24, &factor, &none, LastModes::Given).unwrap();
            let (anew, further) = (basis(&none), basis(&known) - 24);
            assert!(further + 2 * BLOCK <= anew, "{further} {anew}");
        }
    }

    #[test]
    fn a_space_that_ends_is_spanned() {
        // All modes: the blocks run out of directions.
        let (k, m, factor) = cantilever([3, 2, 2], 0.1);
        let modes = lowest_modes(&k, &m, 24, &factor, &Modes::none(24), LastModes::Given).unwrap();
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
            let factor = Cholesky::factor(&k).unwrap();
            lowest_modes(&k, &m, count, &factor, &none, LastModes::Given)
        };
        // More of one kind than a block is wide, and several blocks of the widest.
        for (times, count) in [(12, 24), (20, 60), (20, 20), (20, 7), (150, 280)] {
            let modes = lowest(times, count).unwrap();
            for (i, w2) in modes.omega2.iter().enumerate() {
                assert!((w2 / spring(i / times) - 1.0).abs() < 1e-10, "{i} {w2}");
            }
        }
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
            let found = lowest_modes(&k, &m, 4, &factor, &none, LastModes::Given);
            send.send(found).unwrap();
        });
        let ended = receive.recv_timeout(std::time::Duration::from_secs(60));
        let found = ended.expect("it ends");
        assert!(matches!(found, Err(EigenError::Basis { .. })), "{found:?}");
    }

    #[test]
    fn threads_change_no_bit() {
        let (k, m, factor) = cantilever([30, 14, 12], 0.6);
        let run = |threads: usize| {
            run_on_threads(threads, || {
                lowest_modes(
                    &k,
                    &m,
                    4,
                    &factor,
                    &Modes::none(k.nrows()),
                    LastModes::Given,
                )
                .unwrap()
            })
        };
        let (one, three) = (run(1), run(3));
        assert!(k.nrows() > ROWS);
        assert_eq!(one.omega2, three.omega2);
        assert_eq!(one.vectors, three.vectors);
    }
}
