//! Warnings about the excitation and the damping of a response: a force that excites no mode of the range, a
//! damping in per cent, pairs that all stick.

use dovetail_export::warning::{Warning, accuracy_warning, wrong};
use dovetail_export::words::percent;
use dovetail_solver::damping::Rayleigh;
use dovetail_solver::results::participation::{NO_SHARE, participation};
use dovetail_solver::run::{Bodies, ResponseResult, Run};

/// Ratio of critical damping from which on a first mode is implausible for metal bodies.
const MUCH_DAMPING: f64 = 0.1;

/// Warning about a damping that is probably given in per cent.
pub(super) fn much_damping(run: &Run, found: &ResponseResult) -> Option<Warning> {
    run.reduced.bodies.as_ref()?;
    let omega = run
        .reduced
        .linear_omega2(&run.statics.state)
        .first()?
        .max(0.0)
        .sqrt();
    let Rayleigh {
        stiffness_s,
        mass_per_s,
    } = found.damping;
    let ratio = 0.5 * (stiffness_s * omega + mass_per_s / omega);
    (ratio.is_finite() && ratio > MUCH_DAMPING).then(|| {
        accuracy_warning(format!(
            "the first mode has {} of critical damping, and metal bodies mostly have less than 1 %: check [damping]; a ratio is \
             a share, not per cent (0.5 % is ratio = 0.005)",
            percent(ratio, 2)
        ))
    })
}

/// Note that no pair slips or opens at any frequency.
pub(super) fn all_stuck_note(run: &Run) -> Option<String> {
    let response = run.response.as_ref()?;
    let mut orbits = response
        .response
        .orbits
        .iter()
        .filter(|o| o.outcome.has_motion())
        .peekable();
    let has_pairs = !orbits.peek()?.cycles.is_empty();
    let stuck = orbits.all(|orbit| orbit.counts().stuck == orbit.cycles.len());
    (has_pairs && stuck).then(|| {
        "all pairs stick at all frequencies: at this force the response is the linear one"
            .to_owned()
    })
}

/// Warnings about an excitation that excites no mode of the range, or about observations that show
/// none of the modes that it excites.
pub(super) fn resonance_warnings(run: &Run, found: &ResponseResult) -> Vec<Warning> {
    let reduced = &run.reduced;
    let hz = found.response.orbits.iter().map(|orbit| orbit.frequency_hz);
    let range = [
        hz.clone().fold(f64::INFINITY, f64::min),
        hz.fold(0.0, f64::max),
    ];
    let Some(Bodies { bound, .. }) = &reduced.bodies else {
        return Vec::new();
    };
    let masses_kg: Vec<f64> = bound.properties.iter().map(|p| p.mass_kg).collect();
    let bodies = (&bound.model, &masses_kg[..]);
    let linear = &run.statics.state.linear;
    let Some(shares) = participation(&reduced.problem, linear, range, bodies) else {
        return Vec::new();
    };
    let modes = listed_hz(&shares.resonances_hz);
    if shares.excited < NO_SHARE {
        let elsewhere = shares.excited_outside_hz.map_or(String::new(), |hz| {
            format!("; the first mode that it does excite is at {hz:.3} Hz")
        });
        return vec![wrong(format!(
            "the excitation excites no mode of the range ({modes}), and the largest amplitude is no resonance: by symmetry, or \
             at a node of the mode, the force does no work; check where it acts and its direction (on, direction of \
             [[excitation]]){elsewhere}"
        ))];
    }
    let observed = reduced.observations().into_iter().zip(shares.observed);
    let unseen = observed.filter(|(_, share)| share.is_some_and(|share| share < NO_SHARE));
    let unseen = unseen.map(|(one, _)| {
        wrong(format!(
            "`{}` does not move in the modes of the range that are excited ({modes}), and its largest amplitude is no \
             resonance: it is at a node of the mode, or its direction is across the motion; check points and direction \
             of [[observe]]",
            one.name
        ))
    });
    unseen.collect()
}

/// Some frequencies, and the number of the others.
fn listed_hz(all_hz: &[f64]) -> String {
    const MOST: usize = 3;
    let mut words: Vec<String> = all_hz
        .iter()
        .take(MOST)
        .map(|hz| format!("{hz:.3} Hz"))
        .collect();
    if all_hz.len() > MOST {
        words.push(format!("{} more", all_hz.len() - MOST));
    }
    words.join(", ")
}
