//! As many harmonics as a frequency needs for an accuracy: the truncation error, estimated from the harmonics
//! left out.
//!
//! The contact forces of a motion with H harmonics have harmonics above H, which its balance leaves out. Let in, they are
//! a residual of the finer balance; its first Newton correction says how far the observed amplitudes would
//! move. Where that is more than the accuracy asked for, the finer balance is solved, from the corrected motion.
//!
//! Of few unknowns a balance with four times the harmonics, or at least twice, is solved instead: rigid friction at a point has
//! kinks over which a linear step tells little, and amplitudes that stay between two numbers of harmonics.

use super::balance::Setting;
use super::point::{Frequencies, MOST_EXACT_UNKNOWNS, Neighbour, Solved, Work};
use super::retention::Retention;
use crate::dlft::settings::{Resolution, Solver};
use dovetail_numerics::fourier::Fourier;
use dovetail_numerics::newton::NewtonOptions;
use std::sync::OnceLock;

/// Harmonics that are tried one after the other.
const STEPS: [usize; 9] = [1, 3, 5, 7, 9, 11, 15, 21, Resolution::MOST_ADAPTED];
/// Harmonics that serve the estimate of the last of them.
const BEYOND: usize = 43;

/// The error is estimated at this multiple of the first correction, which lets in the next harmonics only, in one linear step: of
/// 65 motions at five accuracies 16 were further off than so estimated, none by more than its accuracy (docs/method.md).
const SHORTFALL: f64 = 2.5;

/// Rungs above the first that are tried where it has no solution that is found.
const MOST_CLIMBS: usize = 3;

/// An estimate below this fraction of the accuracy lets the next frequency start with fewer harmonics.
const PLENTY: f64 = 0.2;

/// Balances with more and more harmonics.
pub struct Ladder<'a> {
    rungs: Vec<Frequencies<'a>>,
    /// Of each rung, as [`Level::check`].
    checks: Vec<Option<Frequencies<'a>>>,
    /// Relative; `None`: there is one rung, and nothing is estimated.
    accuracy: Option<f64>,
}

/// A frequency solved with the harmonics it needs.
pub struct Resolved<'b> {
    /// The solution that was accepted.
    pub solved: Solved<'b>,
    /// Of the observed amplitudes, relative.
    pub estimated_error: Option<f64>,
    /// The estimate is within the accuracy, where one is asked for.
    pub is_accurate: bool,
    /// Where to begin at a frequency beside this.
    pub next_rung: usize,
}

/// What a balance of so many harmonics is made with.
pub struct Level {
    /// Harmonics and samples.
    pub fourier: Fourier,
    /// As in [`Setting`].
    pub eps: Vec<f64>,
    /// With two to four times the harmonics, where that is so small that it is solved to judge this one.
    pub check: Option<Box<Level>>,
}

/// Samples, harmonics and `eps(harmonics)` of each rung.
pub fn levels(
    resolution: Resolution,
    highest_excited: usize,
    eps: impl Fn(usize) -> Vec<f64>,
) -> Vec<Level> {
    let level = |harmonics, samples| Level {
        fourier: Fourier::new(harmonics, samples),
        eps: eps(harmonics),
        check: None,
    };
    let checked = |accuracy: f64, harmonics: usize| {
        let mut own = level(harmonics, samples_for(accuracy, harmonics));
        let most = (MOST_EXACT_UNKNOWNS / own.eps.len().max(1)).saturating_sub(1) / 2;
        let further = (4 * harmonics + 3).min(most);
        if further > 2 * harmonics {
            own.check = Some(Box::new(level(further, samples_for(accuracy, further))));
        }
        own
    };
    match resolution {
        Resolution::Fixed { harmonics, samples } => vec![level(harmonics, samples)],
        Resolution::Accuracy(accuracy) => {
            let steps = STEPS.into_iter().filter(|h| *h >= highest_excited);
            steps
                .chain([BEYOND.max(2 * highest_excited + 1)])
                .map(|h| checked(accuracy, h))
                .collect()
        }
    }
}

