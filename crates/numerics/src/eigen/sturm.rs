//! Judgement of modes that an iteration found, and the search for those that it missed. Residuals
//! show that computed modes are modes, and a Sturm count shows that none is missing (the inertia of
//! K - sigma M in a gap above them, Parlett, The Symmetric Eigenvalue Problem, 3.3).
//!
//! An iteration misses copies of a multiple mode, and loses digits of modes far above the first
//! ones. [`complete`] then keeps the modes that are right and iterates in blocks for the others,
//! orthogonal to the modes kept (deflation). A block is as wide as the number of missing copies. One
//! Sturm count serves all rounds.

use std::borrow::Cow;

use faer::{Mat, MatRef};
use nalgebra_sparse::CscMatrix;

use super::blocks::{self, BLOCK, IterationTask};
use super::iteration::{FoundModes, SPARE};
use super::{EigenError, LastModes, Modes, Pencil, normalise};
use crate::sparse::{negative_eigenvalues, symmetric_product};

/// Largest accepted `|phi - omega^2 K^-1 M phi| / |phi|`: the relative error of omega^2 is no
/// larger.
const RESIDUAL: f64 = 1e-8;
/// Largest accepted relative difference between omega^2 and the Rayleigh quotient, which does not
/// use the factor.
const RAYLEIGH: f64 = 1e-5;
/// Accepted multiple of the rounding of `phi^T K phi` in units of the last place.
const ROUNDINGS: f64 = 8.0;
/// Largest accepted relative error of omega^2 by rounding.
const MOST_ROUNDING: f64 = 2e-3;
/// Relative distance below which two eigenvalues have no room for a shift between them, and count as
/// equal.
const GAP: f64 = 1e-6;
/// Most columns of a block.
const WIDEST: usize = 64;
/// Number of rounds that may end without a further mode, each with more room.
const TRIES: usize = 3;

/// Sturm count: the number of eigenvalues below a shift.
#[derive(Clone, Copy)]
struct SturmCount {
    shift: f64,
    expected: usize,
}

/// The `count` lowest modes, or a few more as `last` says. `first` is an iteration for a number of modes.
/// Further ones are made until residuals and the Sturm count agree. `known` are the lowest modes, if
/// any are known.
pub(super) fn complete(
    pencil: &Pencil<'_>,
    count: usize,
    last: LastModes,
    known: &Modes,
    first: impl FnOnce(usize) -> Result<FoundModes, EigenError>,
) -> Result<Modes, EigenError> {
    let wanted = count + SPARE;
    let (mut known, mut search) = (Cow::Borrowed(known), (wanted, BLOCK));
    let (mut counted, mut reached, mut idle) = (None, 0, 0);
    let mut outcome = first(wanted);
    for seed in 1.. {
        let (progress, error) = match outcome {
            Ok(found) => {
                let (modes, exhausted) = (found.modes, found.exhausted);
                let judged = judge(pencil, &modes);
                if let Some(error) = judged.error {
                    let right = modes.lowest(judged.accepted);
                    (known, search) = (Cow::Owned(right), (wanted, BLOCK));
                    (judged.accepted, error)
                } else if modes.count() < count && !exhausted {
                    let error = EigenError::Basis {
                        converged: modes.count(),
                        wanted,
                        columns: found.columns,
                    };
                    (known, search) = (Cow::Owned(modes), (wanted, BLOCK));
                    (known.count(), error)
                } else {
                    let count = count.min(modes.count());
                    let of = match counted {
                        Some(of) => of,
                        None => SturmCount::new(pencil, &modes.omega2, count, last)?,
                    };
                    let below = modes.omega2.partition_point(|w2| *w2 < of.shift);
                    if below == of.expected {
                        let count = last.end(&modes.omega2, count);
                        return Ok(finished(&modes, judged.weighted.as_ref(), count));
                    }
                    let missing = of.expected.saturating_sub(below);
                    let width = missing.clamp(BLOCK, WIDEST);
                    search = (modes.count() + missing.min(width), width);
                    counted = Some(of);
                    // More modes than the count are wrong ones.
                    known = Cow::Owned(modes.lowest(if missing > 0 { modes.count() } else { 0 }));
                    (below.min(of.expected), of.missed(below))
                }
            }
            Err(error @ (EigenError::Arpack { .. } | EigenError::Basis { .. })) => (0, error),
            Err(error) => return Err(error),
        };
        if progress <= reached {
            idle += 1;
            if idle == TRIES {
                return Err(error);
            }
        }
        reached = progress.max(reached);
        let (wanted, width) = search;
        outcome = blocks::lanczos(
            pencil.mass,
            pencil.factor,
            &IterationTask {
                known: &known,
                wanted: wanted.min(pencil.mass.nrows()),
                width,
                seed,
                room: 1 << idle,
            },
        );
    }
    unreachable!("the rounds end with the modes or with an error")
}

/// Verdict on modes.
struct Judged {
    /// Products of the mass and the modes.
    weighted: Mat<f64>,
    /// Number of the first modes that are accepted.
    accepted: usize,
    /// Reason for which the next mode is not.
    error: Option<EigenError>,
}

