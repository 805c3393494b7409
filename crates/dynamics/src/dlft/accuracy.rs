//! Choice of as many harmonics as a frequency needs for an accuracy, by the truncation error, which
//! is estimated from the harmonics left out.
//!
//! The contact forces of a motion with H harmonics have harmonics above H, which its balance leaves
//! out. In a finer balance they are a residual; its first Newton correction says how far the
//! observed amplitudes would move. A motion is judged by two such balances, with the next step of
//! harmonics and with about twice as many; for one harmonic both are the balance with three. Where
//! the larger estimate is above the accuracy asked for, the balance of the next step is solved, from
//! its corrected motion.
//!
//! One harmonic is not accepted where most pairs slip or open.
//!
//! For few unknowns a balance with four times the harmonics, or at least twice, is solved instead:
//! rigid friction at a point has kinks over which a linear step tells little, and amplitudes may
//! not change between two numbers of harmonics.

use super::balance::Setting;
use super::point::{
    FrequencySolver, HarmonicTruncation, MOST_EXACT_UNKNOWNS, Neighbour, Solution, SolverWork,
};
use crate::dlft::settings::Resolution;
use dovetail_numerics::fourier::Fourier;
use std::iter;
use std::sync::Arc;

/// Harmonics that are tried one after the other.
const STEPS: [usize; 9] = [1, 3, 5, 7, 9, 11, 15, 21, Resolution::MOST_ADAPTED];
/// Least ratio of the estimated error to the change of the amplitude by further harmonics. The
/// change falls short of the error: the harmonics above them are still left out, and the change is
/// found in one linear step.
pub(crate) const LEAST_SHORTFALL: f64 = 2.5;

/// Ratio of the estimated error to the change of the amplitude by the harmonics from `harmonics` up
/// to `finer`. In gross slip an amplitude approaches its limit as 1 / H: the error is then 1 / H,
/// and the change 1 / H - 1 / H'.
fn shortfall(harmonics: usize, finer: usize) -> f64 {
    LEAST_SHORTFALL.max(finer as f64 / (finer - harmonics) as f64)
}

/// Number of levels above the first that are tried where no solution is found on it.
const MOST_LEVELS_UP: usize = 3;

/// An estimate below this fraction of the accuracy lets the next frequency start with fewer
/// harmonics.
const PLENTY: f64 = 0.2;

/// Refinement in levels: balances with more and more harmonics, of which the last serves estimates
/// alone.
pub(crate) struct Refinement<'a> {
    levels: Vec<FrequencySolver<'a>>,
    /// Solver of [`Level::check`] of each level.
    checks: Vec<Option<FrequencySolver<'a>>>,
    /// Relative accuracy asked for; `None`: the first level is taken, whatever its error.
    accuracy: Option<f64>,
}

/// Frequency solved with the harmonics that it needs.
pub(crate) struct Resolved {
    /// Solution that was accepted.
    pub solved: Solution,
    /// Estimated relative error, at most 1, of each observed amplitude, or of the whole vibration
    /// where nothing is observed. Empty where the error was not estimated.
    pub estimated_errors: Vec<f64>,
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
            level,
            next_level: level,
        }
    }
}

/// Harmonics, samples and eps of a balance.
pub(crate) struct Level {
    /// Harmonics and samples.
    pub fourier: Arc<Fourier>,
    /// Parameter eps, as in [`Setting`].
    pub eps: Arc<[f64]>,
    /// Level with two to four times the harmonics, where that is small enough to be solved to judge
    /// this one.
    pub check: Option<Box<Level>>,
}

