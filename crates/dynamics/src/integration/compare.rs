//! Comparison of harmonic balance with time integration, at one frequency.

use super::IntegrationError;
use super::steady::{SteadyMotion, Until, integrate};
use super::step::{MotionState, Stepper, touching};
use super::whole_disc;
use crate::damping::Rayleigh;
use crate::dlft::retention::Mean;
use crate::dlft::{CycleCounts, CycleStatus, Orbit, StaticState};
use crate::problem::Problem;
use crate::reduced::AllSectors;
use dovetail_numerics::spectrum::Spectrum;

/// Results of one method over one period.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct PeriodFigures {
    /// Largest departure of the observed point from its mean, m; `None` where nothing is observed.
    pub amplitude_m: Option<f64>,
    /// Amplitude of harmonic 1, m; `None` where nothing is observed.
    pub first_harmonic_m: Option<f64>,
    /// Work spent by the contact forces (friction, and impacts), J per period.
    pub contact_work_j: f64,
    /// Work spent by the damping, J per period.
    pub viscous_work_j: f64,
    /// Work of the excitation, J per period.
    pub input_work_j: f64,
    /// Number of pairs of each status.
    pub pairs: CycleCounts,
}

/// Results of both methods at one frequency.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Comparison {
    /// Frequency of the excitation's harmonic 1.
    pub frequency_hz: f64,
    /// Harmonics of the balance.
    pub harmonics: usize,
    /// False where the motion of the balance is unstable by its multipliers, or by its place between two
    /// folds of its curve: the integration is then expected to leave it.
    pub is_stable: bool,
    /// Results of harmonic balance.
    pub balance: PeriodFigures,
    /// Results of the integration in time.
    pub integration: PeriodFigures,
    /// Number of periods integrated.
    pub periods: usize,
    /// True if the rest of the transient is small enough.
    pub steady: bool,
    /// Rest of the transient: see [`SteadyMotion::transient_left`].
    pub transient_left: f64,
    /// Treatment of the mean along motions that friction does not hold, in both.
    pub mean: Mean,
    /// Steady force that retained the mean in both, N: see [`Orbit::retention_n`].
    pub retention_n: f64,
}

impl Comparison {
    /// Relative differences of harmonic balance from integration, of amplitude, harmonic 1, contact
    /// work and input work (the works relative to the input work); `None` where there is nothing to
    /// compare.
    pub fn differences(&self) -> [Option<f64>; 4] {
        self.differences_from(&self.integration)
    }

    /// Differences as those of [`Comparison::differences`], from another integration.
    fn differences_from(&self, i: &PeriodFigures) -> [Option<f64>; 4] {
        let b = &self.balance;
        let relative = |ours: Option<f64>, theirs: Option<f64>| {
            let (ours, theirs) = (ours?, theirs?);
            (theirs != 0.0).then(|| (ours - theirs) / theirs.abs())
        };
        let of_input = |ours: f64, theirs: f64| {
            (i.input_work_j != 0.0).then(|| (ours - theirs) / i.input_work_j.abs())
        };
        [
            relative(b.amplitude_m, i.amplitude_m),
            relative(b.first_harmonic_m, i.first_harmonic_m),
            of_input(b.contact_work_j, i.contact_work_j),
            of_input(b.input_work_j, i.input_work_j),
        ]
    }

    /// The largest of [`Comparison::differences`] by size.
    pub fn worst(&self) -> f64 {
        self.largest_difference(&self.integration)
    }

    /// Largest difference by size of harmonic balance from another integration.
    pub fn largest_difference(&self, other: &PeriodFigures) -> f64 {
        self.differences_from(other)
            .into_iter()
            .flatten()
            .fold(0.0, |m, d| m.max(d.abs()))
    }
}

/// Initial state of the integration.
#[derive(Debug, Clone, Copy)]
pub enum IntegrationStart<'a> {
    /// Motion found by harmonic balance, with its departure from the mean larger by a fraction.
    Orbit {
        /// Fraction by which displacements and velocities are larger.
        larger_by: f64,
    },
    /// Static state.
    Rest(&'a StaticState),
}

