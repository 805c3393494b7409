//! Solution of one frequency by strategies, tried from the cheapest to the dearest.
//!
//! A frequency is started from its neighbour and from the static state, by Newton-GMRES with
//! accurate and then with loose linear solves. From the static state the excited harmonics come first,
//! and their motion is the start for all. If that fails, it is approached by smaller steps in
//! frequency, with a growing force, and by the dense dogleg. For few unknowns the Jacobian is
//! factored instead, which copes with more kinks. Each strategy is tried on the balance with the
//! mean free and on the one with the mean retained ([`super::retention`]). The answer is the free
//! one where the pairs that stick hold every motion that nothing else holds, and otherwise the
//! retained one, whichever way it was found.

use super::balance::{Balance, Deadline, Evaluation, Jacobian, Setting};
use super::dense::{MOST_DENSE_UNKNOWNS, exact_correction, exact_newton, powell};
use super::gross_slip::{GROSS_SLIP, slides_past};
use super::newton_krylov::{
    KRYLOV_TOLERANCE, KrylovSystem, LOOSE_KRYLOV_TOLERANCE, Preconditioner, load_scale,
    relative_residual, step_length,
};
use super::orbit::observed_amplitudes_m;
use super::pair_signals::Periods;
use super::retention::{Holding, Mean, Retention, may_have_walked_off};
use super::{Attempt, Orbit, Told};
use crate::dlft::settings::Solver;
use dovetail_numerics::fourier::Fourier;
use dovetail_numerics::nonlinear::{NewtonEnd, NewtonOptions, NewtonStatus, newton};
use dovetail_numerics::vector::norm;
use std::borrow::Cow;
use std::f64::consts::TAU;

mod rounded_path;

/// No further strategy is tried once a frequency has taken this many times the Newton iterations
/// allowed to an attempt.
const MOST_ATTEMPTS: usize = 10;
/// No further strategy is tried once a frequency has taken this many iterations of GMRES: so poor a
/// preconditioner comes of an eps far from the stiffness of the pairs.
const MOST_KRYLOV_ITERATIONS: usize = 40_000;

/// Largest number of unknowns for which Newton's method takes exact corrections.
pub const MOST_EXACT_UNKNOWNS: usize = 500;

/// Relative residual of the linear solves of the estimates.
const ESTIMATE_TOLERANCE: f64 = 0.05;
/// A start with a relative residual below this is taken, however good another is, and a start that is
/// computed goes no further.
const GOOD_START: f64 = 1e-2;
/// Fractions of the retention's stiffness on the way from a retained motion to the free one.
const RELEASE: [f64; 4] = [0.1, 0.01, 1e-3, 1e-4];
/// Relative residual of the motions at those fractions, which are starts alone.
const RELEASE_TOLERANCE: f64 = 1e-5;
/// Newton iterations allowed at each fraction; a step that needs more leads nowhere.
const RELEASE_ITERATIONS: usize = 15;
/// Newton iterations allowed at each coefficient of friction on the way to a higher one. Where they
/// are not enough, the coefficient grows by the root of the factor before, down to the least one.
const FRICTION_ITERATIONS: usize = 30;
const LEAST_GROWTH: f64 = 1.2;

/// Solver of a frequency, with what is the same at all frequencies: the balance, the solver asked
/// for, and what holds the bodies, found when first asked for.
pub struct FrequencySolver<'a> {
    pub setting: Setting<'a>,
    pub newton: NewtonOptions,
    pub solver: Solver,
    pub holding: &'a Holding<'a>,
    tell: &'a (dyn Fn(Told<'_>) + Sync),
}

/// Converged frequency, from which the next one starts.
#[derive(Debug, Clone)]
pub struct Neighbour {
    pub frequency_hz: f64,
    pub u: Vec<f64>,
    /// dU/df towards the frequency before, m/Hz; `None` unless that has the same mean (free or
    /// retained).
    pub slope: Option<Vec<f64>>,
    /// Treatment of the mean along the motions that only friction holds.
    pub mean: Mean,
}

impl Neighbour {
    /// Neighbour of a frequency with a motion; `before` is the one before it.
    pub fn of(orbit: &Orbit, before: Option<&Self>) -> Self {
        let u = orbit.x.clone();
        Self::after(before, orbit.frequency_hz, u, orbit.mean)
    }

