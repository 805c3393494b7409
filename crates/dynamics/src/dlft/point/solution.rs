//! Solution of a balance, its start, and the work on it.

use crate::dlft::balance::{Balance, Deadline, Evaluation};
use crate::dlft::newton_krylov::Preconditioner;
use dovetail_numerics::nonlinear::{NewtonEnd, NewtonStatus};

/// Work done on one frequency, and the preconditioner, which is kept over frequencies.
#[derive(Default)]
pub(crate) struct SolverWork {
    pub newton_iterations: usize,
    pub krylov_iterations: usize,
    /// Relative residual of each attempt, at its start and after each iteration.
    pub residuals: Vec<Vec<f64>>,
    /// Preconditioner of the linear solves.
    pub preconditioner: Preconditioner,
    /// Pair that could not bear the last vibration with frozen contacts.
    pub(super) violating_pair: Option<usize>,
    /// Time at which the frequency is given up.
    pub deadline: Deadline,
    /// Newton iterations on the way to a motion, and to those that it is estimated with.
    effort: usize,
    /// Work on the finer balance that errors are estimated with, and on the one that judges it; each
    /// keeps its preconditioner.
    estimates: [Option<Box<SolverWork>>; 2],
}

impl SolverWork {
    /// Resets the counts, for a frequency that is given up after `most_seconds`.
    pub(crate) fn start_counting(&mut self, most_seconds: Option<f64>) {
        self.start_part(Deadline::new(most_seconds));
        self.begin_anew();
        for work in self.estimates.iter_mut().flatten() {
            work.begin_anew();
        }
    }

    fn start_part(&mut self, deadline: Deadline) {
        (self.newton_iterations, self.krylov_iterations) = (0, 0);
        self.residuals.clear();
        self.deadline = deadline;
    }

    /// Counts Newton iterations.
    pub(crate) fn count_iterations(&mut self, iterations: usize) {
        self.newton_iterations += iterations;
        self.effort += iterations;
    }

    /// Newton iterations on the way to a motion.
    pub(super) fn effort(&self) -> usize {
        self.effort
    }

    /// Begins another way to a motion.
    pub(crate) fn begin_anew(&mut self) {
        self.effort = 0;
    }

    /// Work of the next estimate by the first or the second finer balance (0 or 1), which the counts of
    /// a frequency leave out. All estimates of a frequency share its effort.
    pub(crate) fn estimate_work(&mut self, finer: usize) -> &mut SolverWork {
        let work = self.estimates[finer].get_or_insert_default();
        work.start_part(self.deadline);
        work
    }
}

/// A balance, its U, the evaluation there, and how the solution ended.
pub(crate) struct Solution {
    pub balance: Balance,
    pub u: Vec<f64>,
    pub evaluation: Evaluation,
    pub end: NewtonEnd,
}

impl Solution {
    pub(crate) fn is_converged(&self) -> bool {
        self.end.status == NewtonStatus::Converged
    }
}

/// U that a method begins at, and the evaluation of its balance there, if it is known.
pub(super) struct MethodStart {
    pub(super) u: Vec<f64>,
    pub(super) known: Option<Evaluation>,
}

impl MethodStart {
    /// Start at which nothing is evaluated yet.
    pub(super) fn new(u: Vec<f64>) -> Self {
        Self { u, known: None }
    }
}

/// Keeps the one of two solutions with the smaller residual, the first of equal ones.
pub(super) fn keep_better(best: &mut Option<Solution>, solved: Solution) {
    let measure = solved.end.measure;
    if best.as_ref().is_none_or(|best| measure < best.end.measure) {
        *best = Some(solved);
    }
}