/// Judges the residuals of the modes, each by its own scale.
fn judge(pencil: &Pencil<'_>, modes: &Modes) -> Judged {
    let weighted = symmetric_product(pencil.mass, modes.vectors.as_ref());
    let mut followed = weighted.clone();
    pencil.factor.solve_in_place(followed.as_mut());
    let pulled = symmetric_product(pencil.stiffness, modes.vectors.as_ref());
    let verdict = |j: usize| {
        let (phi, omega2) = (modes.vectors.col(j), modes.omega2[j]);
        let residual = phi - faer::Scale(omega2) * followed.col(j);
        let relative_residual = residual.norm_l2() / phi.norm_l2();
        let modal_mass = phi.transpose() * weighted.col(j);
        let quotient = (phi.transpose() * pulled.col(j)) / modal_mass;
        let unlike = (quotient / omega2 - 1.0).abs();
        // False for a NaN.
        if relative_residual < RESIDUAL && unlike < RAYLEIGH && omega2 > 0.0 {
            return None;
        }
        let deflated_residual = deflated_length(residual, modes, &weighted, j) / phi.norm_l2();
        let energy = absolute_energy(pencil.stiffness, modes.vectors.col_as_slice(j));
        let rounding = ROUNDINGS * f64::EPSILON * energy / (omega2 * modal_mass);
        let residual = deflated_residual.max(unlike);
        let accepted = |rounding: f64| {
            deflated_residual < RESIDUAL.max(rounding)
                && unlike < RAYLEIGH.max(rounding)
                && omega2 > 0.0
        };
        if accepted(rounding.min(MOST_ROUNDING)) {
            return None;
        }
        if accepted(rounding) {
            return Some(EigenError::Rounding {
                mode: j + 1,
                residual,
            });
        }
        Some(EigenError::Residual {
            mode: j + 1,
            residual,
        })
    };
    let refused = (0..modes.count()).find_map(|j| Some((j, verdict(j)?)));
    let (accepted, error) = match refused {
        Some((j, error)) => (j, Some(error)),
        None => (modes.count(), None),
    };
    Judged {
        weighted,
        accepted,
        error,
    }
}

/// Length of a residual of mode j in which the part along each lower mode counts as the part of that
/// mode in mode j that causes it: a solve by K multiplies this part by the ratio of the squared
/// frequencies.
fn deflated_length(
    mut residual: faer::Col<f64>,
    modes: &Modes,
    weighted: &Mat<f64>,
    j: usize,
) -> f64 {
    let mut squares = 0.0;
    for k in 0..j {
        let phi = modes.vectors.col(k);
        let modal_mass = phi.transpose() * weighted.col(k);
        let share = (weighted.col(k).transpose() * &residual) / modal_mass;
        residual -= faer::Scale(share) * phi;
        let cause = share * (modes.omega2[k] / modes.omega2[j]).min(1.0);
        squares += (cause * phi.norm_l2()).powi(2);
    }
    (squares + residual.squared_norm_l2()).sqrt()
}

/// Computes `|phi|^T |K| |phi|`, which the rounding of `phi^T K phi` is relative to.
fn absolute_energy(stiffness: &CscMatrix<f64>, phi: &[f64]) -> f64 {
    let columns = stiffness.col_iter().zip(phi);
    let of_column = |(column, own): (nalgebra_sparse::csc::CscCol<'_, f64>, &f64)| {
        let entries = column.row_indices().iter().zip(column.values());
        own.abs() * entries.map(|(&i, k)| (k * phi[i]).abs()).sum::<f64>()
    };
    columns.map(of_column).sum()
}

/// The `count` lowest of modes that are complete.
fn finished(modes: &Modes, weighted: MatRef<'_, f64>, count: usize) -> Modes {
    let mut lowest = modes.lowest(count);
    normalise(&mut lowest.vectors, weighted, f64::NEG_INFINITY);
    lowest
}

impl SturmCount {
    /// Counts the eigenvalues below the widest gap above the first `count`. If they are equal to all
    /// further ones the gap is the one below them, or just above the last one if `last` wants equal
    /// ones.
    fn new(
        pencil: &Pencil<'_>,
        omega2: &[f64],
        count: usize,
        last: LastModes,
    ) -> Result<Self, EigenError> {
        let ratio = |i: usize| omega2[i] / omega2[i - 1];
        let is_gap = |i: &usize| ratio(*i) > 1.0 + GAP;
        let between = |i: usize| (omega2[i] * omega2[i - 1]).sqrt();
        let above = (count..omega2.len()).filter(is_gap);
        let above = above.max_by(|&a, &b| ratio(a).total_cmp(&ratio(b)));
        let shift = match (above, last) {
            (Some(i), _) => between(i),
            (None, _) if count == omega2.len() => 2.0 * omega2[count - 1],
            (None, LastModes::WithEqual) => omega2[omega2.len() - 1] * (1.0 + GAP),
            (None, LastModes::Given) => match (1..count).rev().find(is_gap) {
                Some(i) => between(i),
                None => omega2[0] / (1.0 + GAP),
            },
        };
        let (k, m, symbolic) = (pencil.stiffness, pencil.mass, pencil.factor.symbolic());
        let expected = negative_eigenvalues(k, shift, m, symbolic)?;
        Ok(Self { shift, expected })
    }

    fn missed(self, found: usize) -> EigenError {
        EigenError::Missing {
            below: self.shift,
            expected: self.expected,
            found,
        }
    }
}

impl LastModes {
    /// Number of modes that belong to the first `count`.
    pub(super) fn end(self, omega2: &[f64], count: usize) -> usize {
        let is_equal = |i: &usize| omega2[*i] <= omega2[i - 1] * (1.0 + GAP);
        match self {
            Self::Given => count,
            Self::WithEqual => count + (count..omega2.len()).take_while(is_equal).count(),
        }
    }
}
