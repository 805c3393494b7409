//! Frequency response: the static state, then one harmonic balance per frequency.
//!
//! The frequencies are split in two halves, each swept from its end of the range towards the middle:
//! two cores share the work, and the answer does not depend on how many there are.

use super::accuracy::{Refinement, Resolved, levels};
use super::aft::Periods;
use super::balance::Setting;
use super::orbit::{orbit, stuck_point};
use super::penalty::Penalty;
use super::point::{Neighbour, Solution, Work};
use super::retention::Mean;
use super::stuck_curve::stuck_curve;
use super::{Orbit, Outcome, Response, StaticState};
use crate::contact::dynamic_stiffness::ContactSystem;
use crate::contact::inexact::InexactModel;
use crate::dlft::settings::{EpsChoice, Resolution, Solver};
use crate::reduction::RelativeModel;
use crate::reduction::damping::Rayleigh;
use dovetail_numerics::newton::NewtonOptions;
use std::f64::consts::TAU;
use std::sync::OnceLock;

/// Default slip threshold, as a fraction of the largest static slip.
const SLIP_THRESHOLD: f64 = 1e-5;

/// How the response is computed.
#[derive(Debug, Clone)]
pub struct SweepSettings {
    /// Where the response is computed, rising.
    pub frequencies_hz: Vec<f64>,
    /// Harmonics and samples, or the accuracy asked for.
    pub resolution: Resolution,
    /// The parameter eps of DLFT.
    pub eps: Penalty,
    /// When the iterations of a frequency end.
    pub newton: NewtonOptions,
    /// How long pairs are marched.
    pub periods: Periods,
    /// What solves the balance of a frequency.
    pub solver: Solver,
    /// m; `None`: 1e-5 of the largest static slip.
    pub slip_threshold_m: Option<f64>,
}

impl SweepSettings {
    /// With what a scene has where it says nothing: the parameter eps of the dynamic stiffness, Newton-Krylov to a
    /// relative residual of 1e-8, pairs marched until they are periodic.
    pub fn new(frequencies_hz: Vec<f64>, resolution: Resolution) -> Self {
        Self {
            frequencies_hz,
            resolution,
            eps: Penalty::new(EpsChoice::Dynamic),
            newton: NewtonOptions {
                tolerance: 1e-8,
                max_iterations: 60,
            },
            periods: Periods::UntilPeriodic,
            solver: Solver::NewtonKrylov,
            slip_threshold_m: None,
        }
    }
}

/// Response at every frequency. `progress` is called once per finished point, from any thread.
pub fn sweep(
    model: &RelativeModel,
    damping: Rayleigh,
    static_state: &StaticState,
    settings: &SweepSettings,
    progress: &(dyn Fn(&Orbit) + Sync),
) -> Response {
    let system = ContactSystem::new(model, damping);
    let levels = levels(settings.resolution, model.highest_excited(), |harmonics| {
        settings
            .eps
            .of(&system, middle(&settings.frequencies_hz), harmonics)
    });
    let retention = OnceLock::new();
    let largest_slip = static_state
        .x
        .chunks_exact(3)
        .fold(0.0_f64, |m, x| m.max(x[1].hypot(x[2])));
    let slip_threshold_m = settings
        .slip_threshold_m
        .unwrap_or(SLIP_THRESHOLD * largest_slip);
    let inexact = match settings.solver {
        Solver::NewtonKrylov => InexactModel::new(model),
        Solver::Powell => InexactModel::unprepared(model),
    };
    let setting = Setting {
        system: &system,
        inexact: &inexact,
        fourier: &levels[0].fourier,
        eps: &levels[0].eps,
        x_static: &static_state.x,
        static_mean: match static_state.retention_n {
            None => Mean::Free,
            Some(_) => Mean::Retained,
        },
        pressing_n: static_state.lambda.iter().step_by(3).map(|n| -n).sum(),
        periods: settings.periods,
        slip_threshold_m,
    };
    let run = Run {
        refinement: Refinement::new(
            setting,
            &levels,
            settings.resolution,
            settings.newton,
            settings.solver,
            &retention,
        ),
    };
    let middle = settings.frequencies_hz.len().div_ceil(2);
    let (rising, falling) = settings.frequencies_hz.split_at(middle);
    let (mut orbits, upper) = rayon::join(
        || run.segment(rising.iter().copied(), progress),
        || run.segment(falling.iter().rev().copied(), progress),
    );
    orbits.extend(upper.into_iter().rev());
    run.retry_from_other_side(&mut orbits, middle);
    let harmonics = levels[0].fourier.harmonics();
    let frequencies_hz = &settings.frequencies_hz;
    let stuck = frequencies_hz.iter();
    Response {
        stuck: stuck.map(|&f| stuck_point(&system, harmonics, f)).collect(),
        stuck_curve: stuck_curve(&system, harmonics, frequencies_hz),
        orbits,
        slip_threshold_m,
    }
}

/// Of the ends of the range, rad/s: one frequency for all of a curve, so that eps is the same along it.
fn middle(frequencies_hz: &[f64]) -> f64 {
    let ends = frequencies_hz.first().zip(frequencies_hz.last());
    ends.map_or(0.0, |(from, to)| TAU * 0.5 * (from + to))
}

/// Where the sweep stands: the last converged frequency, and the level to begin the next on.
#[derive(Default)]
struct Last {
    neighbour: Option<Neighbour>,
    level: usize,
}

struct Run<'a> {
    refinement: Refinement<'a>,
}

