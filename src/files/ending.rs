//! Report and summary.json of a run that ends: it is done, fails, or is interrupted.

use std::error::Error;

use super::conditions::in_motion;
use super::response::{RunningResponses, sweep};
use super::summary::RunTimes;
use super::{MESH_FILE, RunFiles};
use crate::error::RunError;
use crate::exit::ExitStatus;
use dovetail_export::folder::{Beginning, continuation_hint};
use dovetail_export::journal::{CURVE_JOURNAL, JOURNAL, PEAKS_JOURNAL, WEAR_JOURNAL};
use dovetail_export::manifest::{RunState, Summary};
use dovetail_export::report;
use dovetail_solver::run::{Bodies, Run};

impl RunFiles {
    /// Records the time and the stages of the run so far.
    pub fn record_times(&mut self, taken: RunTimes) {
        let summary = &mut self.figures.summary;
        summary.stages = taken.stages;
        summary.seconds = taken.seconds;
        summary.processor_seconds = taken.processor_seconds;
    }

    /// Writes report.html of a run with this verdict.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn report(&mut self, run: &Run, verdict: &Result<(), RunError>) -> Result<(), RunError> {
        let (state, why) = ended(verdict);
        let (figures, out) = (&self.figures, &self.folder.out);
        let summary = Summary {
            state,
            why,
            files: out.files(state),
            ..figures.summary()
        };
        let contents = report::Contents {
            scene: &self.scene,
            summary: &summary,
            conditions: &in_motion(&self.scene, &[]),
            observations: &run.reduced.observations(),
            pairs: &run.reduced.pairs,
            model: run.reduced.bodies.as_ref().map(Bodies::model),
            modes: &figures.modes,
            static_state: Some(&run.statics.state),
            sweep: run.response.as_ref().map(sweep),
            motion: figures.motion.as_deref(),
            stress: figures.stress.as_ref(),
            forces: &figures.forces,
        };
        Ok(report::write(&out.file(report::REPORT)?, &contents)?)
    }

    /// Writes summary.json of a run that came to its end. The run failed if the verdict is that
    /// there is no result.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn finish(&mut self, verdict: &Result<(), RunError>) -> Result<(), RunError> {
        if self.folder.beginning != Beginning::Anew {
            self.folder.out.remove_earlier()?;
        }
        let RunningResponses { journal, solving } = &mut self.responses;
        if !solving.is_empty() {
            // The tables have the frequencies that were solved.
            journal.clear()?;
        }
        journal.remove_if_empty()?;
        if let Some(search) = &self.search {
            search.journal.remove()?;
        }
        let (state, why) = ended(verdict);
        let summary = self.figures.summary();
        Ok(self.folder.out.write_summary(summary, state, why)?)
    }

    /// Writes summary.json of a run that failed before its last file. If it had no results yet and
    /// made no mesh, the summary of a finished run that was there before stays. An error of writing
    /// is ignored, as the error of the run is the one to report.
    pub fn failed(&self, error: &dyn Error) {
        if !self.folder.out.is_running() {
            return;
        }
        let _ = self.responses.journal.remove_if_empty();
        if let Some(search) = &self.search {
            let _ = search.journal.remove_if_empty();
        }
        let under_way = [
            JOURNAL,
            PEAKS_JOURNAL,
            WEAR_JOURNAL,
            CURVE_JOURNAL,
            MESH_FILE,
        ];
        if self.figures.origin.gmsh.is_none() && self.folder.out.restore_summary(&under_way) {
            return;
        }
        let _ = self.write_summary(RunState::Failed, Some(error_with_causes(error)));
    }

    /// Leaves the folder of a run that is interrupted by `signal` in a state that can be read and
    /// resumed. Returns the message for the user.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn interrupted(&mut self, signal: &str) -> Result<String, RunError> {
        let folder = self.folder.out.path().display().to_string();
        if let Some(search) = &self.search {
            let why = search.ending_text(signal);
            self.responses.journal.remove_if_empty()?;
            let table = search.write(&self.folder.out)?;
            self.write_summary(RunState::Interrupted, Some(why.clone()))?;
            if search.journal.is_empty() {
                return Ok(format!("ended by {why}; there is nothing to resume"));
            }
            let way_on = continuation_hint(&self.figures.summary, "does not look for them again");
            return Ok(format!("ended by {why}{table}. {way_on}"));
        }
        let Some(progress) = self.leave_response()? else {
            self.responses.journal.remove_if_empty()?;
            let until = match self.folder.beginning {
                Beginning::Beside => "end",
                Beginning::Anew | Beginning::Resumed => "first frequency",
            };
            let why = format!("{signal} before the {until}");
            self.write_summary(RunState::Interrupted, Some(why.clone()))?;
            return Ok(format!(
                "ended by {why}; {folder} holds what was written until then"
            ));
        };
        let why = format!("{signal} after {progress}");
        self.write_summary(RunState::Interrupted, Some(why.clone()))?;
        let way_on = continuation_hint(&self.figures.summary, "goes on with the others");
        Ok(format!("ended by {why}; they are in {folder}. {way_on}"))
    }

    /// Writes summary.json with the figures so far.
    pub(super) fn write_summary(
        &self,
        state: RunState,
        why: Option<String>,
    ) -> Result<(), RunError> {
        let mut summary = self.figures.summary();
        summary.seconds = self.folder.begun.elapsed().as_secs_f64();
        Ok(self.folder.out.write_summary(summary, state, why)?)
    }
}

/// State of a run with this verdict, and the reason if it failed.
fn ended(verdict: &Result<(), RunError>) -> (RunState, Option<String>) {
    match verdict {
        Err(error) if error.exit_status() == ExitStatus::Failed => {
            (RunState::Failed, Some(error_with_causes(error)))
        }
        _ => (RunState::Finished, None),
    }
}

/// Message of an error with its causes.
pub(super) fn error_with_causes(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        text += &format!(": {error}");
        cause = error.source();
    }
    text
}
