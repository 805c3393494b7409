//! The ready meshes and assemblies of them, made in code, for the tests of meshes and binding.

use dovetail_mesh::Mesh;
use dovetail_solver::model::Assembly;
use dovetail_testkit::block::side_by_side;

pub use crate::shared_bodies::{assembly, body, ready};
pub use crate::shared_dovetail::{assert_vector, contact};
pub use dovetail_testkit::folder::root;

pub fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(root().join("meshes").join(name)).unwrap()
}

// ---------------------------------------------------------------------------------- assemblies

pub fn blocks_assembly() -> Assembly {
    let bodies = vec![body("upper", &[]), body("lower", &["base"])];
    assembly(
        bodies,
        vec![contact("c", "upper_bottom", "lower_top")],
        "corner",
    )
}

/// Two blocks in one mesh, with the groups that [`blocks_assembly`] names.
pub fn two_blocks(upper: &Mesh, lower: &Mesh) -> Mesh {
    let mut both = side_by_side(("upper", upper), ("lower", lower));
    for (old, new) in [
        ("upper_volume", "upper"),
        ("lower_volume", "lower"),
        ("upper_z_min", "upper_bottom"),
        ("lower_z_max", "lower_top"),
        ("lower_z_min", "base"),
        ("upper_corner_111", "corner"),
    ] {
        let group = both.groups.remove(old).unwrap();
        both.groups.insert(new.to_owned(), group);
    }
    both
}

// ----------------------------------------------------------------------------- small vectors

pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

pub fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    dot(sub(a, b), sub(a, b)).sqrt()
}