    /// Neighbour of a converged frequency; `last` is the one before it.
    pub fn after(last: Option<&Self>, frequency_hz: f64, u: Vec<f64>, mean: Mean) -> Self {
        let slope = last.filter(|l| l.mean == mean).map(|l| {
            let step = frequency_hz - l.frequency_hz;
            let before = resized(&l.u, u.len());
            u.iter().zip(&before).map(|(u, v)| (u - v) / step).collect()
        });
        Self {
            frequency_hz,
            u,
            slope: slope.filter(|s: &Vec<f64>| s.iter().all(|v| v.is_finite())),
            mean,
        }
    }

    /// U continued to `frequency_hz`, and U as it is, of `unknowns` entries each. Further harmonics
    /// are zero.
    fn starts(&self, frequency_hz: f64, unknowns: usize) -> Vec<Vec<f64>> {
        let step = frequency_hz - self.frequency_hz;
        let continued = self.slope.as_ref().map(|slope| {
            let ends = self.u.iter().zip(slope);
            ends.map(|(u, s)| u + step * s).collect()
        });
        let starts = continued.into_iter().chain([self.u.clone()]);
        starts.map(|u| resized(&u, unknowns)).collect()
    }
}

/// Work done on one frequency, and the preconditioner, which is kept over frequencies.
#[derive(Default)]
pub struct Work {
    pub newton_iterations: usize,
    pub krylov_iterations: usize,
    /// Relative residual of each attempt, at its start and after each iteration.
    pub residuals: Vec<Vec<f64>>,
    /// Preconditioner of the linear solves.
    pub preconditioner: Preconditioner,
    /// Time at which the frequency is given up.
    pub deadline: Deadline,
    /// Work on the finer balances that errors are estimated with; each keeps its preconditioner.
    estimates: [Option<Box<Work>>; 2],
}

impl Work {
    /// Resets the counts, for a frequency that is given up after `most_seconds`.
    pub fn start_counting(&mut self, most_seconds: Option<f64>) {
        (self.newton_iterations, self.krylov_iterations) = (0, 0);
        self.residuals.clear();
        self.deadline = Deadline::after(most_seconds);
    }

    /// Work of the next estimate by the first or the second finer balance, which the counts of a
    /// frequency leave out.
    pub fn of_estimate(&mut self, finer: usize) -> &mut Work {
        let work = self.estimates[finer].get_or_insert_default();
        work.start_counting(None);
        work.deadline = self.deadline;
        work
    }
}

/// A balance, its U, the evaluation there, and how the solution ended.
pub struct Solution<'b> {
    pub balance: Balance<'b>,
    pub u: Vec<f64>,
    pub evaluation: Evaluation,
    pub end: NewtonEnd,
}

impl Solution<'_> {
    pub fn is_converged(&self) -> bool {
        self.end.status == NewtonStatus::Converged
    }
}

/// U that a method begins at, and the evaluation of its balance there, if it is known.
struct Start {
    u: Vec<f64>,
    known: Option<Evaluation>,
}

impl Start {
    /// Start at which nothing is evaluated yet.
    fn at(u: Vec<f64>) -> Self {
        Self { u, known: None }
    }
}

/// Keeps the one of two solutions with the smaller residual, the first of equal ones.
fn keep_better<'b>(best: &mut Option<Solution<'b>>, solved: Solution<'b>) {
    let measure = solved.end.measure;
    if best.as_ref().is_none_or(|best| measure < best.end.measure) {
        *best = Some(solved);
    }
}

