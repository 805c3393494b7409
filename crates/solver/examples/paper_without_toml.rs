//! The scene of Charleux, Thouverez and Lombard (IMAC XXII, 2004) as values: the contents of
//! scenes/paper.toml, on the ready mesh.
//!
//!     cargo run --release --package dovetail-solver --example paper_without_toml

use std::error::Error;
use std::path::PathBuf;

use dovetail_solver::mesh;
use dovetail_solver::prelude::*;

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
        let (amplitude_mm, frequency_hz) = (1e3 * peak.amplitude_m, peak.frequency_hz);
        println!("{words}: tip {amplitude_mm:.3} mm at {frequency_hz:.2} Hz");
    }
    Ok(())
}

/// Computes the response near the first mode from the mesh.
pub fn solve() -> Result<Run, Box<dyn Error>> {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../meshes/dovetail.msh");
    let mesh = mesh::parse(std::fs::read(&file)?, METRES_PER_UNIT)?;
    let range = FrequencyRange::relative_to_first_mode(0.98, 1.02);
    let response = ResponseSpec::new(range, Resolution::fixed(3, 128));
    let scene = Scene::new("paper", assembly(file), response).damping(DampingSpec::ratio(0.001));
    Ok(scene.solve(mesh)?)
}

/// Bodies by the groups of the mesh: first the one that vibrates, then the one that holds it.
fn assembly(mesh: PathBuf) -> Assembly {
    let titanium = Material::new(113.8e9, 0.34, 4430.0);
    let y = [0.0, 1.0, 0.0];
    let contact = |side: &str| {
        let [first, second] = ["blade", "jaw"].map(|body| format!("{body}_flank_{side}"));
        ContactSpec::new(side, first, second, 0.3)
    };
    Assembly {
        mesh: Some(MeshSource::file(mesh, METRES_PER_UNIT)),
        bodies: vec![
            BodySpec::new("blade", titanium),
            BodySpec::new("jaw", titanium).fixed(["jaw_base"]),
        ],
        rotation: Some(
            RotationSpec::new([1.0, 0.0, 0.0], 5000.0, ["blade", "jaw"])
                .prestress(Prestress::HeldFlanks),
        ),
        contacts: vec![contact("left"), contact("right")],
        excitations: vec![ExcitationSpec::force("excitation", y, 2.0)],
        observations: vec![ObservationSpec::displacement("tip", "tip_trailing_edge", y)],
        ..Assembly::default()
    }
}