/// Samples of a period that keep their error, which was found to be at most `2 / samples^2` of the amplitude
/// (docs/method.md), at an eighth of `accuracy`, and carry the harmonics.
pub fn samples_for(accuracy: f64, harmonics: usize) -> usize {
    let for_accuracy = (16.0 / accuracy).sqrt().ceil() as usize;
    let least = Resolution::least_samples(harmonics);
    for_accuracy.max(least).next_power_of_two()
}

impl<'a> Ladder<'a> {
    /// One rung for each of `levels`, of which the last serves estimates alone where an accuracy is asked for.
    pub fn new(
        setting: Setting<'a>,
        levels: &'a [Level],
        resolution: Resolution,
        newton: NewtonOptions,
        solver: Solver,
        retention: &'a OnceLock<Retention>,
    ) -> Self {
        let rung = |level: &'a Level| {
            let Level { fourier, eps, .. } = level;
            let setting = Setting {
                fourier,
                eps,
                ..setting
            };
            Frequencies::new(setting, newton, solver, retention)
        };
        Self {
            rungs: levels.iter().map(rung).collect(),
            checks: levels
                .iter()
                .map(|level| level.check.as_deref().map(rung))
                .collect(),
            accuracy: match resolution {
                Resolution::Fixed { .. } => None,
                Resolution::Accuracy(accuracy) => Some(accuracy),
            },
        }
    }

    /// What is the same on all rungs.
    pub fn lowest(&self) -> &Frequencies<'a> {
        &self.rungs[0]
    }

    /// Solves one frequency by `solve`, beginning at rung `from`; by those above where its error is estimated above the
    /// accuracy. Where more harmonics have no solution the one found stands, with its estimate.
    pub fn resolve<'b>(
        &'b self,
        frequency_hz: f64,
        from: usize,
        work: &mut Work,
        solve: impl Fn(&'b Frequencies<'a>, &mut Work) -> Solved<'b>,
    ) -> Resolved<'b> {
        let Some(accuracy) = self.accuracy else {
            return Resolved {
                solved: solve(&self.rungs[0], work),
                estimated_error: None,
                is_accurate: true,
                next_rung: 0,
            };
        };
        let highest = self.rungs.len() - 2;
        let mut rung = from.min(highest);
        let mut solved = solve(&self.rungs[rung], work);
        let last = highest.min(rung + MOST_CLIMBS);
        while !solved.is_converged() && rung < last {
            rung += 1;
            solved = solve(&self.rungs[rung], work);
        }
        loop {
            if !solved.is_converged() {
                return Resolved {
                    solved,
                    estimated_error: None,
                    is_accurate: false,
                    next_rung: rung,
                };
            }
            let (corrected, change) = match &self.checks[rung] {
                Some(check) => check.solved_instead(&solved, frequency_hz, work),
                None => self.rungs[rung + 1].let_in(&solved, frequency_hz, work),
            };
            let estimated_error = SHORTFALL * change;
            let fine = estimated_error <= accuracy;
            if !fine {
                let start =
                    Neighbour::after(None, frequency_hz, corrected, solved.balance.is_held());
                // A rung may have no solution that is found, and the one above it may.
                let found = (rung + 1..=highest).find_map(|above| {
                    let finer = self.rungs[above].solve_from(frequency_hz, &start, work);
                    finer.is_converged().then_some((above, finer))
                });
                if let Some((above, finer)) = found {
                    (rung, solved) = (above, finer);
                    continue;
                }
            }
            let plenty = estimated_error <= PLENTY * accuracy;
            return Resolved {
                solved,
                estimated_error: Some(estimated_error),
                is_accurate: fine,
                next_rung: rung - usize::from(plenty && rung > 0),
            };
        }
    }
}
