//! The scene of Charleux, Thouverez and Lombard (IMAC XXII, 2004) as values: the contents of
//! scenes/paper.toml, on the ready mesh.
//!
//!     cargo run --release --package dovetail-solver --example paper_without_toml

use std::error::Error;
use std::f64::consts::PI;
use std::path::PathBuf;

use dovetail_solver::damping::DampingSpec;
use dovetail_solver::description::{FrequencyRange, ResponseSpec, Scene, StaticSpec, Subject};
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::model::{
    Assembly, BodyMesh, BodySpec, ContactSpec, ExcitationKind, ExcitationSpec, Material, MeshKind,
    MeshSource, ObservationSpec, Prestress, RotationSpec,
};
use dovetail_solver::reduced::Quantity;
use dovetail_solver::results::quantities::{linear_peak, peak};
use dovetail_solver::run::{self, Options, Run, Session};

/// Gmsh files carry no unit: this one is in millimetres.
const METRES_PER_UNIT: f64 = 1e-3;

fn main() -> Result<(), Box<dyn Error>> {
    let run = solve()?;
    let response = &run.response.as_ref().ok_or("no static state")?.response;
    for (words, peak) in [
        ("friction", peak(response, 0)),
        ("all pairs stuck", linear_peak(response, 0)),
    ] {
        let peak = peak.ok_or("no peak")?;
        println!(
            "{words}: tip {:.3} mm at {:.2} Hz",
            1e3 * peak.amplitude_m,
            peak.frequency_hz
        );
    }
    Ok(())
}

/// Computes the response from the mesh.
pub fn solve() -> Result<Run, Box<dyn Error>> {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../meshes/dovetail.msh");
    let mesh = dovetail_mesh::parse(std::fs::read(&file)?, METRES_PER_UNIT)?;
    let scene = scene(assembly(file));
    // Nobody listens, and nothing is kept.
    let (mut observer, mut store) = ((), ());
    let session = Session::new(&mut observer, &mut store);
    let run = run::solve(&scene, mesh.into(), Options::default(), &session)?;
    run.verdict()?;
    Ok(run)
}

/// Scene: the response of the assembly near the first mode, at 11 frequencies and some more at the
/// peaks.
fn scene(assembly: Assembly) -> Scene {
    let range = FrequencyRange::OfFirstLinearMode {
        from: 0.98,
        to: 1.02,
    };
    let resolution = Resolution::fixed(3, 128);
    let ratio = 0.001;
    Scene {
        name: "paper".into(),
        subject: Subject::Assembly(Box::new(assembly)),
        damping: DampingSpec::Ratio {
            ratio,
            linear_mode: 1,
        },
        modal_ratios: Vec::new(),
        static_state: StaticSpec::default(),
        response: ResponseSpec::new(range, resolution),
        engine_orders: Vec::new(),
        mission: Vec::new(),
    }
}

fn assembly(mesh: PathBuf) -> Assembly {
    Assembly {
        mesh: Some(MeshSource {
            kind: MeshKind::File { path: mesh },
            units: METRES_PER_UNIT.into(),
        }),
        // First the body that vibrates, then the one that holds it.
        bodies: vec![body("blade", &[]), body("jaw", &["jaw_base"])],
        rotation: Some(RotationSpec {
            point_m: [0.0; 3],
            axis: [1.0, 0.0, 0.0],
            speed_rad_s: 5000.0 * PI / 30.0,
            bodies: vec!["blade".into(), "jaw".into()],
            prestress: Prestress::HeldFlanks,
        }),
        contacts: vec![contact("left"), contact("right")],
        excitations: vec![ExcitationSpec {
            kind: ExcitationKind::force("excitation", [0.0, 1.0, 0.0]),
            amplitude: 2.0,
            harmonic: 1,
            phase_rad: 0.0,
        }],
        observations: vec![ObservationSpec {
            name: "tip".into(),
            points: "tip_trailing_edge".into(),
            direction: [0.0, 1.0, 0.0],
            quantity: Quantity::Displacement,
        }],
        ..Assembly::default()
    }
}

/// Body of titanium; the names are those of the volume and of the groups that do not move.
fn body(name: &str, fixed: &[&str]) -> BodySpec {
    BodySpec {
        name: name.into(),
        mesh: BodyMesh::Shared,
        volume: name.into(),
        matrices: Material {
            young_pa: 113.8e9,
            poisson: 0.34,
            density_kg_m3: 4430.0,
        }
        .into(),
        fixed: fixed.iter().map(ToString::to_string).collect(),
        fixed_along: Default::default(),
        fixed_interface_modes: None,
        strength: None,
    }
}

fn contact(side: &str) -> ContactSpec {
    let [first, second] = ["blade", "jaw"].map(|body| format!("{body}_flank_{side}"));
    ContactSpec::new(side, first, second, 0.3)
}
