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

impl OneBalance {
    /// Balance at a frequency, with H harmonics and samples of a period. eps is that of the middle
    /// of a range, `eps_hz`, as for a sweep over it. The mean is retained as `mean` says, along the
    /// motions that only friction holds, and always where that of the static state is retained.
    pub fn new(
        (problem, damping): (&Problem, Rayleigh),
        state: &StaticState,
        frequency_hz: f64,
        (harmonics, samples): (usize, usize),
        (eps, eps_hz): (Eps, f64),
        mean: Mean,
    ) -> Self {
        let omega_rad_s = TAU * frequency_hz;
        let system = ContactSystem::new(problem, damping);
        let is_retained = mean == Mean::Retained || state.retention_n.is_some();
        let holding = is_retained.then(|| Holding::of(problem));
        Self {
            omega_rad_s,
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
        let setting = Setting::about(state, (&system, &inexact), (&self.fourier, &self.eps));
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
        let eps = Eps::new(EpsChoice::Dynamic);
        let own = |mean| {
            let problem = (&problem, damping);
            OneBalance::new(problem, &state, hz, (3, 128), (eps, hz), mean)
        };
        let [free, retained] = [Mean::Free, Mean::Retained].map(own);
        let mean = if orbit.retention_n > 0.0 {
            &retained
        } else {
            &free
        };
        assert_eq!(mean.unknowns(), orbit.x.len());
        let residual = |u: &[f64]| mean.with(&problem, &state, |b| norm(&b.evaluate(u).residual));
        let (at_rest, solved) = (residual(&vec![0.0; orbit.x.len()]), residual(&orbit.x));
        assert!(solved < 1e-7 * at_rest, "{solved:e} of {at_rest:e}");
    }
}
