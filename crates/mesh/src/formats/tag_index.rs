//! Indices of nodes and elements by their numbers in a file.

use std::collections::HashMap;

/// Numbers up to this multiple of their count are looked up in a list.
const DENSE: u64 = 4;
/// Numbers below this one are always looked up in a list.
const LEAST: u64 = 1024;
/// Entry of a number that is not known.
const NONE: u32 = u32::MAX;

/// Index by number. Most files number from 1 on, so a list has most numbers, and a map the others.
#[derive(Debug, Default)]
pub(super) struct TagIndex {
    list: Vec<u32>,
    map: HashMap<u64, u32>,
    count: u64,
}

impl TagIndex {
    /// Index of a number.
    pub fn get(&self, tag: u64) -> Option<u32> {
        let listed = usize::try_from(tag).ok().and_then(|tag| self.list.get(tag));
        match listed.copied().filter(|index| *index != NONE) {
            None => self.map.get(&tag).copied(),
            found => found,
        }
    }

    /// Adds a number that is not yet known.
    pub fn insert(&mut self, tag: u64, index: u32) {
        self.count += 1;
        if tag >= LEAST.max(DENSE * self.count) {
            self.map.insert(tag, index);
            return;
        }
        let tag = tag as usize;
        if tag >= self.list.len() {
            self.list.resize(tag + 1, NONE);
        }
        self.list[tag] = index;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dense_and_scattered_numbers_are_found() {
        let tags = (1..3000).chain([5_000_000, u64::MAX, 0]).chain(6000..6100);
        let mut index = TagIndex::default();
        let tags: Vec<u64> = tags.collect();
        for (tag, i) in tags.iter().zip(0..) {
            assert_eq!(index.get(*tag), None);
            index.insert(*tag, i);
        }
        for (tag, i) in tags.iter().zip(0..) {
            assert_eq!(index.get(*tag), Some(i), "{tag}");
        }
        assert!(index.list.len() < 20_000 && index.map.len() == 2);
        assert_eq!(index.get(4000), None);
    }
}
