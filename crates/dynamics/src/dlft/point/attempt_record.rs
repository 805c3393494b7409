//! Log of the attempts at a frequency: what each took, and whether it led to a motion.

use super::{FrequencySolver, Solution, SolverWork, Strategy};
use crate::dlft::retention::Mean;
use std::time::Instant;

/// Target of the log messages. `RUST_LOG=dovetail::attempts` prints them.
const TARGET: &str = "dovetail::attempts";

/// An attempt that has begun, with the counts before it; `None` where nobody reads the log.
pub(super) struct AttemptRecord(Option<Begun>);

struct Begun {
    strategy: Strategy,
    mean: Mean,
    newton_iterations: usize,
    krylov_iterations: usize,
    at: Instant,
}

impl AttemptRecord {
    pub(super) fn begin(strategy: Strategy, mean: Mean, work: &SolverWork) -> Self {
        Self(
            log::log_enabled!(target: TARGET, log::Level::Debug).then(|| Begun {
                strategy,
                mean,
                newton_iterations: work.newton_iterations,
                krylov_iterations: work.krylov_iterations,
                at: Instant::now(),
            }),
        )
    }

    /// Writes a line: strategy, mean, frequency (Hz), harmonics, unknowns, Newton and Krylov iterations,
    /// milliseconds, and how it ended.
    pub(super) fn end(
        self,
        solver: &FrequencySolver<'_>,
        frequency_hz: f64,
        solved: Option<&Solution>,
        work: &SolverWork,
    ) {
        let Some(begun) = self.0 else {
            return;
        };
        let ended = solved.map_or("not tried or given up".into(), |s| {
            format!("{:?}", s.end.status)
        });
        log::debug!(
            target: TARGET,
            "{}|{:?}|{frequency_hz}|{}|{}|{}|{}|{:.3}|{ended}",
            begun.strategy,
            begun.mean,
            solver.setting.fourier.harmonics(),
            solver.unknowns(),
            work.newton_iterations - begun.newton_iterations,
            work.krylov_iterations - begun.krylov_iterations,
            1e3 * begun.at.elapsed().as_secs_f64(),
        );
    }
}
