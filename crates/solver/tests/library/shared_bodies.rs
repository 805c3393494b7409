//! A ready mesh, a body and an assembly of given bodies, made in code.

use std::path::PathBuf;

use dovetail_mesh::Mesh;
use dovetail_solver::model::{
    Assembly, BodySpec, ContactSpec, ExcitationKind, ExcitationSpec, Material, ObservationSpec,
    Prestress, RotationSpec,
};
use dovetail_solver::model::{MeshKind, MeshSource};
use dovetail_solver::reduced::ObservedQuantity;
use dovetail_testkit::folder::root;

pub const MM: f64 = 1e-3;

pub fn ready(name: &str) -> Mesh {
    let bytes = std::fs::read(root().join("meshes").join(name)).unwrap();
    dovetail_mesh::parse(bytes, MM).unwrap()
}

pub fn body(name: &str, fixed: &[&str]) -> BodySpec {
    BodySpec::new(name, Material::new(113.8e9, 0.34, 4430.0)).fixed(fixed.iter().copied())
}

pub fn assembly(bodies: Vec<BodySpec>, contacts: Vec<ContactSpec>, probe: &str) -> Assembly {
    Assembly {
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
            quantity: ObservedQuantity::Displacement,
        }],
        ..Assembly::default()
    }
}
