//! Warnings and remarks about a model, its static state and its response.

use super::excited::{much_damping, resonance_warnings};
use super::line::ReportLine;
use super::mistakes::key_of_sides;
use super::stability::{unstable_motions, unstable_peaks};
use crate::motions::retained_words;
use dovetail_export::warning::{CREEPS, LARGE_ERROR, Warning, accuracy_warning, remark, wrong};
use dovetail_export::words::{counted, figure, percent, quantity};
use dovetail_solver::contact::PairLaw;
use dovetail_solver::dlft::branch::folds;
use dovetail_solver::dlft::peaks::LEAST_RISE;
use dovetail_solver::dlft::retention::Mean;
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::dlft::{Orbit, Outcome, Response, StaticCounts, StaticState};
use dovetail_solver::model::Model;
use dovetail_solver::problem::dynamic_stiffness::ContactSystem;
use dovetail_solver::reduction::ModalTruncation;
use dovetail_solver::results::around_axis::{FreeSides, free_sides};
use dovetail_solver::results::far_slip::{FAR, TOO_FAR};
use dovetail_solver::results::modes::hertz;
use dovetail_solver::results::pairs::{PairRow, PairTable};
use dovetail_solver::results::peak::{
    jump_hz, largest_amplitude, linear_peak, peak, peak_rise, uncomputed_resonance,
};
use dovetail_solver::results::small::{
    AssemblySizes, ContactShare, LARGE_CLEARANCE, LARGE_DISPLACEMENT, LARGE_INTERFERENCE,
    LARGE_PRESSURE, Moved,
};
use dovetail_solver::run::{
    Bodies, ReducedScene, ResponseResult, Run, StaticResult, TractionRange,
};

/// Estimated error of the first stuck frequencies by the modes of a body above which a warning is given.
const LARGE_FREQUENCY_ERROR: f64 = 0.01;
/// Error of a prestress of held flanks above which a warning is given.
const LARGE_HELD_FLANKS_ERROR: f64 = 0.01;

/// Warnings about a response.
pub(super) fn response_warnings(run: &Run) -> Vec<Warning> {
    let Some(found) = &run.response else {
        return Vec::new();
    };
    let mut warnings = motion_warnings(run);
    warnings.extend(held(found));
    let mut modes: Vec<f64> = (run.reduced.linear_omega2(&run.statics.state).iter())
        .map(|omega2| hertz(*omega2))
        .collect();
    if found.run_up.is_some() {
        // Those at its speeds are others.
        modes.clear();
    }
    let keys = match found.run_up {
        Some(_) => "the range of speeds (response.speed_rpm, or response.frequency_hz)",
        None => "response.frequency_hz or response.times_first_linear_mode",
    };
    warnings.extend(frequency_warnings(
        &run.reduced,
        &found.response,
        &modes,
        keys,
    ));
    warnings.extend(unstable_peaks(&run.reduced, found));
    warnings.extend(much_damping(run, found));
    if found.run_up.is_none() {
        warnings.extend(resonance_warnings(run, found));
    }
    warnings.extend(few_modes(found.modes_reach));
    warnings.extend(found.tractions.as_ref().and_then(peakless_tractions));
    warnings.extend(flutter(run, found));
    warnings
}

/// Warning about modes of the wave of the first harmonic that the air drives, if any.
fn flutter(run: &Run, found: &ResponseResult) -> Option<Warning> {
    let problem = &run.reduced.problem;
    let of = problem.reduced.harmonic_model(1);
    of.influence?;
    let system = ContactSystem::new(problem, found.damping);
    let modes = (0..of.model.stuck_modes).step_by(of.copies());
    let ratios = modes.map(|mode| (mode, system.damping_ratio(1, mode)));
    let driven: Vec<(usize, f64)> = ratios.filter(|(_, ratio)| *ratio < 0.0).collect();
    let (mode, ratio) = driven.iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(accuracy_warning(format!(
        "the air drives {} of the wave of the response with all pairs stuck: mode {}, at {:.4} Hz, has a damping ratio of {}; \
         without slip these motions grow, and the response to the excitation alone need not be what the blades do; \
         `dovetail backbone` has the amplitudes at which friction holds them",
        counted(driven.len(), "mode", "modes"),
        of.mode_of_sector(*mode) + 1,
        hertz(of.model.omega2[*mode]),
        percent(*ratio, 2)
    )))
}

