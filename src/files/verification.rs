//! Table of a comparison with integration in time.

use super::RunFiles;
use crate::error::RunError;
use dovetail_export::{csv, manifest};
use dovetail_solver::run::{Verification, Verified};

impl RunFiles {
    /// Writes verify.csv.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn verification(
        &mut self,
        verified: &Verified,
        asked: &Verification,
    ) -> Result<(), RunError> {
        let (run, comparisons) = (&verified.run, &verified.comparisons);
        self.figures.add_static_state(&run.reduced, &run.statics);
        self.figures.summary.verification = Some(manifest::verification_summary(
            comparisons,
            asked.steps_per_period,
            asked.tolerance,
        ));
        let path = self.folder.out.file("verify.csv")?;
        Ok(csv::write_verification(&path, comparisons)?)
    }
}