impl Run<'_> {
    fn segment(
        &self,
        frequencies_hz: impl Iterator<Item = f64>,
        progress: &(dyn Fn(&Orbit) + Sync),
    ) -> Vec<Orbit> {
        let mut work = Work::default();
        let mut last = Last::default();
        frequencies_hz
            .map(|frequency_hz| {
                let orbit = self.point(frequency_hz, &mut last, &mut work);
                progress(&orbit);
                orbit
            })
            .collect()
    }

    fn point(&self, frequency_hz: f64, last: &mut Last, work: &mut Work) -> Orbit {
        work.start_counting();
        let resolved = self
            .refinement
            .resolve(frequency_hz, last.level, work, |level, work| {
                level.solve(frequency_hz, last.neighbour.as_ref(), work)
            });
        let mean = resolved.solved.balance.mean();
        let u = resolved.solved.u.clone();
        let level = resolved.next_level;
        let orbit = self.orbit_of(resolved, frequency_hz, work);
        if orbit.outcome.is_converged() {
            let neighbour = Neighbour::after(last.neighbour.as_ref(), frequency_hz, u, mean);
            *last = Last {
                neighbour: Some(neighbour),
                level,
            };
        }
        orbit
    }

    /// Each frequency that did not converge once more, from the neighbour on the side its half did not come from:
    /// the rising half downwards, then the falling half (from `middle`) upwards.
    fn retry_from_other_side(&self, orbits: &mut [Orbit], middle: usize) {
        let mut work = Work::default();
        let downwards = (0..middle).rev().map(|i| (i, i + 1));
        let upwards = (middle..orbits.len()).map(|i| (i, i.wrapping_sub(1)));
        for (i, beside) in downwards.chain(upwards) {
            let Some(neighbour) = orbits.get(beside) else {
                continue;
            };
            let failed =
                !orbits[i].outcome.is_converged() && orbits[i].outcome != Outcome::LeavesSlot;
            if !failed || !neighbour.outcome.is_converged() {
                continue;
            }
            let mean = if neighbour.retention_n > 0.0 {
                Mean::Retained
            } else {
                Mean::Free
            };
            let u = neighbour.x.clone();
            let neighbour = Neighbour::after(None, neighbour.frequency_hz, u, mean);
            let frequency_hz = orbits[i].frequency_hz;
            work.start_counting();
            let resolved = self
                .refinement
                .resolve(frequency_hz, 0, &mut work, |level, work| {
                    level.solve_from(frequency_hz, &neighbour, work)
                });
            let mut again = self.orbit_of(resolved, frequency_hz, &work);
            again.newton_iterations += orbits[i].newton_iterations;
            again.krylov_iterations += orbits[i].krylov_iterations;
            if again.outcome.is_converged() {
                orbits[i] = again;
            } else {
                orbits[i].newton_iterations = again.newton_iterations;
                orbits[i].krylov_iterations = again.krylov_iterations;
            }
        }
    }

    fn orbit_of(&self, resolved: Resolved<'_>, frequency_hz: f64, work: &Work) -> Orbit {
        let Solution {
            balance,
            u,
            evaluation,
            end,
        } = resolved.solved;
        let mut outcome = Outcome::from(end.status);
        if outcome.is_converged() && evaluation.ends.iter().any(|e| !e.periodic) {
            outcome = Outcome::NotPeriodic;
        } else if !outcome.is_converged() && self.refinement.lowest().excitation_exceeds_preload() {
            outcome = Outcome::LeavesSlot;
        } else if outcome.is_converged() && !resolved.is_accurate {
            outcome = Outcome::AccuracyNotReached;
        }
        let mut orbit = orbit(&balance, &u, &evaluation, frequency_hz, outcome);
        orbit.residual = end.measure;
        orbit.estimated_error = resolved.estimated_error;
        orbit.newton_iterations = work.newton_iterations;
        orbit.krylov_iterations = work.krylov_iterations;
        orbit
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::settings::EpsChoice;
    use crate::dlft::static_state::static_state;
    use crate::reduction::PairLaw;
    use crate::reduction::superelement::read;

    /// Static state and a sweep to where all pairs slip, with the harmonics that an accuracy needs.
    fn computed(threads: usize) -> (StaticState, Response) {
        let law = PairLaw {
            friction: 0.3,
            gap_m: 0.0,
        };
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/dovetail72");
        let newton = NewtonOptions {
            tolerance: 1e-8,
            max_iterations: 60,
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            let model = read(folder.as_ref(), law, 3.0).unwrap().relative;
            let first_hz = model.omega2[0].sqrt() / TAU;
            let damping = Rayleigh {
                stiffness_s: 2.0 * 0.001 / model.omega2[0].sqrt(),
                mass_per_s: 0.0,
            };
            let settings = SweepSettings {
                frequencies_hz: [0.985, 0.99, 0.995, 1.0].map(|r| r * first_hz).to_vec(),
                resolution: Resolution::Accuracy(0.03),
                eps: Penalty::new(EpsChoice::Dynamic),
                newton,
                periods: Periods::UntilPeriodic,
                solver: Solver::NewtonKrylov,
                slip_threshold_m: None,
            };
            let state = static_state(&model, 10, newton);
            let response = sweep(&model, damping, &state, &settings, &|_| ());
            (state, response)
        })
    }

    #[test]
    fn static_state_and_response_do_not_depend_on_the_number_of_threads() {
        let [one, three] = [1, 3].map(computed);
        assert!(one.0.outcome.is_converged());
        let mut converged = one.1.orbits.iter().map(|o| o.outcome.is_converged());
        assert!(converged.all(|c| c));
        let slipping = |o: &Orbit| o.cycles.iter().filter(|c| c.slips).count();
        assert!(one.1.orbits.iter().any(|o| slipping(o) == o.cycles.len()));
        // The texts of numbers that differ in a bit differ, those of zeros by their sign.
        assert!(format!("{one:?}") == format!("{three:?}"));
    }
}
