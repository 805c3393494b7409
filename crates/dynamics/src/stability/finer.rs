//! The same motion with more harmonics: the instants at which pairs change converge slower than
//! amplitudes do.

use crate::damping::Rayleigh;
use crate::dlft::dense::exact_newton;
use crate::dlft::eps::Eps;
use crate::dlft::one_balance::{OneBalanceSettings, one_balance};
use crate::dlft::orbit::orbit;
use crate::dlft::settings::{EpsChoice, Resolution};
use crate::dlft::{Orbit, Outcome, StaticState};
use crate::problem::Problem;
use dovetail_numerics::nonlinear::{NewtonOptions, NewtonStatus};

/// Most unknowns of a balance that is solved for a verdict.
const MOST_UNKNOWNS: usize = 800;
/// Criteria of the balance.
const CRITERIA: NewtonOptions = NewtonOptions::new(1e-8, 20);

/// Motion with more harmonics.
pub(super) enum Finer {
    /// The motion.
    Found(Box<Orbit>),
    /// It was not found from the motion with fewer harmonics.
    NotFound,
    /// It has too many unknowns.
    TooLarge,
}

/// Motion near `coarse` with about twice its harmonics, or with half as many again.
pub(super) fn finer(
    problem: &Problem,
    damping: Rayleigh,
    state: &StaticState,
    coarse: &Orbit,
) -> Finer {
    let known = coarse.harmonics;
    for harmonics in [2 * known + 1, known + known / 2 + 1] {
        let unknowns = (2 * harmonics + 1) * problem.reduced.stiffness.nrows();
        if unknowns > MOST_UNKNOWNS {
            return Finer::TooLarge;
        }
        if let Some(found) = solved(problem, damping, state, coarse, harmonics) {
            return Finer::Found(Box::new(found));
        }
    }
    Finer::NotFound
}

fn solved(
    problem: &Problem,
    damping: Rayleigh,
    state: &StaticState,
    coarse: &Orbit,
    harmonics: usize,
) -> Option<Orbit> {
    let settings = OneBalanceSettings {
        frequency_hz: coarse.frequency_hz,
        harmonics,
        samples: 2 * Resolution::least_samples(harmonics),
        eps: Eps::new(EpsChoice::Dynamic),
        eps_hz: coarse.frequency_hz,
        mean: coarse.mean,
    };
    let balance = one_balance(problem, damping, state, settings);
    let mut u = coarse.x.clone();
    u.resize(balance.unknowns(), 0.0);
    let (end, evaluation) = exact_newton(&balance, &mut u, None, CRITERIA);
    let found = || {
        orbit(
            &balance,
            &u,
            &evaluation,
            coarse.frequency_hz,
            Outcome::Converged,
        )
    };
    (end.status == NewtonStatus::Converged).then(found)
}