/// Warnings about clearances and interferences that are not small.
pub(super) fn gap_warnings(model: &Model) -> Vec<Warning> {
    let [clearance, interference] = AssemblySizes::new(model).widest_gaps();
    let mut warnings = Vec::new();
    if let Some(gap) = clearance.filter(|gap| gap.share > LARGE_CLEARANCE) {
        warnings.push(accuracy_warning(format!(
            "contact `{}` has a clearance of {}, {} of the size of its flank: places that face each other across so wide a gap \
             need not meet; check gap_m, gap = \"mesh\", and the units of the mesh",
            gap.contact,
            quantity(gap.value, "m", 3),
            percent(gap.share, 2),
        )));
    }
    if let Some(gap) = interference.filter(|gap| gap.share > LARGE_INTERFERENCE) {
        warnings.push(accuracy_warning(format!(
            "contact `{}` has an interference of {}, {} of the size of its flank: the bodies lie deep in each other, which linear \
             elasticity does not cover; check gap_m, gap = \"mesh\", and where the bodies lie",
            gap.contact,
            quantity(-gap.value, "m", 3),
            percent(gap.share, 2),
        )));
    }
    warnings
}

/// Notes and warnings about a reduced model.
pub(super) fn model_lines(reduced: &ReducedScene) -> Vec<ReportLine> {
    let mut lines = Vec::new();
    if reduced.bodies.is_none() {
        let pairs = reduced.pairs.rows.len();
        lines.push(ReportLine::Note(format!("{pairs} contact pairs")));
    }
    lines.extend(much_friction(reduced).map(ReportLine::Warning));
    let stuck = reduced.stuck_omega2();
    if let Some(omega2) = stuck.first() {
        lines.push(ReportLine::Note(format!(
            "first stuck mode {:.4} Hz",
            hertz(*omega2)
        )));
    }
    if let Some(bodies) = &reduced.bodies {
        let truncation = &bodies.modes.truncation;
        lines.push(ReportLine::Note(truncation_note(stuck.len(), truncation)));
        lines.extend(few_stuck_modes(truncation).map(ReportLine::Warning));
        lines.extend(few_modes_of_bodies(truncation).map(ReportLine::Warning));
        lines.extend(held_flanks(bodies).map(ReportLine::Warning));
    }
    lines
}

fn much_friction(reduced: &ReducedScene) -> Option<Warning> {
    let pairs = reduced.problem.laws.iter();
    let largest = pairs.map(|pair| pair.friction).fold(0.0, f64::max);
    (largest > PairLaw::MOST_FRICTION).then(|| {
        remark(format!(
            "a coefficient of friction of {largest:e} is computed as {:e}: pairs stick as long as they are pressed",
            PairLaw::MOST_FRICTION
        ))
    })
}

fn held_flanks(bodies: &Bodies) -> Option<Warning> {
    let error = bodies.modes.held_flanks_error;
    let error = error.filter(|error| *error > LARGE_HELD_FLANKS_ERROR)?;
    Some(accuracy_warning(format!(
        "the prestress of held flanks is not that of the assembly: its first frequencies change by an estimated {} with the stress \
         that the contacts hand on (held_flanks_error of summary.json); take prestress = \"contact\" of [rotation], the default",
        percent(error, 2)
    )))
}

fn truncation_note(modes: usize, truncation: &ModalTruncation) -> String {
    let amplitude = match truncation.amplitude {
        Some(error) => format!("amplitudes of the linear curve err by about {error:.0e}"),
        None => "they do not reach the highest frequency of the linear curve".to_string(),
    };
    let worst = truncation.frequencies.iter().copied().fold(0.0, f64::max);
    let frequencies = match truncation.frequencies.len() {
        0 => String::new(),
        n => format!(
            "; fixed_interface_modes raise the first {n} stuck frequencies by up to {:.2} %",
            100.0 * worst
        ),
    };
    format!("{modes} stuck modes: {amplitude}{frequencies}")
}

/// Warning that the stuck modes kept are too few for the linear curve.
fn few_stuck_modes(truncation: &ModalTruncation) -> Option<Warning> {
    let text = match truncation.amplitude {
        None => "the stuck modes kept do not reach the highest frequency of the linear curve, and amplitudes above the last one lack \
                 the modes left out: take more response.stuck_modes"
            .to_owned(),
        Some(error) if error > LARGE_ERROR => format!(
            "the stuck modes left out change amplitudes of the linear curve by an estimated {}: take more response.stuck_modes, or \
             leave the key out",
            percent(error, 2)
        ),
        Some(_) => return None,
    };
    Some(accuracy_warning(text))
}

