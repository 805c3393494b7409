//! Residual vectors: the part of static answers that the modes leave out.
//!
//! With the lowest modes Phi of (K, M), the static answer K^-1 f of a load f has a part that they
//! do not give, R f with the residual flexibility R = K^-1 - Phi Omega^-2 Phi^T. Together with the
//! modes, the parts of all loads make the static answers exact. With those of the observed points
//! the first error of a harmonic answer falls with the fourth power of the frequency (Dickens,
//! Nakagawa, Wittbrodt, Comput. Struct. 62 (1997) 985-998). They are made orthogonal in K and M, so
//! that they can follow the modes as further ones; their frequencies lie above those of the modes
//! and have no other meaning.
//!
//! A load on unknowns without mass may have a part R f without inertia, which follows the load at once.
//! It becomes a further mode with the frequency [`MASSLESS_RAD_S`], at which nothing but its stiffness
//! counts.

use faer::{Mat, MatRef};
use nalgebra_sparse::CscMatrix;

use dovetail_numerics::dense::parallel::product;
use dovetail_numerics::dense::self_adjoint_eigen;
use dovetail_numerics::eigen::Modes;
use dovetail_numerics::sparse::symmetric_product;

/// Fraction of a load's static energy below which its residual counts as rounding.
const RESIDUAL: f64 = 1e-10;
/// Frequency of a vector without inertia, rad/s: above all vibrations of solids, whose atoms vibrate at
/// 1e14 rad/s. One with less inertia than that has none.
const MASSLESS_RAD_S: f64 = 1e15;
/// Smallest eigenvalue of the residuals' energies, each scaled to one, that counts as a direction
/// of its own.
const INDEPENDENT: f64 = 1e-9;

/// Residual vectors, and the energies that they account for.
#[derive(Debug)]
pub(super) struct ResidualVectors {
    /// Vectors of unit modal mass, orthogonal to each other and to the modes in K and M, by
    /// ascending frequency.
    pub vectors: Modes,
    /// Number of the last of them that have no inertia. They move neither other vectors nor contacts.
    pub massless: usize,
    /// Fraction of the static energy of each load that the modes do not give: f^T R f / f^T K^-1 f.
    pub energy_shares: Vec<f64>,
}

/// Error of residual vectors that were not found.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ResidualError {
    #[error(
        "the work of load {load} on its static answer is {energy_j:e} J (load 1 is the steady one, excitations and observed points follow)"
    )]
    NotFinite { load: usize, energy_j: f64 },
    #[error("the dense eigenvalue solver did not converge on {vectors} static answers")]
    Dense { vectors: usize },
}

/// Vectors R f of the `loads` (unknowns x loads) with their static `answers` K^-1 f, of unit modal
/// mass and orthogonal to each other and to the modes. Loads that depend on each other, or that the
/// modes answer in full, give fewer vectors than there are loads.
///
/// # Errors
/// Loads or answers that are not finite, or too large to be squared; a dense eigenvalue solver that
/// does not converge.
pub(super) fn residual_vectors(
    loads: MatRef<'_, f64>,
    answers: MatRef<'_, f64>,
    modes: &Modes,
    mass: &CscMatrix<f64>,
) -> Result<ResidualVectors, ResidualError> {
    let n = loads.nrows();
    let mut residual = answers.to_owned();
    let whole = energies(loads, answers)?;
    // Twice, for the rounding of the first time.
    for _ in 0..2 {
        let weighted = symmetric_product(mass, residual.as_ref());
        let shares = product(modes.vectors.transpose(), weighted.as_ref());
        residual -= product(modes.vectors.as_ref(), shares.as_ref());
    }
    let left = energies(loads, residual.as_ref())?;
    let retained: Vec<usize> = (0..loads.ncols())
        .filter(|&j| left[j] > RESIDUAL * whole[j])
        .collect();
    let scaled = |a: MatRef<'_, f64>| {
        Mat::from_fn(n, retained.len(), |i, j| {
            a[(i, retained[j])] / left[retained[j]].sqrt()
        })
    };
    let (loads, residual) = (scaled(loads), scaled(residual.as_ref()));
    let share = |(left, whole): (&f64, &f64)| {
        if *whole > 0.0 {
            (left / whole).max(0.0)
        } else {
            0.0
        }
    };
    let (vectors, massless) = orthonormal(loads.as_ref(), residual.as_ref(), mass)?;
    Ok(ResidualVectors {
        vectors,
        massless,
        energy_shares: left.iter().zip(&whole).map(share).collect(),
    })
}

