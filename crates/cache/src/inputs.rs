//! Hashes of the inputs of responses, under which a journal keeps solved frequencies.

use crate::fingerprint;
use dovetail_export::journal::Inputs;
use dovetail_solver::description::Scene;
use dovetail_solver::run::{CurveInputs, PeakInputs, ResponseInputs, RunUpInputs};
use serde::Serialize;

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
    let (loads, laws) = (&problem.excitations, &problem.laws);
    let ratios = &problem.modal_ratios;
    let rest = (&state.x, &state.lambda, &state.status, state.retention_n);
    let rest = format!("{loads:?}{laws:?}{damping:?}{ratios:?}{rest:?}{settings:?}{points:?}");
    hash_of(&rest, &*problem.reduced)
}

/// Hash of all inputs of a response along an engine order, including the program. What belongs to a
/// speed follows from them.
pub fn of_run_up(inputs: &RunUpInputs<'_>) -> Inputs {
    let RunUpInputs { model, scene, .. } = inputs;
    let Scene {
        damping,
        modal_ratios,
        static_state,
        response,
        ..
    } = scene;
    let rest = format!("{damping:?}{modal_ratios:?}{static_state:?}{response:?}");
    hash_of(&rest, model)
}

/// Hash of the program, of a model and of the rest of the inputs, whose numbers are written in digits
/// that read back to the bit.
fn hash_of(rest: &str, model: &impl Serialize) -> Inputs {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&fingerprint::key());
    hasher.update(rest.as_bytes());
    if postcard::to_io(model, &mut hasher).is_err() {
        unreachable!("a hasher takes all bytes");
    }
    *hasher.finalize().as_bytes()
}

/// Hash of all inputs of a response, and of the words of what is asked of it.
fn hash_with(response: &ResponseInputs<'_>, asked: &str) -> Inputs {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&of_response(response));
    hasher.update(asked.as_bytes());
    *hasher.finalize().as_bytes()
}

/// Hash of all inputs of a peak that is looked for.
pub fn of_peak(inputs: &PeakInputs<'_>) -> Inputs {
    let (near, observation) = (inputs.near, inputs.observation);
    hash_with(&inputs.response, &format!("{near:?}{observation}"))
}

/// Hash of all inputs of a curve over a value.
pub fn of_curve(inputs: &CurveInputs<'_>) -> Inputs {
    let CurveInputs {
        last, key, range, ..
    } = inputs;
    let of_last = (&last.laws, &last.excitations, &last.reduced.omega2);
    hash_with(&inputs.response, &format!("{of_last:?}{key}{range:?}"))
}
