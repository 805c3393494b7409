//! Forced response of a problem in one call: [`ForcedResponse`].

use crate::damping::{DampingError, DampingSpec, Rayleigh, rayleigh};
use crate::dlft::branch::follow;
use crate::dlft::settings::Resolution;
use crate::dlft::static_state::{CRITERIA, LoadPath, static_state};
use crate::dlft::sweep::{SweepSettings, sweep};
use crate::dlft::{Outcome, Response, StaticState};
use crate::problem::Problem;

/// Static state of a problem and its response to harmonic excitation, with the defaults of a scene.
///
/// ```
/// use std::f64::consts::TAU;
/// use dovetail_dynamics::prelude::*;
///
/// // A mass of 1 kg on a spring of 1 N/m, pressed on the ground with 1 N, and excited with 1 N.
/// let identity = Mat::identity(3, 3);
/// let model = ReducedModel::from_pair_matrices(identity.clone(), identity)
///     .static_load([-1.0, 0.0, 0.0])
///     .unit_load([0.0, 1.0, 0.0])
///     .observe("mass", [0.0, 1.0, 0.0]);
/// let problem = Problem::uniform(model, PairLaw::rigid(0.2, 0.0), 1.0);
/// let solved = ForcedResponse::new(&problem)
///     .harmonics(31)
///     .frequencies_hz([0.7 / TAU])
///     .solve()?;
/// let amplitude_m = solved.response.orbits[0].observed_amplitude[0];
/// // Den Hartog (1931) has 1.9278 m in closed form.
/// assert!((amplitude_m - 1.9278).abs() < 0.02);
/// # Ok::<(), dovetail_dynamics::ResponseError>(())
/// ```
#[derive(Debug, Clone)]
pub struct ForcedResponse<'a> {
    problem: &'a Problem,
    damping: DampingSpec,
    path: LoadPath,
    settings: SweepSettings,
    is_followed: bool,
}

/// Solution of a [`ForcedResponse`].
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Solved {
    /// Static state under the steady load, which the motions are about.
    pub state: StaticState,
    /// Coefficients of the damping.
    pub damping: Rayleigh,
    /// Motions. A frequency without one has an [`Outcome`] that says why.
    pub response: Response,
}

/// Error of a response that cannot be computed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ResponseError {
    /// There is no static state.
    #[error(
        "the static state under the steady load was not found: {0}; press the pairs together, or hold the bodies without contact"
    )]
    NoStaticState(Outcome),
    /// There is no frequency to solve, or no range to follow the curve along.
    #[error("give at least one frequency, and for a followed curve two that ascend")]
    NoFrequencies,
    /// The damping has no coefficients.
    #[error(transparent)]
    Damping(#[from] DampingError),
}

impl<'a> ForcedResponse<'a> {
    /// Response of a problem without damping, with as many harmonics as an accuracy of
    /// [`Resolution::ACCURACY`] needs. It has no frequencies yet.
    pub fn new(problem: &'a Problem) -> Self {
        Self {
            problem,
            damping: DampingSpec::default(),
            path: LoadPath::default(),
            settings: SweepSettings::new(Vec::new(), Resolution::default()),
            is_followed: false,
        }
    }

    /// Solves these frequencies, Hz, ascending, each by itself from its neighbour.
    #[must_use]
    pub fn frequencies_hz(mut self, frequencies_hz: impl Into<Vec<f64>>) -> Self {
        self.settings.frequencies_hz = frequencies_hz.into();
        self.is_followed = false;
        self
    }

    /// Follows the curve between two frequencies, Hz, along its length and round its folds.
    ///
    /// ```
    /// use dovetail_dynamics::prelude::*;
    ///
    /// // A mass of 1 kg on a spring of 1 N/m, 1 m from a stop of 5 N/m.
    /// let identity = Mat::identity(3, 3);
    /// let model = ReducedModel::from_pair_matrices(identity.clone(), identity)
    ///     .unit_load([1.0, 0.0, 0.0])
    ///     .observe("mass", [1.0, 0.0, 0.0]);
    /// let stop = PairLaw::rigid(0.0, 1.0).springs(5.0, 1.0);
    /// let problem = Problem::uniform(model, stop, 0.1);
    /// let mass_per_s = 0.03;
    /// let solved = ForcedResponse::new(&problem)
    ///     .damping(DampingSpec::Rayleigh { stiffness_s: 0.0, mass_per_s })
    ///     .harmonics(3)
    ///     .range_hz(0.1, 0.25)
    ///     .solve()?;
    /// let along: Vec<f64> = solved.response.orbits.iter().map(|o| o.frequency_hz).collect();
    /// assert!(along.windows(2).any(|pair| pair[1] < pair[0]), "the curve turns back");
    /// # Ok::<(), ResponseError>(())
    /// ```
    #[must_use]
    pub fn range_hz(mut self, from_hz: f64, to_hz: f64) -> Self {
        self.settings.frequencies_hz = vec![from_hz, to_hz];
        self.is_followed = true;
        self
    }

    /// Damping of the bodies.
    #[must_use]
    pub fn damping(mut self, damping: DampingSpec) -> Self {
        self.damping = damping;
        self
    }

    /// So many harmonics besides the mean, with [`Resolution::SAMPLES`] samples of a period, or the
    /// least number that the harmonics need.
    #[must_use]
    pub fn harmonics(self, harmonics: usize) -> Self {
        let samples = Resolution::SAMPLES.max(Resolution::least_samples(harmonics));
        self.resolution(Resolution::fixed(harmonics, samples))
    }

    /// Harmonics and samples, or an accuracy, with the tolerance that belongs to them.
    #[must_use]
    pub fn resolution(mut self, resolution: Resolution) -> Self {
        self.settings.resolution = resolution;
        self.settings.newton.tolerance = resolution.tolerance();
        self
    }

    /// Way in which the steady load is applied, or the number of its steps.
    #[must_use]
    pub fn load_path(mut self, path: impl Into<LoadPath>) -> Self {
        self.path = path.into();
        self
    }

    /// All other settings, to be changed.
    pub fn settings(&mut self) -> &mut SweepSettings {
        &mut self.settings
    }

    /// Solves the static state, and the response about it.
    ///
    /// # Errors
    /// [`ResponseError`]. A frequency without a motion is no error.
    pub fn solve(&self) -> Result<Solved, ResponseError> {
        let frequencies = &self.settings.frequencies_hz;
        let ascend = frequencies.windows(2).all(|pair| pair[0] < pair[1]);
        if frequencies.is_empty() || !ascend {
            return Err(ResponseError::NoFrequencies);
        }
        let state = static_state(self.problem, self.path.clone(), CRITERIA);
        if !state.outcome.is_converged() {
            return Err(ResponseError::NoStaticState(state.outcome));
        }
        let modes = state.linear.modes_of_first_harmonic(&self.problem.reduced);
        let damping = rayleigh(&self.damping, &modes)?;
        let compute = if self.is_followed { follow } else { sweep };
        let response = compute(self.problem, damping, &state, &self.settings, &[], &|_| ());
        Ok(Solved {
            state,
            damping,
            response,
        })
    }
}
