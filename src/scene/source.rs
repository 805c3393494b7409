//! Text of a scene and of its `--set` arguments, as one range of byte positions.
//!
//! Values from `--set` are put into the same table as those of the file. To distinguish them by
//! their spans, argument `k` is given the positions after the file and the arguments before it.

use std::ops::Range;
use std::sync::Arc;

use miette::NamedSource;

use super::error::{SceneFault, SceneProblem};
use super::keys::Vocabulary;

/// Texts that the spans of a scene, or of another file of keys and values, refer to.
pub struct SourceTexts<'i> {
    pub name: &'i str,
    /// Text of the file, shared by the problems found in it.
    pub text: Arc<str>,
    pub overrides: &'i [String],
    pub vocabulary: &'static Vocabulary,
}

impl<'i> SourceTexts<'i> {
    /// Position of the first byte of `--set` argument `index`.
    pub fn override_start(&self, index: usize) -> usize {
        // One position between any two texts, so that the end of one is not the start of the next.
        self.text.len()
            + 1
            + self.overrides[..index]
                .iter()
                .map(|o| o.len() + 1)
                .sum::<usize>()
    }

    /// Returns `true` if a span lies in the file and not in an argument.
    pub fn is_in_file(&self, span: &Range<usize>) -> bool {
        span.start <= self.text.len()
    }

    /// Problem with a fault at `span`, in the text of that place.
    pub fn problem(&self, span: Range<usize>, fault: SceneFault) -> SceneProblem {
        let (name, text, start) = self.text_at(span.start);
        SceneProblem {
            fault,
            span: inside(&text, span.start - start..span.end.saturating_sub(start)),
            source_text: NamedSource::new(name, text).with_language("TOML"),
            other: None,
        }
    }

    /// Problem with a second place, which is dropped if it is in another text.
    pub fn problem_with(
        &self,
        span: Range<usize>,
        fault: SceneFault,
        other: Range<usize>,
        label: &'static str,
    ) -> SceneProblem {
        let (_, text, start) = self.text_at(span.start);
        let same_text = start == self.text_at(other.start).2;
        let mut problem = self.problem(span, fault);
        if same_text {
            let span = inside(&text, other.start - start..other.end.saturating_sub(start));
            problem.other = Some((span, label));
        }
        problem
    }

    /// Name and text at a position, and the position of the first byte of the text.
    fn text_at(&self, position: usize) -> (&'i str, Arc<str>, usize) {
        if position <= self.text.len() {
            return (self.name, Arc::clone(&self.text), 0);
        }
        let mut start = self.text.len() + 1;
        for argument in self.overrides {
            if position <= start + argument.len() {
                return ("--set", argument.as_str().into(), start);
            }
            start += argument.len() + 1;
        }
        (self.name, Arc::clone(&self.text), 0)
    }
}

/// Part of `span` inside the text, moved to character boundaries.
fn inside(text: &str, span: Range<usize>) -> Range<usize> {
    let boundary = |position: usize| {
        (0..=position.min(text.len()))
            .rev()
            .find(|&i| text.is_char_boundary(i))
            .unwrap_or(0)
    };
    let start = boundary(span.start);
    start..boundary(span.end).max(start)
}