/// A solution with the mean that it is to have.
enum Settled<'b> {
    /// The motion.
    Answer(Solution<'b>),
    /// Friction holds the bodies, but far from where they are at rest.
    Far(Solution<'b>),
    /// The mean has walked off, and friction does not hold it.
    Walks(Solution<'b>),
}

/// Distance of the motion of a finer balance from that of a coarser one.
#[non_exhaustive]
pub struct Truncation {
    /// Motion of the finer balance.
    pub u: Vec<f64>,
    /// Change of each observed amplitude relative to the larger of both, or of the whole vibration,
    /// in forces, where nothing is observed. 1 where no motion of the finer balance is found.
    pub changes: Vec<f64>,
}

impl Truncation {
    /// Change from `u` to `v`, both of `balance`.
    fn between(balance: &Balance<'_>, u: &[f64], v: Vec<f64>, frequency_hz: f64) -> Self {
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
    fn unknown(u: Vec<f64>, balance: &Balance<'_>) -> Self {
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
    fn at(balance: &Balance<'_>, u: &[f64], finer: Option<Self>) -> Self {
        let Setting {
            fourier, system, ..
        } = balance.setting;
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

/// Returns U with `entries` entries: missing harmonics are zero, further ones are dropped.
pub fn resized(u: &[f64], entries: usize) -> Vec<f64> {
    let mut u = u[..u.len().min(entries)].to_vec();
    u.resize(entries, 0.0);
    u
}

/// Way to approach a balance.
#[derive(Debug, Clone, Copy)]
enum Strategy {
    /// Start from the neighbour, as it is and continued.
    FromNeighbour(Method),
    /// Start from the static state without vibration.
    FromRest(Method),
    /// Steps in frequency from the neighbour.
    InFrequency(u32),
    /// Steps of the vibrating part of the load from the static state.
    InForce(u32),
    /// Start from the static state with rounded laws ([`super::rounded`]); each solution is the
    /// start of the next sharper one.
    InSharpness,
    /// Start from the static state with coefficients of friction that grow. Each start lies on the
    /// straight line in 1 / mu through the last two solutions.
    InFriction(GrowingFriction),
}

/// Coefficients of friction that are at most `from` first, then `growth` times that, or less, and
/// so on.
#[derive(Debug, Clone, Copy)]
struct GrowingFriction {
    from: f64,
    growth: f64,
}

impl Strategy {
    /// Returns `true` if no balances are solved on the way, by the methods that `solver` begins with.
    fn is_direct(self, solver: Solver) -> bool {
        match self {
            Self::FromNeighbour(method) | Self::FromRest(method) => {
                solver == Solver::Powell || !matches!(method, Method::Dogleg)
            }
            _ => false,
        }
    }
}

#[derive(Debug, Clone, Copy)]
enum Method {
    /// Newton-GMRES with this relative residual of the linear solves.
    Krylov(f64),
    /// Newton's method with the Jacobian factored.
    Exact,
    /// Powell's hybrid method.
    Dogleg,
}

impl std::fmt::Display for Strategy {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::FromNeighbour(method) => write!(f, "from the neighbour{method}"),
            Self::FromRest(method) => write!(f, "from the static state{method}"),
            Self::InFrequency(steps) => {
                write!(f, "from the neighbour in {steps} steps of frequency")
            }
            Self::InForce(steps) => write!(f, "from the static state in {steps} steps of force"),
            Self::InSharpness => f.write_str("with rounded contact laws"),
            Self::InFriction(GrowingFriction { from, .. }) => {
                write!(f, "along friction that grows from a coefficient of {from}")
            }
        }
    }
}

impl std::fmt::Display for Method {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Krylov(tolerance) if *tolerance < LOOSE_KRYLOV_TOLERANCE => "",
            Self::Krylov(_) => " with loose linear solves",
            Self::Exact => "",
            Self::Dogleg => " by the dogleg",
        })
    }
}

impl<'a> FrequencySolver<'a> {
    /// `holding` belongs to the model of `setting`; `tell` is called with each strategy tried.
    pub fn new(
        setting: Setting<'a>,
        newton: NewtonOptions,
        solver: Solver,
        holding: &'a Holding<'a>,
        tell: &'a (dyn Fn(Told<'_>) + Sync),
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
    pub fn solve(
        &self,
        frequency_hz: f64,
        last: Option<&Neighbour>,
        work: &mut Work,
    ) -> Solution<'_> {
        self.solve_by(&self.strategies(frequency_hz), frequency_hz, last, work)
    }

    /// Solves one frequency again, from a neighbour on its other side.
    pub fn solve_from(
        &self,
        frequency_hz: f64,
        neighbour: &Neighbour,
        work: &mut Work,
    ) -> Solution<'_> {
        let mut strategies = self.strategies(frequency_hz);
        strategies.retain(|strategy| {
            let is_short = matches!(strategy, Strategy::InFrequency(_) | Strategy::InSharpness);
            strategy.is_direct(self.solver) || is_short
        });
        self.solve_by(&strategies, frequency_hz, Some(neighbour), work)
    }

    /// Corrects a solution by one Newton step of each of these finer balances, in ascending order of
    /// their harmonics.
    ///
    /// Their eps is that of the solution. Where they have as many samples as the finest of them, and
    /// nothing excites its further harmonics, their contact forces and derivatives are those of the
    /// finest up to their own harmonics, and are computed once.
    pub fn truncations(
        finer: &[&Self],
        coarse: &Solution<'_>,
        frequency_hz: f64,
        work: &mut Work,
    ) -> Vec<Truncation> {
        let mut linearised = None;
        let ascending = finer.iter().enumerate();
        let mut found: Vec<Truncation> = ascending
            .rev()
            .map(|(i, finer)| {
                let work = work.of_estimate(i);
                finer.estimate_truncation(coarse, frequency_hz, work, &mut linearised)
            })
            .collect();
        found.reverse();
        found
    }

    /// Corrects a solution with fewer harmonics by one Newton step of this balance. `linearised` is
    /// that of a balance with more harmonics, if any, and becomes the one that was used.
    fn estimate_truncation(
        &self,
        coarse: &Solution<'_>,
        frequency_hz: f64,
        work: &mut Work,
        linearised: &mut Option<Linearised>,
    ) -> Truncation {
        let u = resized(&coarse.u, self.unknowns());
        let setting = Setting {
            eps: coarse.balance.setting.eps,
            ..self.setting
        };
        let with_its_eps = FrequencySolver { setting, ..*self };
        let Some(balance) = with_its_eps.balance(frequency_hz, coarse.balance.mean()) else {
            return Truncation::unknown(u, &coarse.balance);
        };
        let dx = match self.stepping() {
            Method::Exact => exact_correction(&balance, &u, self.newton),
            Method::Krylov(_) | Method::Dogleg => {
                let known = linearised.take();
                let known = linearised.insert(Linearised::at(&balance, &u, known));
                self.krylov_correction(&balance, known, work)
            }
        };
        work.newton_iterations += 1;
        let Some(dx) = dx else {
            return Truncation::unknown(u, &balance);
        };
        let corrected: Vec<f64> = u.iter().zip(&dx).map(|(u, d)| u + d).collect();
        Truncation::between(&balance, &u, corrected, frequency_hz)
    }

    /// Newton's correction where a balance is linearised, solved for loosely; `None` where it is not
    /// found.
    fn krylov_correction(
        &self,
        balance: &Balance<'_>,
        linearised: &Linearised,
        work: &mut Work,
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

    /// Decides between the free and the retained balance for a solution of either.
    fn with_its_mean<'b>(
        &'b self,
        frequency_hz: f64,
        solved: Solution<'b>,
        work: &mut Work,
    ) -> Settled<'b> {
        if solved.balance.mean() == Mean::Retained {
            let released = (!self.must_be_retained())
                .then(|| self.with_mean_released(frequency_hz, &solved, work))
                .flatten();
            return Settled::Answer(released.unwrap_or(solved));
        }
        let is_held = self.is_blocked_by_friction(&solved);
        match (self.walked_off(&solved.u), is_held) {
            (false, true) => Settled::Answer(solved),
            (false, false) => {
                let retained = self.with_mean_retained(frequency_hz, &solved, work);
                Settled::Answer(retained.unwrap_or(solved))
            }
            // Friction holds bodies anywhere along a slot: one nearer to where they are at rest
            // comes first.
            (true, true) => Settled::Far(solved),
            (true, false) => Settled::Walks(solved),
        }
    }

    /// Solution of a step along a curve with the mean that holds there; `None` where it has walked
    /// off.
    pub fn on_curve<'b>(
        &'b self,
        frequency_hz: f64,
        solved: Solution<'b>,
        work: &mut Work,
    ) -> Option<Solution<'b>> {
        match self.with_its_mean(frequency_hz, solved, work) {
            Settled::Answer(solved) => Some(solved),
            Settled::Far(_) | Settled::Walks(_) => None,
        }
    }

    /// Like [`FrequencySolver::truncations`], but solves this balance instead of correcting
    /// once.
    pub fn truncation_by_finer_solution(
        &self,
        coarse: &Solution<'_>,
        frequency_hz: f64,
        work: &mut Work,
    ) -> Truncation {
        let u = resized(&coarse.u, self.unknowns());
        let start = Neighbour::after(None, frequency_hz, u.clone(), coarse.balance.mean());
        let strategies = [
            Strategy::FromNeighbour(Method::Exact),
            Strategy::InSharpness,
        ];
        let solved = self.solve_by(&strategies, frequency_hz, Some(&start), work);
        if !solved.is_converged() {
            return self.estimate_truncation(coarse, frequency_hz, work, &mut None);
        }
        Truncation::between(&solved.balance, &u, solved.u, frequency_hz)
    }

    /// Returns `true` if, even applied slowly, the excitation pulls harder at the flanks than the
    /// preload of the static state presses them together, whether they stick or slide. Sums of the
    /// pairs' normal forces are compared. Bodies that are held without contact cannot be pulled
    /// away.
    pub fn excitation_exceeds_preload(&self, frequency_hz: f64) -> bool {
        let setting = &self.setting;
        let loads = &setting.system.problem.excitations;
        let factors = loads.iter().map(|load| load.factor(TAU * frequency_hz));
        let n = setting.system.unknowns();
        let stuck_n = factors.clone().zip(loads).map(|(factor, load)| {
            let parts = load.cosine.on_x.iter().zip(&load.sine.on_x);
            let parts = parts.take(n).step_by(3);
            factor * parts.map(|(c, s)| c.hypot(*s)).sum::<f64>()
        });
        if stuck_n.sum::<f64>() <= setting.pressing_n || self.holding.without_contact() {
            return false;
        }
        let sliding_n = factors.zip(self.holding.pulls()).map(|(factor, pulls)| {
            let sizes = pulls.iter().map(|pull| pull.norm());
            factor * sizes.sum::<f64>()
        });
        sliding_n.sum::<f64>() > setting.pressing_n
    }

    /// Solves one frequency by the first of these strategies that leads to a motion. One of them begins
    /// at the static state, or directly at `last`: these apply whatever the mean.
    fn solve_by(
        &self,
        strategies: &[Strategy],
        frequency_hz: f64,
        last: Option<&Neighbour>,
        work: &mut Work,
    ) -> Solution<'_> {
        let mut best: Option<Solution<'_>> = None;
        let mut far: Option<Solution<'_>> = None;
        let means: &[Mean] = match (self.must_be_retained(), last.map(|l| l.mean)) {
            (true, _) => &[Mean::Retained],
            (false, Some(Mean::Retained)) => &[Mean::Retained, Mean::Free],
            (false, Some(Mean::Free) | None) => &[Mean::Free, Mean::Retained],
        };
        for &strategy in strategies {
            if best.is_some() && self.budget_exhausted(work)
                || far.is_some() && !strategy.is_direct(self.solver)
            {
                break;
            }
            (self.tell)(Told::Tries(Attempt {
                frequency_hz,
                harmonics: self.setting.fourier.harmonics(),
                strategy: &strategy.to_string(),
            }));
            // Rounded pairs creep under any force, so that they find the mean only where it is
            // retained.
            let creeps = matches!(strategy, Strategy::InSharpness) && self.retention().is_some();
            let means = if creeps && means.len() > 1 {
                &[Mean::Retained, Mean::Free]
            } else {
                means
            };
            for &mean in means {
                if best.is_some() && self.budget_exhausted(work) {
                    break;
                }
                let Some(mut solved) = self.attempt(strategy, frequency_hz, mean, last, work)
                else {
                    continue;
                };
                if solved.is_converged() {
                    match self.with_its_mean(frequency_hz, solved, work) {
                        Settled::Answer(solved) => return solved,
                        Settled::Far(solved) => {
                            far.get_or_insert(solved);
                            continue;
                        }
                        Settled::Walks(walking) => solved = walking,
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

    fn budget_exhausted(&self, work: &Work) -> bool {
        work.newton_iterations >= MOST_ATTEMPTS * self.newton.max_iterations
            || work.krylov_iterations >= MOST_KRYLOV_ITERATIONS
            || work.deadline.is_over()
    }

    fn strategies(&self, frequency_hz: f64) -> Vec<Strategy> {
        use Strategy::{FromNeighbour, FromRest, InForce, InFrequency, InFriction, InSharpness};
        let [from_high, from_low] = [(10.0, 10.0), (0.5, 4.0)]
            .map(|(from, growth)| InFriction(GrowingFriction { from, growth }));
        let steps = [InFrequency(2), InFrequency(4), InForce(4), InForce(8)];
        let small_steps = [InFrequency(8), InFrequency(16), InForce(16), InForce(32)];
        let directly = |method| [FromNeighbour(method), FromRest(method)];
        let dogleg = directly(Method::Dogleg);
        if self.solver == Solver::Powell {
            return dogleg
                .into_iter()
                .chain([from_high, from_low])
                .chain(steps)
                .chain(small_steps)
                .collect();
        }
        if self.excitation_exceeds_preload(frequency_hz) {
            return directly(self.stepping()).to_vec();
        }
        let (first, second) = if self.unknowns() <= MOST_EXACT_UNKNOWNS {
            (Method::Exact, None)
        } else {
            let loose = Method::Krylov(LOOSE_KRYLOV_TOLERANCE);
            (Method::Krylov(KRYLOV_TOLERANCE), Some(loose))
        };
        let is_small = self.unknowns() <= MOST_DENSE_UNKNOWNS;
        let in_gross_slip = slides_past(&self.setting, self.setting.free_slips_m) > GROSS_SLIP;
        in_gross_slip
            .then_some(InSharpness)
            .into_iter()
            .chain(directly(first))
            // Costs nothing below that coefficient. Above it pairs that slide seize or lift off, so
            // that no motion is near the static state.
            .chain([from_high])
            .chain(second.into_iter().flat_map(directly))
            .chain((!in_gross_slip).then_some(InSharpness))
            .chain([from_low])
            .chain(steps)
            .chain(is_small.then_some(dogleg).into_iter().flatten())
            .chain(small_steps)
            .collect()
    }

    /// Tries one strategy towards the free or the retained balance; `None` where it does not apply.
    fn attempt(
        &self,
        strategy: Strategy,
        frequency_hz: f64,
        mean: Mean,
        last: Option<&Neighbour>,
        work: &mut Work,
    ) -> Option<Solution<'_>> {
        match strategy {
            Strategy::FromNeighbour(method) => {
                let balance = self.balance(frequency_hz, mean)?;
                let scale = load_scale(&balance, self.newton.tolerance);
                let n = balance.unknowns_per_block();
                let evaluated = |start: &mut Start| {
                    let evaluation = start.known.insert(balance.evaluate(&start.u));
                    relative_residual(&evaluation.residual, n, scale)
                };
                let starts = last?.starts(frequency_hz, self.unknowns());
                let mut starts: Vec<Start> = starts.into_iter().map(Start::at).collect();
                if let [continued, unchanged] = &mut starts[..] {
                    // Across a resonance the line through the neighbours leads astray.
                    let measure = evaluated(continued);
                    let is_good = measure <= GOOD_START;
                    if !is_good && evaluated(unchanged) < measure {
                        std::mem::swap(continued, unchanged);
                    }
                }
                let mut best: Option<Solution<'_>> = None;
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
                    Method::Krylov(_) => self.excited_start(frequency_hz, mean, method, work)?,
                    Method::Exact | Method::Dogleg => self.static_start(),
                };
                Some(self.iterate(balance, start, method, self.newton, work))
            }
            Strategy::InFrequency(steps) => {
                let last = last?;
                let from_hz = last.frequency_hz;
                let at = |fraction: f64| {
                    self.balance(from_hz + (frequency_hz - from_hz) * fraction, mean)
                };
                self.continue_in_steps(resized(&last.u, self.unknowns()), steps, &at, work)
            }
            Strategy::InForce(steps) => {
                let at = |fraction: f64| {
                    let mut balance = self.balance(frequency_hz, mean)?;
                    let n = balance.unknowns_per_block();
                    balance.force[n..].iter_mut().for_each(|f| *f *= fraction);
                    Some(balance)
                };
                self.continue_in_steps(self.static_start(), steps, &at, work)
            }
            Strategy::InSharpness => self.with_rounded_laws(frequency_hz, mean, work),
            Strategy::InFriction(friction) => {
                self.with_growing_friction(friction, frequency_hz, mean, work)
            }
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
        work: &mut Work,
    ) -> Option<Vec<f64>> {
        let setting = &self.setting;
        let excited = setting.system.problem.highest_excited().max(1);
        let start = self.static_start();
        if excited >= setting.fourier.harmonics() {
            return Some(start);
        }
        let fourier = Fourier::new(excited, setting.fourier.samples());
        let fewer = self.with_fourier(&fourier);
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

    /// This solver with other harmonics and samples.
    fn with_fourier<'b>(&'b self, fourier: &'b Fourier) -> FrequencySolver<'b> {
        let setting = Setting {
            fourier,
            ..self.setting
        };
        FrequencySolver { setting, ..*self }
    }

    /// Follows growing coefficients of friction, which grow by less where no solution is found. `None`
    /// where that does not help, or no coefficient is above the first.
    fn with_growing_friction(
        &self,
        friction: GrowingFriction,
        frequency_hz: f64,
        mean: Mean,
        work: &mut Work,
    ) -> Option<Solution<'_>> {
        let GrowingFriction { from, mut growth } = friction;
        let pairs = self.setting.system.problem.laws.iter();
        let highest = pairs.fold(0.0_f64, |m, p| m.max(p.computed_friction()));
        if highest <= from {
            return None;
        }
        let mut newton = self.newton;
        newton.max_iterations = newton.max_iterations.min(FRICTION_ITERATIONS);
        let (mut earlier, mut last) = (None::<(f64, Vec<f64>)>, None::<(f64, Vec<f64>)>);
        loop {
            if self.budget_exhausted(work) {
                return None;
            }
            let (most, start) = match &last {
                None => (from, self.static_start()),
                Some((last, u)) => {
                    let most = (last * growth).min(highest);
                    let along =
                        |before: f64| (1.0 / most - 1.0 / last) / (1.0 / last - 1.0 / before);
                    let start = earlier.as_ref().map(|(before, v)| {
                        let t = along(*before);
                        u.iter().zip(v).map(|(u, v)| u + t * (u - v)).collect()
                    });
                    (most, start.unwrap_or_else(|| u.clone()))
                }
            };
            let mut balance = self.balance(frequency_hz, mean)?;
            balance.most_friction = most;
            let solved = self.iterate(balance, start, self.stepping(), newton, work);
            if !solved.is_converged() {
                growth = growth.sqrt();
                if last.is_none() || growth < LEAST_GROWTH {
                    return None;
                }
            } else if most >= highest {
                return Some(solved);
            } else {
                earlier = last.replace((most, solved.u));
            }
        }
    }

    /// Solves `at(1 / steps), at(2 / steps), ..., at(1)`, each from the one before; `None` where
    /// one of them fails.
    fn continue_in_steps<'b>(
        &'b self,
        mut u: Vec<f64>,
        steps: u32,
        at: &dyn Fn(f64) -> Option<Balance<'b>>,
        work: &mut Work,
    ) -> Option<Solution<'b>> {
        let method = self.stepping();
        let mut solved = None;
        for step in 1..=steps {
            if self.budget_exhausted(work) {
                return None;
            }
            let balance = at(f64::from(step) / f64::from(steps))?;
            let step = self.iterate(balance, u, method, self.newton, work);
            if !step.is_converged() {
                return None;
            }
            u = step.u.clone();
            solved = Some(step);
        }
        solved
    }

    /// Method used for small steps.
    fn stepping(&self) -> Method {
        match self.solver {
            Solver::Powell => Method::Dogleg,
            Solver::NewtonKrylov if self.unknowns() <= MOST_EXACT_UNKNOWNS => Method::Exact,
            Solver::NewtonKrylov => Method::Krylov(KRYLOV_TOLERANCE),
        }
    }

    /// Free motion beside a retained one in which the pairs that stick hold the bodies; `None` where
    /// none is found. It is not looked for where they do not even hold them beside the spring: they
    /// would have to carry its force as well. The spring is removed at once. If that fails, it is
    /// softened in steps as long as the pairs hold the bodies.
    fn with_mean_released(
        &self,
        frequency_hz: f64,
        retained: &Solution<'_>,
        work: &mut Work,
    ) -> Option<Solution<'_>> {
        if !self.is_blocked_by_friction(retained) {
            return None;
        }
        let mut u = retained.u.clone();
        let first_step = NewtonOptions {
            max_iterations: 1,
            ..self.newton
        };
        for options in [first_step, self.newton] {
            let balance = self.balance(frequency_hz, Mean::Free)?;
            let free = self.iterate(balance, u, self.stepping(), options, work);
            if self.walked_off(&free.u) {
                break;
            }
            if free.is_converged() {
                return self.is_blocked_by_friction(&free).then_some(free);
            }
            u = free.u;
        }
        let mut u = retained.u.clone();
        let max_iterations = RELEASE_ITERATIONS.min(self.newton.max_iterations);
        for fraction in RELEASE.into_iter().chain([0.0]) {
            let mut balance = Balance::new(&self.setting, TAU * frequency_hz);
            let mut options = NewtonOptions {
                max_iterations,
                ..self.newton
            };
            if fraction > 0.0 {
                balance = balance.retained_by(Cow::Owned(self.retention()?.softened(fraction)));
                options.tolerance = options.tolerance.max(RELEASE_TOLERANCE);
            }
            let solved = self.iterate(balance, u, self.stepping(), options, work);
            if !solved.is_converged() || !self.is_blocked_by_friction(&solved) {
                return None;
            }
            if fraction == 0.0 {
                return Some(solved);
            }
            u = solved.u;
        }
        None
    }

    /// Retained motion beside a free one that friction does not hold; `None` where none is found.
    fn with_mean_retained(
        &self,
        frequency_hz: f64,
        free: &Solution<'_>,
        work: &mut Work,
    ) -> Option<Solution<'_>> {
        let balance = self.balance(frequency_hz, Mean::Retained)?;
        let u = free.u.clone();
        let retained = self.iterate(balance, u, self.stepping(), self.newton, work);
        if !retained.is_converged() {
            return None;
        }
        Some(
            self.with_mean_released(frequency_hz, &retained, work)
                .unwrap_or(retained),
        )
    }

    /// Returns `true` if the pairs that stick throughout hold the motions that nothing else holds.
    pub fn is_blocked_by_friction(&self, solved: &Solution<'_>) -> bool {
        let Some(retention) = self.retention() else {
            return true;
        };
        let ends = &solved.evaluation.ends;
        let stuck = (0..ends.len()).filter(|pair| solved.balance.sticks(*pair, &ends[*pair]));
        retention.is_blocked_by(stuck)
    }

    fn iterate<'b>(
        &self,
        balance: Balance<'b>,
        u: Vec<f64>,
        method: Method,
        options: NewtonOptions,
        work: &mut Work,
    ) -> Solution<'b> {
        self.iterate_from(balance, Start::at(u), method, options, work)
    }

    /// Like [`FrequencySolver::iterate`], from a start at which the balance may be evaluated already.
    fn iterate_from<'b>(
        &self,
        mut balance: Balance<'b>,
        start: Start,
        method: Method,
        options: NewtonOptions,
        work: &mut Work,
    ) -> Solution<'b> {
        balance.deadline = work.deadline;
        let Start { mut u, known } = start;
        let (end, evaluation) = match method {
            Method::Krylov(tolerance) => {
                let walked_off = |u: &[f64]| balance.mean() == Mean::Free && self.walked_off(u);
                let mut system = KrylovSystem::new(
                    &balance,
                    &mut work.preconditioner,
                    tolerance,
                    options.tolerance,
                    &walked_off,
                );
                system.evaluator.keep(&u, known);
                let end = newton(&mut system, &mut u, options);
                work.krylov_iterations += system.krylov_iterations;
                (end, system.evaluator.take(&u))
            }
            Method::Exact => exact_newton(&balance, &mut u, known, options),
            Method::Dogleg => powell(&balance, &mut u, known, options),
        };
        work.newton_iterations += end.iterations;
        work.residuals.push(end.residuals.clone());
        Solution {
            balance,
            u,
            evaluation,
            end,
        }
    }

    /// Balance with this mean; `None` where there is nothing to retain.
    pub fn balance(&self, frequency_hz: f64, mean: Mean) -> Option<Balance<'_>> {
        let balance = Balance::new(&self.setting, TAU * frequency_hz);
        Some(match mean {
            Mean::Free => balance,
            Mean::Retained => balance.retained_by(Cow::Borrowed(self.retention()?)),
        })
    }

    /// Solution that is known, evaluated; `None` where its mean cannot be retained, or where it has
    /// not as many unknowns.
    pub fn evaluated(&self, frequency_hz: f64, u: &[f64], mean: Mean) -> Option<Solution<'_>> {
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
    pub fn is_exact(&self) -> bool {
        !matches!(self.stepping(), Method::Krylov(_))
    }

    /// Number of entries of U.
    pub fn unknowns(&self) -> usize {
        self.setting.fourier.width() * self.setting.system.unknowns()
    }

    /// U of the static state, without vibration.
    pub fn static_start(&self) -> Vec<f64> {
        let n = self.setting.system.unknowns();
        let mut u = vec![0.0; self.unknowns()];
        u[..n].copy_from_slice(self.setting.x_static);
        u
    }

    /// Returns `true` if friction does not even hold the static state.
    pub fn must_be_retained(&self) -> bool {
        self.setting.static_mean == Mean::Retained && self.retention().is_some()
    }

    /// Motions that only friction holds. `None` where there are none, or where fixed periods are
    /// asked for, which is how programs without a retention evaluate the law.
    pub fn retention(&self) -> Option<&Retention> {
        if self.setting.periods != Periods::UntilPeriodic {
            return None;
        }
        self.holding.retention()
    }

    /// Returns `true` if the mean of U has walked off the static state along a motion that only
    /// friction holds.
    pub fn walked_off(&self, u: &[f64]) -> bool {
        let (mean, rest) = u.split_at(self.setting.system.unknowns());
        let (anchor, vibration) = (self.setting.x_static, norm(rest));
        may_have_walked_off(mean, anchor, vibration)
            && self
                .retention()
                .is_some_and(|r| r.walked_off(mean, anchor, vibration))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::jacobians::{OMEGA_RAD_S, at_sample_points};

    #[test]
    fn a_solution_comes_with_what_the_pairs_do_there_however_it_ended() {
        let mut statuses = vec![];
        at_sample_points(|_, balance, u| {
            for method in [Method::Krylov(1e-2), Method::Exact, Method::Dogleg] {
                for max_iterations in [1, 3, 60] {
                    let newton = NewtonOptions::new(1e-9, max_iterations);
                    let setting = *balance.setting;
                    let holding = Holding::of(setting.system.problem);
                    let solver = Solver::NewtonKrylov;
                    let frequencies =
                        FrequencySolver::new(setting, newton, solver, &holding, &|_| ());
                    let mut work = Work::default();
                    // Pressed together, and excited little: there is a motion to be found.
                    let mut balance = Balance::new(balance.setting, OMEGA_RAD_S);
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
        });
        for status in [NewtonStatus::Converged, NewtonStatus::IterationLimit] {
            assert!(statuses.contains(&status), "{statuses:?}");
        }
    }
}
