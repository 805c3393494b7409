//! Hashes of the inputs of responses, under which a journal keeps solved frequencies.

use crate::fingerprint;
use dovetail_export::journal::Inputs;
use dovetail_solver::description::Scene;
use dovetail_solver::run::{CurveInputs, PeakInputs, ResponseInputs, RunUpInputs};

/// Hash of all inputs of a response, including the program.
pub fn of_response(inputs: &ResponseInputs<'_>) -> Inputs {
    let ResponseInputs {
        problem,
        damping,
        state,
        settings,
        points,
        ..
    } = inputs;
    let mut hasher = blake3::Hasher::new();
    hasher.update(&fingerprint::key());
    // Numbers are written so that they read back to the bit.
    let (loads, laws) = (&problem.excitations, &problem.laws);
    let ratios = &problem.modal_ratios;
    let rest = (&state.x, &state.lambda, &state.status, state.retention_n);
    hasher.update(
        format!("{loads:?}{laws:?}{damping:?}{ratios:?}{rest:?}{settings:?}{points:?}").as_bytes(),
    );
    if postcard::to_io(&*problem.reduced, &mut hasher).is_err() {
        unreachable!("a hasher takes all bytes");
    }
    *hasher.finalize().as_bytes()
}

/// Hash of all inputs of a response along an engine order, including the program. What belongs to a
/// speed follows from them.
pub fn of_run_up(inputs: &RunUpInputs<'_>) -> Inputs {
    let RunUpInputs { model, scene, .. } = inputs;
    let mut hasher = blake3::Hasher::new();
    hasher.update(&fingerprint::key());
    let Scene {
        damping,
        modal_ratios,
        static_state,
        response,
        ..
    } = scene;
    hasher.update(format!("{damping:?}{modal_ratios:?}{static_state:?}{response:?}").as_bytes());
    if postcard::to_io(model, &mut hasher).is_err() {
        unreachable!("a hasher takes all bytes");
    }
    *hasher.finalize().as_bytes()
}

/// Hash of all inputs of a peak that is looked for.
pub fn of_peak(inputs: &PeakInputs<'_>) -> Inputs {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&of_response(&inputs.response));
    let (near, observation) = (inputs.near, inputs.observation);
    hasher.update(format!("{near:?}{observation}").as_bytes());
    *hasher.finalize().as_bytes()
}

/// Hash of all inputs of a curve over a value.
pub fn of_curve(inputs: &CurveInputs<'_>) -> Inputs {
    let CurveInputs {
        last, key, range, ..
    } = inputs;
    let mut hasher = blake3::Hasher::new();
    hasher.update(&of_response(&inputs.response));
    let of_last = (&last.laws, &last.excitations, &last.reduced.omega2);
    hasher.update(format!("{of_last:?}{key}{range:?}").as_bytes());
    *hasher.finalize().as_bytes()
}