/// Levels of a resolution, with `eps(harmonics)` of each.
pub(crate) fn levels(
    resolution: Resolution,
    highest_excited: usize,
    eps: impl Fn(usize) -> Vec<f64>,
) -> Vec<Level> {
    let level = |harmonics, samples| Level {
        fourier: Fourier::new(harmonics, samples).into(),
        eps: eps(harmonics).into(),
        check: None,
    };
    let checked = |harmonics: usize, samples: &dyn Fn(usize) -> usize| {
        let mut base_level = level(harmonics, samples(harmonics));
        let most = (MOST_EXACT_UNKNOWNS / base_level.eps.len().max(1)).saturating_sub(1) / 2;
        let further = (4 * harmonics + 3).min(most);
        if further > 2 * harmonics {
            base_level.check = Some(Box::new(level(further, samples(further))));
        }
        base_level
    };
    match resolution {
        Resolution::Fixed { harmonics, samples } => {
            let carrying = |h| samples.max(Resolution::least_samples(h));
            // At least a fifth more: with fewer the change would be too small a part of the error.
            let next = STEPS
                .into_iter()
                .find(|h| 5 * h >= 6 * harmonics && *h < doubled(harmonics));
            let judges = next.into_iter().chain([doubled(harmonics)]);
            iter::once(checked(harmonics, &carrying))
                .chain(judges.map(|h| level(h, carrying(h))))
                .collect()
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

/// Samples of a period that keep their error at an eighth of `accuracy`, and carry the harmonics.
/// The error was found to be at most `2 / samples^2` of the amplitude (docs/method.md).
pub fn samples_for(accuracy: f64, harmonics: usize) -> usize {
    let for_accuracy = (16.0 / accuracy).sqrt().ceil() as usize;
    let least = Resolution::least_samples(harmonics);
    for_accuracy.max(least).next_power_of_two()
}

impl<'a> Refinement<'a> {
    /// Solvers like `lowest`, one for each of `levels`. The last one serves estimates alone; for a
    /// fixed number of harmonics all but the first do.
    pub(crate) fn new(
        lowest: &FrequencySolver<'a>,
        levels: &[Level],
        resolution: Resolution,
    ) -> Self {
        let solver_at = |level: &Level| lowest.with_resolution(&level.fourier, &level.eps);
        let check_of = |level: &Level| level.check.as_deref().map(solver_at);
        Self {
            levels: levels.iter().map(solver_at).collect(),
            checks: levels.iter().map(check_of).collect(),
            accuracy: match resolution {
                Resolution::Fixed { .. } => None,
                Resolution::Accuracy(accuracy) => Some(accuracy),
            },
        }
    }

    /// Solvers of the same levels, but otherwise like `solver`, such as one of another model.
    pub(crate) fn rebuilt<'s>(&self, solver: &FrequencySolver<'s>) -> Refinement<'s> {
        let levels_with = |of_level: &FrequencySolver<'_>| {
            let Setting { fourier, eps, .. } = &of_level.setting;
            solver.with_resolution(fourier, eps)
        };
        Refinement {
            levels: self.levels.iter().map(levels_with).collect(),
            checks: self
                .checks
                .iter()
                .map(|check| check.as_ref().map(levels_with))
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
        let enough = |level: &FrequencySolver<'_>| level.setting.fourier.harmonics() >= harmonics;
        self.levels.iter().position(enough).unwrap_or(0)
    }

    /// Solver of the first level with at least so many harmonics.
    pub(crate) fn solver_for_harmonics(&self, harmonics: usize) -> &FrequencySolver<'_> {
        &self.levels[self.level_of(harmonics)]
    }

    /// Solver of the lowest level, for what is the same on all levels.
    pub(crate) fn lowest(&self) -> &FrequencySolver<'_> {
        &self.levels[0]
    }

    /// Solves one frequency by `solve` on level `from`, or on one of the next above it where no
    /// solution is found. Returns the level of the solution, and the solution.
    pub(crate) fn solve(
        &self,
        from: usize,
        work: &mut SolverWork,
        solve: impl Fn(&FrequencySolver<'_>, &mut SolverWork) -> Solution,
    ) -> (usize, Solution) {
        let highest = self.highest();
        let mut level = from.min(highest);
        let mut solved = solve(&self.levels[level], work);
        let last = highest.min(level + MOST_LEVELS_UP);
        while !solved.is_converged() && level < last {
            level += 1;
            solved = solve(&self.levels[level], work);
        }
        (level, solved)
    }

    /// Highest level that a frequency may be solved on.
    pub(crate) fn highest(&self) -> usize {
        match self.accuracy {
            Some(_) => self.levels.len() - 2,
            None => 0,
        }
    }

    /// Solver of a level.
    pub(crate) fn level(&self, level: usize) -> &FrequencySolver<'a> {
        &self.levels[level]
    }

    /// Estimates the error of a solution of a level, and solves levels above until the accuracy
    /// asked for is reached.
    pub(crate) fn refined(
        &self,
        frequency_hz: f64,
        mut level: usize,
        mut solved: Solution,
        work: &mut SolverWork,
    ) -> Resolved {
        let highest = self.highest();
        loop {
            if !solved.is_converged() {
                return Resolved::unestimated(level, solved);
            }
            let (estimated_errors, finer) = self.estimate(level, &solved, frequency_hz, work);
            let largest = estimated_errors.iter().copied().fold(0.0, f64::max);
            let fine = self.accuracy.is_none_or(|a| largest <= a);
            let suffices = fine && !(highest > level && self.is_rough(level, &solved));
            if !suffices {
                let start = Neighbour::following(None, frequency_hz, finer, solved.balance.mean());
                // A level may have no solution that is found, and the one above it may.
                let refined = (level + 1..=highest).find_map(|above| {
                    let finer = self.levels[above].solve_from(frequency_hz, &start, work);
                    finer.is_converged().then_some((above, finer))
                });
                if let Some((above, finer)) = refined {
                    (level, solved) = (above, finer);
                    continue;
                }
            }
            let fewer = self.is_plenty(largest) && level > 0 && !self.is_rough(level - 1, &solved);
            return Resolved {
                solved,
                estimated_errors,
                is_accurate: suffices,
                level,
                next_level: level - usize::from(fewer),
            };
        }
    }

    /// Estimated error of each observed amplitude of a motion of this level, and the motion with
    /// further harmonics. The error is the largest of those by the next harmonics and by up to
    /// twice as many.
    fn estimate(
        &self,
        level: usize,
        solved: &Solution,
        frequency_hz: f64,
        work: &mut SolverWork,
    ) -> (Vec<f64>, Vec<f64>) {
        let harmonics = self.harmonics(level);
        let finer: Vec<(usize, HarmonicTruncation)> = match &self.checks[level] {
            Some(check) => {
                let work = work.estimate_work(0);
                let finer = check.truncation_by_finer_solution(solved, frequency_hz, work);
                vec![(check.setting.fourier.harmonics(), finer)]
            }
            None => {
                let mut judges = vec![level + 1, self.level_of(doubled(harmonics))];
                judges.dedup();
                let finer: Vec<&FrequencySolver<'_>> =
                    judges.iter().map(|judge| &self.levels[*judge]).collect();
                let truncations = FrequencySolver::truncations(&finer, solved, frequency_hz, work);
                let harmonics = judges.iter().map(|judge| self.harmonics(*judge));
                harmonics.zip(truncations).collect()
            }
        };
        let mut errors = vec![0.0_f64; finer[0].1.changes.len()];
        for (of, truncation) in &finer {
            let shortfall = shortfall(harmonics, *of);
            for (error, change) in errors.iter_mut().zip(&truncation.changes) {
                *error = error.max(shortfall * change).min(1.0);
            }
        }
        let (_, first) = finer.into_iter().next().expect("one at least");
        (errors, first.u)
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
        self.levels[level].setting.fourier.harmonics()
    }
}
