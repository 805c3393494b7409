//! Course of a backbone from one amplitude to the next.
//!
//! The parameter is the logarithm of q, the amplitude of the tracked mode, or of a relative
//! displacement where no stuck mode moves. A point starts from the
//! last two, whose vibrations over q, means, frequencies and damping ratios are continued along
//! lines. A step that fails is halved.

use super::equations::{AmplitudeFamily, Tracked};
use super::{Backbone, BackboneEnd, BackbonePoint, BackboneRange};
use crate::damping::Rayleigh;
use crate::dlft::accuracy::shortfall;
use crate::dlft::balance::add_harmonic;
use crate::dlft::branch::bordered::{BorderedStart, corrected};
use crate::dlft::figure_errors::FigureErrors;

use crate::dlft::orbit::{complex_block, unforced_orbit};
use crate::dlft::point::{FrequencySolver, Solution, SolverWork, resized};
use crate::dlft::retention::Mean;
use crate::dlft::settings::Resolution;
use crate::dlft::sweep::{SweepSettings, SweepSolvers};
use crate::dlft::{Orbit, Outcome, StaticState};
use crate::problem::Problem;
use crate::problem::dynamic_stiffness::ContactSystem;
use crate::problem::unforced::Unforced;
use crate::reduced::HarmonicModel;
use dovetail_numerics::fourier::Fourier;
use dovetail_numerics::nonlinear::NewtonOptions;
use dovetail_numerics::spectrum::blocks;
use dovetail_numerics::vector::dot;
use faer::c64;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Newton iterations allowed to a step.
const MOST_ITERATIONS: usize = 30;
/// Shortest step in the logarithm of q: where it fails, the backbone ends.
const SHORTEST_STEP: f64 = 1e-3;
/// Longest step in the logarithm of q.
const LONGEST_STEP: f64 = 0.7;
/// First amplitude that is tried where the first one asked for has no solution, as a fraction of it;
/// each of the following attempts takes the same fraction again.
const SMALLER: f64 = 0.1;
const MOST_SMALLER: usize = 6;
/// Relative difference from an amplitude asked for at which it counts as reached.
const REACHED: f64 = 1e-6;
/// Relative difference from an amplitude asked for above which it is not reached.
const NEAR: f64 = 0.01;
/// Most points that are solved to reach an amplitude.
const MOST_CORRECTIONS: usize = 8;
/// Share of the pairs closed at rest that may be open in the whole period: with more the mode means
/// little.
const OPEN: f64 = 0.05;
/// Power of friction below this share of the other powers is rounding.
const NO_FRICTION: f64 = 1e-9;

/// Linear mode that a backbone begins at.
pub(crate) struct LinearMode {
    /// Stuck mode with the largest share, or without any the relative displacement that moves most.
    tracked: Tracked,
    /// Motion of the pairs for a unit of the tracked coordinate.
    x: Vec<c64>,
    /// Amplitude of the observed displacement for a unit of the tracked coordinate.
    observed: f64,
    omega: f64,
    ratio: f64,
}

