//! Modes of a meshed blade in its dovetail at 5000 rpm: of the blade with its flanks held, and of
//! the assembly with all contacts stuck.
//!
//!     cargo run --release --package dovetail-solver --example mesh_modes

use std::error::Error;
use std::f64::consts::TAU;
use std::path::Path;

use dovetail_solver::fem::assemble;
use dovetail_solver::mesh;
use dovetail_solver::model::bind;
use dovetail_solver::prelude::*;
use dovetail_solver::reduction::craig_bampton::fixed_interface_modes;
use dovetail_solver::reduction::stuck_modes;

fn main() -> Result<(), Box<dyn Error>> {
    let modes = modes_hz(4)?;
    println!("flanks held:    {:.4?} Hz", modes.held);
    println!("contacts stuck: {:.4?} Hz", modes.stuck);
    Ok(())
}

/// Natural frequencies, ascending, Hz.
pub struct ModesHz {
    /// Modes of the blade with its flanks held.
    pub held: Vec<f64>,
    /// Modes of blade and jaw with all contacts stuck.
    pub stuck: Vec<f64>,
}

/// The lowest modes of each kind.
pub fn modes_hz(count: usize) -> Result<ModesHz, Box<dyn Error>> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../meshes/dovetail.msh");
    // The mesh is in millimetres.
    let mesh = mesh::parse(std::fs::read(&file)?, 1e-3)?;
    let model = bind(&assembly(), &mesh, None)?;
    let structure = assemble(&model)?;
    let held = fixed_interface_modes(&structure.bodies[0], count)?;
    let hertz = |omega2: Vec<f64>| omega2.iter().map(|w2| w2.sqrt() / TAU).collect();
    Ok(ModesHz {
        held: hertz(held.omega2),
        stuck: hertz(stuck_modes(&structure, count)?),
    })
}

/// Bodies and contacts by the groups of the mesh.
fn assembly() -> Assembly {
    let titanium = Material::new(113.8e9, 0.34, 4430.0);
    let contact = |side: &str| {
        let [first, second] = ["blade", "jaw"].map(|body| format!("{body}_flank_{side}"));
        ContactSpec::new(side, first, second, 0.3)
    };
    Assembly {
        mesh: Some(MeshSource::file("meshes/dovetail.msh", 1e-3)),
        bodies: vec![
            BodySpec::new("blade", titanium),
            BodySpec::new("jaw", titanium).fixed(["jaw_base"]),
        ],
        rotation: Some(
            RotationSpec::new([1.0, 0.0, 0.0], 5000.0, ["blade", "jaw"])
                .prestress(Prestress::HeldFlanks),
        ),
        contacts: vec![contact("left"), contact("right")],
        ..Assembly::default()
    }
}
