//! Takes a reduced model to its static state and its response.

use std::sync::atomic::{AtomicBool, Ordering};

use super::cache::program;
use super::error::RunError;
use super::free_motion;
use super::hertz;
use super::observer::ResponseBegins;
use super::progress::Progress;
use super::reduced::Reduced;
use super::statics::static_state;
use crate::export::journal::Inputs;
use crate::stage::Stage;
use crate::warning::Weight;
use crate::words::counted;
use dovetail_numerics::memory;
use dovetail_numerics::newton::NewtonOptions;
use dovetail_solver::description::{FrequencyRange, ResponseSpec, Scene};
use dovetail_solver::dlft::accuracy::samples_for;
use dovetail_solver::dlft::demand;
use dovetail_solver::dlft::eps::Eps;
use dovetail_solver::dlft::linear_curve::linear_curve;
use dovetail_solver::dlft::orbit::{linear_orbit, linear_point};
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::dlft::sweep::{SweepSettings, sweep};
use dovetail_solver::dlft::{Outcome, Response, StaticState, Told};
use dovetail_solver::problem::dynamic_stiffness::ContactSystem;
use dovetail_solver::reduction::ReducedModel;
use dovetail_solver::reduction::damping::Rayleigh;
use dovetail_solver::results::far_slip::ShorterSides;

/// With friction; told where a retention was needed.
///
/// # Errors
/// Those of the way back to the bodies, where what is not held is to be named.
pub(super) fn statics(
    scene: &Scene,
    reduced: &Reduced,
    progress: &Progress,
) -> Result<StaticState, RunError> {
    let state = static_state(scene, reduced.problem(), progress);
    if let (Some(retention_n), true) = (state.retention_n, state.outcome.is_converged()) {
        let what = free_motion::retained_at_rest(reduced, &state, progress)?;
        progress.warning(
            Weight::Remark,
            format!(
                "friction does not hold {what} under the steady load: that was held at rest, as by a lock plate, with \
                 {retention_n:.3} N (static.retention_n of summary.json)"
            ),
        );
    }
    free_motion::prepare(reduced, &state, progress)?;
    Ok(state)
}

/// Whether there is a static state to vibrate about.
pub(super) fn usable(reduced: &Reduced, state: &StaticState) -> Result<(), RunError> {
    match state.outcome {
        Outcome::NothingHolds => Err(RunError::NothingHolds {
            what: free_motion::held_by_nothing(reduced),
        }),
        Outcome::SlidesTooFar => Err(RunError::SlidesTooFar),
        outcome if outcome.is_converged() => Ok(()),
        outcome => Err(RunError::StaticState {
            outcome,
            iterations: state.newton_iterations,
            residual: state.residual,
        }),
    }
}

/// What is linear where pairs are open in the static state.
pub(super) fn tell_of_linear_reference(
    reduced: &Reduced,
    state: &StaticState,
    progress: &Progress,
) {
    let open = state.open_pairs().len();
    let first = reduced.linear_omega2(state).first();
    if let Some(why) = &state.linear.not_released {
        progress.warning(Weight::Doubt, format!(
            "without the {open} pairs that are open in the static state the assembly has no linear modes ({why}): the linear curve, \
             damping.ratio and response.times_first_linear_mode take them as stuck"
        ));
    } else if let (Some(omega2), 1..) = (first, open) {
        progress.note(&format!(
            "first linear mode {:.4} Hz, with the {open} pairs released that are open in the static state",
            hertz(*omega2)
        ));
    }
}

/// The frequencies of the response, rising.
///
/// # Errors
/// [`RunError::NoLinearMode`] where they are counted from the first of the linear modes `omega2`, and there is none.
pub(super) fn frequencies_hz(
    response: &ResponseSpec,
    omega2: &[f64],
) -> Result<Vec<f64>, RunError> {
    let (from, to) = match response.range {
        FrequencyRange::Hz { from_hz, to_hz } => (from_hz, to_hz),
        FrequencyRange::OfFirstLinearMode { from, to } => {
            let first = hertz(*omega2.first().ok_or(RunError::NoLinearMode)?);
            (from * first, to * first)
        }
    };
    let points = response.points;
    let last = points.saturating_sub(1).max(1) as f64;
    Ok((0..points)
        .map(|i| from + (to - from) * i as f64 / last)
        .collect())
}

