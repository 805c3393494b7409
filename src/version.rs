//! Says which version of the program this is, and from which commit it was built.

/// The version as in summary.json, with the commit where it is known: `0.1.0 (8d1d101)`.
pub const WITH_COMMIT: &str = concat!(env!("CARGO_PKG_VERSION"), env!("DOVETAIL_COMMIT"));
