//! A line that a run tells.

use crate::warning::{Warning, Weight};

/// Something to know or to mind.
pub(super) enum Line {
    Note(String),
    Warning(Warning),
}

impl Line {
    pub(super) fn warning(weight: Weight, text: String) -> Self {
        Self::Warning(Warning { weight, text })
    }
}
