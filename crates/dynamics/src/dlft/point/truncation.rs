//! Change of a motion by further harmonics and samples, from which its error is estimated
//! ([`crate::dlft::accuracy`]).

use super::{FrequencySolver, Method, Neighbour, Solution, SolverWork, Strategy, resized};
use crate::dlft::balance::{Balance, Evaluation, Jacobian, Setting};
use crate::dlft::dense::exact_correction;
use crate::dlft::newton_krylov::{load_scale, relative_residual, step_length};
use crate::dlft::orbit::{observation_scales, observed_amplitudes_m, orbit};
use crate::dlft::{Orbit, Outcome};
use dovetail_numerics::fourier::Fourier;
use std::sync::Arc;

/// Relative residual of the linear solves of the estimates.
const ESTIMATE_TOLERANCE: f64 = 0.05;

/// An observed displacement that moves by less than this part of the vibration stands still: its
/// error is relative to this part, as the tolerance of the solution is relative to the whole.
const STILL: f64 = 1e-3;

/// Motion whose error is estimated.
pub(crate) struct EstimatedMotion<'s> {
    pub solution: &'s Solution,
    pub frequency_hz: f64,
    /// Its figures.
    pub orbit: Orbit,
    /// Size of the vibration for each observed displacement ([`observation_scales`]).
    scales: Vec<f64>,
}

/// Motion with more harmonics and samples.
pub(crate) struct FinerMotion {
    /// Its U.
    pub u: Vec<f64>,
    /// Change of each observed amplitude, or of the whole vibration, in forces, where nothing is
    /// observed.
    pub changes: Vec<AmplitudeChange>,
    /// Its figures, where they were asked for and it was found.
    pub orbit: Option<Orbit>,
}

/// Change of an amplitude, and the size to which it is relative.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AmplitudeChange {
    pub by: f64,
    pub of: f64,
}

impl AmplitudeChange {
    /// Change of a motion of which nothing is known.
    const UNKNOWN: Self = Self { by: 1.0, of: 1.0 };

    /// Relative size of a change: at most 1, and 1 where a number is not finite.
    pub(crate) fn relative(self, change: f64) -> f64 {
        match change.abs() {
            0.0 => 0.0,
            change if change < self.of => change / self.of,
            _ => 1.0,
        }
    }
}

impl<'s> EstimatedMotion<'s> {
    /// Solution of a frequency, with its figures.
    pub(crate) fn new(solution: &'s Solution, frequency_hz: f64) -> Self {
        let Solution {
            balance,
            u,
            evaluation,
            ..
        } = solution;
        Self {
            solution,
            frequency_hz,
            orbit: orbit(balance, u, evaluation, frequency_hz, Outcome::Converged),
            scales: observation_scales(balance, u, &evaluation.lambda, frequency_hz),
        }
    }

    /// Its change to the motion `v` of `balance`, with the figures of the latter if its evaluation is
    /// given.
    pub(crate) fn change_to(
        &self,
        balance: &Balance,
        v: Vec<f64>,
        evaluation: Option<&Evaluation>,
    ) -> FinerMotion {
        let after = observed_amplitudes_m(balance, &v, self.frequency_hz);
        let before = self.orbit.observed_amplitude.iter().zip(&self.scales);
        let mut changes: Vec<AmplitudeChange> = before
            .zip(&after)
            .map(|((a, scale), b)| AmplitudeChange {
                by: (b - a).abs(),
                of: a.max(*b).max(STILL * scale),
            })
            .collect();
        if changes.is_empty() {
            let u = resized(&self.solution.u, v.len());
            let n = balance.unknowns_per_block();
            let vibration = |v: &[f64]| {
                let mut v = v.to_vec();
                v[..n].fill(0.0);
                step_length(balance, &v)
            };
            let moved: Vec<f64> = u.iter().zip(&v).map(|(u, v)| v - u).collect();
            changes.push(AmplitudeChange {
                by: vibration(&moved),
                of: vibration(&u).max(vibration(&v)),
            });
        }
        let of = |evaluation| {
            orbit(
                balance,
                &v,
                evaluation,
                self.frequency_hz,
                Outcome::Converged,
            )
        };
        FinerMotion {
            orbit: evaluation.map(of),
            u: v,
            changes,
        }
    }

    /// Finer motion of which nothing is known.
    fn unknown(&self, u: Vec<f64>) -> FinerMotion {
        let observed = self.orbit.observed_amplitude.len();
        FinerMotion {
            u,
            changes: vec![AmplitudeChange::UNKNOWN; observed.max(1)],
            orbit: None,
        }
    }
}

/// Solver of a balance, with as many harmonics at twice the samples.
#[derive(Clone)]
pub(crate) struct Judge<'a> {
    pub solver: FrequencySolver<'a>,
    pub twice: Arc<Fourier>,
}

/// Residual of a balance at one U with twice the samples, and its Jacobian there.
struct Linearised {
    samples: usize,
    harmonics: usize,
    evaluation: Evaluation,
    jacobian: Jacobian,
}