/// Warning that the modes kept of the bodies that are reduced by themselves are too few.
fn few_modes_of_bodies(truncation: &ModalTruncation) -> Option<Warning> {
    let errors = truncation.frequencies.iter().copied().enumerate();
    let (mode, error) = errors.max_by(|a, b| a.1.total_cmp(&b.1))?;
    (error > LARGE_FREQUENCY_ERROR).then(|| {
        accuracy_warning(format!(
            "the fixed_interface_modes kept of the bodies raise the first {} stuck frequencies by up to an estimated {} (mode {}): keep \
             more of them, or leave body.*.fixed_interface_modes out: the body is then not reduced by itself",
            truncation.frequencies.len(),
            percent(error, 2),
            mode + 1,
        ))
    })
}

/// Note on the first linear mode, if pairs are open in the static state.
pub(super) fn linear_note(reduced: &ReducedScene, statics: &StaticResult) -> Option<String> {
    let state = &statics.state;
    let open = state.open_pairs().len();
    if statics.usable().is_err() || state.linear.not_released.is_some() || open == 0 {
        return None;
    }
    let first = reduced.linear_omega2(state).first().copied()?;
    Some(format!(
        "first linear mode {:.4} Hz, with the {open} pairs released that are open in the static state",
        hertz(first)
    ))
}

/// Warnings about the static state.
pub(super) fn static_warnings(reduced: &ReducedScene, statics: &StaticResult) -> Vec<Warning> {
    let state = &statics.state;
    let mut warnings = Vec::new();
    if let (Some(retention_n), true) = (state.retention_n, state.outcome.is_converged()) {
        warnings.push(remark(format!(
            "friction does not hold {} under the steady load: that was held at rest, as by a lock plate, with \
             {retention_n:.3} N (static.retention_n of summary.json)",
            retained_words(&statics.retained)
        )));
    }
    if let (Some(why), true) = (&state.linear.not_released, statics.usable().is_ok()) {
        let open = state.open_pairs().len();
        warnings.push(accuracy_warning(format!(
            "without the {open} pairs that are open in the static state the assembly has no linear modes ({why}): the linear curve, \
             damping.ratio and response.times_first_linear_mode take them as stuck"
        )));
    }
    let place = "in the static state";
    warnings.extend(far_slide(place, statics.slide));
    if state.outcome.is_converged() {
        let sides = reduced
            .bodies
            .iter()
            .flat_map(|bodies| free_sides(bodies.model()));
        warnings.extend(all_open(&reduced.pairs, state, &sides.collect::<Vec<_>>()));
    }
    if let Some(bodies) = &reduced.bodies {
        let sizes = AssemblySizes::new(bodies.model());
        let moved = statics.farthest.as_ref();
        warnings.extend(moved.and_then(|moved| far_moved(place, moved)));
        let hardest = sizes.hardest_static(state);
        warnings.extend(hardest.and_then(|hardest| hard_pressed(place, &hardest)));
    }
    warnings
}

/// Share of the pairs of a flank without clearance that are open if it carries next to nothing.
const NEARLY_ALL: f64 = 0.9;

