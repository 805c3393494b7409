//! A mesh file of any format, also of those that are only named.

#![no_main]

mod checks;
mod limits;

use dovetail_mesh::{MeshError, formats};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| limits::hold(bytes, read));

fn read(bytes: &[u8]) {
    let none = |_: &str| Err(MeshError::NoBytes);
    let endings = ["msh", "inp", "vtu", "cdb", "bdf", "stl", "med", ""];
    let ending = endings[bytes.len() % endings.len()];
    let name = format!("mesh.{ending}");
    checks::content(formats::parse(bytes, &name, &mut { none }));
}
