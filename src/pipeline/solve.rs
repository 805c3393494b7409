//! Takes a reduced model to its static state and its response.

use super::error::RunError;
use super::hertz;
use super::progress::Progress;
use crate::stage::Stage;
use dovetail_numerics::newton::NewtonOptions;
use dovetail_solver::contact::dynamic_stiffness::ContactSystem;
use dovetail_solver::description::{FrequencyRange, ResponseSpec, Scene};
use dovetail_solver::dlft::accuracy::samples_for;
use dovetail_solver::dlft::orbit::{linear_orbit, stuck_point};
use dovetail_solver::dlft::penalty::Penalty;
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::dlft::static_state::static_state as solve_static;
use dovetail_solver::dlft::stuck_curve::stuck_curve;
use dovetail_solver::dlft::sweep::{SweepSettings, sweep};
use dovetail_solver::dlft::{Orbit, Outcome, PairStatus, Response, StaticState, aft::Periods};
use dovetail_solver::reduction::RelativeModel;
use dovetail_solver::reduction::damping::Rayleigh;

/// Newton iterations allowed for one step of the static load.
const STATIC_ITERATIONS: usize = 100;

/// With friction; where no pair can open or slip there is nothing to solve.
pub(super) fn statics(scene: &Scene, relative: &RelativeModel, progress: &Progress) -> StaticState {
    if relative.pairs.is_empty() {
        return StaticState {
            outcome: Outcome::Converged,
            x: Vec::new(),
            lambda: Vec::new(),
            status: Vec::new(),
            newton_iterations: 0,
            residual: 0.0,
            retention_n: None,
        };
    }
    let stage = progress.stage(Stage::StaticState);
    stage.solves(relative.stiffness.nrows());
    let newton = NewtonOptions {
        tolerance: scene.response.tolerance.min(1e-10),
        max_iterations: STATIC_ITERATIONS,
    };
    let state = solve_static(relative, scene.static_state.load_steps, newton);
    if let (Some(retention_n), true) = (state.retention_n, state.outcome.is_converged()) {
        progress.warning(&format!(
            "friction does not hold the blade along its slot under the steady load: it was held there, as by a lock \
             plate, with {retention_n:.3} N (static.retention_n of summary.json)"
        ));
    }
    state
}

/// Whether there is a static state to vibrate about.
pub(super) fn usable(state: &StaticState) -> Result<(), RunError> {
    let open = |s: &PairStatus| *s == PairStatus::Open;
    if !state.status.is_empty() && state.status.iter().all(open) {
        return Err(RunError::NothingHolds);
    }
    if state.outcome == Outcome::SlidesTooFar {
        return Err(RunError::SlidesTooFar);
    }
    if !state.outcome.is_converged() {
        return Err(RunError::StaticState {
            outcome: state.outcome,
            iterations: state.newton_iterations,
            residual: state.residual,
        });
    }
    Ok(())
}

/// The frequencies of the response, rising.
///
/// # Errors
/// [`RunError::NoStuckMode`] where they are counted from a stuck mode of a model that has none.
pub(super) fn frequencies_hz(
    response: &ResponseSpec,
    relative: &RelativeModel,
) -> Result<Vec<f64>, RunError> {
    let (from, to) = match response.range {
        FrequencyRange::Hz { from_hz, to_hz } => (from_hz, to_hz),
        FrequencyRange::OfFirstStuckMode { from, to } => {
            let first = hertz(*relative.omega2.first().ok_or(RunError::NoStuckMode)?);
            (from * first, to * first)
        }
    };
    let points = response.points;
    let last = points.saturating_sub(1).max(1) as f64;
    Ok((0..points)
        .map(|i| from + (to - from) * i as f64 / last)
        .collect())
}

/// Nearer to an undamped stuck mode than this, relative, a harmonic of the response is taken to lie on it.
const ON_A_MODE: f64 = 1e-9;

