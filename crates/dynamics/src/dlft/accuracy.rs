//! Choice of as many harmonics as a frequency needs for an accuracy, by the errors of its figures,
//! which are estimated from the harmonics left out and from twice the samples.
//!
//! The contact forces of a motion with H harmonics have harmonics above H, which its balance leaves
//! out. In a finer balance they are a residual, as is what its samples leave of a force with corners.
//! Its first Newton correction says how far the observed amplitudes, the powers and the contact
//! forces would move. A motion is judged by such a balance with about twice as many harmonics. Where the
//! estimate is above the accuracy asked for, the balance of the next step is solved, from the
//! corrected motion. The friction power and the largest contact force may err three times as much as
//! the amplitudes.
//!
//! One harmonic is not accepted where most pairs slip or open.
//!
//! For few unknowns a balance with four times the harmonics, or at least twice, is solved instead:
//! rigid friction at a point has kinks over which a linear step tells little, and amplitudes may
//! not change between two numbers of harmonics. This finer solution is judged by a still finer balance
//! before it is believed. Where one linear step already shows that the motion is far from the accuracy, the
//! next level is solved without it.

use super::Orbit;
use super::balance::Setting;
use super::figure_errors::{FigureErrors, relative};
use super::point::{
    AmplitudeChange, EstimatedMotion, FinerMotion, FrequencySolver, Judge, MOST_CHECKED_UNKNOWNS,
    Neighbour, Solution, SolverWork,
};
use crate::dlft::settings::Resolution;
use dovetail_numerics::fourier::Fourier;
use std::sync::Arc;

/// Harmonics that are tried one after the other.
const STEPS: [usize; 9] = [1, 3, 5, 7, 9, 11, 15, 21, Resolution::MOST_ADAPTED];
/// Least ratio of the estimated error to the change of the amplitude by further harmonics. The
/// change falls short of the error: the harmonics above them are still left out, and the change is
/// found in one linear step.
const LEAST_SHORTFALL: f64 = 3.0;
/// The same ratio for a finer balance that is solved, and whose own error is known.
const SOLVED_SHORTFALL: f64 = 2.0;

/// Ratio of the estimated error to the change of the amplitude by the harmonics from `harmonics` up
/// to `finer`. In gross slip an amplitude approaches its limit as 1 / H: the error is then 1 / H,
/// and the change 1 / H - 1 / H'.
pub(crate) fn shortfall(harmonics: usize, finer: usize) -> f64 {
    LEAST_SHORTFALL.max(omission(harmonics, finer))
}

/// Ratio of an error that falls as 1 / H to its change from `harmonics` to `finer`.
fn omission(harmonics: usize, finer: usize) -> f64 {
    finer as f64 / (finer - harmonics) as f64
}

/// Most unknowns of a check that has more than about twice the harmonics.
const CHEAP_CHECK_UNKNOWNS: usize = 400;

/// A motion whose linear estimate is above this multiple of the accuracy is not checked by a finer
/// solution, which would hardly ever show less, and takes the longest where it is not found.
const FAR_OFF: f64 = 10.0;

/// Number of levels above the first that are tried where no solution is found on it, and most unknowns of
/// those that are tried beyond them.
const MOST_LEVELS_UP: usize = 3;
const MOST_SMALL_UNKNOWNS: usize = 1000;

/// An estimate below this fraction of the accuracy lets the next frequency start with fewer
/// harmonics.
const PLENTY: f64 = 0.2;

/// Refinement in levels: balances with more and more harmonics, of which the last serves estimates
/// alone.
pub(crate) struct Refinement<'a> {
    levels: Vec<Judge<'a>>,
    /// Solvers of [`Level::check`] of each level.
    checks: Vec<Option<CheckSolvers<'a>>>,
    /// Relative accuracy asked for; `None`: the first level is taken, whatever its error.
    accuracy: Option<f64>,
}

/// Solvers of a [`Check`].
struct CheckSolvers<'a> {
    solved: Judge<'a>,
    judge: Option<Judge<'a>>,
}

/// Errors of a motion, and a start for the next level.
struct Estimate {
    /// Relative error of each observed amplitude, at most 1.
    observed: Vec<f64>,
    figures: Option<FigureErrors>,
    /// U with more harmonics.
    finer: Vec<f64>,
}