/// Remark on contacts that are open in the static state, everywhere or nearly so. Flanks with a
/// clearance, such as crowned ones, touch in few places, and count only if they touch nowhere.
fn all_open(pairs: &PairTable, state: &StaticState, sides: &[FreeSides<'_>]) -> Option<Warning> {
    let contacts = pairs.contacts.iter().enumerate();
    let open = contacts.filter_map(|(c, name)| {
        let contact_rows = || {
            pairs
                .rows
                .iter()
                .zip(&state.status)
                .filter(|(row, _)| row.contact == c)
        };
        let counts: StaticCounts = contact_rows().map(|(_, status)| *status).collect();
        let is_conformal = contact_rows().all(|(row, _): (&PairRow, _)| row.gap_m <= 0.0);
        let (open, all) = (counts.open, counts.pairs());
        let is_open = open > 0 && open == all;
        let is_nearly = is_conformal && open as f64 >= NEARLY_ALL * all as f64 && open > 0;
        (is_open || is_nearly).then(|| match (is_open, all) {
            (true, 1) => format!("the pair of contact `{name}`"),
            (true, all) => format!("all {all} pairs of contact `{name}`"),
            (false, all) => format!("{open} of {all} pairs of contact `{name}`"),
        })
    });
    let open: Vec<String> = open.collect();
    let (last, others) = open.split_last()?;
    let (listed, is) = match others {
        [] if last.starts_with("the pair") => (last.clone(), "is"),
        [] => (last.clone(), "are"),
        others => (format!("{} and {last}", others.join(", ")), "are"),
    };
    let sides = sides.iter().map(|body| {
        format!(
            "; the sides of body `{}` are free, and the load spreads it: if it is a sector of a disc, hold its sides by {}, or \
             name them in [cyclic]",
            body.name,
            key_of_sides(body)
        )
    });
    let sides: String = sides.collect();
    Some(remark(format!(
        "{listed} {is} open at rest: small vibrations do not feel them; if they are meant to touch, check the steady load, \
         the supports, gap_m and where the bodies stand{sides}"
    )))
}

/// Warnings about slides, displacements and pressures of a response, without those that the static
/// state already has.
pub(super) fn motion_warnings(run: &Run) -> Vec<Warning> {
    let (reduced, statics) = (&run.reduced, &run.statics);
    let Some(found) = &run.response else {
        return Vec::new();
    };
    let place = "in the response";
    let slide = far_slide(place, found.slide).filter(|_| statics.slide < FAR);
    let mut warnings: Vec<Warning> = slide.into_iter().collect();
    if let Some(bodies) = &reduced.bodies {
        let sizes = AssemblySizes::new(bodies.model());
        let moved = found.farthest.as_ref();
        warnings.extend(moved.and_then(|moved| far_moved(place, moved)));
        let is_new = sizes
            .hardest_static(&statics.state)
            .is_none_or(|at_rest| at_rest.share <= LARGE_PRESSURE);
        let hardest = sizes.hardest_in_motion(&found.response).filter(|_| is_new);
        warnings.extend(hardest.and_then(|hardest| hard_pressed(place, &hardest)));
    }
    warnings
}

/// Warning about a pair that slides far: the two sides of a pair are assumed to stay opposite each
/// other.
fn far_slide(place: &str, farthest: f64) -> Option<Warning> {
    (FAR..=TOO_FAR).contains(&farthest).then(|| {
        accuracy_warning(format!(
            "{place} a pair slides by {} of the shorter side of its flank: the two sides of a pair are \
             assumed to stay opposite each other, and a solution that slides by more than {} % is refused",
            percent(farthest, 2),
            100.0 * TOO_FAR
        ))
    })
}

fn far_moved(place: &str, moved: &Moved) -> Option<Warning> {
    (moved.share() > LARGE_DISPLACEMENT).then(|| {
        accuracy_warning(format!(
            "{place} {} of body `{}` moves by {}, {} of the longest side of the body ({}): displacements are taken to be small; \
             check the units of the loads, of young_pa and of the mesh, or load and excite it less",
            moved.what,
            moved.body,
            quantity(moved.displacement_m, "m", 3),
            percent(moved.share(), 2),
            quantity(moved.size_m, "m", 3),
        ))
    })
}

fn hard_pressed(place: &str, at: &ContactShare) -> Option<Warning> {
    (at.share > LARGE_PRESSURE).then(|| {
        accuracy_warning(format!(
            "{place} a pair of contact `{}` is pressed with {}, {} of Young's modulus: strains are taken to be small, and most \
             materials yield before; check the units of the loads and of young_pa, gap_m and the mesh at the edges of the flank",
            at.contact,
            quantity(at.value, "Pa", 3),
            percent(at.share, 2),
        ))
    })
}

/// Warning about the frequencies at which friction does not hold the bodies, and about the motions
/// that it does not hold.
fn held(found: &ResponseResult) -> Option<Warning> {
    let response = &found.response;
    let held = |o: &&Orbit| o.outcome.has_motion() && o.mean == Mean::Retained;
    let held: Vec<&Orbit> = response.orbits.iter().filter(held).collect();
    let most_n = held.iter().map(|o| o.retention_n).reduce(f64::max)?;
    let what = retained_words(&found.retained);
    // Pairs that stick all period hold it: a motion without the lock plate may exist, and was not
    // found.
    let is_found = held.iter().all(|orbit| orbit.counts().stuck == 0);
    let why = if is_found {
        format!("friction does not hold {what}")
    } else {
        format!("no motion was found in which friction alone holds {what}")
    };
    Some(accuracy_warning(format!(
        "at {} of {} frequencies {why}: the mean position was held there, as a lock plate does, with up to {} (column \
         retention_n of response.csv)",
        held.len(),
        response.orbits.len(),
        quantity(most_n, "N", 4),
    )))
}

/// Warnings about frequencies: first those that failed, then those that are doubtful.
/// `keys` give the range.
fn frequency_warnings(
    reduced: &ReducedScene,
    response: &Response,
    modes_hz: &[f64],
    keys: &str,
) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let ended = |outcome: Outcome| {
        response
            .orbits
            .iter()
            .filter(|o| o.outcome == outcome)
            .count()
    };
    if ended(Outcome::NoStaticEquilibrium) > 0 {
        warnings.push(wrong(format!(
            "{} no motion was found, and the bodies would come apart: a static test shows that at some instant no contact forces \
             balance the excitation, applied slowly, and the steady load; excite it less (force_n), or press the flanks harder \
             (rotation.speed_rpm, [[load]])",
            places(response, &[Outcome::NoStaticEquilibrium]),
        )));
    }
    if FAILED.iter().any(|outcome| ended(*outcome) > 0) {
        warnings.push(wrong(format!(
            "{} no motion was found (column outcome of response.csv): nothing is known of the response there",
            places(response, &FAILED),
        )));
    }
    if ended(Outcome::SlidesTooFar) > 0 {
        warnings.push(wrong(format!(
            "{} a pair slides farther than {} % of the shorter side of its flank, and the two sides of a \
             pair are assumed to stay opposite each other (outcome slides_too_far of response.csv)",
            places(response, &[Outcome::SlidesTooFar]),
            100.0 * TOO_FAR,
        )));
    }
    if ended(Outcome::NothingHolds) > 0 {
        warnings.push(wrong(format!(
            "{} nothing holds the bodies at rest: no pair is in contact in the static state at their speeds; \
             begin the run-up at a higher speed, or press them together with a [[load]]",
            places(response, &[Outcome::NothingHolds]),
        )));
    }
    if ended(Outcome::TimeLimit) > 0 {
        warnings.push(wrong(format!(
            "{} the search for a motion was given up after response.most_seconds_per_frequency: allow more, or leave the key out",
            places(response, &[Outcome::TimeLimit]),
        )));
    }
    if ended(Outcome::AccuracyNotReached) > 0 {
        warnings.push(accuracy_warning(format!(
            "{} the error is estimated above the accuracy asked for, and they do not count as converged: \
             with more harmonics, at most {}, no motion was found or the estimate did not fall (outcome accuracy_not_reached and column \
             estimated_error of response.csv)",
            places(response, &[Outcome::AccuracyNotReached]),
            Resolution::MOST_ADAPTED,
        )));
    } else {
        warnings.extend(truncation(response));
    }
    let observed = reduced.observations();
    let unstable = if folds(response).is_empty() {
        ""
    } else {
        ", and those on the dashed part of the curve are unstable (column stable of response.csv)"
    };
    for several in &response.second_motions {
        let (name, unit) = observed
            .get(several.observation)
            .map_or(("", "m"), |one| (one.name.as_str(), one.quantity.unit()));
        warnings.push(accuracy_warning(format!(
            "from {:.4} to {:.4} Hz several motions were found: at {:.4} Hz the amplitude of {} is {} in the largest and {} in the \
             smallest (response.second_motion of summary.json). Which of them is met depends on how the frequency is reached{unstable}{}",
            several.from_hz,
            several.to_hz,
            several.frequency_hz,
            name,
            quantity(several.amplitude_m, unit, 4),
            quantity(several.other_amplitude_m, unit, 4),
            if are_of_truncation(
                [several.from_hz, several.to_hz],
                several.observation,
                1.0 - several.other_amplitude_m / several.amplitude_m,
                &response.orbits,
            ) {
                ". The harmonics left out are estimated to change amplitudes there by more than the motions differ, and may be all \
                 there is between them: take more response.harmonics"
            } else {
                ""
            },
        )));
    }
    warnings.extend(gaps(response));
    warnings.extend(given_up(response));
    warnings.extend(unstable_motions(response, &observed));
    let is_linear = reduced.problem.laws.is_empty();
    for (i, one) in observed.iter().enumerate() {
        warnings.extend(hidden_peak(
            (&one.name, i),
            (response, is_linear),
            modes_hz,
            keys,
        ));
    }
    warnings
}