impl LinearMode {
    /// Mode of the linear reference; `None` where it does not move the observed displacement.
    pub(crate) fn find(
        problem: &Problem,
        damping: Rayleigh,
        state: &StaticState,
        range: &BackboneRange,
    ) -> Option<Self> {
        let linear = state.linear.problem(problem, damping);
        let (of, of_linear) = (
            problem.reduced.harmonic_model(1),
            linear.reduced.harmonic_model(1),
        );
        let first = range.mode * of.copies();
        let system = ContactSystem::new(&linear, damping);
        // Dashpots and the air between blades couple the linear modes.
        let vanishing = Unforced {
            system: &system,
            tracked: &of_linear.moving_together(first),
            omega_rad_s: of_linear.model.omega2.get(first)?.sqrt(),
            damping_ratio: system.damping_ratio(1, first),
        };
        let vanishing = vanishing.pairless()?;
        let (mut x, mut q) = state.linear.first_harmonic_motion(problem, range.mode);
        let (tracked, unit) = match largest(&q) {
            Some(mode) => (Tracked::Mode(of.moving_together(mode)), q[mode]),
            None => {
                let row = largest(&x)?;
                let inertia_n_m = vanishing.omega_rad_s.powi(2) * mass_times(of, &x);
                let inertia_n_m = inertia_n_m / x[row].norm();
                (Tracked::Displacement { row, inertia_n_m }, x[row])
            }
        };
        x.iter_mut().chain(&mut q).for_each(|v| *v /= unit);
        let point = of.observations().get(range.observation)?;
        let observed = point.amplitude(&of.widened(&x), &q).norm();
        (observed > 0.0).then_some(Self {
            tracked,
            x,
            observed,
            omega: vanishing.omega_rad_s,
            ratio: vanishing.damping_ratio,
        })
    }
}

/// Number of the largest of some amplitudes; `None` where all are zero.
fn largest(amplitudes: &[c64]) -> Option<usize> {
    let larger = |a: &usize, b: &usize| amplitudes[*a].norm().total_cmp(&amplitudes[*b].norm());
    let largest = (0..amplitudes.len()).max_by(larger);
    largest.filter(|i| amplitudes[*i] != c64::ZERO)
}

/// Norm of M X, of complex amplitudes X of the pairs of one sector.
fn mass_times(of: HarmonicModel<'_>, x: &[c64]) -> f64 {
    let widened = of.widened(x);
    let moved = of.model.mass.row_iter().map(|row| {
        let products = row.iter().zip(widened.iter()).map(|(m, x)| *m * x);
        products.sum::<c64>().norm_sqr()
    });
    moved.sum::<f64>().sqrt()
}

/// Solved point from which the next one starts.
#[derive(Clone)]
struct SolvedAmplitude {
    log_q: f64,
    u: Vec<f64>,
    /// Frequency over that of the linear mode, and damping ratio.
    further: Vec<f64>,
    mean: Mean,
    amplitude_m: f64,
    point: BackbonePoint,
}

/// Follower of a backbone.
struct BackboneFollower<'b> {
    run: &'b SweepSolvers<'b>,
    mode: &'b LinearMode,
    observation: usize,
    accuracy: Option<f64>,
    most_seconds: Option<f64>,
    work: SolverWork,
    /// Last two points, the later one last.
    last: Vec<SolvedAmplitude>,
}

/// Follows a backbone through the amplitudes asked for.
pub(crate) fn followed(
    run: &SweepSolvers<'_>,
    mode: &LinearMode,
    settings: &SweepSettings,
    range: &BackboneRange,
    tell: &mut dyn FnMut(&BackbonePoint) -> bool,
) -> Backbone {
    let mut follower = BackboneFollower {
        run,
        mode,
        observation: range.observation,
        accuracy: match settings.resolution {
            Resolution::Accuracy(accuracy) => Some(accuracy),
            Resolution::Fixed { .. } => None,
        },
        most_seconds: settings.most_seconds,
        work: SolverWork::default(),
        last: Vec::new(),
    };
    let mut points = Vec::new();
    let mut end = BackboneEnd::Reached;
    for amplitude_m in &range.amplitudes_m {
        let Some(solved) = follower.reach(*amplitude_m) else {
            end = BackboneEnd::Lost;
            break;
        };
        if stays_open(&solved.point.orbit) {
            end = BackboneEnd::Open;
            break;
        }
        let mut point = solved.point;
        point.orbit.point = points.len();
        let goes_on = tell(&point);
        points.push(point);
        if !goes_on {
            end = BackboneEnd::Stopped;
            break;
        }
    }
    Backbone {
        points,
        end,
        linear_hz: mode.omega / TAU,
        linear_ratio: mode.ratio,
    }
}

