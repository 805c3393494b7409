//! A VTU file.

#![no_main]

mod checks;
mod limits;

use dovetail_mesh::formats::vtu;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| limits::hold(bytes, read));

fn read(bytes: &[u8]) {
    checks::content(vtu::parse(bytes));
}
