//! Harmonic balance of one frequency for solvers of one's own.

use super::StaticState;
use super::balance::{Balance, Setting};
use super::eps::Eps;
use super::retention::{Holding, Mean};
use crate::damping::Rayleigh;
use crate::problem::Problem;
use crate::problem::dynamic_stiffness::ContactSystem;
use crate::problem::inexact::InexactModel;
use dovetail_numerics::fourier::Fourier;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Choices for the balance of one frequency.
#[derive(Debug, Clone, Copy)]
pub struct OneBalanceSettings {
    /// Frequency of the first harmonic.
    pub frequency_hz: f64,
    /// Harmonics of the motion, H.
    pub harmonics: usize,
    /// Samples of a period.
    pub samples: usize,
    /// The parameter eps of DLFT.
    pub eps: Eps,
    /// Frequency that eps belongs to. For the eps of a sweep it is the middle of its range.
    pub eps_hz: f64,
    /// Treatment of the mean along the motions that only friction holds. It is always retained if
    /// that of the static state is.
    pub mean: Mean,
}

/// Balance of a problem about a static state.
pub fn one_balance(
    problem: &Problem,
    damping: Rayleigh,
    state: &StaticState,
    settings: OneBalanceSettings,
) -> Balance {
    let OneBalanceSettings {
        frequency_hz,
        harmonics,
        samples,
        eps,
        eps_hz,
        mean,
    } = settings;
    let system = ContactSystem::new(problem, damping);
    let eps = eps.values(&system, TAU * eps_hz, harmonics);
    let setting = Setting::new(
        state,
        system.into(),
        InexactModel::unprepared(&problem.reduced).into(),
        Fourier::new(harmonics, samples).into(),
        eps.into(),
    );
    let balance = Balance::new(&setting, TAU * frequency_hz);
    if mean == Mean::Free && state.retention_n.is_none() {
        return balance;
    }
    match Holding::new(problem).retention() {
        Some(retention) => balance.retained_by(Arc::clone(retention)),
        None => balance,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::jacobians::{differences, sample_points};
    use crate::dlft::settings::{EpsChoice, Resolution};
    use crate::dlft::static_state::static_state;
    use crate::dlft::sweep::{SweepSettings, sweep};
    use crate::problem::dovetail72::{damping, dovetail72};
    use dovetail_numerics::vector::norm;
    use dovetail_testkit::differences::assert_close;
    use faer::Mat;

    #[test]
    fn products_with_the_jacobian_are_those_of_its_differences() {
        for (what, balance, u) in &sample_points() {
            let jacobian = balance.linearise(&balance.evaluate(u));
            let mut product = Mat::zeros(u.len(), u.len());
            for j in 0..u.len() {
                let mut unit = vec![0.0; u.len()];
                unit[j] = 1.0;
                let column = balance.jacobian_times(&jacobian, &unit);
                (0..u.len()).for_each(|i| product[(i, j)] = column[i]);
            }
            assert_close(&product, &differences(balance, u), 1e-5, what);
        }
    }

    #[test]
    fn the_motion_that_a_sweep_finds_solves_the_balance_of_its_frequency() {
        let problem = dovetail72(1.0);
        let (hz, damping) = (699.5, damping(&problem));
        let settings = SweepSettings::new(vec![hz], Resolution::fixed(3, 128));
        let state = static_state(&problem, 10, settings.newton);
        let orbit = sweep(&problem, damping, &state, &settings, &[], &|_| ())
            .orbits
            .remove(0);
        assert!(orbit.counts().slipping > 0);
        let own = |mean| {
            let settings = OneBalanceSettings {
                frequency_hz: hz,
                harmonics: 3,
                samples: 128,
                eps: Eps::new(EpsChoice::Dynamic),
                eps_hz: hz,
                mean,
            };
            one_balance(&problem, damping, &state, settings)
        };
        let [free, retained] = [Mean::Free, Mean::Retained].map(own);
        let own = match orbit.mean {
            Mean::Free => free,
            Mean::Retained => retained,
        };
        assert_eq!(own.unknowns(), orbit.x.len());
        let residual = |u: &[f64]| norm(&own.evaluate(u).residual);
        let (at_rest, solved) = (residual(&vec![0.0; orbit.x.len()]), residual(&orbit.x));
        assert!(solved < 1e-7 * at_rest, "{solved:e} of {at_rest:e}");
    }
}