/// Without damping the stuck answer is infinite at the frequency of a stuck mode.
///
/// # Errors
/// [`RunError::UndampedMode`] where a harmonic of some frequency lies there.
pub(super) fn off_undamped_modes(
    relative: &RelativeModel,
    damping: Rayleigh,
    frequencies_hz: &[f64],
    harmonics: usize,
) -> Result<(), RunError> {
    if damping.stiffness_s > 0.0 || damping.mass_per_s > 0.0 {
        return Ok(());
    }
    let modes_hz: Vec<f64> = relative.omega2.iter().map(|w2| hertz(*w2)).collect();
    for &frequency_hz in frequencies_hz {
        for harmonic in 1..=harmonics {
            let of_harmonic = harmonic as f64 * frequency_hz;
            // Ascending: the first mode not below the window around the harmonic.
            let mode = modes_hz.partition_point(|m| *m < of_harmonic * (1.0 - ON_A_MODE));
            let on_it = |m: &f64| (m / of_harmonic - 1.0).abs() <= ON_A_MODE;
            if modes_hz.get(mode).is_some_and(on_it) {
                return Err(RunError::UndampedMode {
                    frequency_hz,
                    harmonic,
                    mode: mode + 1,
                });
            }
        }
    }
    Ok(())
}

/// A response with `harmonics` beside one of another resolution: with its samples, where it says how many.
pub(super) fn compared(own: Resolution, harmonics: usize) -> Resolution {
    let samples = match own {
        Resolution::Fixed { samples, .. } => samples,
        Resolution::Accuracy(accuracy) => samples_for(accuracy, harmonics),
    };
    Resolution::Fixed { harmonics, samples }
}

pub(super) fn respond(
    spec: &ResponseSpec,
    relative: &RelativeModel,
    damping: Rayleigh,
    state: &StaticState,
    frequencies_hz: &[f64],
    resolution: Resolution,
    progress: &Progress,
) -> Response {
    if relative.pairs.is_empty() {
        let harmonics = match resolution {
            Resolution::Fixed { harmonics, .. } => harmonics,
            Resolution::Accuracy(_) => relative.highest_excited().max(1),
        };
        return linear(relative, damping, frequencies_hz, harmonics, progress);
    }
    let title = match resolution {
        Resolution::Fixed { harmonics: 1, .. } => "response, 1 harmonic".to_owned(),
        Resolution::Fixed { harmonics, .. } => format!("response, {harmonics} harmonics"),
        Resolution::Accuracy(accuracy) => format!("response to {accuracy}"),
    };
    let blocks = 2 * resolution.most_harmonics() + 1;
    let stage = progress.titled_stage(Stage::Response, &title);
    stage.solves(blocks * relative.stiffness.nrows());
    let steps = progress.steps(frequencies_hz.len(), "frequencies");
    let settings = SweepSettings {
        frequencies_hz: frequencies_hz.to_vec(),
        resolution,
        eps: Penalty {
            choice: spec.eps,
            scale: spec.eps_scale,
        },
        newton: NewtonOptions {
            tolerance: spec.tolerance,
            max_iterations: spec.max_newton_iterations,
        },
        periods: Periods::UntilPeriodic,
        solver: spec.solver,
        slip_threshold_m: spec.slip_threshold_m,
    };
    let step = |orbit: &Orbit| {
        progress.tell(|observer| observer.frequency(orbit));
        steps.step();
    };
    sweep(relative, damping, state, &settings, &step)
}

/// The response where all flanks are bonded: the stuck modes', each by itself.
fn linear(
    relative: &RelativeModel,
    damping: Rayleigh,
    frequencies_hz: &[f64],
    harmonics: usize,
    progress: &Progress,
) -> Response {
    let _stage = progress.titled_stage(Stage::Response, "linear response");
    let system = ContactSystem::new(relative, damping);
    let frequencies = frequencies_hz.iter();
    Response {
        stuck: frequencies
            .clone()
            .map(|&f| stuck_point(&system, harmonics, f))
            .collect(),
        stuck_curve: stuck_curve(&system, harmonics, frequencies_hz),
        orbits: frequencies
            .map(|&f| linear_orbit(&system, harmonics, f))
            .collect(),
        slip_threshold_m: 0.0,
    }
}
