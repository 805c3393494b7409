//! Says which version of the program this is, and from which commit it was built.

/// The version as in summary.json, with the commit where it is known: `0.1.0 (8d1d101)`.
pub const WITH_COMMIT: &str = concat!(env!("CARGO_PKG_VERSION"), env!("DOVETAIL_COMMIT"));

/// The commit alone, with `-dirty` where what the program is made from was changed; `None` where it
/// is not known.
pub fn commit() -> Option<&'static str> {
    let in_brackets = env!("DOVETAIL_COMMIT").trim();
    in_brackets.strip_prefix('(')?.strip_suffix(')')
}
