//! Defines who hears of a run while it goes on, and what an observer is told.

use dovetail_solver::dlft::{Response, SolvedFrequency, StaticState};

use super::Reduced;
use super::error::RunError;
use crate::export::journal::Inputs;
use crate::export::manifest::Summary;
use crate::stage::{Stage, StageRecord};
use crate::warning::Warning;

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
    /// The loop that began last has one step more.
    fn loop_grows(&mut self) {}
    /// What goes on within a step of the loop that began last.
    fn loop_detail(&mut self, _detail: &str) {}
    /// The loop that began last ends.
    fn loop_ends(&mut self) {}
    /// Something to know.
    fn note(&mut self, _message: &str) {}
    /// Something to mind.
    fn warning(&mut self, _warning: &Warning) {}

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
    /// The figures that are known once the static state is.
    fn figures(&mut self, _summary: &Summary) {}
    /// A response is about to be computed. Gives its frequencies that were solved before it was broken off.
    ///
    /// # Errors
    /// The observer's own.
    fn response_begins(
        &mut self,
        _begins: &ResponseBegins<'_>,
    ) -> Result<Vec<SolvedFrequency>, RunError> {
        Ok(Vec::new())
    }
    /// One frequency of the response that began last is solved, converged or not; one that was solved before
    /// is told, too. An error is told as a warning, and the run goes on.
    ///
    /// # Errors
    /// The observer's own.
    fn frequency(&mut self, _solved: &SolvedFrequency) -> Result<(), RunError> {
        Ok(())
    }
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
    fn held_modes(
        &mut self,
        _reduced: &Reduced,
        _state: &StaticState,
        _omega2: &[Vec<f64>],
    ) -> Result<(), RunError> {
        Ok(())
    }
}

/// A response that is about to be computed.
#[derive(Debug, Clone, Copy)]
pub struct ResponseBegins<'a> {
    pub reduced: &'a Reduced,
    /// Rising.
    pub frequencies_hz: &'a [f64],
    /// Of the response that the scene's own is compared with; `None`: its own.
    pub compared_harmonics: Option<usize>,
    /// Everything that the response is computed from.
    pub inputs: Inputs,
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
    fn loop_grows(&mut self) {
        self.0.loop_grows();
        self.1.loop_grows();
    }
    fn loop_detail(&mut self, detail: &str) {
        self.0.loop_detail(detail);
        self.1.loop_detail(detail);
    }
    fn loop_ends(&mut self) {
        self.0.loop_ends();
        self.1.loop_ends();
    }
    fn note(&mut self, message: &str) {
        self.0.note(message);
        self.1.note(message);
    }
    fn warning(&mut self, warning: &Warning) {
        self.0.warning(warning);
        self.1.warning(warning);
    }
    fn reduced(&mut self, reduced: &Reduced) -> Result<(), RunError> {
        self.0.reduced(reduced)?;
        self.1.reduced(reduced)
    }
    fn static_state(&mut self, reduced: &Reduced, state: &StaticState) -> Result<(), RunError> {
        self.0.static_state(reduced, state)?;
        self.1.static_state(reduced, state)
    }
    fn figures(&mut self, summary: &Summary) {
        self.0.figures(summary);
        self.1.figures(summary);
    }
    fn response_begins(
        &mut self,
        begins: &ResponseBegins<'_>,
    ) -> Result<Vec<SolvedFrequency>, RunError> {
        let mut solved = self.0.response_begins(begins)?;
        solved.extend(self.1.response_begins(begins)?);
        Ok(solved)
    }
    fn frequency(&mut self, solved: &SolvedFrequency) -> Result<(), RunError> {
        self.0.frequency(solved)?;
        self.1.frequency(solved)
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
    fn held_modes(
        &mut self,
        reduced: &Reduced,
        state: &StaticState,
        omega2: &[Vec<f64>],
    ) -> Result<(), RunError> {
        self.0.held_modes(reduced, state, omega2)?;
        self.1.held_modes(reduced, state, omega2)
    }
}
