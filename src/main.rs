//! The `dovetail` program: see `dovetail --help`.
fn main() {}