/// Nearer to an undamped mode than this, relative, a harmonic of the response is taken to lie on it.
const ON_A_MODE: f64 = 1e-9;

/// Without damping the linear answer is infinite at the frequency of a linear mode. At that of a stuck mode the
/// condensed stiffness is.
///
/// # Errors
/// [`RunError::UndampedMode`] where a harmonic of some frequency lies there.
pub(super) fn off_undamped_modes(
    reduced: &ReducedModel,
    state: &StaticState,
    damping: Rayleigh,
    frequencies_hz: &[f64],
    harmonics: usize,
) -> Result<(), RunError> {
    if damping.stiffness_s > 0.0 || damping.mass_per_s > 0.0 {
        return Ok(());
    }
    let modes = [("stuck", &reduced.omega2), ("linear", &state.linear.omega2)];
    for (kind, omega2) in modes {
        let modes_hz: Vec<f64> = omega2.iter().map(|w2| hertz(*w2)).collect();
        for &frequency_hz in frequencies_hz {
            let on_it = |h: usize| Some((h, mode_at(&modes_hz, h as f64 * frequency_hz)?));
            if let Some((harmonic, mode)) = (1..=harmonics).find_map(on_it) {
                return Err(RunError::UndampedMode {
                    frequency_hz,
                    harmonic,
                    kind,
                    mode: mode + 1,
                });
            }
        }
    }
    Ok(())
}

/// The mode, of ascending ones, that lies at a frequency.
fn mode_at(modes_hz: &[f64], frequency_hz: f64) -> Option<usize> {
    // The first one not below the window around it.
    let mode = modes_hz.partition_point(|m| *m < frequency_hz * (1.0 - ON_A_MODE));
    let is_there = |m: &f64| (m / frequency_hz - 1.0).abs() <= ON_A_MODE;
    modes_hz.get(mode).is_some_and(is_there).then_some(mode)
}

/// A response with `harmonics` beside one of another resolution: with its samples, where it says how many.
pub(super) fn compared(own: Resolution, harmonics: usize) -> Resolution {
    let samples = match own {
        Resolution::Fixed { samples, .. } => samples,
        Resolution::Accuracy(accuracy) => samples_for(accuracy, harmonics),
    };
    Resolution::Fixed { harmonics, samples }
}

/// What the responses of a run have in common.
pub(super) struct Responses<'a, 'o> {
    pub spec: &'a ResponseSpec,
    pub reduced: &'a Reduced,
    pub damping: Rayleigh,
    pub state: &'a StaticState,
    pub frequencies_hz: &'a [f64],
    pub progress: &'a Progress<'o>,
}

impl Responses<'_, '_> {
    /// The scene's own response, or the one with so many harmonics that it is compared with, and
    /// how far a pair slides in it over the shorter side of its flank.
    ///
    /// # Errors
    /// The observer's.
    pub fn response(&self, compared_harmonics: Option<usize>) -> Result<(Response, f64), RunError> {
        let own = self.spec.resolution;
        let resolution = compared_harmonics.map_or(own, |h| compared(own, h));
        let sides = ShorterSides::of(&self.reduced.pairs);
        let mut response = match self.reduced.problem().laws.is_empty() {
            true => self.linear(resolution),
            false => self.with_contact(resolution, compared_harmonics, &sides)?,
        };
        let farthest = sides.judge_response(&mut response);
        Ok((response, farthest))
    }

