//! Change of a motion by further harmonics, from which its error is estimated
//! ([`crate::dlft::accuracy`]).

use super::{FrequencySolver, Method, Neighbour, Solution, SolverWork, Strategy, resized};
use crate::dlft::balance::{Balance, Evaluation, Jacobian, Setting};
use crate::dlft::dense::exact_correction;
use crate::dlft::newton_krylov::{load_scale, relative_residual, step_length};
use crate::dlft::orbit::observed_amplitudes_m;

/// Relative residual of the linear solves of the estimates.
const ESTIMATE_TOLERANCE: f64 = 0.05;

/// Distance of the motion of a finer balance from that of a coarser one.
#[non_exhaustive]
pub(crate) struct HarmonicTruncation {
    /// Motion of the finer balance.
    pub u: Vec<f64>,
    /// Change of each observed amplitude relative to the larger of both, or of the whole vibration,
    /// in forces, where nothing is observed. 1 where no motion of the finer balance is found.
    pub changes: Vec<f64>,
}

impl HarmonicTruncation {
    /// Change from `u` to `v`, both of `balance`.
    fn difference(balance: &Balance, u: &[f64], v: Vec<f64>, frequency_hz: f64) -> Self {
        let [before, after] = [u, &v].map(|u| observed_amplitudes_m(balance, u, frequency_hz));
        let mut changes: Vec<f64> = before
            .iter()
            .zip(&after)
            .map(|(a, b)| relative(b - a, a.max(*b)))
            .collect();
        if changes.is_empty() {
            let n = balance.unknowns_per_block();
            let vibration = |v: &[f64]| {
                let mut v = v.to_vec();
                v[..n].fill(0.0);
                step_length(balance, &v)
            };
            let moved: Vec<f64> = u.iter().zip(&v).map(|(u, v)| v - u).collect();
            let larger = vibration(u).max(vibration(&v));
            changes = vec![relative(vibration(&moved), larger)];
        }
        Self { u: v, changes }
    }

    /// Truncation of 1 everywhere, where nothing is known of the finer balance.
    fn unknown(u: Vec<f64>, balance: &Balance) -> Self {
        let observed = balance.setting.system.problem.reduced.observations.len();
        Self {
            u,
            changes: vec![1.0; observed.max(1)],
        }
    }
}

/// Evaluation of a balance at one U, and its Jacobian there.
struct Linearised {
    samples: usize,
    harmonics: usize,
    evaluation: Evaluation,
    jacobian: Jacobian,
}

impl Linearised {
    /// Linearises a balance at U, or takes what is known of one with more harmonics and the same
    /// eps, where it has as many samples and nothing excites its further harmonics.
    fn new(balance: &Balance, u: &[f64], finer: Option<Self>) -> Self {
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
            None => {
                let evaluation = balance.evaluate(u);
                let jacobian = balance.linearise(&evaluation);
                (evaluation, jacobian)
            }
        };
        Self {
            samples,
            harmonics,
            evaluation,
            jacobian,
        }
    }
}

/// Size of a change relative to `of`: at most 1, and 1 where a number is not finite.
fn relative(change: f64, of: f64) -> f64 {
    match change.abs() {
        0.0 => 0.0,
        change if change < of => change / of,
        _ => 1.0,
    }
}

impl FrequencySolver<'_> {
    /// Corrects a solution by one Newton step of each of these finer balances, in ascending order of
    /// their harmonics.
    ///
    /// Their eps is that of the solution. Where they have as many samples as the finest of them, and
    /// nothing excites its further harmonics, their contact forces and derivatives are those of the
    /// finest up to their own harmonics, and are computed once.
    pub(crate) fn truncations(
        finer: &[&Self],
        coarse: &Solution,
        frequency_hz: f64,
        work: &mut SolverWork,
    ) -> Vec<HarmonicTruncation> {
        let mut linearised = None;
        let ascending = finer.iter().enumerate();
        let mut truncations: Vec<HarmonicTruncation> = ascending
            .rev()
            .map(|(i, finer)| {
                let work = work.estimate_work(i);
                finer.estimate_truncation(coarse, frequency_hz, work, &mut linearised)
            })
            .collect();
        truncations.reverse();
        truncations
    }

    /// Like [`FrequencySolver::truncations`], but solves this balance instead of correcting
    /// once.
    pub(crate) fn truncation_by_finer_solution(
        &self,
        coarse: &Solution,
        frequency_hz: f64,
        work: &mut SolverWork,
    ) -> HarmonicTruncation {
        let u = resized(&coarse.u, self.unknowns());
        let start = Neighbour::following(None, frequency_hz, u.clone(), coarse.balance.mean());
        let strategies = [
            Strategy::FromNeighbour(Method::Exact),
            Strategy::InSharpness,
        ];
        let solved = self.solve_by(&strategies, frequency_hz, Some(&start), work);
        if !solved.is_converged() {
            return self.estimate_truncation(coarse, frequency_hz, work, &mut None);
        }
        HarmonicTruncation::difference(&solved.balance, &u, solved.u, frequency_hz)
    }

    /// Corrects a solution with fewer harmonics by one Newton step of this balance. `linearised` is
    /// that of a balance with more harmonics, if any, and becomes the one that was used.
    fn estimate_truncation(
        &self,
        coarse: &Solution,
        frequency_hz: f64,
        work: &mut SolverWork,
        linearised: &mut Option<Linearised>,
    ) -> HarmonicTruncation {
        let u = resized(&coarse.u, self.unknowns());
        let with_its_eps = self.with_resolution(&self.setting.fourier, &coarse.balance.setting.eps);
        let Some(balance) = with_its_eps.balance(frequency_hz, coarse.balance.mean()) else {
            return HarmonicTruncation::unknown(u, &coarse.balance);
        };
        let dx = match self.stepping() {
            Method::Exact => exact_correction(&balance, &u, self.newton),
            Method::Krylov(_) | Method::Dogleg => {
                let known = linearised.take();
                let known = linearised.insert(Linearised::new(&balance, &u, known));
                self.krylov_correction(&balance, known, work)
            }
        };
        work.newton_iterations += 1;
        let Some(dx) = dx else {
            return HarmonicTruncation::unknown(u, &balance);
        };
        let corrected: Vec<f64> = u.iter().zip(&dx).map(|(u, d)| u + d).collect();
        HarmonicTruncation::difference(&balance, &u, corrected, frequency_hz)
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
