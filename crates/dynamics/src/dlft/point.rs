//! Solution of one frequency by strategies, tried from the cheapest to the dearest.
//!
//! Where frozen contacts bear the vibration, it is known at once. Elsewhere a frequency is started
//! from its neighbour and from the static state, by Newton-GMRES with accurate and then with loose
//! linear solves. From the static state the excited harmonics come first, and their motion is the
//! start for all. If that fails, it is approached by smaller steps in frequency, with a growing
//! force, and by the dense dogleg. For few unknowns the Jacobian is factored instead, which copes
//! with more kinks. Each strategy is tried on the balance with the mean free and on the one with the
//! mean retained ([`super::retention`]). The answer is the free one where the pairs that stick hold
//! every motion that nothing else holds, and otherwise the retained one, whichever way it was found.
//!
//! - `strategy` names the ways and the methods. `frozen` is the one without iterations, `mean_step` has
//!   the steps of its mean. `friction_path` and `rounded_path` are ways of several balances.
//! - `neighbour` is the motion that a frequency starts from, `solution` its result.
//! - `mean` decides between the two balances, `truncation` finds the change by further harmonics.
//! - `attempt_record` logs what each attempt took.

use super::balance::{Balance, Setting};
use super::dense::{exact_newton, powell};
use super::gross_slip::{GROSS_SLIP, slides_past};
use super::measure::{load_scale, relative_residual};
use super::newton_krylov::{KRYLOV_TOLERANCE, KrylovSystem};
use super::retention::{Holding, Mean};
use super::{Attempt, SweepProgress};
use crate::dlft::settings::Solver;
use dovetail_numerics::fourier::Fourier;
use dovetail_numerics::nonlinear::{NewtonEnd, NewtonOptions, NewtonStatus, newton};
use std::f64::consts::TAU;
use std::sync::Arc;

mod attempt_record;
mod frozen;
mod mean;
mod mean_step;
mod neighbour;
mod rounded_path;
mod solution;
mod steps;
mod strategy;
mod truncation;

pub(crate) use neighbour::{Neighbour, resized};
pub(crate) use solution::{Solution, SolverWork};
pub(crate) use truncation::{
    AmplitudeChange, EstimatedMotion, FinerMotion, Judge, MOST_CHECKED_UNKNOWNS,
};

use attempt_record::AttemptRecord;
use mean::SettledMean;
use solution::{MethodStart, keep_better};
use strategy::{Method, Strategy};

/// No further strategy is tried once a motion, or the estimates of a frequency, have taken this many times
/// the Newton iterations allowed to an attempt.
const MOST_ATTEMPTS: usize = 10;
/// No further strategy is tried once a frequency has taken this many iterations of GMRES: so poor a
/// preconditioner comes of an eps far from the stiffness of the pairs.
const MOST_KRYLOV_ITERATIONS: usize = 40_000;

/// Coefficient of friction above which a motion is looked for by lower ones before it is by rounded
/// laws.
const SEIZING_FRICTION: f64 = 10.0;

/// Largest number of unknowns for which Newton's method takes exact corrections.
pub(crate) const MOST_EXACT_UNKNOWNS: usize = 500;

/// A start with a relative residual below this is taken, however good another is, and a start that is
/// computed goes no further.
const GOOD_START: f64 = 1e-2;

/// Solver of a frequency, with what is the same at all frequencies: the balance, the solver asked
/// for, and what holds the bodies, found when first asked for.
#[derive(Clone)]
pub(crate) struct FrequencySolver<'a> {
    pub setting: Setting,
    pub newton: NewtonOptions,
    pub solver: Solver,
    pub holding: Arc<Holding>,
    pub tell: &'a (dyn Fn(SweepProgress<'_>) + Sync),
}

