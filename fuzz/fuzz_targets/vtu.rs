//! A VTU file.

#![no_main]

mod checks;

use dovetail_mesh::formats::vtu;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    checks::content(vtu::parse(bytes));
});