/// Frequency solved with the harmonics that it needs.
pub(crate) struct Resolved {
    /// Solution that was accepted.
    pub solved: Solution,
    /// Estimated relative error, at most 1, of each observed amplitude, or of the whole vibration
    /// where nothing is observed. Empty where the error was not estimated.
    pub estimated_errors: Vec<f64>,
    /// Estimated errors of the other figures; `None` where they are not known.
    pub figure_errors: Option<FigureErrors>,
    /// Figures of the solution, where they were needed to estimate errors.
    pub orbit: Option<Orbit>,
    /// True if the estimate is within the accuracy, or no accuracy is asked for.
    pub is_accurate: bool,
    /// Level of the solution.
    pub level: usize,
    /// Level to begin on at a neighbouring frequency.
    pub next_level: usize,
}

impl Resolved {
    /// Solution of a level as it is, whose error is not estimated.
    pub(crate) fn unestimated(level: usize, solved: Solution) -> Self {
        Self {
            is_accurate: solved.is_converged(),
            solved,
            estimated_errors: Vec::new(),
            figure_errors: None,
            orbit: None,
            level,
            next_level: level,
        }
    }
}

/// Harmonics and samples of a balance, and its eps.
pub(crate) struct Grid {
    /// Harmonics and samples.
    fourier: Arc<Fourier>,
    /// As many harmonics with twice the samples.
    twice: Arc<Fourier>,
    /// Parameter eps, as in [`Setting`].
    eps: Arc<[f64]>,
}

/// Balance that a frequency is solved with, or judged by.
pub(crate) struct Level {
    grid: Grid,
    /// Finer balance that is solved to judge this one, where it is small enough.
    check: Option<Check>,
}

/// Balance with two to four times the harmonics and twice the samples.
struct Check {
    solved: Grid,
    /// Still finer balance, by which the solution is judged.
    judge: Option<Grid>,
}

impl Level {
    /// Harmonics and samples, and eps.
    pub(crate) fn fourier_and_eps(&self) -> (&Arc<Fourier>, &Arc<[f64]>) {
        (&self.grid.fourier, &self.grid.eps)
    }
}

impl Grid {
    fn new(harmonics: usize, samples: usize, eps: Vec<f64>) -> Self {
        Self {
            fourier: Fourier::new(harmonics, samples).into(),
            twice: Fourier::new(harmonics, 2 * samples).into(),
            eps: eps.into(),
        }
    }

    fn judge<'a>(&self, lowest: &FrequencySolver<'a>) -> Judge<'a> {
        Judge {
            solver: lowest.with_resolution(&self.fourier, &self.eps),
            twice: Arc::clone(&self.twice),
        }
    }
}

/// Levels of a resolution, with `eps(harmonics)` of each.
pub(crate) fn levels(
    resolution: Resolution,
    highest_excited: usize,
    eps: impl Fn(usize) -> Vec<f64>,
) -> Vec<Level> {
    let level = |harmonics, samples| Level {
        grid: Grid::new(harmonics, samples, eps(harmonics)),
        check: None,
    };
    let checked = |harmonics: usize, samples: &dyn Fn(usize) -> usize| {
        let mut base_level = level(harmonics, samples(harmonics));
        let unknowns = base_level.grid.eps.len().max(1);
        let fitting = |limit: usize| (limit / unknowns).saturating_sub(1) / 2;
        let most = fitting(MOST_CHECKED_UNKNOWNS);
        let cheap = fitting(CHEAP_CHECK_UNKNOWNS).max(doubled(harmonics));
        let further = (4 * harmonics + 3).min(cheap).min(most);
        if further > 2 * harmonics {
            let solved = 2 * samples(further).max(samples(harmonics));
            let finest = doubled(further)
                .min(most)
                .min(doubled(Resolution::MOST_ADAPTED));
            let is_finer = 5 * finest >= 6 * further;
            base_level.check = Some(Check {
                solved: Grid::new(further, solved, eps(further)),
                judge: is_finer
                    .then(|| Grid::new(finest, solved.max(samples(finest)), eps(further))),
            });
        }
        base_level
    };
    match resolution {
        Resolution::Fixed { harmonics, samples } => {
            let carrying = |h| samples.max(Resolution::least_samples(h));
            let finer = doubled(harmonics);
            vec![checked(harmonics, &carrying), level(finer, carrying(finer))]
        }
        Resolution::Accuracy(accuracy) => {
            let steps = STEPS.into_iter().filter(|h| *h >= highest_excited);
            steps
                .chain([doubled(Resolution::MOST_ADAPTED.max(highest_excited))])
                .map(|h| checked(h, &|h| samples_for(accuracy, h)))
                .collect()
        }
    }
}