/// Integrates at the frequency of `orbit` and measures the first observed point. Where harmonic
/// balance retained a mean, its steady force acts here, too. Of a wave round a disc all sectors are
/// integrated, each free to move in its own way; works are those of one sector on average.
///
/// # Errors
/// See [`IntegrationError`].
pub fn compare(
    problem: &Problem,
    damping: Rayleigh,
    orbit: &Orbit,
    start: IntegrationStart<'_>,
    steps: usize,
    until: Until,
    slip_threshold_m: f64,
) -> Result<Comparison, IntegrationError> {
    let retained = match orbit.mean {
        Mean::Free => None,
        Mean::Retained => Some(add_retention_force(problem, orbit)),
    };
    let problem = retained.as_ref().unwrap_or(problem);
    if !problem.reduced.dashpots.influenced().is_empty() {
        return Err(IntegrationError::Influence);
    }
    let sectors = AllSectors::new(&problem.reduced);
    let sectors =
        sectors.map_err(|nodal_diameter| IntegrationError::NodalDiameter { nodal_diameter })?;
    let count = sectors.as_ref().map_or(1, AllSectors::count);
    let of_all = sectors.map(|all| {
        let motion = whole_disc::orbit_of(&all, problem, orbit);
        (whole_disc::problem_of(&all, problem), motion)
    });
    let (problem, motion) = match &of_all {
        Some((problem, motion)) => (problem, motion),
        None => (problem, orbit),
    };
    let mut stepper = Stepper::new(problem, damping, orbit.frequency_hz, steps)?;
    let mut state = match start {
        IntegrationStart::Orbit { larger_by } => perturbed_state(problem, motion, larger_by),
        IntegrationStart::Rest(rest) => {
            let [x, lambda] = [&rest.x, &rest.lambda].map(|v| v.repeat(count));
            MotionState::resting(problem, &x, &lambda)
        }
    };
    let settled = integrate(&mut stepper, &mut state, until)?;
    Ok(Comparison {
        frequency_hz: orbit.frequency_hz,
        harmonics: orbit.harmonics,
        is_stable: true,
        balance: orbit_figures(orbit),
        integration: integration_figures(&settled, count, orbit, slip_threshold_m),
        periods: settled.periods,
        steady: settled.steady,
        transient_left: settled.transient_left,
        mean: orbit.mean,
        retention_n: orbit.retention_n,
    })
}

/// Problem with the steady force added that the mean of `orbit` lacks for equilibrium: K X_0 +
/// lambda_0 - F_0, which depends on no parameter of the balance.
pub(super) fn add_retention_force(problem: &Problem, orbit: &Orbit) -> Problem {
    let mut retained = problem.clone();
    let n = retained.reduced.static_load.on_x.len();
    let (x, lambda) = (&orbit.x[..n], &orbit.lambda[..n]);
    for (i, load) in retained
        .reduced_mut()
        .static_load
        .on_x
        .iter_mut()
        .enumerate()
    {
        let elastic: f64 = (0..n)
            .map(|j| problem.reduced.stiffness[(i, j)] * x[j])
            .sum();
        *load = elastic + lambda[i];
    }
    retained
}

/// State of an orbit at t = 0: x = X_0 + sum C_k, x' = w sum k S_k.
pub fn orbit_state(problem: &Problem, orbit: &Orbit) -> MotionState {
    let omega = std::f64::consts::TAU * orbit.frequency_hz;
    let at_start = |v: &[f64]| {
        let v = Spectrum::new(v, orbit.harmonics);
        let mut place = v.mean().to_vec();
        let mut rate = vec![0.0; place.len()];
        for k in 1..=orbit.harmonics {
            for (i, (c, s)) in v.cosine(k).iter().zip(v.sine(k)).enumerate() {
                place[i] += c;
                rate[i] += k as f64 * omega * s;
            }
        }
        (place, rate)
    };
    let (x, v) = at_start(&orbit.x);
    let (q, q_rate) = at_start(&orbit.modal);
    let (lambda, _) = at_start(&orbit.lambda);
    MotionState {
        touching: touching(problem, &x, &lambda),
        x,
        v,
        q,
        q_rate,
        lambda,
    }
}

/// State of an orbit at t = 0 with its departure from the mean larger by a fraction. No rigid pair
/// overlaps.
pub(super) fn perturbed_state(problem: &Problem, orbit: &Orbit, larger_by: f64) -> MotionState {
    let mut state = orbit_state(problem, orbit);
    if larger_by == 0.0 {
        return state;
    }
    let (x_mean, q_mean) = (&orbit.x[..state.x.len()], &orbit.modal[..state.q.len()]);
    let pairs = [(&mut state.x, x_mean), (&mut state.q, q_mean)];
    for (place, mean) in pairs {
        for (at, mean) in place.iter_mut().zip(mean) {
            *at += larger_by * (*at - mean);
        }
    }
    for rate in state.v.iter_mut().chain(&mut state.q_rate) {
        *rate *= 1.0 + larger_by;
    }
    for (pair, law) in problem.laws.iter().enumerate() {
        if law.stiffness.is_none() {
            state.x[3 * pair] = state.x[3 * pair].max(-law.gap_m);
        }
    }
    state.touching = touching(problem, &state.x, &state.lambda);
    state
}

fn orbit_figures(orbit: &Orbit) -> PeriodFigures {
    PeriodFigures {
        amplitude_m: orbit.observed_amplitude.first().copied(),
        first_harmonic_m: orbit
            .observed
            .first()
            .filter(|c| c.len() >= 3)
            .map(|c| c[1].hypot(c[2])),
        contact_work_j: orbit.friction_power_w / orbit.frequency_hz,
        viscous_work_j: orbit.viscous_power_w / orbit.frequency_hz,
        input_work_j: orbit.input_power_w / orbit.frequency_hz,
        pairs: orbit.counts(),
    }
}