/// Span of the residuals of `loads`, each of unit energy, and the number of its last vectors that have
/// no inertia.
fn orthonormal(
    loads: MatRef<'_, f64>,
    residual: MatRef<'_, f64>,
    mass: &CscMatrix<f64>,
) -> Result<(Modes, usize), ResidualError> {
    let eigen = |a: Mat<f64>| {
        let failed = ResidualError::Dense { vectors: a.nrows() };
        self_adjoint_eigen(a.as_ref())
            .filter(|(values, _)| values.iter().all(|v| v.is_finite()))
            .ok_or(failed)
    };
    // R^T K R = R^T F, R being orthogonal to the modes.
    let (energy, directions) = eigen(product(residual.transpose(), loads))?;
    let first = energy.partition_point(|e| *e < INDEPENDENT);
    let directions = Mat::from_fn(energy.len(), energy.len() - first, |i, j| {
        directions[(i, first + j)] / energy[first + j].sqrt()
    });
    let residual = product(residual, directions.as_ref());
    let weighted = symmetric_product(mass, residual.as_ref());
    let (inertia, directions) = eigen(product(residual.transpose(), weighted.as_ref()))?;
    // The largest inertia is the lowest frequency.
    let least = MASSLESS_RAD_S.powi(-2);
    let massless = inertia.iter().filter(|inertia| **inertia <= least).count();
    let count = inertia.len();
    let scale = |j: usize| inertia[count - 1 - j].max(least);
    let directions = Mat::from_fn(count, count, |i, j| {
        directions[(i, count - 1 - j)] / scale(j).sqrt()
    });
    let vectors = Modes {
        omega2: (0..count).map(|j| scale(j).recip()).collect(),
        vectors: product(residual.as_ref(), directions.as_ref()),
    };
    Ok((vectors, massless))
}

/// Computes f . u for each column.
fn energies(loads: MatRef<'_, f64>, answers: MatRef<'_, f64>) -> Result<Vec<f64>, ResidualError> {
    let energy = |j: usize| match loads.col(j).transpose() * answers.col(j) {
        energy_j if f64::is_finite(energy_j) => Ok(energy_j),
        energy_j => Err(ResidualError::NotFinite {
            load: j + 1,
            energy_j,
        }),
    };
    (0..loads.ncols()).map(energy).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Residual vectors of two loads on three unit masses on springs of 2 N/m.
    fn residual_of(loads: [[f64; 3]; 2]) -> Result<ResidualVectors, ResidualError> {
        let none = Modes::none(3);
        let loads = Mat::from_fn(3, 2, |i, j| loads[j][i]);
        let answers = Mat::from_fn(3, 2, |i, j| 0.5 * loads[(i, j)]);
        residual_vectors(
            loads.as_ref(),
            answers.as_ref(),
            &none,
            &CscMatrix::identity(3),
        )
    }

    #[test]
    fn loads_that_no_number_can_answer_are_an_error_and_not_left_out() {
        let found = residual_of([[1.0, 0.0, 0.0], [3.0, 4.0, 0.0]]).unwrap();
        assert_eq!(found.vectors.count(), 2);
        assert_eq!(found.energy_shares, [1.0; 2]);
        for large in [1e200, f64::INFINITY, f64::NAN] {
            let refused = residual_of([[1.0, 0.0, 0.0], [0.0, large, 0.0]]);
            assert!(
                matches!(refused, Err(ResidualError::NotFinite { load: 2, .. })),
                "{large}: {refused:?}"
            );
        }
    }

    #[test]
    fn an_eigen_solver_that_fails_is_an_error() {
        let loads = Mat::from_fn(3, 2, |i, j| (i + j) as f64);
        let answers = Mat::from_fn(3, 2, |i, _| if i == 0 { f64::NAN } else { 1.0 });
        let refused = orthonormal(loads.as_ref(), answers.as_ref(), &CscMatrix::identity(3));
        assert!(
            matches!(refused, Err(ResidualError::Dense { vectors: 2 })),
            "{refused:?}"
        );
    }
}
