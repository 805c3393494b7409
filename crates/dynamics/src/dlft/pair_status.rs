//! Status of pairs, in the static state and in a period of the vibration about it. Each pair has
//! exactly one status in either, so that the counts add up to the number of pairs.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Status of a pair in the static state, with the code written to VTK files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum PairStatus {
    /// The pair neither slides nor opens.
    Stuck = 0,
    /// Friction is at its limit.
    Slipping = 1,
    /// The pair carries no force.
    Open = 2,
}

/// Status of a pair over a period, with the code written to VTK files. The first three are for
/// pairs that are closed in the static state, the others for pairs that are open there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CycleStatus {
    /// The pair stays closed, and slides no farther than the threshold.
    Stuck = 0,
    /// The pair stays closed, and slides farther than the threshold.
    Slipping = 1,
    /// The pair separates at some sample, whether it slides or not.
    Opening = 2,
    /// The pair is open in the static state and touches at some sample.
    Closing = 3,
    /// The pair is open in the static state and stays so.
    Open = 4,
}

/// Word written to files.
impl fmt::Display for CycleStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

impl CycleStatus {
    /// Status of a pair that is open for a fraction of the period. `slides` is true if it slides
    /// farther than the threshold.
    pub fn new(is_open_at_rest: bool, open_fraction: f64, slides: bool) -> Self {
        match (is_open_at_rest, slides) {
            (true, _) if open_fraction < 1.0 => Self::Closing,
            (true, _) => Self::Open,
            (false, _) if open_fraction > 0.0 => Self::Opening,
            (false, true) => Self::Slipping,
            (false, false) => Self::Stuck,
        }
    }

    /// Returns `true` if the pair is open in the static state.
    pub(crate) fn is_open_at_rest(self) -> bool {
        matches!(self, Self::Closing | Self::Open)
    }
}

/// Number of pairs of each status in the static state. Files append `_pairs` to the names.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct StaticCounts {
    /// Number of [`PairStatus::Stuck`] pairs.
    #[serde(rename = "stuck_pairs")]
    pub stuck: usize,
    /// Number of [`PairStatus::Slipping`] pairs.
    #[serde(rename = "slipping_pairs")]
    pub slipping: usize,
    /// Number of [`PairStatus::Open`] pairs.
    #[serde(rename = "open_pairs")]
    pub open: usize,
}

impl StaticCounts {
    /// Number of all pairs.
    pub fn pairs(self) -> usize {
        self.stuck + self.slipping + self.open
    }
}

impl FromIterator<PairStatus> for StaticCounts {
    fn from_iter<I: IntoIterator<Item = PairStatus>>(statuses: I) -> Self {
        let mut counts = Self::default();
        for status in statuses {
            *match status {
                PairStatus::Stuck => &mut counts.stuck,
                PairStatus::Slipping => &mut counts.slipping,
                PairStatus::Open => &mut counts.open,
            } += 1;
        }
        counts
    }
}

/// Number of pairs of each status in a period. Files append `_pairs` to the names.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct CycleCounts {
    /// Number of [`CycleStatus::Stuck`] pairs.
    #[serde(rename = "stuck_pairs")]
    pub stuck: usize,
    /// Number of [`CycleStatus::Slipping`] pairs.
    #[serde(rename = "slipping_pairs")]
    pub slipping: usize,
    /// Number of [`CycleStatus::Opening`] pairs.
    #[serde(rename = "opening_pairs")]
    pub opening: usize,
    /// Number of [`CycleStatus::Closing`] pairs.
    #[serde(rename = "closing_pairs")]
    pub closing: usize,
    /// Number of [`CycleStatus::Open`] pairs.
    #[serde(rename = "open_pairs")]
    pub open: usize,
}

impl CycleCounts {
    /// Number of all pairs.
    pub fn pairs(self) -> usize {
        self.stuck + self.slipping + self.opening + self.closing + self.open
    }
}

impl FromIterator<CycleStatus> for CycleCounts {
    fn from_iter<I: IntoIterator<Item = CycleStatus>>(statuses: I) -> Self {
        let mut counts = Self::default();
        for status in statuses {
            *match status {
                CycleStatus::Stuck => &mut counts.stuck,
                CycleStatus::Slipping => &mut counts.slipping,
                CycleStatus::Opening => &mut counts.opening,
                CycleStatus::Closing => &mut counts.closing,
                CycleStatus::Open => &mut counts.open,
            } += 1;
        }
        counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pair_does_one_thing_in_a_period() {
        use CycleStatus::{Closing, Open, Opening, Slipping, Stuck};
        for (is_open_at_rest, open_fraction, slides, expected) in [
            (false, 0.0, false, Stuck),
            (false, 0.0, true, Slipping),
            (false, 0.1, false, Opening),
            (false, 0.1, true, Opening),
            (false, 1.0, false, Opening),
            (true, 1.0, false, Open),
            (true, 0.9, false, Closing),
            (true, 0.9, true, Closing),
            (true, 0.0, false, Closing),
        ] {
            let found = CycleStatus::new(is_open_at_rest, open_fraction, slides);
            assert_eq!(
                found, expected,
                "{is_open_at_rest} {open_fraction} {slides}"
            );
            assert_eq!(found.is_open_at_rest(), is_open_at_rest);
        }
        let all = [Stuck, Slipping, Slipping, Opening, Closing, Open, Open];
        let counts: CycleCounts = all.into_iter().collect();
        assert_eq!(counts.pairs(), all.len());
        let expected = CycleCounts {
            stuck: 1,
            slipping: 2,
            opening: 1,
            closing: 1,
            open: 2,
        };
        assert_eq!(counts, expected);
    }

    #[test]
    fn counts_of_the_static_state_add_up() {
        use PairStatus::{Open, Slipping, Stuck};
        let all = [Open, Stuck, Open, Slipping];
        let counts: StaticCounts = all.into_iter().collect();
        assert_eq!((counts.stuck, counts.slipping, counts.open), (1, 1, 2));
        assert_eq!(counts.pairs(), all.len());
    }
}