/// Number of harmonics of the finer of the two balances that judge one with `harmonics`.
fn doubled(harmonics: usize) -> usize {
    2 * harmonics + 1
}

/// Samples of a period for a motion with so many harmonics: enough for an error of `2 / samples^2`, as
/// most amplitudes have, to be an eighth of `accuracy`, and twice as many as carry the harmonics, so
/// that the error of the samples falls with that of the harmonics.
pub fn samples_for(accuracy: f64, harmonics: usize) -> usize {
    let for_accuracy = (16.0 / accuracy).sqrt().ceil() as usize;
    let carrying = 2 * Resolution::least_samples(harmonics);
    for_accuracy.max(carrying).next_power_of_two()
}

impl<'a> Refinement<'a> {
    /// Solvers like `lowest`, one for each of `levels`. The last one serves estimates alone; for a
    /// fixed number of harmonics all but the first do.
    pub(crate) fn new(
        lowest: &FrequencySolver<'a>,
        levels: &[Level],
        resolution: Resolution,
    ) -> Self {
        let check_of = |check: &Check| CheckSolvers {
            solved: check.solved.judge(lowest),
            judge: check.judge.as_ref().map(|judge| judge.judge(lowest)),
        };
        let checks = levels.iter().map(|level| level.check.as_ref());
        Self {
            levels: levels
                .iter()
                .map(|level| level.grid.judge(lowest))
                .collect(),
            checks: checks.map(|check| check.map(check_of)).collect(),
            accuracy: match resolution {
                Resolution::Fixed { .. } => None,
                Resolution::Accuracy(accuracy) => Some(accuracy),
            },
        }
    }