/// Figures of the motion that the integration of so many sectors settled to, for the comparison with
/// `orbit`, the motion of the first one.
fn integration_figures(
    settled: &SteadyMotion,
    sectors: usize,
    orbit: &Orbit,
    slip_threshold_m: f64,
) -> PeriodFigures {
    let cycle = &settled.cycle;
    let of_each = |work_j: f64| work_j / sectors as f64;
    let motions = cycle.open_fraction.iter().zip(&cycle.slid_m);
    let statuses = motions
        .zip(&orbit.cycles)
        .map(|((open, slid_m), of_orbit)| {
            let slides = *slid_m > slip_threshold_m;
            CycleStatus::new(of_orbit.status.is_open_at_rest(), *open, slides)
        });
    let observed = cycle.observed.first();
    PeriodFigures {
        amplitude_m: observed.map(|o| o.amplitude_m),
        first_harmonic_m: observed.map(|o| o.first_harmonic_m[0].hypot(o.first_harmonic_m[1])),
        contact_work_j: of_each(cycle.work.friction_j + cycle.work.impact_j),
        viscous_work_j: of_each(cycle.work.viscous_j),
        input_work_j: of_each(cycle.work.input_j),
        pairs: statuses.collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::dlft::Outcome;
    use crate::dlft::eps::Eps;
    use crate::dlft::settings::{EpsChoice, Resolution};
    use crate::dlft::static_state::static_state;
    use crate::dlft::sweep::{SweepSettings, sweep};
    use crate::problem::dovetail72::dovetail72;
    use crate::reduced::{Dashpots, Load};
    use dovetail_numerics::nonlinear::NewtonOptions;

    /// The air acts in harmonics alone.
    #[test]
    fn air_that_acts_back_is_refused() {
        let mut problem = dovetail72(1.0);
        let (n, m) = (
            problem.reduced.stiffness.nrows(),
            problem.reduced.omega2.len(),
        );
        let rest = static_state(&problem, 10, NewtonOptions::new(1e-10, 60));
        let hz = 0.9 * problem.reduced.omega2[0].sqrt() / std::f64::consts::TAU;
        let settings = SweepSettings::new(vec![hz], Resolution::fixed(1, 64));
        let response = sweep(&problem, Rayleigh::NONE, &rest, &settings, &[], &|_| ());
        let dashpots = std::mem::replace(&mut problem.reduced_mut().dashpots, Dashpots::none(n, m));
        problem.reduced_mut().dashpots = dashpots.with_influenced(&[Load::zeros(n, m)]);
        let (orbit, until) = (&response.orbits[0], Until::new(1, 0.0));
        let start = IntegrationStart::Rest(&rest);
        let found = compare(&problem, Rayleigh::NONE, orbit, start, 64, until, 0.0);
        assert_eq!(found, Err(IntegrationError::Influence));
    }

    /// All pairs of the reference dovetail slide at this force and frequency.
    #[test]
    fn what_holds_the_mean_is_the_retention_along_the_slot_and_nothing_else() {
        let problem = dovetail72(3.0);
        let damping = Rayleigh::from_damping_ratio(0.001, problem.reduced.omega2[0].sqrt());
        let newton = NewtonOptions::new(1e-10, 60);
        let rest = static_state(&problem, 10, newton);
        let settings = SweepSettings {
            eps: Eps::new(EpsChoice::Pair),
            newton,
            ..SweepSettings::new(
                vec![0.9995 * problem.reduced.omega2[0].sqrt() / std::f64::consts::TAU],
                Resolution::fixed(1, 128),
            )
        };
        let response = sweep(&problem, damping, &rest, &settings, &[], &|_| ());
        let orbit = &response.orbits[0];
        assert_eq!(
            (orbit.outcome, orbit.mean),
            (Outcome::Converged, Mean::Retained)
        );
        assert!(orbit.retention_n > 1.0);

        let retained = add_retention_force(&problem, orbit);
        let [with, without] = [&retained, &problem].map(|p| &p.reduced.static_load);
        let loads = with.on_x.iter().zip(&without.on_x);
        let added_n: Vec<f64> = loads.map(|(retained, free)| retained - free).collect();
        let along_n: f64 = added_n.chunks_exact(3).map(|f| f[1].hypot(f[2])).sum();
        assert!(
            (along_n / orbit.retention_n - 1.0).abs() < 1e-5,
            "{along_n}"
        );
        let across_n: f64 = added_n.iter().step_by(3).map(|f| f.abs()).sum();
        assert!(across_n < 1e-5 * along_n, "{across_n} of {along_n}");
        // The force pulls back to where the static state has the blade.
        let moved_m = orbit.x.iter().zip(&rest.x).map(|(x, s)| x - s);
        let work_j: f64 = moved_m.zip(&added_n).map(|(m, f)| m * f).sum();
        assert!(work_j < 0.0, "{work_j}");
        assert_eq!(with.on_modes, without.on_modes);
    }
}
