//! Static state with friction, and periodic motions about it by DLFT, the dynamic Lagrangian
//! frequency-time method (Nacivet et al. 2003; `docs/method.md`, section 4). DLFT balances the
//! equations in frequency and evaluates the contact law in time.
//!
//! The unknown U is a motion of H harmonics. It gives a prediction of the contact force,
//! `lambda_u = F - Lambda U + eps U`, and the law makes the force lambda of it, sample after
//! sample. The residual is `Lambda U + lambda - F`. The memory of friction is
//! `lambda_x = lambda_u - lambda` along the contact (of a rigid pair), which goes from each sample
//! to the next. eps is a stiffness of each pair that stands for the harmonics above H. Its choice
//! moves the solution by no more than leaving those out does.
//!
//! In the order of reading:
//! - `aft` evaluates the law of one pair over a period. `pair_signals` has its input and its
//!   signals, `between_samples` the changes between two samples, `rounded` a law without corners.
//! - `balance` has the residual of all pairs and its Jacobian, `one_balance` offers those of one
//!   frequency to other solvers. `dense` and `newton_krylov` solve it; `linear_system`, `two_level` and `coarse` are the linear solves of the latter and of the
//!   static state.
//! - `point` tries strategies until a frequency is solved, with `retention` for a mean that
//!   friction does not hold and `gross_slip` for bodies that slide as a whole. `accuracy` chooses
//!   the harmonics, `eps` the parameter.
//! - `sweep` goes through the frequencies, from the state of `static_state` on. `branch` follows
//!   the curve instead. `backbone` follows a mode over its amplitude. `wear` wears the pairs between
//!   two vibrations.
//! - `orbit`, `pair_status`, `linear_curve` and `peaks` turn solutions into results. `settings` are
//!   the choices of a user, `demand` is the memory that they take.
//!
//! These rules hold:
//! - Fourier vectors are harmonic-major: block 0 the mean, then cosine and sine of harmonics 1..H;
//!   each block has n = 3 pairs entries (N, t1, t2 per pair).
//!   `x(t) = X_0 + sum_k C_k cos(k w t) + S_k sin(k w t)`.
//! - The Jacobian is the exact derivative of the residual, with the history of slip. A change of
//!   one is a change of the other, which `jacobians` tests by differences.
//! - A frequency without a solution has an [`Outcome`], and is no error.
//! - Results depend neither on the number of threads nor on where a run was broken off: what only
//!   speeds up a solution does not outlive a stretch of frequencies (`sweep`, `branch`).

use std::fmt;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use serde::{Deserialize, Serialize};

use crate::contact::PairLaw;
use crate::problem::LinearReference;
use dovetail_numerics::spectrum::blocks;
use retention::Mean;
use verdict::{Kind, Stability};

pub use figure_errors::{FigureErrors, PairErrors};

/// Outcome of the solution of one frequency, or of the static state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Outcome {
    /// The balance holds, to the accuracy asked for.
    Converged,
    /// No motion was found: no step, however small, made progress in the attempt that came closest.
    Stagnated,
    /// No motion was found: the allowed Newton iterations were used up in the attempt that came
    /// closest.
    IterationLimit,
    /// The contact forces did not become periodic.
    NotPeriodic,
    /// No motion was found: a number that is not finite came up in the attempt that came closest.
    NotFinite,
    /// The time allowed to a frequency was over.
    TimeLimit,
    /// No motion was found, and a static test shows that at some instant no contact forces balance
    /// the excitation, applied slowly, and the steady load: the bodies would come apart.
    NoStaticEquilibrium,
    /// The balance holds, but some pair slides so far that its two nodes do not face each other
    /// (`far_slip` of the results).
    SlidesTooFar,
    /// No pair carries a force, and neither supports nor springs hold the bodies then: there is no
    /// static state.
    NothingHolds,
    /// The balance holds, but its estimated truncation error exceeds the accuracy asked for.
    AccuracyNotReached,
}

/// Word written to files.
impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