/// Returns `true` if the estimated error of an amplitude in a range of several motions is larger than
/// their relative difference.
fn are_of_truncation(
    [from_hz, to_hz]: [f64; 2],
    observation: usize,
    difference: f64,
    orbits: &[Orbit],
) -> bool {
    let within = |orbit: &&Orbit| {
        (from_hz..=to_hz).contains(&orbit.frequency_hz) && orbit.outcome.has_motion()
    };
    let errors = orbits.iter().filter(within);
    let errors = errors.filter_map(|orbit| orbit.amplitude_error(observation));
    errors.fold(0.0, f64::max) > difference
}

/// Outcomes of a search for a motion that ended without one and without a reason in the model.
const FAILED: [Outcome; 4] = [
    Outcome::Stagnated,
    Outcome::IterationLimit,
    Outcome::NotPeriodic,
    Outcome::NotFinite,
];
/// Number of stretches of frequencies that are named.
const MOST_STRETCHES: usize = 4;

/// Number of the frequencies that ended with one of these outcomes, and where they are: `at 15 of 80
/// frequencies (450 to 594.304 Hz, 702.532 Hz)`.
fn places(response: &Response, outcomes: &[Outcome]) -> String {
    let orbits = &response.orbits;
    let is_one = |orbit: &Orbit| outcomes.contains(&orbit.outcome);
    let hz = |orbit: &Orbit| orbit.frequency_hz;
    let stretches = orbits.chunk_by(|a, b| is_one(a) == is_one(b));
    let stretches = stretches.filter(|stretch| stretch.first().is_some_and(is_one));
    let stretches: Vec<String> = stretches
        .map(|stretch| match stretch {
            [one] => format!("{} Hz", figure(hz(one), 6)),
            several => {
                // A curve that was followed runs both ways.
                let ends = [f64::min, f64::max].map(|end| several.iter().map(hz).reduce(end));
                let ends = ends.map(|end| figure(end.unwrap_or_default(), 6));
                ends.join(" to ") + " Hz"
            }
        })
        .collect();
    let named = &stretches[..stretches.len().min(MOST_STRETCHES)];
    let more = match stretches.len() - named.len() {
        0 => String::new(),
        more => format!(", and {more} more"),
    };
    format!(
        "at {} of {} frequencies ({}{more})",
        orbits.iter().filter(|orbit| is_one(orbit)).count(),
        orbits.len(),
        named.join(", "),
    )
}

