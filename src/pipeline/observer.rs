//! Defines who hears of a run while it goes on, and what an observer is told.

use dovetail_solver::dlft::{Orbit, Response, StaticState};

use super::Reduced;
use super::error::RunError;
use crate::stage::{Stage, StageRecord};

/// Hears of a run. Every method does nothing by itself, so that an observer says only what it cares for.
///
/// The calls come one after the other, from whichever thread has something to tell. An error of one of those that may
/// fail ends the run.
pub trait Observer: Send {
    /// A stage begins, under a title that a reader understands.
    fn stage_begins(&mut self, _stage: Stage, _title: &str) {}
    /// The stage that began last ends.
    fn stage_ends(&mut self, _record: &StageRecord) {}
    /// A loop of so many steps begins.
    fn loop_begins(&mut self, _label: &str, _steps: usize) {}
    /// So many more steps of the loop that began last are done.
    fn loop_advances(&mut self, _steps: usize) {}
    /// The loop that began last ends.
    fn loop_ends(&mut self) {}
    /// Something to know.
    fn note(&mut self, _message: &str) {}
    /// Something to mind.
    fn warning(&mut self, _message: &str) {}

    /// The assembly is reduced.
    ///
    /// # Errors
    /// The observer's own.
    fn reduced(&mut self, _reduced: &Reduced) -> Result<(), RunError> {
        Ok(())
    }
    /// The static state is there, converged or not.
    ///
    /// # Errors
    /// The observer's own.
    fn static_state(&mut self, _reduced: &Reduced, _state: &StaticState) -> Result<(), RunError> {
        Ok(())
    }
    /// One frequency of a response is solved, converged or not.
    fn frequency(&mut self, _orbit: &Orbit) {}
    /// The response is there, and the one it is compared with.
    ///
    /// # Errors
    /// The observer's own.
    fn response(
        &mut self,
        _reduced: &Reduced,
        _response: &Response,
        _compared: Option<&Compared>,
    ) -> Result<(), RunError> {
        Ok(())
    }
    /// The modes of each body with its contacts held: squared angular frequencies, rad2/s2.
    ///
    /// # Errors
    /// The observer's own.
    fn held_modes(&mut self, _reduced: &Reduced, _omega2: &[Vec<f64>]) -> Result<(), RunError> {
        Ok(())
    }
}

/// A response with another number of harmonics.
#[derive(Debug, Clone)]
pub struct Compared {
    pub harmonics: usize,
    pub response: Response,
}

/// One that does not listen.
impl Observer for () {}

/// Two observers; both hear everything, the first one first.
pub struct Both<'a>(pub &'a mut dyn Observer, pub &'a mut dyn Observer);

impl std::fmt::Debug for Both<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Both").finish_non_exhaustive()
    }
}

impl Observer for Both<'_> {
    fn stage_begins(&mut self, stage: Stage, title: &str) {
        self.0.stage_begins(stage, title);
        self.1.stage_begins(stage, title);
    }
    fn stage_ends(&mut self, record: &StageRecord) {
        self.0.stage_ends(record);
        self.1.stage_ends(record);
    }
    fn loop_begins(&mut self, label: &str, steps: usize) {
        self.0.loop_begins(label, steps);
        self.1.loop_begins(label, steps);
    }
    fn loop_advances(&mut self, steps: usize) {
        self.0.loop_advances(steps);
        self.1.loop_advances(steps);
    }
    fn loop_ends(&mut self) {
        self.0.loop_ends();
        self.1.loop_ends();
    }
    fn note(&mut self, message: &str) {
        self.0.note(message);
        self.1.note(message);
    }
    fn warning(&mut self, message: &str) {
        self.0.warning(message);
        self.1.warning(message);
    }
    fn reduced(&mut self, reduced: &Reduced) -> Result<(), RunError> {
        self.0.reduced(reduced)?;
        self.1.reduced(reduced)
    }
    fn static_state(&mut self, reduced: &Reduced, state: &StaticState) -> Result<(), RunError> {
        self.0.static_state(reduced, state)?;
        self.1.static_state(reduced, state)
    }
    fn frequency(&mut self, orbit: &Orbit) {
        self.0.frequency(orbit);
        self.1.frequency(orbit);
    }
    fn response(
        &mut self,
        reduced: &Reduced,
        response: &Response,
        compared: Option<&Compared>,
    ) -> Result<(), RunError> {
        self.0.response(reduced, response, compared)?;
        self.1.response(reduced, response, compared)
    }
    fn held_modes(&mut self, reduced: &Reduced, omega2: &[Vec<f64>]) -> Result<(), RunError> {
        self.0.held_modes(reduced, omega2)?;
        self.1.held_modes(reduced, omega2)
    }
}
