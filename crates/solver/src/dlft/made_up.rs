//! Made-up data for unit tests: an orbit that nothing computed, and the smallest model whose curve
//! folds.

use super::{Orbit, Outcome};
use crate::contact::PairLaw;
use crate::contact::penalty::PairStiffness;
use crate::model::Growth;
use crate::problem::{HarmonicLoad, Problem};
use crate::reduction::damping::Rayleigh;
use crate::reduction::{Load, ObservedDisplacement, ReducedModel};
use faer::Mat;

/// Orbit without pairs, with these observed amplitudes.
pub fn orbit(frequency_hz: f64, outcome: Outcome, amplitudes_m: &[f64]) -> Orbit {
    Orbit {
        observed: amplitudes_m.iter().map(|a| vec![0.0, *a, 0.0]).collect(),
        observed_amplitude_m: amplitudes_m.to_vec(),
        ..Orbit::without_motion(frequency_hz, outcome)
    }
}

/// Mass of 1 kg on a spring of 1 N/m, excited by 0.1 N, in front of a stop of 5 N/m without
/// friction at a distance of `gap_m`. It is on such springs along the stop, too, and nothing
/// couples these motions with the first.
pub fn mass_with_a_stop(gap_m: f64) -> Problem {
    let unit = || Mat::from_fn(3, 3, |i, j| f64::from(u8::from(i == j)));
    let load = |force_n: f64| Load {
        on_x: vec![force_n, 0.0, 0.0],
        on_modes: Vec::new(),
    };
    Problem {
        reduced: ReducedModel {
            stiffness: unit(),
            mass: unit(),
            coupling: Mat::zeros(3, 0),
            omega2: Vec::new(),
            stuck_modes: 0,
            static_load: load(0.0),
            unit_loads: Vec::new(),
            observations: vec![ObservedDisplacement {
                name: "mass".to_owned(),
                on_x: load(1.0).on_x,
                on_modes: Vec::new(),
            }],
        },
        laws: vec![PairLaw {
            friction: 0.0,
            gap_m,
            stiffness: Some(PairStiffness {
                normal_n_m: 5.0,
                tangential_n_m: 1.0,
            }),
        }],
        excitations: vec![HarmonicLoad {
            harmonic: 1,
            cosine: load(0.1),
            sine: load(0.0),
            growth: Growth::Constant,
        }],
    }
}

/// Damping of the mass.
pub const DAMPING: Rayleigh = Rayleigh {
    stiffness_s: 0.0,
    mass_per_s: 0.03,
};