/// Warning that a curve has gaps.
fn gaps(response: &Response) -> Option<Warning> {
    let branches = response.branches.iter();
    let gaps: Vec<usize> = branches.flat_map(|b| b.gaps.iter().copied()).collect();
    let first = *gaps.first()?;
    let [from, to] = [first - 1, first].map(|i| response.orbits[i].frequency_hz);
    Some(accuracy_warning(format!(
        "the curve could not be followed everywhere: it has {}, the first from {from:.4} to {to:.4} Hz, where nothing is known of it; \
         give a grid (response.points) to solve each frequency by itself",
        counted(gaps.len(), "gap", "gaps"),
    )))
}

/// Warning that a curve was given up.
fn given_up(response: &Response) -> Option<Warning> {
    let places = response.branches.iter().filter_map(|b| b.given_up);
    let places = places.map(|at| format!("{:.4} Hz", response.orbits[at].frequency_hz));
    let places: Vec<String> = places.collect();
    (!places.is_empty()).then(|| {
        accuracy_warning(format!(
            "the curve was given up at {}, where {CREEPS}, and nothing is known of it behind that place; \
             give a grid (response.points) to solve each frequency by itself, or take fewer response.harmonics",
            places.join(" and "),
        ))
    })
}

/// Warning that the given number of harmonics may be too small.
fn truncation(response: &Response) -> Option<Warning> {
    let converged = response.orbits.iter().filter(|o| o.outcome.has_motion());
    let errors: Vec<f64> = converged.filter_map(|o| o.estimated_error).collect();
    let above = errors.iter().filter(|e| **e > LARGE_ERROR).count();
    (above > 0).then(|| {
        accuracy_warning(format!(
            "at {above} of {} frequencies the harmonics left out are estimated to change the amplitude by more than {} %, at worst by {:.1} % \
             (column estimated_error of response.csv): take more response.harmonics, or response.accuracy = 0.01 in their place",
            response.orbits.len(),
            100.0 * LARGE_ERROR,
            100.0 * errors.iter().copied().fold(0.0, f64::max),
        ))
    })
}

/// Warning that the range of the peak over starting tractions leaves some of them out.
fn peakless_tractions(range: &TractionRange) -> Option<Warning> {
    let all = 1 + range.others.len();
    let without = all - range.peaks().count();
    (without > 0).then(|| {
        accuracy_warning(format!(
            "from {without} of {all} starting tractions no peak was computed (tractions.csv): the range of the peak leaves them out"
        ))
    })
}

