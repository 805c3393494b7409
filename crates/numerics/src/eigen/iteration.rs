//! Result and start vectors that all iterations for modes share.

use super::Modes;

/// Number of modes computed beyond those asked for, to find a gap for the Sturm count.
pub(super) const SPARE: usize = 2;

/// Modes that an iteration found.
#[derive(Debug)]
pub(super) struct FoundModes {
    /// The lowest modes, of unit modal mass. They are fewer than were wanted if the others need an
    /// iteration of their own, or if no other motion has mass.
    pub modes: Modes,
    /// Number of vectors of the basis.
    pub columns: usize,
    /// True if no other motion has mass.
    pub exhausted: bool,
}

/// Entry of the start vector, which is the same in every run and differs from seed to seed.
pub(super) fn start_entry(i: usize, seed: usize) -> f64 {
    let mixed = ((i + 1) as u64 + ((seed as u64) << 40)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (mixed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
}
