//! Displacement and force of a pair over a period.

use std::f64::consts::TAU;

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

impl PairSignals {
    /// Direction in the tangent plane in which the pair moves most, along t1 and t2: the longest
    /// axis of its path.
    pub fn main_direction(&self) -> [f64; 2] {
        let [_, x1, x2] = &self.displacement_m;
        let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
        let (m1, m2) = (mean(x1), mean(x2));
        let moment = |a: &[f64], ma: f64, b: &[f64], mb: f64| -> f64 {
            let pairs = a.iter().zip(b);
            pairs.map(|(a, b)| (a - ma) * (b - mb)).sum()
        };
        let (s11, s22) = (moment(x1, m1, x1, m1), moment(x2, m2, x2, m2));
        let angle = 0.5 * (2.0 * moment(x1, m1, x2, m2)).atan2(s11 - s22);
        let (sin, cos) = angle.rem_euclid(TAU).sin_cos();
        [cos, sin]
    }
}

/// Signal with these coefficients (mean, cosine 1, sine 1, ...) at `instants` or more evenly spaced
/// instants of a period, without its end.
pub(crate) fn sample_period(coefficients: &[f64], instants: usize) -> Vec<f64> {
    let harmonics = coefficients.len() / 2;
    let fourier = Fourier::new(harmonics, instants.max(4 * (harmonics + 1)));
    let mut signal = vec![0.0; fourier.samples()];
    fourier.to_time(coefficients, &mut signal);
    signal
}

/// Signals of a pair of an orbit at `instants` or more evenly spaced instants, without the end of
/// the period.
pub fn pair_signals(orbit: &Orbit, pair: usize, instants: usize) -> PairSignals {
    let fourier = Fourier::new(orbit.harmonics, instants.max(4 * (orbit.harmonics + 1)));
    let signal = |v: &[f64], component: usize| {
        let v = Spectrum::new(v, orbit.harmonics);
        let coefficients: Vec<f64> = v.signal_coefficients(3 * pair + component).collect();
        let mut out = vec![0.0; fourier.samples()];
        fourier.to_time(&coefficients, &mut out);
        out
    };
    PairSignals {
        displacement_m: [0, 1, 2].map(|c| signal(&orbit.x, c)),
        force_n: [0, 1, 2].map(|c| signal(&orbit.lambda, c)),
    }
}