/// Warning that harmonics of a solution may lie above the retained modes.
fn few_modes(modes_reach: Option<f64>) -> Option<Warning> {
    let reach = modes_reach.filter(|reach| *reach < 1.0)?;
    Some(accuracy_warning(format!(
        "the last stuck mode kept lies at {reach:.2} times the frequency of the highest harmonic: above it the bodies answer without their \
         own modes (truncation.modes_reach of summary.json); take more response.stuck_modes and see whether the amplitude stays"
    )))
}

/// Warnings that a peak may lie outside the range or between two frequencies, or belong to another
/// motion.
fn hidden_peak(
    (name, observation): (&str, usize),
    (response, is_linear): (&Response, bool),
    modes_hz: &[f64],
    keys: &str,
) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if let Some([from_hz, to_hz]) = uncomputed_resonance(response, observation) {
        let found = largest_amplitude(response, observation);
        let found = found.map_or(String::new(), |largest| {
            format!(
                "; the largest amplitude that was found, at {} Hz, need not be the peak",
                figure(largest.frequency_hz, 6)
            )
        });
        warnings.push(wrong(format!(
            "the resonance of {name} was not computed: no motion is known from {} to {} Hz{found}; the column outcome of response.csv \
             says why, and a finer grid (response.points), more response.max_newton_iterations or less force_n may help",
            figure(from_hz, 6),
            figure(to_hz, 6),
        )));
        return warnings;
    }
    let at_end =
        peak(response, observation).filter(|peak| peak.amplitude_m > 0.0 && peak.is_at_an_end);
    if let Some(peak) = at_end {
        warnings.push(accuracy_warning(format!(
            "the largest amplitude of {name} is at an end of the range, {:.3} Hz: a peak may lie outside; widen {keys}{}",
            peak.frequency_hz,
            nearest_modes(modes_hz, peak.frequency_hz)
        )));
    } else if let Some(linear) = linear_peak(response, observation)
        .filter(|peak| peak.amplitude_m > 0.0 && peak.is_at_an_end)
    {
        warnings.push(accuracy_warning(format!(
            "the largest linear amplitude of {name} is at an end of the range, {:.3} Hz: the linear peak may lie outside, and the ratio of \
             the two peaks then says nothing; widen {keys}, or give the range of \
             another mode{}",
            linear.frequency_hz,
            nearest_modes(modes_hz, linear.frequency_hz)
        )));
    }
    if let (Some([from_hz, to_hz]), false) = (jump_hz(response, observation), is_linear) {
        warnings.push(accuracy_warning(format!(
            "the amplitude of {name} jumps between {from_hz:.4} and {to_hz:.4} Hz, where the curve may fold and other motions be possible: \
             leave response.points out, and the curve is followed round its folds"
        )));
    }
    if let Some(rise) = peak_rise(response, observation).filter(|rise| *rise > LEAST_RISE) {
        let remedy = match (response.is_followed(), is_linear) {
            (true, _) => "a narrower range",
            (false, true) => "more response.points, or leave them out: the curve then has its peak",
            (false, false) => {
                "more response.points, or leave them out: the curve is then followed to its peak"
            }
        };
        let higher = if rise < 1.0 {
            format!("{:.1} % higher", 100.0 * rise)
        } else {
            "more than twice as high".to_owned()
        };
        warnings.push(accuracy_warning(format!(
            "between two frequencies the peak of {name} may be {higher}: take {remedy}"
        )));
    }
    warnings
}

