//! Harmonic balance of one frequency for solvers of one's own.
//!
//! A [`Balance`] borrows the data that all frequencies of a sweep share. [`OneBalance`] owns what a
//! single frequency needs besides its problem and static state, and lends the balance to a function.

use super::StaticState;
use super::balance::{Balance, Setting};
use super::eps::Eps;
use super::retention::{Holding, Mean, Retention};
use crate::damping::Rayleigh;
use crate::problem::Problem;
use crate::problem::dynamic_stiffness::ContactSystem;
use crate::problem::inexact::InexactModel;
use dovetail_numerics::fourier::Fourier;
use dovetail_numerics::spectrum::blocks;
use std::borrow::Cow;
use std::f64::consts::TAU;

/// Data of the balance of one frequency, besides its problem and static state.
pub struct OneBalance {
    omega_rad_s: f64,
    damping: Rayleigh,
    fourier: Fourier,
    /// Parameter eps of each unknown of a block, N/m, n.
    eps: Vec<f64>,
    /// Spring that retains the mean where that of the static state is retained.
    retention: Option<Retention>,
}

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

impl OneBalance {
    /// Balance of a problem about a static state.
    pub fn new(
        problem: &Problem,
        damping: Rayleigh,
        state: &StaticState,
        settings: OneBalanceSettings,
    ) -> Self {
        let OneBalanceSettings {
            frequency_hz,
            harmonics,
            samples,
            eps,
            eps_hz,
            mean,
        } = settings;
        let system = ContactSystem::new(problem, damping);
        let is_retained = mean == Mean::Retained || state.retention_n.is_some();
        let holding = is_retained.then(|| Holding::of(problem));
        Self {
            omega_rad_s: TAU * frequency_hz,
            damping,
            fourier: Fourier::new(harmonics, samples),
            eps: eps.of(&system, TAU * eps_hz, harmonics),
            retention: holding.and_then(|holding| holding.retention().cloned()),
        }
    }

    /// Number of unknowns, (2H+1) n.
    pub fn unknowns(&self) -> usize {
        blocks(self.fourier.harmonics()) * self.eps.len()
    }

    /// Parameter eps of each unknown of a block, N/m, n.
    pub fn eps(&self) -> &[f64] {
        &self.eps
    }

    /// Lends the balance of the problem and the static state that this was made for.
    pub fn with<T>(
        &self,
        problem: &Problem,
        state: &StaticState,
        work: impl FnOnce(&Balance<'_>) -> T,
    ) -> T {
        let system = ContactSystem::new(problem, self.damping);
        let inexact = InexactModel::unprepared(&problem.reduced);
        let setting = Setting::about(state, &system, &inexact, &self.fourier, &self.eps);
        let mut balance = Balance::new(&setting, self.omega_rad_s);
        if let Some(retention) = &self.retention {
            balance = balance.retained_by(Cow::Borrowed(retention));
        }
        work(&balance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::jacobians::{at_sample_points, differences};
    use crate::dlft::settings::{EpsChoice, Resolution};
    use crate::dlft::static_state::static_state;
    use crate::dlft::sweep::{SweepSettings, sweep};
    use crate::problem::dovetail72::{damping, dovetail72};
    use dovetail_numerics::vector::norm;
    use dovetail_testkit::differences::assert_close;
    use faer::Mat;

    #[test]
    fn products_with_the_jacobian_are_those_of_its_differences() {
        at_sample_points(|what, balance, u| {
            let jacobian = balance.linearise(&balance.evaluate(u));
            let mut product = Mat::zeros(u.len(), u.len());
            for j in 0..u.len() {
                let mut unit = vec![0.0; u.len()];
                unit[j] = 1.0;
                let column = balance.jacobian_times(&jacobian, &unit);
                (0..u.len()).for_each(|i| product[(i, j)] = column[i]);
            }
            assert_close(&product, &differences(balance, u), 1e-5, what);
        });
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
            OneBalance::new(&problem, damping, &state, settings)
        };
        let [free, retained] = [Mean::Free, Mean::Retained].map(own);
        let mean = match orbit.mean {
            Mean::Free => &free,
            Mean::Retained => &retained,
        };
        assert_eq!(mean.unknowns(), orbit.x.len());
        let residual = |u: &[f64]| mean.with(&problem, &state, |b| norm(&b.evaluate(u).residual));
        let (at_rest, solved) = (residual(&vec![0.0; orbit.x.len()]), residual(&orbit.x));
        assert!(solved < 1e-7 * at_rest, "{solved:e} of {at_rest:e}");
    }
}