impl Outcome {
    /// Returns `true` if the balance holds to the accuracy asked for.
    pub fn is_converged(self) -> bool {
        self == Self::Converged
    }
    /// Returns `true` if the balance holds, whatever its accuracy: there are numbers to write, draw
    /// and sum.
    pub fn has_motion(self) -> bool {
        matches!(self, Self::Converged | Self::AccuracyNotReached)
    }
    /// Returns `true` if the balance holds, even where the method does not cover the solution. The
    /// next frequency of a sweep may start from it.
    pub(crate) fn is_balanced(self) -> bool {
        self.has_motion() || self == Self::SlidesTooFar
    }
}

/// Default slip threshold, as a fraction of the largest static slip.
const SLIP_THRESHOLD: f64 = 1e-5;
/// Distance that a pair at its cone may slide by rounding, as a fraction of the largest elastic
/// compression.
const SLIP_BY_ROUNDING: f64 = 1e-9;

/// Static state of the pairs.
#[derive(Debug, Clone, Serialize)]
pub struct StaticState {
    /// Outcome of the solution; a vibration is about a converged one.
    #[serde(skip)]
    pub outcome: Outcome,
    /// Relative displacement, m, n.
    pub x: Vec<f64>,
    /// Contact force, N, n (lambda_N < 0 is compression).
    pub lambda: Vec<f64>,
    /// Status of each pair.
    pub status: Vec<PairStatus>,
    /// Newton iterations of all load steps, which no vibration depends on.
    #[serde(skip)]
    pub newton_iterations: usize,
    /// Relative residual, |f| / |F|. Where nothing presses the pairs, it is relative to their own
    /// stiffness times the clearances. No vibration depends on it.
    #[serde(skip)]
    pub residual: f64,
    /// Forces that retain the motions that friction does not hold, N: their sizes on the pairs, added
    /// up ([`retention`]). `None` where nothing is retained at rest.
    pub retention_n: Option<f64>,
    /// Linear reference, which small vibrations about this state obey. It follows from the problem and
    /// the status of its pairs.
    #[serde(skip)]
    pub linear: LinearReference,
    /// Relative displacement at each point of the load path that was reached, m, n each. A vibration
    /// depends on the end of the path.
    #[serde(skip)]
    pub on_path: Vec<Vec<f64>>,
    /// Number of the point of the load path, from 0, at which the way to the state ended; `None` where
    /// it came to its end. The way to a converged state does.
    #[serde(skip)]
    pub ended_at: Option<usize>,
}

impl StaticState {
    /// Numbers of the pairs that carry no force, ascending.
    pub fn open_pairs(&self) -> Vec<usize> {
        let is_open = |pair: &usize| self.status[*pair] == PairStatus::Open;
        (0..self.status.len()).filter(is_open).collect()
    }

    /// Number of pairs of each status.
    pub fn counts(&self) -> StaticCounts {
        self.status.iter().copied().collect()
    }

    /// Distance beyond which a pair slips in a period, m, where none is given: a fraction of the
    /// largest static slip, or what a pair at its cone may slide by rounding, whichever is longer.
    /// The latter is a fraction of the largest elastic compression, lambda_N / eps_N; `eps` is that
    /// of the balance, N/m, n.
    pub(crate) fn slip_threshold_m(&self, eps: &[f64]) -> f64 {
        let slips = self.x.chunks_exact(3).map(|x| x[1].hypot(x[2]));
        let pressed = self.lambda.iter().zip(eps).step_by(3);
        let compressions = pressed.map(|(lambda, eps)| (lambda / eps).abs());
        let of_slips = SLIP_THRESHOLD * slips.fold(0.0, f64::max);
        of_slips.max(SLIP_BY_ROUNDING * compressions.fold(0.0, f64::max))
    }

    /// Returns `true` if no pair carries a force.
    pub fn all_open(&self) -> bool {
        self.status.iter().all(|s| *s == PairStatus::Open)
    }
}