/// Returns `true` if more than [`OPEN`] of the pairs that are closed at rest are open in the whole
/// period.
fn stays_open(orbit: &Orbit) -> bool {
    let closed = orbit.cycles.iter().filter(|c| !c.status.is_open_at_rest());
    let open = closed.clone().filter(|c| c.open_fraction >= 1.0).count();
    open as f64 > OPEN * closed.count() as f64
}

impl BackboneFollower<'_> {
    /// Point at which the observed displacement has an amplitude, to what a few solutions reach.
    fn reach(&mut self, amplitude_m: f64) -> Option<SolvedAmplitude> {
        let mut solution = match self.last.last() {
            None => self.first(amplitude_m)?,
            Some(last) => {
                let log_q = last.log_q + self.slope() * (amplitude_m / last.amplitude_m).ln();
                self.walk(log_q)?
            }
        };
        let mut slope = self.slope();
        for _ in 0..MOST_CORRECTIONS {
            let off = (amplitude_m / solution.amplitude_m).ln();
            if off.abs() < REACHED || stays_open(&solution.point.orbit) {
                break;
            }
            let log_q = solution.log_q + slope * off;
            let is_far = (slope * off).abs() > LONGEST_STEP;
            let next = if is_far {
                self.walk(log_q)
            } else {
                self.solve(log_q)
            };
            let Some(next) = next else {
                break;
            };
            let left = (amplitude_m / next.amplitude_m).ln();
            if left.abs() >= off.abs() {
                break;
            }
            slope = usable((next.log_q - solution.log_q) / (off - left));
            if !is_far {
                // The point before stays that of the amplitude before.
                self.last.pop();
                self.last.push(next.clone());
            }
            solution = next;
        }
        let off = (amplitude_m / solution.amplitude_m).ln();
        (off.abs() < NEAR || stays_open(&solution.point.orbit)).then_some(solution)
    }

    /// Derivative of log q by the logarithm of the observed amplitude.
    fn slope(&self) -> f64 {
        let [before, last] = &self.last[..] else {
            return 1.0;
        };
        usable((last.log_q - before.log_q) / (last.amplitude_m / before.amplitude_m).ln())
    }

    /// First point, from the linear mode, where need be from smaller amplitudes on.
    fn first(&mut self, amplitude_m: f64) -> Option<SolvedAmplitude> {
        let target = (amplitude_m / self.mode.observed).ln();
        for attempt in 0..=MOST_SMALLER {
            let log_q = target + attempt as f64 * SMALLER.ln();
            if let Some(solved) = self.solve(log_q) {
                self.last.push(solved.clone());
                return if attempt == 0 {
                    Some(solved)
                } else {
                    self.walk(target)
                };
            }
        }
        None
    }

    /// Goes to an amplitude of the tracked mode in as many steps as it takes.
    fn walk(&mut self, target: f64) -> Option<SolvedAmplitude> {
        let mut step = LONGEST_STEP;
        loop {
            let from = self.last.last()?.log_q;
            let left = target - from;
            if !left.is_finite() {
                return None;
            }
            let by = left.signum() * left.abs().min(step);
            match self.solve(from + by) {
                Some(solved) => {
                    self.last.push(solved.clone());
                    if self.last.len() > 2 {
                        self.last.remove(0);
                    }
                    if stays_open(&solved.point.orbit) || by == left {
                        return Some(solved);
                    }
                    step = (2.0 * step).min(LONGEST_STEP);
                }
                None if by.abs() <= SHORTEST_STEP => return None,
                None => step = 0.5 * by.abs(),
            }
        }
    }

    /// Solves at an amplitude of the tracked mode, with the harmonics that the accuracy takes.
    fn solve(&mut self, log_q: f64) -> Option<SolvedAmplitude> {
        self.work.start_counting(self.most_seconds);
        let lowest = self.run.refinement.lowest();
        let laws = lowest.setting.system.problem.laws.clone();
        let mut level = self.last.last().map_or(0, |last| {
            let Orbit { harmonics, .. } = last.point.orbit;
            let error = last.point.orbit.judged_error(&laws);
            self.run.refinement.neighbour_level(harmonics, error)
        });
        let mut solved = self.solve_from(log_q, level, None, &self.starts(log_q))?;
        if !self.run.estimates() {
            return Some(solved);
        }
        loop {
            let twice = Arc::clone(self.run.refinement.twice(level + 1));
            let finer = self.solve_from(log_q, level + 1, Some(&twice), &[solved.start()]);
            solved.estimate_errors(finer.as_ref());
            let Some(accuracy) = self.accuracy else {
                return Some(solved);
            };
            let error = solved.point.orbit.judged_error(&laws);
            if error.is_some_and(|error| error <= accuracy) {
                return Some(solved);
            }
            let Some(finer) = finer.filter(|_| level < self.run.refinement.highest()) else {
                solved.point.orbit.outcome = Outcome::AccuracyNotReached;
                return Some(solved);
            };
            solved = self
                .solve_from(log_q, level + 1, None, &[finer.start()])
                .unwrap_or(finer);
            level += 1;
        }
    }

    /// Starts for an amplitude of the tracked mode: continued, and as the last one scaled.
    fn starts(&self, log_q: f64) -> Vec<BorderedStart> {
        let n = self.run.refinement.lowest().setting.system.unknowns();
        let Some(last) = self.last.last() else {
            let solver = self.run.refinement.level(0);
            let mut u = solver.static_start();
            let q = log_q.exp();
            let x: Vec<c64> = self.mode.x.iter().map(|x| x * q).collect();
            add_harmonic(&mut u, 1, &x);
            return vec![BorderedStart {
                u,
                further: vec![1.0, self.mode.ratio],
                mean: solver.setting.static_mean,
            }];
        };
        let scaled = |solved: &SolvedAmplitude| {
            let (mut u, by) = (solved.u.clone(), (log_q - solved.log_q).exp());
            u[n..].iter_mut().for_each(|u| *u *= by);
            u
        };
        let mut starts = vec![BorderedStart {
            u: scaled(last),
            further: last.further.clone(),
            mean: last.mean,
        }];
        if let [before, last] = &self.last[..]
            && before.mean == last.mean
            && before.log_q != last.log_q
        {
            let t = (log_q - last.log_q) / (last.log_q - before.log_q);
            let line = |a: &[f64], b: &[f64]| -> Vec<f64> {
                let b = resized(b, a.len());
                a.iter().zip(&b).map(|(a, b)| a + t * (a - b)).collect()
            };
            let continued = BorderedStart {
                u: line(&scaled(last), &scaled(before)),
                further: line(&last.further, &before.further),
                mean: last.mean,
            };
            starts.insert(0, continued);
        }
        starts
    }

    /// Solves with the harmonics of a level, from the first start that leads to a motion. `fourier`
    /// has other samples than the level.
    fn solve_from(
        &mut self,
        log_q: f64,
        level: usize,
        fourier: Option<&Arc<Fourier>>,
        starts: &[BorderedStart],
    ) -> Option<SolvedAmplitude> {
        let solver = self.run.refinement.level(level);
        let with_samples = fourier.map(|f| solver.with_resolution(f, &solver.setting.eps));
        let solver = with_samples.as_ref().unwrap_or(solver);
        let family = AmplitudeFamily {
            solver,
            tracked: &self.mode.tracked,
            q: log_q.exp(),
            linear_omega: self.mode.omega,
        };
        let solved = starts
            .iter()
            .find_map(|start| settled(solver, &family, start, &mut self.work));
        let (solution, further) = solved?;
        let point = self.point(&solution, &family, &further);
        let amplitude_m = point.orbit.observed_amplitude[self.observation];
        (amplitude_m.is_finite() && amplitude_m > 0.0).then(|| SolvedAmplitude {
            log_q,
            mean: solution.balance.mean(),
            u: solution.u,
            further,
            amplitude_m,
            point,
        })
    }

    fn point(
        &self,
        solution: &Solution,
        family: &AmplitudeFamily<'_>,
        further: &[f64],
    ) -> BackbonePoint {
        let Solution {
            balance,
            u,
            evaluation,
            end,
        } = solution;
        let (motion, q) = (family.motion(further), family.q);
        let orbit = unforced_orbit(balance, u, evaluation, &motion, q);
        let x = complex_block(u, balance.unknowns_per_block(), 1);
        let modes = motion.modal_amplitudes(1, &x, q);
        let squared = modal_mass(&motion, &x, &modes);
        let worked = first_harmonic_work(&motion, &x, &modes);
        let resonant = 2.0 * motion.damping_ratio * motion.omega_rad_s.powi(2) * squared;
        BackbonePoint {
            damping_ratio: motion.damping_ratio,
            friction_ratio: friction_damping_ratio(&orbit),
            tracked_amplitude: q,
            modal_amplitude: squared.sqrt(),
            excitation_scale: worked
                .filter(|_| resonant > 0.0)
                .map(|worked| resonant / worked),
            estimated_error: None,
            friction_ratio_error: None,
            orbit: Orbit {
                newton_iterations: self.work.newton_iterations,
                krylov_iterations: self.work.krylov_iterations,
                newton_residuals: self.work.residuals.clone(),
                residual: end.measure,
                ..orbit
            },
        }
    }
}