/// Words on the linear modes next to a frequency, below and above it.
fn nearest_modes(modes_hz: &[f64], frequency_hz: f64) -> String {
    let above = modes_hz.partition_point(|mode| *mode < frequency_hz);
    let near = &modes_hz[above.saturating_sub(1)..modes_hz.len().min(above + 1)];
    let words: Vec<String> = near.iter().map(|hz| format!("{hz:.3} Hz")).collect();
    match near.len() {
        0 => String::new(),
        1 => format!(" (the nearest linear mode lies at {})", words[0]),
        _ => format!(" (the nearest linear modes lie at {})", words.join(" and ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_solver::dlft::Branch;

    #[test]
    fn the_modes_on_both_sides_of_a_frequency_are_named() {
        let modes = [10.0, 20.0, 30.0];
        for (at, words) in [
            (5.0, " (the nearest linear mode lies at 10.000 Hz)"),
            (
                25.0,
                " (the nearest linear modes lie at 20.000 Hz and 30.000 Hz)",
            ),
            (35.0, " (the nearest linear mode lies at 30.000 Hz)"),
        ] {
            assert_eq!(nearest_modes(&modes, at), words);
        }
        assert_eq!(nearest_modes(&[], 5.0), "");
    }

    /// Only the errors of the range and of the observed displacement count.
    #[test]
    fn motions_that_differ_less_than_their_error_may_be_one() {
        let orbit = |(hz, errors): (f64, [f64; 2])| {
            let mut orbit = Orbit::motionless(hz, Outcome::Converged);
            orbit.observed_error = errors.to_vec();
            orbit
        };
        let orbits = [(10.0, [0.9, 0.9]), (20.0, [0.3, 0.01]), (30.0, [0.9, 0.9])].map(orbit);
        let told = |observation, difference| {
            are_of_truncation([15.0, 25.0], observation, difference, &orbits)
        };
        assert!(told(0, 0.2) && !told(0, 0.4));
        assert!(!told(1, 0.2));
    }

    #[test]
    fn gaps_of_a_curve_are_counted_and_the_first_is_named() {
        let told = |branches: [&[usize]; 2]| {
            let branch = |gaps: &[usize]| {
                let mut branch = Branch::swept(4);
                branch.gaps = gaps.to_vec();
                branch
            };
            let orbit = |hz| Orbit::motionless(hz, Outcome::Converged);
            let response = Response {
                orbits: [10.0, 20.0, 30.5, 40.0].map(orbit).to_vec(),
                branches: branches.map(branch).to_vec(),
                ..Response::default()
            };
            gaps(&response).map(|warning| warning.text)
        };
        assert_eq!(told([&[], &[]]), None);
        let one = told([&[], &[2]]).unwrap();
        assert!(one.contains("could not be followed everywhere"), "{one}");
        assert!(
            one.contains("1 gap, the first from 20.0000 to 30.5000 Hz"),
            "{one}"
        );
        let two = told([&[1], &[3]]).unwrap();
        assert!(
            two.contains("2 gaps, the first from 10.0000 to 20.0000 Hz"),
            "{two}"
        );
    }

    #[test]
    fn a_curve_that_was_given_up_says_where() {
        let told = |places: [Option<usize>; 2]| {
            let branch = |place| {
                let mut branch = Branch::swept(1);
                branch.given_up = place;
                branch
            };
            let orbit = |hz| Orbit::motionless(hz, Outcome::Converged);
            let response = Response {
                orbits: [940.83, 951.5].map(orbit).to_vec(),
                branches: places.map(branch).to_vec(),
                ..Response::default()
            };
            given_up(&response).map(|warning| warning.text)
        };
        assert_eq!(told([None, None]), None);
        let both = told([Some(0), Some(1)]).unwrap();
        assert!(both.contains("at 940.8300 Hz and 951.5000 Hz"), "{both}");
    }

    #[test]
    fn frequencies_that_failed_are_counted_and_named() {
        let orbit = |(i, fails): (usize, char)| {
            let outcome = match fails {
                'x' => Outcome::IterationLimit,
                _ => Outcome::Converged,
            };
            Orbit::motionless(10.0 * (i + 1) as f64, outcome)
        };
        let told = |ends: &str| {
            let response = Response {
                orbits: ends.chars().enumerate().map(orbit).collect(),
                ..Response::default()
            };
            places(&response, &FAILED)
        };
        assert_eq!(
            told("xx..x"),
            "at 3 of 5 frequencies (10.0000 to 20.0000 Hz, 50.0000 Hz)"
        );
        let both_ways = Response {
            orbits: [3.0, 2.0, 1.0, 3.0]
                .map(|hz| Orbit::motionless(hz, Outcome::Stagnated))
                .to_vec(),
            ..Response::default()
        };
        assert_eq!(
            places(&both_ways, &FAILED),
            "at 4 of 4 frequencies (1.00000 to 3.00000 Hz)"
        );
        let many = told("x.x.x.x.x.x");
        assert!(many.ends_with("70.0000 Hz, and 2 more)"), "{many}");
    }

    /// A slide that is larger is refused, and needs no warning.
    #[test]
    fn a_slide_is_far_between_one_twentieth_and_one_fifth_of_the_flank() {
        for (slide, is_told) in [(0.049, false), (0.051, true), (0.199, true), (0.201, false)] {
            let told = far_slide("at rest", slide);
            assert_eq!(told.is_some(), is_told, "{slide}");
        }
    }
}