/// The periodic motion at one frequency.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Orbit {
    /// Frequency of the first harmonic.
    pub frequency_hz: f64,
    /// Number of the frequency, from 0: rising over those that were swept, and in the order in which
    /// a branch was followed.
    pub point: usize,
    /// Outcome of the solution.
    pub outcome: Outcome,
    /// Harmonics of the motion, H.
    pub harmonics: usize,
    /// Relative displacement, m: (2H+1) n, harmonic-major.
    pub x: Vec<f64>,
    /// Contact forces, N: (2H+1) n, harmonic-major.
    pub lambda: Vec<f64>,
    /// Stuck-mode amplitudes: (2H+1) m, harmonic-major.
    pub modal: Vec<f64>,
    /// Cycle of each pair.
    pub cycles: Vec<PairCycle>,
    /// Fourier coefficients (mean, cosine, sine...) of each observed displacement, m, or strain,
    /// 2H+1 each.
    pub observed: Vec<Vec<f64>>,
    /// Largest departure of each observed displacement, m, or strain from its mean over the period.
    pub observed_amplitude: Vec<f64>,
    /// Friction power of all pairs, mean over a period, W.
    pub friction_power_w: f64,
    /// Power of the damping, mean over a period, W.
    pub viscous_power_w: f64,
    /// Power of the excitation, mean over a period, W.
    pub input_power_w: f64,
    /// Kinetic energy of the vibration, mean over a period, J.
    pub kinetic_energy_j: f64,
    /// Newton iterations of all attempts.
    pub newton_iterations: usize,
    /// Iterations of the linear solves of all attempts.
    pub krylov_iterations: usize,
    /// Relative residual of each attempt, at its start and after each Newton iteration.
    pub newton_residuals: Vec<Vec<f64>>,
    /// The larger of |f_0| / |F| and |f_1..H| / |F_1..H|.
    pub residual: f64,
    /// Largest of `observed_error`, or the error of the whole vibration where nothing is observed.
    /// `None` where no harmonics are left out, or the balance was not solved.
    pub estimated_error: Option<f64>,
    /// Estimated relative error of each observed amplitude, from harmonics and samples
    /// ([`accuracy`]), 0 to 1. Empty where `estimated_error` is `None`.
    pub observed_error: Vec<f64>,
    /// Estimated errors of the other figures; `None` where they are not known.
    pub figure_errors: Option<FigureErrors>,
    /// Treatment of the mean that the motion was solved with, along the motions that only friction
    /// holds ([`retention`]).
    pub mean: Mean,
    /// Forces of the spring that retains the mean, N: their sizes on the pairs, added up. Zero where
    /// the mean is free. The spring is anchored at the static state, or at rest where that is itself
    /// retained: the force of the static state is then included.
    pub retention_n: f64,
    /// Stability; not judged until [`judge`](crate::stability::judge) was asked.
    pub stability: Stability,
}

impl Orbit {
    /// The same motion, but for stuck modes in this range, which do not vibrate.
    pub fn omit_modes(&self, left_out: Range<usize>) -> Self {
        let mut without = self.clone();
        let modes = self.modal.len() / blocks(self.harmonics);
        let left_out = left_out.start.min(modes)..left_out.end.min(modes);
        for modal in without.modal.chunks_mut(modes.max(1)).skip(1) {
            modal[left_out.clone()].fill(0.0);
        }
        without
    }

    /// Orbit of one harmonic without pairs, where every other figure is zero and every list empty.
    pub fn motionless(frequency_hz: f64, outcome: Outcome) -> Self {
        Self {
            frequency_hz,
            point: 0,
            outcome,
            harmonics: 1,
            x: Vec::new(),
            lambda: Vec::new(),
            modal: Vec::new(),
            cycles: Vec::new(),
            observed: Vec::new(),
            observed_amplitude: Vec::new(),
            friction_power_w: 0.0,
            viscous_power_w: 0.0,
            input_power_w: 0.0,
            kinetic_energy_j: 0.0,
            newton_iterations: 0,
            krylov_iterations: 0,
            newton_residuals: Vec::new(),
            residual: 0.0,
            estimated_error: None,
            observed_error: Vec::new(),
            figure_errors: None,
            mean: Mean::Free,
            retention_n: 0.0,
            stability: Stability::default(),
        }
    }

    /// Relative error by which an accuracy judges the motion: that of its amplitudes, or a third of
    /// that of the friction power or of the largest contact force, if that is larger. `laws` are those
    /// of the pairs.
    pub(crate) fn judged_error(&self, laws: &[PairLaw]) -> Option<f64> {
        let figures = self.figure_errors.as_ref();
        let figures = figures.map_or(0.0, |errors| errors.as_amplitude_error(self, laws));
        Some(self.estimated_error?.max(figures))
    }