/// Damping ratio that the power of friction makes alone, without rounding.
fn friction_damping_ratio(orbit: &Orbit) -> f64 {
    let (friction_w, other_w) = (orbit.friction_power_w, orbit.viscous_power_w);
    if friction_w.abs() <= NO_FRICTION * other_w.abs() {
        return 0.0;
    }
    friction_w / (4.0 * TAU * orbit.frequency_hz * orbit.kinetic_energy_j)
}

/// Derivative of log q by the logarithm of the observed amplitude; 1 in place of one that leads
/// astray.
fn usable(slope: f64) -> f64 {
    if (0.2..5.0).contains(&slope) {
        slope
    } else {
        1.0
    }
}

impl SolvedAmplitude {
    /// Start of the same motion with other harmonics or samples.
    fn start(&self) -> BorderedStart {
        BorderedStart {
            u: self.u.clone(),
            further: self.further.clone(),
            mean: self.mean,
        }
    }

    /// Estimates the errors from the point with further harmonics, if it was found.
    ///
    /// The error of the damping ratio is at most 1, and relative to that ratio or, where the air
    /// drives the mode, to that of friction alone if it is larger.
    fn estimate_errors(&mut self, finer: Option<&Self>) {
        let point = &mut self.point;
        let mut error = 1.0;
        if let Some(Self { point: finer, .. }) = finer {
            let factor = shortfall(point.orbit.harmonics, finer.orbit.harmonics);
            let size = |point: &BackbonePoint| point.damping_ratio.abs().max(point.friction_ratio);
            let off = (point.damping_ratio - finer.damping_ratio).abs();
            let relative = factor * off / size(point).max(size(finer));
            error = if relative < 1.0 { relative } else { 1.0 };
            let friction_off = (point.friction_ratio - finer.friction_ratio).abs();
            point.friction_ratio_error = Some(factor * friction_off);
            let figures = FigureErrors::from_distance(&point.orbit, &finer.orbit, factor);
            point.orbit.figure_errors = Some(figures);
        }
        point.estimated_error = Some(error);
        point.orbit.estimated_error = Some(error);
    }
}