    /// Solvers of the same levels, but otherwise like `solver`, such as one of another model.
    pub(crate) fn rebuilt<'s>(&self, solver: &FrequencySolver<'s>) -> Refinement<'s> {
        let rebuilt = |judge: &Judge<'_>| {
            let Setting { fourier, eps, .. } = &judge.solver.setting;
            Judge {
                solver: solver.with_resolution(fourier, eps),
                twice: Arc::clone(&judge.twice),
            }
        };
        let rebuilt_check = |check: &CheckSolvers<'_>| CheckSolvers {
            solved: rebuilt(&check.solved),
            judge: check.judge.as_ref().map(rebuilt),
        };
        Refinement {
            levels: self.levels.iter().map(rebuilt).collect(),
            checks: self
                .checks
                .iter()
                .map(|check| check.as_ref().map(rebuilt_check))
                .collect(),
            accuracy: self.accuracy,
        }
    }

    /// Level for a motion beside one of so many harmonics and this estimated error: one lower, where
    /// the error is far below the accuracy asked for.
    pub(crate) fn neighbour_level(&self, harmonics: usize, estimated_error: Option<f64>) -> usize {
        let level = self.level_of(harmonics);
        let plenty = estimated_error.is_some_and(|error| self.is_plenty(error));
        level.saturating_sub(usize::from(plenty))
    }

    /// Returns `true` if an estimated error lets a neighbouring motion do with fewer harmonics.
    fn is_plenty(&self, estimated_error: f64) -> bool {
        self.accuracy.is_some_and(|a| estimated_error <= PLENTY * a)
    }

    /// Number of the first level with at least so many harmonics.
    pub(crate) fn level_of(&self, harmonics: usize) -> usize {
        let levels = 0..self.levels.len();
        let enough = |level: &usize| self.harmonics(*level) >= harmonics;
        levels.into_iter().find(enough).unwrap_or(0)
    }

    /// Solver of the lowest level, for what is the same on all levels.
    pub(crate) fn lowest(&self) -> &FrequencySolver<'_> {
        self.level(0)
    }

    /// Solves one frequency by `solve` on level `from`, or on one of the next above it where no
    /// solution is found. Returns the level of the solution, and the solution.
    pub(crate) fn solve(
        &self,
        from: usize,
        work: &mut SolverWork,
        solve: impl Fn(&FrequencySolver<'_>, &mut SolverWork) -> Solution,
    ) -> (usize, Solution) {
        let mut level = from.min(self.highest());
        let mut solved = solve(self.level(level), work);
        let first = level;
        while !solved.is_converged() {
            let Some(above) = self.level_above(level, first) else {
                break;
            };
            level = above;
            work.begin_anew();
            solved = solve(self.level(level), work);
        }
        (level, solved)
    }

    /// Level with about twice the harmonics, for a motion that is not found from level `first` on. Above
    /// some levels there is none where the unknowns are many.
    fn level_above(&self, level: usize, first: usize) -> Option<usize> {
        let highest = self.highest();
        if level >= highest {
            return None;
        }
        let doubled = self.level_of(doubled(self.harmonics(level)));
        let above = doubled.clamp(level + 1, highest);
        let is_small = self.level(above).unknowns() <= MOST_SMALL_UNKNOWNS;
        (is_small || above <= first + MOST_LEVELS_UP).then_some(above)
    }

    /// Highest level that a frequency may be solved on.
    pub(crate) fn highest(&self) -> usize {
        match self.accuracy {
            Some(_) => self.levels.len() - 2,
            None => 0,
        }
    }

    /// Harmonics of a level with twice its samples.
    pub(crate) fn twice(&self, level: usize) -> &Arc<Fourier> {
        &self.levels[level].twice
    }

    /// Solver of a level.
    pub(crate) fn level(&self, level: usize) -> &FrequencySolver<'a> {
        &self.levels[level].solver
    }

    /// Estimates the error of a solution of a level, and solves levels above until the accuracy
    /// asked for is reached. Powers and contact forces ask for harmonics, too, where `judges_figures` is
    /// true.
    pub(crate) fn refined(
        &self,
        frequency_hz: f64,
        mut level: usize,
        mut solved: Solution,
        judges_figures: bool,
        work: &mut SolverWork,
    ) -> Resolved {
        let highest = self.highest();
        loop {
            if !solved.is_converged() {
                return Resolved::unestimated(level, solved);
            }
            let motion = EstimatedMotion::new(&solved, frequency_hz);
            let estimate = self.estimate(level, &motion, work);
            let laws = &solved.balance.setting.system.problem.laws;
            let figures = estimate.figures.as_ref().filter(|_| judges_figures);
            let of_figures = figures.map_or(0.0, |f| f.as_amplitude_error(&motion.orbit, laws));
            let largest = estimate.observed.iter().copied().fold(of_figures, f64::max);
            let fine = self.accuracy.is_none_or(|a| largest <= a);
            let suffices = fine && !(highest > level && self.is_rough(level, &solved));
            if !suffices {
                let finer = estimate.finer;
                let start = Neighbour::following(None, frequency_hz, finer, solved.balance.mean());
                // A level may have no solution that is found, and one of the next above it may.
                let mut next = (level + 1..=highest).take(MOST_LEVELS_UP);
                let refined = next.find_map(|above| {
                    if self.level(above).budget_exhausted(work) {
                        return None;
                    }
                    let finer = self.level(above).solve_from(frequency_hz, &start, work);
                    finer.is_converged().then_some((above, finer))
                });
                if let Some((above, finer)) = refined {
                    (level, solved) = (above, finer);
                    continue;
                }
            }
            let orbit = motion.orbit;
            let fewer = self.is_plenty(largest) && level > 0 && !self.is_rough(level - 1, &solved);
            return Resolved {
                solved,
                estimated_errors: estimate.observed,
                figure_errors: estimate.figures,
                orbit: Some(orbit),
                is_accurate: suffices,
                level,
                next_level: level - usize::from(fewer),
            };
        }
    }

    /// Estimates the errors of a motion of this level.
    fn estimate(
        &self,
        level: usize,
        motion: &EstimatedMotion<'_>,
        work: &mut SolverWork,
    ) -> Estimate {
        let Some(check) = &self.checks[level] else {
            let judge = self.level_of(doubled(self.harmonics(level)));
            return estimate_by_correction(&self.levels[judge], motion, work.estimate_work(0));
        };
        let (solver, coarse) = (&check.solved.solver, motion.solution);
        let work_on_check = work.estimate_work(0);
        let mut corrected = None;
        if let Some(accuracy) = self.accuracy.filter(|_| level < self.highest()) {
            let estimate = estimate_by_correction(&check.solved, motion, work_on_check);
            if estimate
                .observed
                .iter()
                .any(|error| *error > FAR_OFF * accuracy)
            {
                return estimate;
            }
            corrected = Some(estimate);
        }
        if let Some(finer) = solver.finer_solution(coarse, motion.frequency_hz, work_on_check) {
            return check.estimate(&finer, motion, work);
        }
        corrected
            .unwrap_or_else(|| estimate_by_correction(&check.solved, motion, work.estimate_work(0)))
    }

    /// Returns `true` if this level has one harmonic, and most pairs slip or open: a linear step
    /// does not tell how far further harmonics move such a motion.
    fn is_rough(&self, level: usize, solved: &Solution) -> bool {
        let ends = &solved.evaluation.ends;
        let sticks = |pair: &usize| solved.balance.sticks(*pair, &ends[*pair]);
        let stuck = (0..ends.len()).filter(sticks).count();
        self.harmonics(level) == 1 && 2 * stuck < ends.len()
    }

    fn harmonics(&self, level: usize) -> usize {
        self.levels[level].harmonics()
    }
}

