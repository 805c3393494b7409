//! Made-up data for unit tests: an orbit that nothing computed, and the smallest model whose curve
//! folds; and what a solution told.

use super::{Orbit, Outcome, SolvedFrequency, SweepProgress};
use crate::contact::PairLaw;
use crate::contact::penalty::PairStiffness;
use crate::damping::Rayleigh;
use crate::problem::{HarmonicLoad, Problem};
use crate::reduced::{Load, ObservedPoint, ReducedModel};
use faer::Mat;
use std::sync::Mutex;

/// Orbit without pairs, with these observed amplitudes.
pub(crate) fn orbit(frequency_hz: f64, outcome: Outcome, amplitudes_m: &[f64]) -> Orbit {
    Orbit {
        observed: amplitudes_m.iter().map(|a| vec![0.0, *a, 0.0]).collect(),
        observed_amplitude: amplitudes_m.to_vec(),
        ..Orbit::motionless(frequency_hz, outcome)
    }
}

/// Mass of 1 kg on a spring of 1 N/m, excited by 0.1 N, in front of a stop of 5 N/m without
/// friction at a distance of `gap_m`. It is on such springs along the stop, too, and nothing
/// couples these motions with the first.
pub(crate) fn mass_with_a_stop(gap_m: f64) -> Problem {
    let normal = |size: f64| vec![size, 0.0, 0.0];
    Problem {
        reduced: ReducedModel {
            observations: vec![ObservedPoint::new("mass", normal(1.0), vec![])],
            ..ReducedModel::from_pair_matrices(Mat::identity(3, 3), Mat::identity(3, 3))
        }
        .into(),
        laws: vec![PairLaw {
            stiffness: Some(PairStiffness::new(5.0, 1.0)),
            ..PairLaw::rigid(0.0, gap_m)
        }],
        excitations: vec![HarmonicLoad::cosine(1, Load::new(normal(0.1), vec![]))],
        modal_ratios: Vec::new(),
    }
}

/// Result of `solve`, and the frequencies that it told of.
pub(crate) fn recorded<T>(
    solve: impl FnOnce(&(dyn Fn(SweepProgress<'_>) + Sync)) -> T,
) -> (T, Vec<SolvedFrequency>) {
    let solved = Mutex::new(Vec::new());
    let response = solve(&|told| {
        if let SweepProgress::Solved(one) = told {
            solved.lock().unwrap().push(one.clone());
        }
    });
    (response, solved.into_inner().unwrap())
}

/// Damping of the mass.
pub(crate) const DAMPING: Rayleigh = Rayleigh::mass_proportional(0.03);