    /// Number of pairs of each status in the period.
    pub fn counts(&self) -> CycleCounts {
        self.cycles.iter().map(|cycle| cycle.status).collect()
    }

    /// Estimated relative error of an observed amplitude from harmonics and samples: 0 where there
    /// are no pairs, `None` where it is not known.
    pub fn amplitude_error(&self, observation: usize) -> Option<f64> {
        let estimated = self.observed_error.get(observation).copied();
        estimated.or_else(|| self.cycles.is_empty().then_some(0.0))
    }
}

/// Behaviour of one pair over one period.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PairCycle {
    /// Status of the pair.
    pub status: CycleStatus,
    /// Distance slid in a period, m.
    pub slid_m: f64,
    /// Compression times distance slid, integral over a period, N m: what Archard's law is about.
    /// With friction it is the energy that friction takes over its coefficient.
    pub rubbed_nm: f64,
    /// Fraction of the period spent open.
    pub open_fraction: f64,
    /// Mean compression -lambda_N over the period, N.
    pub compression_mean_n: f64,
    /// Smallest compression that the law gives, N: 0 where the pair opens.
    pub compression_min_n: f64,
    /// Largest compression that the law gives, N. That of a rigid pair that lands
    /// depends on the number of harmonics: the true force has no finite maximum.
    pub compression_max_n: f64,
    /// Landing of a rigid pair that opens and closes again.
    pub landing: Option<Landing>,
    /// Friction power, W: the mean of force times velocity, both of H harmonics. With the power of
    /// the damping it makes up the power put in. It can be slightly below zero where a pair hardly
    /// slides, and is 0 without friction.
    pub friction_power_w: f64,
}

/// Landing of a rigid pair: its force is an impulse, which so many harmonics spread over
/// 1 / (H + 1) of a period.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Landing {
    /// Impulse of the compression from the landing on, for that share of a period, N s; the largest of
    /// all landings.
    pub impulse_ns: f64,
    /// Largest compression outside these shares, N.
    pub compression_after_n: f64,
}

/// Answer of the [linear reference](LinearReference) at one frequency.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct LinearPoint {
    /// Frequency of the first harmonic.
    pub frequency_hz: f64,
    /// Largest departure of each observed displacement, m, or strain from its mean.
    pub observed_amplitude: Vec<f64>,
}

/// Progress of a running sweep.
#[derive(Debug, Clone, Copy)]
pub enum SweepProgress<'a> {
    /// A frequency is solved, or was solved before. One that is solved again is reported again
    /// ([`SolvedFrequency::again`]).
    Solved(&'a SolvedFrequency),
    /// A strategy is tried at a frequency.
    Tries(Attempt<'a>),
    /// The curves from both ends of a range have different motions in its middle. Each is followed on
    /// to the other end.
    Apart,
    /// One more frequency is to be solved. A listener may stop the sweep here: its response then has
    /// only the frequencies that were solved before.
    Next(&'a Stop),
}

/// Switch by which a listener stops a sweep.
#[derive(Debug, Default)]
pub struct Stop(AtomicBool);

impl Stop {
    /// Stops the sweep: no further frequency is begun.
    pub fn stop(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Returns `true` once the sweep is stopped.
    pub(crate) fn is_stopped(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Strategy that is tried at a frequency.
#[derive(Debug, Clone, Copy)]
pub struct Attempt<'a> {
    /// Frequency of the first harmonic, Hz.
    pub frequency_hz: f64,
    /// Harmonics of the balance. A balance that serves only to estimate an error may have more.
    pub harmonics: usize,
    /// Description of the strategy.
    pub strategy: &'a str,
}

/// A frequency that a sweep has solved, with what the next frequency starts from.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SolvedFrequency {
    /// Motion at the frequency.
    pub orbit: Orbit,
    /// Answer of the linear reference at the frequency.
    pub linear: LinearPoint,
    /// Level of [`accuracy`] that the next frequency begins on.
    pub next_level: usize,
    /// True if the frequency was solved once more, from its other side, after the frequencies that
    /// began from the first attempt. `orbit` is then the better of both motions.
    pub again: bool,
    /// Place along its branch; `None` where the frequencies were swept.
    pub along: Option<BranchPosition>,
}

/// Part of a branch that a solved frequency was found by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Part {
    /// Beginning of the branch, or of its rest behind a gap.
    Begun,
    /// End of a step along the branch.
    Reached,
    /// Frequency asked for, inside of a step.
    Passed,
    /// Point added at a peak.
    Added,
}

/// Place of a solved frequency along its branch, and what the branch is followed on with after an
/// interruption.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BranchPosition {
    /// True for the branch that begins at the last abscissa of the range.
    pub from_last: bool,
    /// Step of the follower, counted from 0, in which the frequency was solved.
    pub step: usize,
    /// Part of the branch that it belongs to.
    pub part: Part,
    /// Abscissa of the branch: the frequency, Hz, or what else the branch is followed over.
    pub abscissa: f64,
    /// Length of the branch up to it.
    pub length: f64,
    /// Direction of the branch; `None` where it could not be followed on, and for those passed and
    /// added.
    pub heading: Option<Heading>,
}

/// Direction of a branch at a point, and the scales of its length there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Heading {
    /// Change of the observed first harmonics in a length of 1, m: cosine and sine part of each
    /// observed displacement.
    pub motion_m: Vec<f64>,
    /// Change of the abscissa in a length of 1.
    pub abscissa: f64,
    /// Size of the observed motion that a change is measured against, m.
    pub scale_m: f64,
    /// Largest size of the observed motion so far, m.
    pub largest_m: f64,
    /// Length of the next step.
    pub next_step: f64,
}