/// Solves from a start with the mean that holds there: free where the pairs that stick hold the
/// bodies, and else retained.
fn settled(
    solver: &FrequencySolver<'_>,
    family: &AmplitudeFamily<'_>,
    start: &BorderedStart,
    work: &mut SolverWork,
) -> Option<(Solution, Vec<f64>)> {
    let entries = blocks(solver.setting.fourier.harmonics()) * solver.setting.system.unknowns();
    let options = NewtonOptions {
        max_iterations: MOST_ITERATIONS.min(solver.newton.max_iterations),
        ..solver.newton
    };
    let solve = |u: &[f64], further: &[f64], mean: Mean, work: &mut SolverWork| {
        let (u, further) = (u.to_vec(), further.to_vec());
        let corrected = corrected(
            solver,
            family,
            BorderedStart { u, further, mean },
            options,
            work,
        );
        corrected.filter(|(solution, _)| solution.is_converged())
    };
    let (mut u, mut further) = (resized(&start.u, entries), start.further.clone());
    if solver.must_be_retained() {
        return solve(&u, &further, Mean::Retained, work);
    }
    let is_held = |(solution, _): &(Solution, Vec<f64>)| {
        !solver.walked_off(&solution.u) && solver.is_blocked_by_friction(solution)
    };
    if start.mean == Mean::Free {
        let free = solve(&u, &further, Mean::Free, work);
        if free.as_ref().is_some_and(is_held) || solver.retention().is_none() {
            return free;
        }
        if let Some((solution, own)) = free.filter(|(s, _)| !solver.walked_off(&s.u)) {
            (u, further) = (solution.u, own);
        }
    }
    let retained = solve(&u, &further, Mean::Retained, work)?;
    // A free motion beside it that friction holds is the answer. There is none where friction does
    // not even hold the bodies beside the spring.
    let (solution, further) = &retained;
    if !solver.is_blocked_by_friction(solution) {
        return Some(retained);
    }
    let free = solve(&solution.u, further, Mean::Free, work).filter(is_held);
    Some(free.unwrap_or(retained))
}

