//! Line of the output of a run.

use dovetail_export::warning::{Warning, Weight};

/// Note or warning.
pub(super) enum ReportLine {
    Note(String),
    Warning(Warning),
}

impl ReportLine {
    pub(super) fn warning(weight: Weight, text: String) -> Self {
        Self::Warning(Warning { weight, text })
    }
}