impl SolvedFrequency {
    /// Record of a motion by itself, without what the next frequency would go on from.
    pub fn isolated(orbit: Orbit) -> Self {
        Self {
            linear: LinearPoint {
                frequency_hz: orbit.frequency_hz,
                observed_amplitude: Vec::new(),
            },
            orbit,
            next_level: 0,
            again: false,
            along: None,
        }
    }

    /// Abscissa of the curve: the frequency, Hz, unless it is followed over something else.
    pub fn abscissa(&self) -> f64 {
        let along = self.along.as_ref();
        along.map_or(self.orbit.frequency_hz, |along| along.abscissa)
    }

    /// Key of this frequency in its response: its number, and whether it comes from the second
    /// attempt. A curve may have several solutions at one frequency.
    pub fn place(&self) -> (usize, bool) {
        (self.orbit.point, self.again)
    }
}

impl Response {
    /// Abscissa of an orbit: the frequency, Hz, unless its branch is followed over something else.
    pub(crate) fn abscissa(&self, index: usize) -> f64 {
        let branch = self.branches.get(self.branch_of(index));
        let abscissa = branch.and_then(|b| b.abscissae.get(index.checked_sub(b.points.start)?));
        abscissa.copied().unwrap_or(self.orbits[index].frequency_hz)
    }

    /// Number of the branch that has an orbit, counted from 0.
    pub fn branch_of(&self, index: usize) -> usize {
        let before = |branch: &Branch| branch.points.end <= index;
        self.branches.partition_point(before)
    }

    /// Returns `true` if the branches were followed along their length.
    pub fn is_followed(&self) -> bool {
        let mut branches = self.branches.iter();
        branches.any(|branch| !branch.lengths.is_empty())
    }

    /// Positions in `orbits` of each curve without a gap: of each branch, or of its parts between
    /// gaps. A branch that has no point yet has no curve.
    pub fn curves(&self) -> Vec<Range<usize>> {
        let of_branch = |branch: &Branch| {
            let Range { start, end } = branch.points;
            let starts = std::iter::once(start).chain(branch.gaps.iter().copied());
            let ends = branch.gaps.iter().copied().chain([end]);
            let parts = starts.zip(ends).map(|(from, to)| from..to);
            parts.filter(|part| !part.is_empty()).collect::<Vec<_>>()
        };
        self.branches.iter().flat_map(of_branch).collect()
    }
}

/// Branch of a response: a curve of motions over the frequency, or over a value of the model, in the
/// order in which it runs. It may turn back.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct Branch {
    /// Positions of its points in the orbits of the response.
    pub points: Range<usize>,
    /// Positions in the orbits before which the branch was lost, and a motion looked for anew.
    pub gaps: Vec<usize>,
    /// Length of the branch up to each of its points; empty where the frequencies were swept.
    pub lengths: Vec<f64>,
    /// Abscissa of each of its points: the frequency, Hz, or what else the branch is followed over.
    /// Empty where the frequencies were swept.
    pub abscissae: Vec<f64>,
    /// Position in the orbits at which the branch was given up, because it crept: its last steps led
    /// through hardly any of the range.
    pub given_up: Option<usize>,
}

