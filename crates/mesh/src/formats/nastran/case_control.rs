//! Sets of case control: `SET 5 = 1, 3 THRU 8`.

use std::collections::BTreeMap;

use super::super::source::label;

/// Sets that case control has so far, and the one that goes on in the next line.
#[derive(Debug, Default)]
pub(super) struct CaseControl {
    sets: BTreeMap<u64, Vec<(u64, u64)>>,
    /// Number and text of a set whose line ends with a comma.
    open: Option<(u64, String)>,
}

impl CaseControl {
    /// Reads a line. Only lines of sets matter.
    pub fn line(&mut self, line: &str) {
        let (number, text) = match self.open.take() {
            Some((number, text)) => (number, text + line),
            None => {
                let Some((before, text)) = line.split_once('=') else {
                    return;
                };
                let mut words = before.split_whitespace();
                let is_set = words
                    .next()
                    .is_some_and(|word| word.eq_ignore_ascii_case("SET"));
                match words.next().and_then(|word| label(word).ok()) {
                    Some(number) if is_set => (number, text.to_owned()),
                    _ => return,
                }
            }
        };
        if text.trim_end().ends_with(',') {
            self.open = Some((number, text));
            return;
        }
        self.close(number, &text);
    }

    fn close(&mut self, number: u64, text: &str) {
        let spaced = text.replace([',', '(', ')'], " ");
        let mut words = spaced.split_whitespace().peekable();
        let mut ranges: Vec<(u64, u64)> = Vec::new();
        while let Some(word) = words.next() {
            let Ok(first) = label(word) else {
                // ALL and EXCEPT, and sets of names, are none of these.
                return;
            };
            let is_range = words
                .peek()
                .is_some_and(|word| word.eq_ignore_ascii_case("THRU"));
            let last = match is_range {
                true => words.nth(1).and_then(|word| label(word).ok()),
                false => Some(first),
            };
            let Some(last) = last.filter(|last| *last >= first) else {
                return;
            };
            ranges.push((first, last));
        }
        self.sets.insert(number, ranges);
    }

    /// All sets.
    pub fn finish(mut self) -> BTreeMap<u64, Vec<(u64, u64)>> {
        if let Some((number, text)) = self.open.take() {
            self.close(number, &text);
        }
        self.sets
    }
}
