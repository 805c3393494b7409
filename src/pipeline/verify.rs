//! Compares harmonic balance with integration in time at a few frequencies: `dovetail verify`.

use super::error::RunError;
use super::progress::Progress;
use super::reduced::Reduced;
use super::{Context, findings, solve, summary};
use crate::export::manifest::{self, Summary};
use crate::stage::Stage;
use dovetail_solver::description::{ResponseSpec, Scene, Subject};
use dovetail_solver::dlft::{Orbit, Response, StaticState};
use dovetail_solver::integration::compare::{Comparison, Start, compare};
use dovetail_solver::integration::steady::{MOST_STEPS_IN_ALL, Until};
use dovetail_solver::reduction::StuckModes;
use dovetail_solver::reduction::damping::{Rayleigh, rayleigh};
use dovetail_solver::results::quantities::peak;

/// Most frequencies of the response in which the peak is looked for.
const MOST_POINTS: usize = 81;
/// A flank of the peak is the first frequency beside it below this fraction of its amplitude.
const FLANK: f64 = 0.75;

/// What is integrated, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct Verification {
    /// Empty: the peak of a response over the scene's range, and its two flanks.
    pub frequencies_hz: Vec<f64>,
    pub steps_per_period: usize,
    /// Exactly so many periods; `None`: until steady, at most `most_periods`.
    pub periods: Option<usize>,
    pub most_periods: usize,
    /// What may be left of the transient, relative.
    pub steady: f64,
    /// Start from the static state instead of the motion of harmonic balance.
    pub from_rest: bool,
    /// Largest relative difference that passes.
    pub tolerance: f64,
}

impl Verification {
    /// How many periods are integrated, or the most where they end with the transient.
    fn most_periods_asked(&self) -> usize {
        self.periods.unwrap_or(self.most_periods)
    }
}

/// Both methods beside each other.
#[derive(Debug)]
pub struct Verified {
    pub comparisons: Vec<Comparison>,
    pub summary: Summary,
    /// [`RunError::NotSteady`] or [`RunError::Disagreement`], where they are not alike.
    pub verdict: Result<(), RunError>,
}

impl Verified {
    /// For a reader.
    pub fn table(&self) -> String {
        self.comparisons.iter().map(table).collect()
    }
}

/// Integrates the reduced model in time at each frequency and compares.
///
/// # Errors
/// [`RunError::TooManySteps`]; those of the static state and the reduction; [`RunError::NotConverged`]
/// where harmonic balance has no
/// motion to compare.
pub fn verify(
    scene: &Scene,
    context: &Context,
    asked: &Verification,
    progress: &Progress,
) -> Result<Verified, RunError> {
    let (periods, steps) = (asked.most_periods_asked(), asked.steps_per_period);
    if periods.saturating_mul(steps) > MOST_STEPS_IN_ALL {
        return Err(RunError::TooManySteps {
            periods,
            steps,
            most: MOST_STEPS_IN_ALL,
        });
    }
    let scene = &with_modes_of_harmonics(scene);
    let reduced = Reduced::of(scene, context, progress)?;
    let problem = reduced.problem();
    if problem.laws.is_empty() {
        let why = "the response is linear and in closed form, there is nothing to compare";
        return Err(RunError::AllBonded { why });
    }
    let state = solve::statics(scene, &reduced, progress)?;
    solve::usable(&reduced, &state)?;
    let damping = rayleigh(&scene.damping, reduced.linear_omega2(&state))?;
    let (response, chosen) = orbits(scene, &reduced, damping, &state, asked, progress)?;
    let failed = chosen
        .iter()
        .filter(|i| !response.orbits[**i].outcome.has_motion());
    if let (unconverged @ 1.., points) = (failed.count(), chosen.len()) {
        return Err(RunError::NotConverged {
            unconverged,
            points,
        });
    }
    let comparisons = {
        let _stage = progress.stage(Stage::TimeIntegration);
        let steps = progress.steps(chosen.len(), "frequencies");
        let until = Until {
            most_periods: periods,
            tolerance: if asked.periods.is_some() {
                0.0
            } else {
                asked.steady
            },
        };
        let one = |i: &usize| {
            let start = match asked.from_rest {
                true => Start::Rest(&state),
                false => Start::Orbit,
            };
            let done = compare(
                problem,
                damping,
                &response.orbits[*i],
                start,
                asked.steps_per_period,
                until,
                response.slip_threshold_m,
            );
            steps.step();
            done
        };
        use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
        chosen
            .par_iter()
            .map(one)
            .collect::<Result<Vec<Comparison>, _>>()?
    };
    let mut summary = summary::of_reduced(scene, context, &reduced);
    summary.static_state = Some(manifest::static_summary(&reduced.pairs, &state));
    summary.verification = Some(manifest::verification_summary(
        &comparisons,
        asked.steps_per_period,
        asked.tolerance,
    ));
    summary::take_down(progress, &mut summary);
    Ok(Verified {
        verdict: judge(&comparisons, asked),
        comparisons,
        summary,
    })
}

