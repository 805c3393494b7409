//! Contents of a file that are not read, by name, with their numbers.

use std::collections::BTreeMap;

use crate::text;

/// Names with the number of times that each occurs.
#[derive(Debug, Default)]
pub(super) struct Tally(BTreeMap<String, usize>);

impl Tally {
    /// Counts a name `count` more times.
    pub fn add(&mut self, name: &str, count: usize) {
        match self.0.get_mut(name) {
            Some(known) => *known += count,
            None => {
                self.0.insert(name.to_owned(), count);
            }
        }
    }

    /// True if the name was counted.
    pub fn has(&self, name: &str) -> bool {
        self.0.contains_key(name)
    }

    /// Names without their numbers.
    pub fn names(&self) -> Vec<String> {
        self.0.keys().cloned().collect()
    }

    /// `sentence: a (3), b (1).` with a hint behind it, or nothing if nothing was counted.
    pub fn sentence(&self, sentence: &str, hint: &str) -> Option<String> {
        if self.0.is_empty() {
            return None;
        }
        let items = self
            .0
            .iter()
            .map(|(name, count)| format!("{name} ({count})"));
        let items = text::list(&items.collect::<Vec<_>>());
        Some(format!("{sentence}: {items}.{hint}"))
    }
}
