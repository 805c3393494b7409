//! Line of the output of a run.

use dovetail_export::warning::{Warning, Weight};

/// Note or warning.
pub(super) enum Line {
    Note(String),
    Warning(Warning),
}

impl Line {
    pub(super) fn warning(weight: Weight, text: String) -> Self {
        Self::Warning(Warning { weight, text })
    }
}