/// Square of the modal amplitude of harmonic 1, `Y^H M Y`, of one sector.
fn modal_mass(motion: &Unforced<'_>, x: &[c64], modes: &[c64]) -> f64 {
    let of = motion.system.problem.reduced.harmonic_model(1);
    let (reduced, widened) = (of.model, of.widened(x));
    let mut sum = 0.0;
    for part in [|v: &c64| v.re, |v: &c64| v.im] {
        let x: Vec<f64> = widened.iter().map(part).collect();
        let q: Vec<f64> = modes.iter().map(part).collect();
        for (j, x_j) in x.iter().enumerate() {
            sum += x_j * dot(reduced.mass.col_as_slice(j), &x);
        }
        sum += dot(&q, &q);
        for (m, q) in q.iter().enumerate() {
            sum += 2.0 * q * dot(reduced.coupling.col_as_slice(m), &x);
        }
    }
    sum / of.copies() as f64
}

/// Size of `Y^H f` of one sector, where f is the excitation of harmonic 1 before condensation; `None`
/// where there is none of that harmonic or one of another, or where it does no work.
fn first_harmonic_work(motion: &Unforced<'_>, x: &[c64], modes: &[c64]) -> Option<f64> {
    let of = motion.system.problem.reduced.harmonic_model(1);
    let loads = &motion.system.problem.excitations;
    if loads.iter().any(|load| load.harmonic != 1) {
        return None;
    }
    let (mut sum, x) = (c64::new(0.0, 0.0), of.widened(x));
    for load in loads {
        let factor = load.factor(motion.omega_rad_s);
        let mut add = |motion: &[c64], cosine: &[f64], sine: &[f64]| {
            let parts = motion.iter().zip(cosine.iter().zip(sine));
            let of_parts = parts.map(|(y, (c, s))| y.conj() * c64::new(*c, -*s));
            sum += factor * of_parts.sum::<c64>();
        };
        add(&x, &load.cosine.on_x, &load.sine.on_x);
        add(modes, &load.cosine.on_modes, &load.sine.on_modes);
    }
    Some(sum.norm() / of.copies() as f64).filter(|work| *work > 0.0)
}
