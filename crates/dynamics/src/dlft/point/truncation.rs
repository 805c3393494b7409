//! Change of a motion by further harmonics and samples, from which its error is estimated
//! ([`crate::dlft::accuracy`]).

use super::{FrequencySolver, Method, Neighbour, Solution, SolverWork, Strategy, resized};
use crate::dlft::balance::{Balance, Evaluation, Jacobian};
use crate::dlft::border::Equations;
use crate::dlft::dense::exact_correction;
use crate::dlft::measure::{load_scale, relative_residual, step_length};
use crate::dlft::orbit::{observation_scales, observed_amplitudes_m, orbit, pair_cycles};
use crate::dlft::{Orbit, Outcome, PairCycle};
use dovetail_numerics::fourier::Fourier;
use std::sync::Arc;

/// Most unknowns of a balance that is solved, or corrected by a factor of its Jacobian, to judge another
/// one.
pub(crate) const MOST_CHECKED_UNKNOWNS: usize = 800;

/// Most iterations of a balance of more than [`super::MOST_EXACT_UNKNOWNS`] that is solved to judge
/// another one.
const MOST_CHECK_ITERATIONS: usize = 12;

/// Relative residual of the linear solves of the estimates.
const ESTIMATE_TOLERANCE: f64 = 0.01;

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
    /// Its figures, if it was found.
    pub orbit: Option<Orbit>,
    /// Cycles of the pairs of the coarser motion with twice the samples, where the figures do not show
    /// the error of the samples.
    pub sampled: Option<Vec<PairCycle>>,
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

    /// Evaluation at its U, with zeros for further harmonics, by a balance that has these. That of the
    /// solution serves where both have the same samples and nothing excites further harmonics.
    fn evaluation_by(&self, balance: &Balance, u: &[f64]) -> Evaluation {
        let Solution {
            balance: own,
            evaluation,
            ..
        } = self.solution;
        let (own, finer) = (&own.setting.fourier, &balance.setting.fourier);
        let loads = &balance.setting.system.problem.excitations;
        let further = own.harmonics() + 1..=finer.harmonics();
        let is_excited = loads.iter().any(|load| further.contains(&load.harmonic));
        if own.samples() != finer.samples() || is_excited {
            return balance.evaluate(u);
        }
        evaluation.widened(u.len())
    }

    /// Its change to the motion `v` of `balance`.
    pub(crate) fn change_to(&self, balance: &Balance, v: Vec<f64>) -> FinerMotion {
        let evaluation = balance.evaluate(&v);
        self.change_to_evaluated(balance, v, &evaluation)
    }

    /// Its change to the motion `v` of `balance`, evaluated there.
    pub(crate) fn change_to_evaluated(
        &self,
        balance: &Balance,
        v: Vec<f64>,
        evaluation: &Evaluation,
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
        let orbit = orbit(
            balance,
            &v,
            evaluation,
            self.frequency_hz,
            Outcome::Converged,
        );
        FinerMotion {
            orbit: Some(orbit),
            sampled: None,
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
            sampled: None,
        }
    }
}

/// Solver of a balance, with as many harmonics at twice the samples.
pub(crate) struct Judge<'a> {
    pub solver: FrequencySolver<'a>,
    pub twice: Arc<Fourier>,
}

impl Judge<'_> {
    /// Number of harmonics.
    pub(crate) fn harmonics(&self) -> usize {
        self.solver.setting.fourier.harmonics()
    }

    /// Corrects a motion with fewer harmonics by one Newton step of this balance, whose residual has
    /// twice the samples. Its eps is that of the motion.
    pub(crate) fn correction(
        &self,
        motion: &EstimatedMotion<'_>,
        work: &mut SolverWork,
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
        work.count_iterations(1);
        let corrected =
            |dx: Vec<f64>| -> Vec<f64> { u.iter().zip(&dx).map(|(u, d)| u + d).collect() };
        if self.solver.unknowns() <= MOST_CHECKED_UNKNOWNS {
            return match exact_correction(&twice, &u, self.solver.newton) {
                Some(dx) => motion.change_to(&twice, corrected(dx)),
                None => motion.unknown(u),
            };
        }
        let near = &motion.solution.evaluation;
        let sampled = twice.evaluate_near(&u, near);
        let jacobian = balance.linearise(&motion.evaluation_by(&balance, &u));
        let correction = self
            .solver
            .krylov_correction(&balance, jacobian, &sampled, work);
        let Some(dx) = correction else {
            return motion.unknown(u);
        };
        // The samples are doubled at the motion itself, and the harmonics by the correction.
        let cycles = pair_cycles(&twice, &u, &sampled, motion.frequency_hz);
        let v = corrected(dx);
        let evaluation = balance.evaluate_near(&v, near);
        let mut finer = motion.change_to_evaluated(&balance, v, &evaluation);
        finer.sampled = Some(cycles);
        finer
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
        if self.unknowns() <= super::MOST_EXACT_UNKNOWNS {
            let solved = self.solve_by(&strategies, frequency_hz, Some(&start), work);
            return solved.is_converged().then_some(solved);
        }
        // Rounded laws take many iterations, as does a motion far from the start.
        let mut quick = self.clone();
        quick.newton.max_iterations = MOST_CHECK_ITERATIONS;
        let solved = quick.solve_by(&strategies[..1], frequency_hz, Some(&start), work);
        solved.is_converged().then_some(solved)
    }

    /// Newton's correction by the residual of an evaluation, solved for loosely; `None` where it is not
    /// found.
    fn krylov_correction(
        &self,
        balance: &Balance,
        jacobian: Jacobian,
        evaluation: &Evaluation,
        work: &mut SolverWork,
    ) -> Option<Vec<f64>> {
        let f = &evaluation.residual;
        let (n, tolerance) = (balance.unknowns_per_block(), self.newton.tolerance);
        let scale = load_scale(balance, tolerance);
        let mut dx = vec![0.0; f.len()];
        if relative_residual(f, n, scale) <= tolerance {
            return Some(dx);
        }
        let kept = &mut work.preconditioner;
        let linear = kept.linear_system(balance, jacobian);
        let right: Vec<f64> = f.iter().map(|f| -f).collect();
        let within = ESTIMATE_TOLERANCE;
        let equations = Equations {
            border: None,
            right: &right,
        };
        let end = kept.solve(balance, &linear, equations, (scale, within), &mut dx);
        work.krylov_iterations += end.iterations;
        dx.iter().all(|d| d.is_finite()).then_some(dx)
    }
}