/// Errors of a motion by the Newton correction of a finer balance. The corrected motion is the start
/// for the next level.
fn estimate_by_correction(
    judge: &Judge<'_>,
    motion: &EstimatedMotion<'_>,
    work: &mut SolverWork,
) -> Estimate {
    let finer = judge.correction(motion, work);
    let factor = shortfall(motion.orbit.harmonics, judge.harmonics());
    let changes = finer.changes.iter();
    Estimate {
        observed: changes
            .map(|change| relative(factor * change.by, change.of))
            .collect(),
        figures: finer_figures(motion, &finer, factor),
        finer: finer.u,
    }
}

/// Errors of the figures of a motion beside a finer one; `None` where that was not found.
fn finer_figures(
    motion: &EstimatedMotion<'_>,
    finer: &FinerMotion,
    factor: f64,
) -> Option<FigureErrors> {
    let figures = FigureErrors::from_distance(&motion.orbit, finer.orbit.as_ref()?, factor);
    Some(match &finer.sampled {
        Some(cycles) => {
            let sampled = FigureErrors::from_cycles(&motion.orbit, cycles);
            figures.combined(&sampled, |a, b| a + factor * b)
        }
        None => figures,
    })
}

impl CheckSolvers<'_> {
    /// Errors of a motion beside the solution of the finer balance, which has an error of its own.
    fn estimate(
        &self,
        finer: &Solution,
        motion: &EstimatedMotion<'_>,
        work: &mut SolverWork,
    ) -> Estimate {
        let finer = EstimatedMotion::new(finer, motion.frequency_hz);
        let Solution {
            balance,
            u,
            evaluation,
            ..
        } = finer.solution;
        let harmonics = finer.orbit.harmonics;
        let own_harmonics = motion.orbit.harmonics;
        let factor = SOLVED_SHORTFALL.max(omission(own_harmonics, harmonics));
        let change = motion.change_to_evaluated(balance, u.clone(), evaluation);
        let distance = |factor| FigureErrors::from_distance(&motion.orbit, &finer.orbit, factor);
        let (mut observed, mut figures) = (Vec::new(), distance(factor));
        let judged = self.judge.as_ref().map(|judge| {
            let corrected = judge.correction(&finer, work.estimate_work(1));
            (corrected, shortfall(harmonics, judge.harmonics()))
        });
        // A correction that is not found says nothing.
        let judged = judged.filter(|(corrected, _)| corrected.orbit.is_some());
        for (i, change) in change.changes.iter().enumerate() {
            let AmplitudeChange { by, of } = *change;
            let own = judged
                .as_ref()
                .map_or(0.0, |(corrected, factor)| factor * corrected.changes[i].by);
            observed.push(relative((factor * by).max(by + own), of));
        }
        if let Some((corrected, factor)) = &judged
            && let Some(own) = finer_figures(&finer, corrected, *factor)
        {
            let sum = distance(1.0).combined(&own, |a, b| a + b);
            figures = figures.combined(&sum, f64::max);
        }
        Estimate {
            observed,
            figures: Some(figures),
            finer: change.u,
        }
    }
}
