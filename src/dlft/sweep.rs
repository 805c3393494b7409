//! Frequency response: the static state, then one harmonic balance per frequency.
//!
//! The frequencies are split in two halves, each swept from its end of the range towards the middle:
//! two cores share the work, and the answer does not depend on how many there are. A frequency is
//! started from its neighbour, then, failing that, from the static state, then by smaller steps, then
//! with a growing force.

use super::balance::{Balance, Setting};
use super::march::Periods;
use super::newton_krylov::{
    KRYLOV_TOLERANCE, KrylovSystem, LOOSE_KRYLOV_TOLERANCE, Preconditioner,
};
use super::orbit::{orbit, stuck_point};
use super::powell::powell;
use super::{Orbit, Outcome, Response, StaticState};
use crate::contact::dynamic_stiffness::ContactSystem;
use crate::numerics::fourier::Fourier;
use crate::numerics::newton::{NewtonEnd, NewtonOptions, NewtonStatus, newton};
use crate::reduction::RelativeModel;
use crate::reduction::damping::Rayleigh;
use crate::scene::{EpsChoice, Solver};

/// Smaller steps tried between a solved frequency and one that fails from both starts.
const BISECTIONS: u32 = 4;
/// Newton-GMRES that fails hands over to the dense dogleg up to this many unknowns.
const MOST_DENSE_UNKNOWNS: usize = 4000;
/// Default slip threshold, as a fraction of the largest static slip.
const SLIP_THRESHOLD: f64 = 1e-5;

/// How the response is computed.
#[derive(Debug, Clone)]
pub struct SweepSettings {
    pub frequencies_hz: Vec<f64>,
    pub harmonics: usize,
    pub samples: usize,
    pub newton: NewtonOptions,
    pub periods: Periods,
    pub solver: Solver,
    /// m; `None`: 1e-5 of the largest static slip.
    pub slip_threshold_m: Option<f64>,
}

/// eps per unknown, N/m, one value for N and one for both T of a pair.
pub fn eps_of(model: &RelativeModel, choice: EpsChoice, scale: f64) -> Vec<f64> {
    let k = &model.stiffness;
    match choice {
        EpsChoice::Pair => (0..model.pairs.len())
            .flat_map(|p| {
                let tangential = 0.5 * (k[(3 * p + 1, 3 * p + 1)] + k[(3 * p + 2, 3 * p + 2)]);
                [k[(3 * p, 3 * p)], tangential, tangential].map(|v| scale * v)
            })
            .collect(),
        EpsChoice::SpectralRadius => {
            let rho = scale * spectral_radius(model);
            vec![rho; k.nrows()]
        }
    }
}

/// Largest eigenvalue of K by power iteration (K is symmetric positive semi-definite).
fn spectral_radius(model: &RelativeModel) -> f64 {
    let n = model.stiffness.nrows();
    let mut v: Vec<f64> = (0..n).map(|i| 1.0 + (i as f64).sin()).collect();
    let mut w = vec![0.0; n];
    let mut rho = 0.0;
    for _ in 0..10_000 {
        let length = crate::numerics::gmres::norm(&v);
        v.iter_mut().for_each(|x| *x /= length);
        super::balance::apply_real(&model.stiffness, &v, &mut w);
        let next = crate::numerics::gmres::dot(&v, &w);
        std::mem::swap(&mut v, &mut w);
        if (next - rho).abs() <= 1e-13 * next {
            return next;
        }
        rho = next;
    }
    rho
}

