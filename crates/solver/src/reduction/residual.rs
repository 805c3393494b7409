//! What modes leave of static answers.
//!
//! With the lowest modes Phi of (K, M), the static answer K^-1 f of a load f has a part that they do not
//! give, R f with the residual flexibility R = K^-1 - Phi Omega^-2 Phi^T. Beside the modes, the parts of
//! all loads make the static answers exact, and with those of the observed points the first error of
//! a harmonic answer falls with the fourth power of the frequency (Dickens, Nakagawa, Wittbrodt,
//! Comput. Struct. 62 (1997) 985-998). They are made orthogonal in K and M, so that they stand beside the
//! modes as further ones; their frequencies lie above those of the modes and mean nothing else.

use faer::{Mat, MatRef};
use nalgebra_sparse::CscMatrix;

use dovetail_numerics::dense::self_adjoint_eigen;
use dovetail_numerics::eigen::Modes;
use dovetail_numerics::sparse::{product, symmetric_product};

/// Share of a load's static energy below which its residual counts as rounding.
const RESIDUAL: f64 = 1e-10;
/// Smallest eigenvalue of the residuals' energies, each scaled to one, that is a direction of its own.
const INDEPENDENT: f64 = 1e-9;

/// Residual vectors, and what they are for.
pub(super) struct Residual {
    /// Of unit modal mass, orthogonal to each other and to the modes in K and M, by ascending frequency.
    pub vectors: Modes,
    /// Of each load the share of its static energy that the modes do not give: f^T R f / f^T K^-1 f.
    pub left: Vec<f64>,
}

/// Vectors R f of the `loads` (unknowns x loads) with their static `answers` K^-1 f, of unit modal mass and orthogonal to each other and to
/// the modes. Loads that depend on each other, or that the modes answer in full, give fewer vectors than there
/// are loads.
pub(super) fn residual_vectors(
    loads: MatRef<'_, f64>,
    answers: MatRef<'_, f64>,
    modes: &Modes,
    mass: &CscMatrix<f64>,
) -> Residual {
    let n = loads.nrows();
    let mut residual = answers.to_owned();
    let whole: Vec<f64> = energies(loads, answers);
    // Twice, for the rounding of the first time.
    for _ in 0..2 {
        let weighted = symmetric_product(mass, residual.as_ref());
        let shares = product(modes.vectors.transpose(), weighted.as_ref());
        residual -= product(modes.vectors.as_ref(), shares.as_ref());
    }
    let left = energies(loads, residual.as_ref());
    let kept: Vec<usize> = (0..loads.ncols())
        .filter(|&j| left[j] > RESIDUAL * whole[j])
        .collect();
    let scaled = |a: MatRef<'_, f64>| {
        Mat::from_fn(n, kept.len(), |i, j| a[(i, kept[j])] / left[kept[j]].sqrt())
    };
    let (loads, residual) = (scaled(loads), scaled(residual.as_ref()));
    let shares = left.iter().zip(&whole);
    let shares = shares.map(|(left, whole)| {
        if *whole > 0.0 {
            (left / whole).max(0.0)
        } else {
            0.0
        }
    });
    let shares: Vec<f64> = shares.collect();
    let vectors = orthonormal(loads.as_ref(), residual.as_ref(), mass).unwrap_or_else(|| Modes {
        omega2: Vec::new(),
        vectors: Mat::zeros(n, 0),
    });
    Residual {
        vectors,
        left: shares,
    }
}

/// The span of the residuals of `loads`, each of unit energy; `None` where the eigenvalues are not found.
fn orthonormal(
    loads: MatRef<'_, f64>,
    residual: MatRef<'_, f64>,
    mass: &CscMatrix<f64>,
) -> Option<Modes> {
    // R^T K R = R^T F, R being orthogonal to the modes.
    let stiffness = product(residual.transpose(), loads);
    let (energy, directions) = self_adjoint_eigen(stiffness.as_ref())?;
    let first = energy.partition_point(|e| *e < INDEPENDENT);
    let directions = Mat::from_fn(energy.len(), energy.len() - first, |i, j| {
        directions[(i, first + j)] / energy[first + j].sqrt()
    });
    let residual = product(residual, directions.as_ref());
    let weighted = symmetric_product(mass, residual.as_ref());
    let inertia = product(residual.transpose(), weighted.as_ref());
    let (inertia, directions) = self_adjoint_eigen(inertia.as_ref())?;
    // The largest inertia is the lowest frequency.
    let count = inertia.len();
    let ascending: Vec<usize> = (0..count).rev().filter(|&j| inertia[j] > 0.0).collect();
    let directions = Mat::from_fn(count, ascending.len(), |i, j| {
        directions[(i, ascending[j])] / inertia[ascending[j]].sqrt()
    });
    Some(Modes {
        omega2: ascending.iter().map(|&j| inertia[j].recip()).collect(),
        vectors: product(residual.as_ref(), directions.as_ref()),
    })
}

/// f . u of each column.
fn energies(loads: MatRef<'_, f64>, answers: MatRef<'_, f64>) -> Vec<f64> {
    (0..loads.ncols())
        .map(|j| loads.col(j).transpose() * answers.col(j))
        .collect()
}