impl Linearised {
    /// Linearises a balance at U, `twice` being that with twice the samples, or takes what is known
    /// of one with more harmonics and the same eps, where it has as many samples and nothing excites
    /// its further harmonics.
    fn new(balance: &Balance, twice: &Balance, u: &[f64], finer: Option<Self>) -> Self {
        let Setting {
            fourier, system, ..
        } = &balance.setting;
        let (samples, harmonics) = (fourier.samples(), fourier.harmonics());
        let excited = system.problem.excitations.iter().map(|load| load.harmonic);
        let excites = |further: std::ops::RangeInclusive<usize>| {
            excited.clone().any(|harmonic| further.contains(&harmonic))
        };
        let serves =
            |finer: &Self| finer.samples == samples && !excites(harmonics + 1..=finer.harmonics);
        let (evaluation, jacobian) = match finer.filter(serves) {
            Some(Self {
                evaluation,
                jacobian,
                ..
            }) => (
                evaluation.truncated(fourier.width()),
                jacobian.truncated(fourier.width()),
            ),
            None => (twice.evaluate(u), balance.linearise(&balance.evaluate(u))),
        };
        Self {
            samples,
            harmonics,
            evaluation,
            jacobian,
        }
    }
}

impl Judge<'_> {
    /// Number of harmonics.
    pub(crate) fn harmonics(&self) -> usize {
        self.solver.setting.fourier.harmonics()
    }

    /// Corrects a motion by one Newton step of each of these finer balances, in ascending order of
    /// their harmonics, with twice their samples. The last one comes with its figures.
    ///
    /// Their eps is that of the motion. Where they have as many samples as the finest of them, and
    /// nothing excites its further harmonics, their contact forces and derivatives are those of the
    /// finest up to their own harmonics, and are computed once.
    pub(crate) fn corrections(
        finer: &[&Self],
        motion: &EstimatedMotion<'_>,
        work: &mut SolverWork,
    ) -> Vec<FinerMotion> {
        let mut linearised = None;
        let ascending = finer.iter().enumerate();
        let mut corrections: Vec<FinerMotion> = ascending
            .rev()
            .map(|(i, judge)| {
                let is_last = i + 1 == finer.len();
                let work = work.estimate_work(i);
                judge.correction(motion, is_last, work, &mut linearised)
            })
            .collect();
        corrections.reverse();
        corrections
    }

    /// Corrects a motion with fewer harmonics by one Newton step. `linearised` is that of a balance
    /// with more harmonics, if any, and becomes the one that was used.
    fn correction(
        &self,
        motion: &EstimatedMotion<'_>,
        with_figures: bool,
        work: &mut SolverWork,
        linearised: &mut Option<Linearised>,
    ) -> FinerMotion {
        let Solution { balance, u, .. } = motion.solution;
        let (eps, mean) = (&balance.setting.eps, balance.mean());
        let u = resized(u, self.solver.unknowns());
        let balances = [&self.solver.setting.fourier, &self.twice].map(|fourier| {
            let solver = self.solver.with_resolution(fourier, eps);
            solver.balance(motion.frequency_hz, mean)
        });
        let [Some(balance), Some(twice)] = balances else {
            return motion.unknown(u);
        };
        let dx = match self.solver.stepping() {
            Method::Exact => exact_correction(&twice, &u, self.solver.newton),
            Method::Krylov(_) | Method::Dogleg => {
                let known = linearised.take();
                let known = linearised.insert(Linearised::new(&balance, &twice, &u, known));
                self.solver.krylov_correction(&balance, known, work)
            }
        };
        work.newton_iterations += 1;
        let Some(dx) = dx else {
            return motion.unknown(u);
        };
        let corrected: Vec<f64> = u.iter().zip(&dx).map(|(u, d)| u + d).collect();
        let evaluation = with_figures.then(|| twice.evaluate(&corrected));
        motion.change_to(&twice, corrected, evaluation.as_ref())
    }
}

impl FrequencySolver<'_> {
    /// Solves this balance from the motion of one with fewer harmonics; `None` where that does not
    /// lead to a motion.
    pub(crate) fn finer_solution(
        &self,
        coarse: &Solution,
        frequency_hz: f64,
        work: &mut SolverWork,
    ) -> Option<Solution> {
        let u = resized(&coarse.u, self.unknowns());
        let start = Neighbour::following(None, frequency_hz, u, coarse.balance.mean());
        let strategies = [
            Strategy::FromNeighbour(Method::Exact),
            Strategy::InSharpness,
        ];
        // Rounded laws take many iterations.
        let is_small = self.unknowns() <= super::MOST_EXACT_UNKNOWNS;
        let strategies = &strategies[..if is_small { 2 } else { 1 }];
        let solved = self.solve_by(strategies, frequency_hz, Some(&start), work);
        solved.is_converged().then_some(solved)
    }

    /// Newton's correction where a balance is linearised, solved for loosely; `None` where it is not
    /// found.
    fn krylov_correction(
        &self,
        balance: &Balance,
        linearised: &Linearised,
        work: &mut SolverWork,
    ) -> Option<Vec<f64>> {
        let f = &linearised.evaluation.residual;
        let (n, tolerance) = (balance.unknowns_per_block(), self.newton.tolerance);
        let scale = load_scale(balance, tolerance);
        let mut dx = vec![0.0; f.len()];
        if relative_residual(f, n, scale) <= tolerance {
            return Some(dx);
        }
        let kept = &mut work.preconditioner;
        let linear = kept.linear_system(balance, &linearised.jacobian);
        let right: Vec<f64> = f.iter().map(|f| -f).collect();
        let within = ESTIMATE_TOLERANCE;
        let end = kept.solve(balance, &linear, None, &right, scale, within, &mut dx);
        work.krylov_iterations += end.iterations;
        dx.iter().all(|d| d.is_finite()).then_some(dx)
    }
}