    fn with_contact(
        &self,
        resolution: Resolution,
        compared_harmonics: Option<usize>,
        sides: &ShorterSides,
    ) -> Result<Response, RunError> {
        let Self { spec, progress, .. } = self;
        let problem = self.reduced.problem();
        let stage = progress.titled_stage(Stage::Response, &title(resolution));
        let blocks = 2 * resolution.most_harmonics() + 1;
        stage.solves(blocks * problem.reduced.stiffness.nrows());
        let settings = SweepSettings {
            eps: Eps {
                choice: spec.eps,
                scale: spec.eps_scale,
            },
            newton: NewtonOptions {
                tolerance: spec.tolerance,
                max_iterations: spec.max_newton_iterations,
            },
            solver: spec.solver,
            slip_threshold_m: spec.slip_threshold_m,
            most_added: spec.most_added_points,
            most_seconds: spec.most_seconds_per_frequency,
            ..SweepSettings::new(self.frequencies_hz.to_vec(), resolution)
        };
        memory::ask_for(demand::bytes(problem, &settings))
            .map_err(|source| RunError::TooLittleMemory { blocks, source })?;
        let begins = ResponseBegins {
            reduced: self.reduced,
            frequencies_hz: self.frequencies_hz,
            compared_harmonics,
            inputs: self.inputs(&settings),
        };
        let earlier = progress.tell(|observer| observer.response_begins(&begins))?;
        if !earlier.is_empty() {
            progress.note(&format!(
                "{} of {} frequencies were solved before",
                earlier.len(),
                self.frequencies_hz.len()
            ));
        }
        let steps = progress.steps(self.frequencies_hz.len(), "frequencies");
        let not_kept = AtomicBool::new(false);
        let tell = |told: Told<'_>| {
            let solved = match told {
                Told::Solved(solved) => solved,
                Told::Adds => return steps.grow(),
                Told::Tries {
                    frequency_hz,
                    harmonics,
                    strategy,
                } => {
                    return steps.detail(&format!(
                        "{frequency_hz:.3} Hz: {}, {strategy}",
                        counted(harmonics, "harmonic", "harmonics")
                    ));
                }
            };
            let mut solved = solved.clone();
            sides.judge_orbit(&mut solved.orbit);
            if let Err(error) = progress.tell(|observer| observer.frequency(&solved))
                && !not_kept.swap(true, Ordering::Relaxed)
            {
                progress.warning(
                    Weight::Remark,
                    format!("what is solved is not kept if the run is broken off: {error}"),
                );
            }
            steps.step();
        };
        let (damping, state) = (self.damping, self.state);
        Ok(sweep(problem, damping, state, &settings, &earlier, &tell))
    }

    /// A hash of all that the response is computed from, the program included.
    fn inputs(&self, settings: &SweepSettings) -> Inputs {
        let problem = self.reduced.problem();
        let mut hasher = blake3::Hasher::new();
        hasher.update(&program::fingerprint().unwrap_or_default());
        // Numbers are written so that they read back to the bit.
        let Self { damping, state, .. } = self;
        let (loads, laws) = (&problem.excitations, &problem.laws);
        let rest = (&state.x, &state.lambda, &state.status, state.retention_n);
        hasher.update(format!("{loads:?}{laws:?}{damping:?}{rest:?}{settings:?}").as_bytes());
        if postcard::to_io(&problem.reduced, &mut hasher).is_err() {
            unreachable!("a hasher takes all bytes");
        }
        *hasher.finalize().as_bytes()
    }

    /// Where all flanks are bonded: the modes' answer, each by itself.
    fn linear(&self, resolution: Resolution) -> Response {
        let _stage = self
            .progress
            .titled_stage(Stage::Response, "linear response");
        let problem = self.reduced.problem();
        let harmonics = match resolution {
            Resolution::Fixed { harmonics, .. } => harmonics,
            Resolution::Accuracy(_) => problem.highest_excited().max(1),
        };
        let system = ContactSystem::new(problem, self.damping);
        let frequencies = || self.frequencies_hz.iter();
        Response {
            linear: frequencies()
                .map(|&f| linear_point(&system, harmonics, f))
                .collect(),
            linear_curve: linear_curve(&system, harmonics, self.frequencies_hz),
            orbits: frequencies()
                .enumerate()
                .map(|(point, &f)| linear_orbit(&system, harmonics, (point, f)))
                .collect(),
            asked: self.frequencies_hz.len(),
            second_motions: Vec::new(),
            slip_threshold_m: 0.0,
        }
    }
}

fn title(resolution: Resolution) -> String {
    match resolution {
        Resolution::Fixed { harmonics: 1, .. } => "response, 1 harmonic".to_owned(),
        Resolution::Fixed { harmonics, .. } => format!("response, {harmonics} harmonics"),
        Resolution::Accuracy(accuracy) => format!("response, accuracy {accuracy}"),
    }
}
