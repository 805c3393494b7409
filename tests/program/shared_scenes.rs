//! The ready meshes and assemblies of them, made in code, for the tests of meshes and binding.

use std::path::{Path, PathBuf};

use dovetail_solver::mesh::block::side_by_side;
use dovetail_solver::mesh::source::{MeshKind, MeshSource};
use dovetail_solver::mesh::{self, Mesh};
use dovetail_solver::model::{
    Assembly, BodyMesh, BodySpec, ContactSpec, ExcitationKind, ExcitationSpec, Material,
    ObservationSpec, Prestress, RotationSpec,
};

pub const MM: f64 = 1e-3;

pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

pub fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(root().join("meshes").join(name)).unwrap()
}

pub fn ready(name: &str) -> Mesh {
    mesh::read(&root().join("meshes").join(name), MM).unwrap()
}

// ---------------------------------------------------------------------------------- assemblies

pub fn body(name: &str, fixed: &[&str]) -> BodySpec {
    BodySpec {
        name: name.into(),
        mesh: BodyMesh::Shared,
        volume: name.into(),
        material: Material {
            young_pa: 113.8e9,
            poisson: 0.34,
            density_kg_m3: 4430.0,
        }
        .into(),
        fixed: fixed.iter().map(|s| s.to_string()).collect(),
        fixed_along: Default::default(),
        fixed_interface_modes: None,
    }
}

pub fn contact(name: &str, first: &str, second: &str) -> ContactSpec {
    ContactSpec {
        name: name.into(),
        first: first.into(),
        second: Some(second.into()),
        law: dovetail_solver::model::ContactLaw::UnilateralCoulomb,
        friction: 0.3,
        gap_m: 0.0,
        gap_from_mesh: false,
        search_distance_m: None,
        slave: None,
        crown: None,
    }
}

pub fn assembly(bodies: Vec<BodySpec>, contacts: Vec<ContactSpec>, probe: &str) -> Assembly {
    Assembly {
        springs: Vec::new(),
        mesh: Some(MeshSource {
            kind: MeshKind::File {
                path: PathBuf::from("test.msh"),
            },
            units: MM.into(),
        }),
        rotation: Some(RotationSpec {
            point_m: [0.0; 3],
            axis: [1.0, 0.0, 0.0],
            speed_rad_s: 523.6,
            bodies: vec![bodies[0].name.clone()],
            prestress: Prestress::HeldFlanks,
        }),
        bodies,
        contacts,
        loads: Vec::new(),
        excitations: vec![ExcitationSpec {
            kind: ExcitationKind::force(probe, [0.0, 1.0, 0.0]),
            amplitude: 6.0,
            harmonic: 1,
            phase_rad: 0.0,
        }],
        observations: vec![ObservationSpec {
            name: "tip".into(),
            points: probe.into(),
            direction: [0.0, 0.6, 0.8],
        }],
    }
}

pub fn dovetail_assembly() -> Assembly {
    let sides = ["jaw_base", "jaw_side_left", "jaw_side_right"];
    assembly(
        vec![body("blade", &[]), body("jaw", &sides)],
        vec![
            contact("left", "blade_flank_left", "jaw_flank_left"),
            contact("right", "blade_flank_right", "jaw_flank_right"),
        ],
        "excitation",
    )
}

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

pub fn assert_vector(found: [f64; 3], expected: [f64; 3], tolerance: f64) {
    assert!(
        distance(found, expected) < tolerance,
        "{found:?} is not {expected:?}"
    );
}