/// Response at every frequency. `progress` is called once per finished point, from any thread.
pub fn sweep(
    model: &RelativeModel,
    damping: Rayleigh,
    eps: &[f64],
    static_state: &StaticState,
    settings: &SweepSettings,
    progress: &(dyn Fn(&Orbit) + Sync),
) -> Response {
    let highest_hz = settings
        .frequencies_hz
        .iter()
        .fold(0.0_f64, |m, f| m.max(*f));
    let top = std::f64::consts::TAU * highest_hz * settings.harmonics.max(1) as f64;
    let system = ContactSystem::new(model, damping, top);
    let fourier = Fourier::new(settings.harmonics, settings.samples);
    let largest_slip = static_state
        .x
        .chunks_exact(3)
        .fold(0.0_f64, |m, x| m.max(x[1].hypot(x[2])));
    let slip_threshold_m = settings
        .slip_threshold_m
        .unwrap_or(SLIP_THRESHOLD * largest_slip);
    let run = Run {
        setting: Setting {
            system: &system,
            fourier: &fourier,
            eps,
            x_static: &static_state.x,
            periods: settings.periods,
        },
        settings,
        slip_threshold_m,
    };
    let middle = settings.frequencies_hz.len().div_ceil(2);
    let (rising, falling) = settings.frequencies_hz.split_at(middle);
    let (mut orbits, upper) = rayon::join(
        || run.segment(rising.iter().copied(), progress),
        || run.segment(falling.iter().rev().copied(), progress),
    );
    orbits.extend(upper.into_iter().rev());
    let stuck = settings
        .frequencies_hz
        .iter()
        .map(|&f| stuck_point(&system, settings.harmonics, f))
        .collect();
    Response {
        stuck,
        orbits,
        slip_threshold_m,
    }
}

struct Run<'a> {
    setting: Setting<'a>,
    settings: &'a SweepSettings,
    slip_threshold_m: f64,
}

/// One way to solve a frequency from a start.
#[derive(Debug, Clone, Copy)]
enum Method {
    /// Newton-GMRES with this relative residual of the linear solves.
    Krylov(f64),
    /// Powell's hybrid method.
    Dogleg,
}

/// Work spent on one frequency, over all starts.
#[derive(Default)]
struct Effort {
    newton: usize,
    krylov: usize,
}

