//! Version of the program, and the commit from which it was built.

/// Version as in summary.json, with the commit if it is known: `0.2.0 (8d1d101)`.
pub const WITH_COMMIT: &str = concat!(env!("CARGO_PKG_VERSION"), env!("DOVETAIL_COMMIT"));

/// Commit alone, with `-dirty` if the sources of the program were changed; `None` if it is not
/// known.
pub fn commit() -> Option<&'static str> {
    let in_brackets = env!("DOVETAIL_COMMIT").trim();
    in_brackets.strip_prefix('(')?.strip_suffix(')')
}