impl Branch {
    /// Branch of so many frequencies that were swept.
    pub fn swept(points: usize) -> Self {
        Self {
            points: 0..points,
            ..Self::default()
        }
    }
}

/// A frequency response.
#[derive(Debug, Clone, Default)]
pub struct Response {
    /// Linear reference at the frequency of each orbit.
    pub linear: Vec<LinearPoint>,
    /// Linear reference at the frequencies of the orbits and at others, ascending, so close that no
    /// peak is missed.
    pub linear_curve: Vec<LinearPoint>,
    /// Motions, one branch after the other, in the order in which each runs. Swept frequencies are
    /// one branch and ascend.
    pub orbits: Vec<Orbit>,
    /// Branches of the response.
    pub branches: Vec<Branch>,
    /// Ranges in which several motions were found, ascending. They are not looked for where
    /// frequencies were swept.
    pub second_motions: Vec<SecondMotion>,
    /// Changes of stability along the curves that are no turning points, in the order of the orbits.
    /// They are not looked for where frequencies were swept.
    pub bifurcations: Vec<Bifurcation>,
    /// Branches of motions of twice the period, beyond a period doubling. The frequency of their first
    /// harmonic is half that of the excitation.
    pub two_periods: Vec<Response>,
    /// Distance beyond which a pair counts as slipping, m.
    pub slip_threshold_m: f64,
}

/// Change of stability along a curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Bifurcation {
    /// Position in the orbits of the last point before the change.
    pub after: usize,
    /// Frequency of the change, Hz.
    pub frequency_hz: f64,
    /// Amplitude of each observed displacement there, m.
    pub observed_amplitude: Vec<f64>,
    /// Kind of the instability on its unstable side.
    pub kind: Kind,
}

/// Range of frequencies at which several motions were found, and the frequency in it at which the
/// largest and the smallest of them differ most.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct SecondMotion {
    /// First frequency of the range.
    pub from_hz: f64,
    /// Last frequency of the range.
    pub to_hz: f64,
    /// Frequency at which an amplitude differs most.
    pub frequency_hz: f64,
    /// Number of the observed displacement whose amplitude differs most, 0 = first.
    pub observation: usize,
    /// Largest amplitude of that displacement.
    pub amplitude_m: f64,
    /// Smallest amplitude of that displacement.
    pub other_amplitude_m: f64,
}

pub mod accuracy;
pub(crate) mod aft;
pub mod backbone;
pub mod balance;
mod between_samples;
mod border;
pub mod branch;
mod coarse;
pub mod demand;
pub mod dense;
mod derivative_rows;
pub mod eps;
mod factored;
mod figure_errors;
mod frozen;
mod gross_slip;
mod homotopy;
#[cfg(test)]
pub(crate) mod jacobians;
pub mod linear_curve;
mod linear_system;
#[cfg(test)]
pub(crate) mod made_up;
mod measure;
pub mod newton_krylov;
pub mod one_balance;
pub mod orbit;
pub mod pair_signals;
pub(crate) mod pair_status;
pub mod peaks;
mod point;
pub mod retention;
mod rounded;
mod same_vibration;
pub mod settings;
mod slow_excitation;
pub mod starting_traction;
pub mod static_state;
pub mod sweep;
mod two_level;
pub(crate) mod verdict;
pub mod wear;

pub use pair_status::{CycleCounts, CycleStatus, PairStatus, StaticCounts};

use dovetail_numerics::nonlinear::NewtonStatus;

impl From<NewtonStatus> for Outcome {
    fn from(status: NewtonStatus) -> Self {
        match status {
            NewtonStatus::Converged => Self::Converged,
            NewtonStatus::Stagnated => Self::Stagnated,
            NewtonStatus::IterationLimit => Self::IterationLimit,
            NewtonStatus::NotFinite => Self::NotFinite,
            NewtonStatus::TimeLimit => Self::TimeLimit,
        }
    }
}
