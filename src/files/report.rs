//! The report of a run.

use super::Files;
use super::conditions::in_motion;
use super::ending::ended;
use super::response::sweep;
use crate::error::RunError;
use dovetail_export::manifest::Summary;
use dovetail_export::report;
use dovetail_solver::run::{Bodies, Run};

impl Files {
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
            ..figures.with_warnings()
        };
        let contents = report::Contents {
            scene: &self.scene,
            summary: &summary,
            conditions: &in_motion(&self.scene),
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
}
