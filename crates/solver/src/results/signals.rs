//! Displacement and force of a pair over a period.

use crate::dlft::Orbit;
use dovetail_numerics::fourier::Fourier;
use dovetail_numerics::spectrum::Spectrum;

/// Signals of a pair over one period, from the start of the excitation's cosine; components n, t1,
/// t2.
#[derive(Debug, Clone, PartialEq)]
pub struct PairSignals {
    /// Relative displacement, m, one entry per instant.
    pub displacement_m: [Vec<f64>; 3],
    /// Contact force, N, one entry per instant.
    pub force_n: [Vec<f64>; 3],
}

/// Signals of a pair of an orbit at `instants` or more evenly spaced instants, without the end of
/// the period.
pub fn pair_signals(orbit: &Orbit, pair: usize, instants: usize) -> PairSignals {
    let fourier = Fourier::new(orbit.harmonics, instants.max(4 * (orbit.harmonics + 1)));
    let signal = |v: &[f64], component: usize| {
        let v = Spectrum::new(v, orbit.harmonics);
        let coefficients: Vec<f64> = v.of_signal(3 * pair + component).collect();
        let mut out = vec![0.0; fourier.samples()];
        fourier.to_time(&coefficients, &mut out);
        out
    };
    PairSignals {
        displacement_m: [0, 1, 2].map(|c| signal(&orbit.x, c)),
        force_n: [0, 1, 2].map(|c| signal(&orbit.lambda, c)),
    }
}
