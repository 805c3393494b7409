//! Sturm check. Residuals show that computed modes are modes, and a Sturm count shows that none is
//! missing (the inertia of K - sigma M just above the last one, Parlett, The Symmetric Eigenvalue
//! Problem, 3.3).

use nalgebra_sparse::CscMatrix;

use super::{EigenError, Modes, normalise};
use crate::sparse::{self, Cholesky, negative_eigenvalues};

/// Number of modes computed beyond those asked for, to find a gap for the Sturm count; more at each
/// new try.
pub(super) const SPARE: usize = 2;
/// Largest accepted `|phi - omega^2 K^-1 M phi| / |phi|`: the relative error of omega^2 is no
/// larger.
const RESIDUAL: f64 = 1e-8;
/// Accepted rounding of the solves by K, times omega^2 over the first one. Rounding adds so much of
/// the first mode to the others.
const ROUNDING: f64 = 1e-14;
/// Largest accepted relative difference between omega^2 and the Rayleigh quotient, which does not
/// use the factor: rounding of K alone leaves its condition number times 1e-16.
const RAYLEIGH: f64 = 1e-5;
/// Relative distance below which two eigenvalues have no room for a shift between them.
const GAP: f64 = 1e-6;

/// Number of tries of a Lanczos method, each with other start vectors and more room.
pub(super) const TRIES: usize = 3;

/// The `count` lowest modes of `lanczos(wanted, attempt)`, tried until the Sturm check accepts
/// them.
pub(super) fn certified_of_tries(
    stiffness: &CscMatrix<f64>,
    mass: &CscMatrix<f64>,
    count: usize,
    factor: &Cholesky,
    lanczos: impl Fn(usize, usize) -> Result<Modes, EigenError>,
) -> Result<Modes, EigenError> {
    let attempted = |attempt: usize| {
        lanczos(count + (SPARE << attempt), attempt)
            .and_then(|modes| certified(stiffness, mass, count, modes, factor))
    };
    for attempt in 0..TRIES - 1 {
        match attempted(attempt) {
            Err(
                EigenError::Arpack { .. }
                | EigenError::Basis { .. }
                | EigenError::Residual { .. }
                | EigenError::Missing { .. },
            ) => {}
            outcome => return outcome,
        }
    }
    attempted(TRIES - 1)
}

/// Checks residuals and that no mode is missing, and drops the spare modes.
pub(super) fn certified(
    stiffness: &CscMatrix<f64>,
    mass: &CscMatrix<f64>,
    count: usize,
    modes: Modes,
    factor: &Cholesky,
) -> Result<Modes, EigenError> {
    let weighted = sparse::symmetric_product(mass, modes.vectors.as_ref());
    let mut followed = weighted.clone();
    factor.solve_in_place(followed.as_mut());
    let pulled = sparse::symmetric_product(stiffness, modes.vectors.as_ref());
    for j in 0..modes.count() {
        let (phi, omega2) = (modes.vectors.col(j), modes.omega2[j]);
        let residual = (phi - faer::Scale(omega2) * followed.col(j)).norm_l2();
        let residual = residual / phi.norm_l2();
        let quotient = (phi.transpose() * pulled.col(j)) / (phi.transpose() * weighted.col(j));
        let unlike = (quotient / omega2 - 1.0).abs();
        // False for a NaN.
        let rounding = (ROUNDING * omega2 / modes.omega2[0]).min(RAYLEIGH);
        let accepted = residual < RESIDUAL.max(rounding) && unlike < RAYLEIGH && omega2 > 0.0;
        if !accepted {
            let residual = residual.max(unlike);
            return Err(EigenError::Residual {
                mode: j + 1,
                residual,
            });
        }
    }
    let (found, shift) = gap(&modes.omega2, count);
    let below = negative_eigenvalues(stiffness, shift, mass, factor.symbolic())?;
    if below != found {
        return Err(EigenError::Missing {
            below: shift,
            expected: below,
            found,
        });
    }
    let mut vectors = modes.vectors.get(.., ..count).to_owned();
    normalise(&mut vectors, weighted.as_ref(), f64::NEG_INFINITY);
    Ok(Modes {
        omega2: modes.omega2[..count].to_vec(),
        vectors,
    })
}

/// Widest gap above the first `count` eigenvalues: the number of eigenvalues below it, and a shift
/// in it. Where all the spare ones coincide with the last, the shift is just above the last.
fn gap(omega2: &[f64], count: usize) -> (usize, f64) {
    let ratio = |i: usize| omega2[i] / omega2[i - 1];
    (count..omega2.len())
        .filter(|&i| ratio(i) > 1.0 + GAP)
        .max_by(|&a, &b| ratio(a).total_cmp(&ratio(b)))
        .map_or(
            (omega2.len(), omega2[omega2.len() - 1] * (1.0 + GAP)),
            |i| (i, (omega2[i] * omega2[i - 1]).sqrt()),
        )
}
