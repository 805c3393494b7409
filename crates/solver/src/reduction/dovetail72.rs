//! The reduced model of 72 pairs in `tests/data/dovetail72`, for unit tests.

use super::RelativeModel;
use super::superelement::read;
use crate::law::PairLaw;

/// With a friction of 0.3 and no clearance, excited by `force_n`.
pub fn dovetail72(force_n: f64) -> RelativeModel {
    let law = PairLaw::rigid(0.3, 0.0);
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/dovetail72");
    read(folder.as_ref(), law, force_n).unwrap().relative
}
