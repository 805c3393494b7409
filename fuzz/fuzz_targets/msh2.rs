//! A Gmsh mesh of version 2.2.

#![no_main]

mod checks;
mod limits;

use dovetail_mesh::formats::msh2;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| limits::hold(bytes, read));

fn read(bytes: &[u8]) {
    checks::content(msh2::parse(bytes));
}