/// A motion in time has all harmonics: the scene with no fewer modes than they ask for. A folder has the modes that it has.
fn with_modes_of_harmonics(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    let asked = &mut scene.response.stuck_modes;
    let least = StuckModes::OF_HARMONICS;
    *asked = match (*asked, &scene.subject) {
        (None, Subject::ReducedModel(_)) => None,
        (asked, _) => Some(asked.map_or(least, |modes| modes.max(least))),
    };
    scene
}

/// A response, and the positions in it of the orbits to compare.
fn orbits(
    scene: &Scene,
    reduced: &Reduced,
    damping: Rayleigh,
    state: &StaticState,
    asked: &Verification,
    progress: &Progress,
) -> Result<(Response, Vec<usize>), RunError> {
    let mut frequencies_hz = asked.frequencies_hz.clone();
    frequencies_hz.sort_by(f64::total_cmp);
    frequencies_hz.dedup();
    let given = !frequencies_hz.is_empty();
    if !given {
        let mut spec = scene.response.clone();
        spec.points = spec.points.min(MOST_POINTS);
        frequencies_hz = solve::frequencies_hz(&spec, reduced.linear_omega2(state))?;
    }
    // Those that are compared are asked for by the caller, or found on the grid.
    let spec = ResponseSpec {
        most_added_points: 0,
        ..scene.response.clone()
    };
    let responses = solve::Responses {
        spec: &spec,
        reduced,
        damping,
        state,
        frequencies_hz: &frequencies_hz,
        progress,
    };
    let (response, slide) = responses.response(None)?;
    for warning in findings::of_motion(reduced, state, &response, [0.0, slide]) {
        progress.tell(|o| o.warning(&warning));
    }
    let chosen = if given {
        (0..response.orbits.len()).collect()
    } else {
        peak_and_flanks(&response)
    };
    Ok((response, chosen))
}

/// Peak, and the first frequency with a motion on each side below [`FLANK`] of it; all where nothing is
/// observed or has a motion.
fn peak_and_flanks(response: &Response) -> Vec<usize> {
    let Some(top) = peak(response, 0) else {
        return (0..response.orbits.len()).collect();
    };
    let below = |i: &usize| {
        let orbit: &Orbit = &response.orbits[*i];
        orbit.outcome.has_motion() && orbit.observed_amplitude_m[0] < FLANK * top.amplitude_m
    };
    let left = (0..top.index).rev().find(below);
    let right = (top.index + 1..response.orbits.len()).find(below);
    left.into_iter().chain([top.index]).chain(right).collect()
}

/// Both methods side by side at one frequency.
fn table(comparison: &Comparison) -> String {
    let (b, i) = (&comparison.balance, &comparison.integration);
    let steady = match comparison.steady {
        true => "steady",
        false => "not steady",
    };
    let mut lines = vec![
        format!(
            "{:.4} Hz, {} harmonics; {} periods, {steady}, {:.1e} of the transient left",
            comparison.frequency_hz,
            comparison.harmonics,
            comparison.periods,
            comparison.transient_left
        ),
        format!(
            "    {:<28} {:>14} {:>14} {:>11}",
            "", "balance", "integration", "difference"
        ),
    ];
    let [amplitude, first, contact, input] = comparison.differences();
    let line = |name: &str, b: f64, i: f64, difference: Option<f64>| {
        let percent = difference.map_or(String::new(), |d| format!("{:+.4} %", 100.0 * d));
        format!("    {name:<28} {b:>14.6e} {i:>14.6e} {percent:>11}")
    };
    if let (Some(b), Some(i)) = (b.amplitude_m, i.amplitude_m) {
        lines.push(line("amplitude, m", b, i, amplitude));
    }
    if let (Some(b), Some(i)) = (b.first_harmonic_m, i.first_harmonic_m) {
        lines.push(line("harmonic 1, m", b, i, first));
    }
    let count = |name: &str, b: usize, i: usize| format!("    {name:<28} {b:>14} {i:>14}");
    lines.extend([
        line(
            "contact work, J",
            b.contact_work_j,
            i.contact_work_j,
            contact,
        ),
        line("damping work, J", b.viscous_work_j, i.viscous_work_j, None),
        line("input work, J", b.input_work_j, i.input_work_j, input),
        count("pairs that slip", b.pairs.slipping, i.pairs.slipping),
        count("pairs that open", b.pairs.opening, i.pairs.opening),
    ]);
    if comparison.retention_n > 0.0 {
        lines.push(format!(
            "    what friction does not hold is held in both by a steady {:.3} N",
            comparison.retention_n
        ));
    }
    lines.join("\n") + "\n"
}

fn judge(comparisons: &[Comparison], asked: &Verification) -> Result<(), RunError> {
    if asked.periods.is_none()
        && let Some(moving) = comparisons.iter().find(|c| !c.steady)
    {
        return Err(RunError::NotSteady {
            frequency_hz: moving.frequency_hz,
            periods: moving.periods,
            left: moving.transient_left,
        });
    }
    let worst = comparisons
        .iter()
        .max_by(|a, b| a.worst().total_cmp(&b.worst()));
    match worst {
        Some(worst) if worst.worst() > asked.tolerance => Err(RunError::Disagreement {
            frequency_hz: worst.frequency_hz,
            percent: 100.0 * worst.worst(),
            tolerance_percent: 100.0 * asked.tolerance,
        }),
        _ => Ok(()),
    }
}