impl Run<'_> {
    fn segment(
        &self,
        frequencies_hz: impl Iterator<Item = f64>,
        progress: &(dyn Fn(&Orbit) + Sync),
    ) -> Vec<Orbit> {
        let mut preconditioner = Preconditioner::default();
        // Last converged frequency and its solution.
        let mut last: Option<(f64, Vec<f64>)> = None;
        frequencies_hz
            .map(|frequency_hz| {
                let orbit = self.point(frequency_hz, &mut last, &mut preconditioner);
                progress(&orbit);
                orbit
            })
            .collect()
    }

    fn point(
        &self,
        frequency_hz: f64,
        last: &mut Option<(f64, Vec<f64>)>,
        preconditioner: &mut Preconditioner,
    ) -> Orbit {
        let balance = self.balance(frequency_hz);
        let mut effort = Effort::default();
        // The neighbour and the static state, each by one method after the other.
        let starts: Vec<Vec<f64>> = last
            .iter()
            .map(|(_, u)| u.clone())
            .chain([self.cold()])
            .collect();
        let mut best: Option<(Vec<f64>, NewtonEnd)> = None;
        let methods = self.methods(balance.force.len());
        for (method, start) in methods
            .iter()
            .flat_map(|m| starts.iter().map(move |s| (*m, s)))
        {
            let mut u = start.clone();
            let end = self.solve(&balance, &mut u, preconditioner, &mut effort, method);
            let converged = end.status == NewtonStatus::Converged;
            let better = |(_, b): &(Vec<f64>, NewtonEnd)| converged || end.measure < b.measure;
            if best.as_ref().is_none_or(better) {
                best = Some((u, end));
            }
            if converged {
                break;
            }
        }
        let (mut u, mut end) = best.expect("there is always the static state to start from");
        if let (Some((from_hz, start)), false) = (&*last, end.status == NewtonStatus::Converged)
            && let Some((stepped, again)) =
                self.smaller_steps(*from_hz, start, frequency_hz, preconditioner, &mut effort)
        {
            (u, end) = (stepped, again);
        }
        if end.status != NewtonStatus::Converged
            && let Some((grown, again)) =
                self.growing_force(frequency_hz, preconditioner, &mut effort)
        {
            (u, end) = (grown, again);
        }
        let evaluation = balance.evaluate(&u);
        let mut outcome = Outcome::from(end.status);
        if outcome.is_converged() && evaluation.ends.iter().any(|e| !e.periodic) {
            outcome = Outcome::NotPeriodic;
        }
        let mut orbit = orbit(
            &balance,
            &u,
            &evaluation,
            frequency_hz,
            outcome,
            self.slip_threshold_m,
        );
        orbit.residual = end.measure;
        orbit.newton_iterations = effort.newton;
        orbit.krylov_iterations = effort.krylov;
        if orbit.outcome.is_converged() {
            *last = Some((frequency_hz, u));
        }
        orbit
    }

    /// What is tried on `unknowns` unknowns: the solver asked for first.
    fn methods(&self, unknowns: usize) -> Vec<Method> {
        match self.settings.solver {
            Solver::Powell => vec![Method::Dogleg],
            Solver::NewtonKrylov => [KRYLOV_TOLERANCE, LOOSE_KRYLOV_TOLERANCE]
                .map(Method::Krylov)
                .into_iter()
                .chain((unknowns <= MOST_DENSE_UNKNOWNS).then_some(Method::Dogleg))
                .collect(),
        }
    }

    fn first_method(&self) -> Method {
        self.methods(usize::MAX)[0]
    }

    fn balance(&self, frequency_hz: f64) -> Balance<'_> {
        Balance::new(&self.setting, std::f64::consts::TAU * frequency_hz)
    }

    /// The static state, no vibration.
    fn cold(&self) -> Vec<f64> {
        let n = self.setting.system.unknowns();
        let mut u = vec![0.0; self.setting.fourier.width() * n];
        u[..n].copy_from_slice(self.setting.x_static);
        u
    }

    fn solve(
        &self,
        balance: &Balance<'_>,
        u: &mut [f64],
        preconditioner: &mut Preconditioner,
        effort: &mut Effort,
        method: Method,
    ) -> NewtonEnd {
        let end = match method {
            Method::Krylov(tolerance) => {
                let mut system = KrylovSystem::new(balance, preconditioner, tolerance);
                let end = newton(&mut system, u, self.settings.newton);
                effort.krylov += system.krylov_iterations;
                end
            }
            Method::Dogleg => powell(balance, u, self.settings.newton),
        };
        effort.newton += end.iterations;
        end
    }

    /// Walks from a solved frequency in 2, 4, 8, ... steps until one walk arrives.
    fn smaller_steps(
        &self,
        from_hz: f64,
        start: &[f64],
        to_hz: f64,
        preconditioner: &mut Preconditioner,
        effort: &mut Effort,
    ) -> Option<(Vec<f64>, NewtonEnd)> {
        let balance = |fraction: f64| self.balance(from_hz + (to_hz - from_hz) * fraction);
        (1..=BISECTIONS)
            .find_map(|halvings| self.walk(start, 1 << halvings, &balance, preconditioner, effort))
    }

    /// Lets the vibrating part of the load grow from nothing in 4, 8, 16, ... steps.
    fn growing_force(
        &self,
        frequency_hz: f64,
        preconditioner: &mut Preconditioner,
        effort: &mut Effort,
    ) -> Option<(Vec<f64>, NewtonEnd)> {
        let start = self.cold();
        let balance = |fraction: f64| {
            let mut balance = self.balance(frequency_hz);
            let n = balance.unknowns_per_block();
            balance.force[n..].iter_mut().for_each(|f| *f *= fraction);
            balance
        };
        (2..=BISECTIONS + 1)
            .find_map(|halvings| self.walk(&start, 1 << halvings, &balance, preconditioner, effort))
    }

    /// Solves the problems `at(1 / steps), at(2 / steps), ..., at(1)`, each from the one before;
    /// `None` where one of them fails.
    fn walk<'b>(
        &'b self,
        start: &[f64],
        steps: u32,
        at: &dyn Fn(f64) -> Balance<'b>,
        preconditioner: &mut Preconditioner,
        effort: &mut Effort,
    ) -> Option<(Vec<f64>, NewtonEnd)> {
        let mut u = start.to_vec();
        let mut end = None;
        for step in 1..=steps {
            let balance = at(f64::from(step) / f64::from(steps));
            let solved = self.solve(
                &balance,
                &mut u,
                preconditioner,
                effort,
                self.first_method(),
            );
            if solved.status != NewtonStatus::Converged {
                return None;
            }
            end = Some(solved);
        }
        end.map(|end| (u, end))
    }
}