impl<'a> FrequencySolver<'a> {
    /// `holding` belongs to the model of `setting`; `tell` is called with each strategy tried.
    pub(crate) fn new(
        setting: Setting,
        newton: NewtonOptions,
        solver: Solver,
        holding: Arc<Holding>,
        tell: &'a (dyn Fn(SweepProgress<'_>) + Sync),
    ) -> Self {
        Self {
            setting,
            newton,
            solver,
            holding,
            tell,
        }
    }

    /// Solves one frequency: free where friction holds the motions that nothing else holds,
    /// otherwise with the mean retained along them. Returns the attempt with the smallest residual
    /// where none converges.
    pub(crate) fn solve(
        &self,
        frequency_hz: f64,
        last: Option<&Neighbour>,
        work: &mut SolverWork,
    ) -> Solution {
        self.solve_by(&self.strategies(), frequency_hz, last, work)
    }

    /// Solves one frequency again, from a neighbour on its other side.
    pub(crate) fn solve_from(
        &self,
        frequency_hz: f64,
        neighbour: &Neighbour,
        work: &mut SolverWork,
    ) -> Solution {
        let mut strategies = self.strategies();
        strategies.retain(|strategy| {
            let is_short = matches!(strategy, Strategy::InFrequency | Strategy::InSharpness);
            strategy.is_direct() || is_short
        });
        self.solve_by(&strategies, frequency_hz, Some(neighbour), work)
    }

    /// Returns `true` if a static test shows that contact cannot balance the excitation, applied slowly,
    /// at some instant of the period ([`Holding::excitation_exceeds_contact`]).
    pub(crate) fn excitation_exceeds_contact(&self, frequency_hz: f64) -> bool {
        let setting = &self.setting;
        let loads = setting.system.problem.excitations.iter();
        let factors: Vec<f64> = loads.map(|load| load.factor(TAU * frequency_hz)).collect();
        let holding = &self.holding;
        holding.excitation_exceeds_contact(&setting.lambda_static, &factors)
    }

    /// Solves one frequency by the first of these strategies that leads to a motion. One of them begins
    /// at the static state, or directly at `last`: these apply whatever the mean.
    fn solve_by(
        &self,
        strategies: &[Strategy],
        frequency_hz: f64,
        last: Option<&Neighbour>,
        work: &mut SolverWork,
    ) -> Solution {
        let mut best: Option<Solution> = None;
        let mut far: Option<Solution> = None;
        let means: &[Mean] = match (self.must_be_retained(), last.map(|l| l.mean)) {
            (true, _) => &[Mean::Retained],
            (false, Some(Mean::Retained)) => &[Mean::Retained, Mean::Free],
            (false, Some(Mean::Free) | None) => &[Mean::Free, Mean::Retained],
        };
        for &strategy in strategies {
            if best.is_some() && self.budget_exhausted(work)
                || far.is_some() && !strategy.is_direct()
            {
                break;
            }
            // Whether contacts may be frozen takes no time to see.
            if !matches!(strategy, Strategy::Frozen(_)) {
                let is_direct = strategy.is_direct();
                if !is_direct && self.excitation_exceeds_contact(frequency_hz) {
                    continue;
                }
                self.tell_of(frequency_hz, strategy);
            }
            // Rounded pairs creep under any force, so that they find the mean only where it is
            // retained.
            let creeps = matches!(strategy, Strategy::InSharpness) && self.retention().is_some();
            let means = if creeps && means.len() > 1 {
                &[Mean::Retained, Mean::Free]
            } else if matches!(strategy, Strategy::Frozen(_)) {
                // What violates a condition of contact about one mean does so about the other.
                &means[..1]
            } else {
                means
            };
            for &mean in means {
                if best.is_some() && self.budget_exhausted(work) {
                    break;
                }
                let record = AttemptRecord::begin(strategy, mean, work);
                let solved = self.attempt(strategy, frequency_hz, mean, last, work);
                record.end(self, frequency_hz, solved.as_ref(), work);
                let Some(mut solved) = solved else {
                    continue;
                };
                if solved.is_converged() {
                    match self.decide_mean(frequency_hz, solved, work) {
                        SettledMean::Answer(solved) => return solved,
                        SettledMean::Far(solved) => {
                            far.get_or_insert(solved);
                            continue;
                        }
                        SettledMean::Walks(walking) => solved = walking,
                    }
                    solved.end.status = NewtonStatus::Stagnated;
                    solved.end.measure = f64::INFINITY;
                }
                keep_better(&mut best, solved);
            }
        }
        if let Some(far) = far {
            return far;
        }
        let mut best = best.expect("the static state or the neighbour is a start");
        if work.deadline.is_over() {
            best.end.status = NewtonStatus::TimeLimit;
        }
        best
    }

    fn tell_of(&self, frequency_hz: f64, strategy: Strategy) {
        (self.tell)(SweepProgress::Tries(Attempt {
            frequency_hz,
            harmonics: self.setting.fourier.harmonics(),
            strategy: &strategy.to_string(),
        }));
    }

    /// Returns `true` if the frequency has taken all the work that it may, or its time is over.
    pub(crate) fn budget_exhausted(&self, work: &SolverWork) -> bool {
        work.effort() >= MOST_ATTEMPTS * self.newton.max_iterations
            || work.krylov_iterations >= MOST_KRYLOV_ITERATIONS
            || work.deadline.is_over()
    }

    fn strategies(&self) -> Vec<Strategy> {
        use Strategy::{
            FromNeighbour, FromRest, Frozen, InForce, InFrequency, InFriction, InSharpness,
        };
        let is_newton = self.solver == Solver::NewtonKrylov;
        let in_gross_slip = slides_past(&self.setting, &self.setting.free_slips_m) > GROSS_SLIP;
        // Pairs that slide seize or lift off, so that no motion is near the static state.
        let seizes = self.highest_friction() > SEIZING_FRICTION;
        let method = self.stepping();
        std::iter::once(Frozen(method))
            .chain((is_newton && in_gross_slip).then_some(InSharpness))
            .chain([FromNeighbour(method), FromRest(method)])
            .chain(seizes.then_some(InFriction))
            .chain((is_newton && !in_gross_slip).then_some(InSharpness))
            .chain((!seizes).then_some(InFriction))
            .chain([InFrequency, InForce])
            .collect()
    }

    /// Tries one strategy towards the free or the retained balance; `None` where it does not apply.
    fn attempt(
        &self,
        strategy: Strategy,
        frequency_hz: f64,
        mean: Mean,
        last: Option<&Neighbour>,
        work: &mut SolverWork,
    ) -> Option<Solution> {
        match strategy {
            Strategy::FromNeighbour(method) => {
                let balance = self.balance(frequency_hz, mean)?;
                let scale = load_scale(&balance, self.newton.tolerance);
                let n = balance.unknowns_per_block();
                let evaluated = |start: &mut MethodStart| {
                    let evaluation = start.known.insert(balance.evaluate(&start.u));
                    relative_residual(&evaluation.residual, n, scale)
                };
                let starts = last?.starts(frequency_hz, self.unknowns());
                let mut starts: Vec<MethodStart> =
                    starts.into_iter().map(MethodStart::new).collect();
                if let [continued, unchanged] = &mut starts[..] {
                    // Across a resonance the line through the neighbours leads astray.
                    let measure = evaluated(continued);
                    let is_good = measure <= GOOD_START;
                    if !is_good && evaluated(unchanged) < measure {
                        std::mem::swap(continued, unchanged);
                    }
                }
                let mut best: Option<Solution> = None;
                let mut first = Some(balance);
                for start in starts {
                    let balance = match first.take() {
                        Some(balance) => balance,
                        None => self.balance(frequency_hz, mean)?,
                    };
                    let solved = self.iterate_from(balance, start, method, self.newton, work);
                    if solved.is_converged() {
                        return Some(solved);
                    }
                    keep_better(&mut best, solved);
                }
                best
            }
            Strategy::FromRest(method) => {
                let balance = self.balance(frequency_hz, mean)?;
                let start = match method {
                    Method::Krylov => self.excited_start(frequency_hz, mean, method, work)?,
                    Method::Exact | Method::Dogleg => self.static_start(),
                };
                Some(self.iterate(balance, start, method, self.newton, work))
            }
            Strategy::Frozen(method) => {
                let balance = self.balance(frequency_hz, mean)?;
                self.solve_frozen(frequency_hz, balance, method, last, work)
            }
            Strategy::InFrequency => self.step_in_frequency(frequency_hz, mean, last?, work),
            Strategy::InForce => self.step_in_force(frequency_hz, mean, work),
            Strategy::InSharpness => self.follow_rounded_laws(frequency_hz, mean, last, work),
            Strategy::InFriction => self.step_in_friction(frequency_hz, mean, work),
        }
    }

    /// Motion with the mean and the harmonics up to the highest excited one alone, found from the
    /// static state: the start for all harmonics, whose iterations cost several times as much. The
    /// static state itself where no such motion is found, or for a free mean that may be retained
    /// `None`: with all harmonics it would not be found either.
    fn excited_start(
        &self,
        frequency_hz: f64,
        mean: Mean,
        method: Method,
        work: &mut SolverWork,
    ) -> Option<Vec<f64>> {
        let setting = &self.setting;
        let excited = setting.system.problem.highest_excited().max(1);
        let start = self.static_start();
        if excited >= setting.fourier.harmonics() {
            return Some(start);
        }
        let fourier = Fourier::new(excited, setting.fourier.samples());
        let fewer = self.with_resolution(&fourier.into(), &setting.eps);
        let balance = fewer.balance(frequency_hz, mean)?;
        let options = NewtonOptions {
            tolerance: self.newton.tolerance.max(GOOD_START),
            ..self.newton
        };
        let first = resized(&start, fewer.unknowns());
        let solved = fewer.iterate(balance, first, method, options, work);
        if solved.is_converged() {
            return Some(resized(&solved.u, start.len()));
        }
        let may_be_retained = mean == Mean::Free && self.retention().is_some();
        (!may_be_retained).then_some(start)
    }

    /// This solver with other harmonics and samples, and another eps.
    pub(crate) fn with_resolution(&self, fourier: &Arc<Fourier>, eps: &Arc<[f64]>) -> Self {
        let mut other = self.clone();
        other.setting.fourier = Arc::clone(fourier);
        other.setting.eps = Arc::clone(eps);
        other
    }

    /// Method used for small steps.
    fn stepping(&self) -> Method {
        match self.solver {
            Solver::Powell => Method::Dogleg,
            Solver::NewtonKrylov if self.unknowns() <= MOST_EXACT_UNKNOWNS => Method::Exact,
            Solver::NewtonKrylov => Method::Krylov,
        }
    }

    fn iterate(
        &self,
        balance: Balance,
        u: Vec<f64>,
        method: Method,
        options: NewtonOptions,
        work: &mut SolverWork,
    ) -> Solution {
        self.iterate_from(balance, MethodStart::new(u), method, options, work)
    }

    /// Like [`FrequencySolver::iterate`], from a start at which the balance may be evaluated already.
    fn iterate_from(
        &self,
        mut balance: Balance,
        start: MethodStart,
        method: Method,
        options: NewtonOptions,
        work: &mut SolverWork,
    ) -> Solution {
        balance.deadline = work.deadline;
        let MethodStart { mut u, known } = start;
        let (end, evaluation) = match method {
            Method::Krylov => {
                let walked_off = |u: &[f64]| balance.mean() == Mean::Free && self.walked_off(u);
                let mut system = KrylovSystem::new(
                    &balance,
                    &mut work.preconditioner,
                    KRYLOV_TOLERANCE,
                    options.tolerance,
                    &walked_off,
                );
                system.evaluator.keep(&u, known);
                let end = newton(&mut system, &mut u, options);
                work.krylov_iterations += system.krylov_iterations;
                (end, system.evaluator.take_evaluation(&u))
            }
            Method::Exact => exact_newton(&balance, &mut u, known, options),
            Method::Dogleg => powell(&balance, &mut u, known, options),
        };
        work.count_iterations(end.iterations);
        work.residuals.push(end.residuals.clone());
        Solution {
            balance,
            u,
            evaluation,
            end,
        }
    }

    /// Balance with this mean; `None` where there is nothing to retain.
    pub(crate) fn balance(&self, frequency_hz: f64, mean: Mean) -> Option<Balance> {
        let balance = Balance::new(&self.setting, TAU * frequency_hz);
        Some(match mean {
            Mean::Free => balance,
            Mean::Retained => balance.retained_by(Arc::clone(self.retention()?)),
        })
    }

    /// Solution that is known, evaluated; `None` where its mean cannot be retained, or where it has
    /// not as many unknowns.
    pub(crate) fn evaluated(&self, frequency_hz: f64, u: &[f64], mean: Mean) -> Option<Solution> {
        let balance = self.balance(frequency_hz, mean)?;
        (u.len() == self.unknowns()).then(|| Solution {
            evaluation: balance.evaluate(u),
            u: u.to_vec(),
            balance,
            end: NewtonEnd {
                status: NewtonStatus::Converged,
                iterations: 0,
                measure: 0.0,
                residuals: Vec::new(),
            },
        })
    }

    /// Returns `true` if corrections are taken from a factor of the whole Jacobian.
    pub(crate) fn is_exact(&self) -> bool {
        !matches!(self.stepping(), Method::Krylov)
    }

    /// Number of entries of U.
    pub(crate) fn unknowns(&self) -> usize {
        self.setting.fourier.width() * self.setting.system.unknowns()
    }

    /// U of the static state, without vibration.
    pub(crate) fn static_start(&self) -> Vec<f64> {
        let n = self.setting.system.unknowns();
        let mut u = vec![0.0; self.unknowns()];
        u[..n].copy_from_slice(&self.setting.x_static);
        u
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::balance::Evaluation;
    use crate::dlft::jacobians::{OMEGA_RAD_S, sample_points};

    #[test]
    fn a_solution_comes_with_what_the_pairs_do_there_however_it_ended() {
        let mut statuses = vec![];
        for (_, balance, u) in &sample_points() {
            for method in [Method::Krylov, Method::Exact, Method::Dogleg] {
                for max_iterations in [1, 3, 60] {
                    let newton = NewtonOptions::new(1e-9, max_iterations);
                    let setting = balance.setting.clone();
                    let holding = Holding::new(&setting.system.problem).into();
                    let solver = Solver::NewtonKrylov;
                    let frequencies =
                        FrequencySolver::new(setting.clone(), newton, solver, holding, &|_| ());
                    let mut work = SolverWork::default();
                    // Pressed together, and excited little: there is a motion to be found.
                    let mut balance = Balance::new(&setting, OMEGA_RAD_S);
                    let (mean, vibration) = balance.force.split_at_mut(setting.system.unknowns());
                    mean.iter_mut().step_by(3).for_each(|f| *f = -20.0);
                    vibration.iter_mut().for_each(|f| *f *= 0.1);
                    let start = u.to_vec();
                    let solved = frequencies.iterate(balance, start, method, newton, &mut work);
                    let anew = solved.balance.evaluate(&solved.u);
                    assert_eq!(solved.evaluation.residual, anew.residual);
                    assert_eq!(solved.evaluation.lambda, anew.lambda);
                    let slid = |e: &Evaluation| e.ends.iter().map(|e| e.slid_n).collect::<Vec<_>>();
                    assert_eq!(slid(&solved.evaluation), slid(&anew));
                    statuses.push(solved.end.status);
                }
            }
        }
        for status in [NewtonStatus::Converged, NewtonStatus::IterationLimit] {
            assert!(statuses.contains(&status), "{statuses:?}");
        }
    }
}
