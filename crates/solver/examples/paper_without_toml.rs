//! The scene of Charleux, Thouverez and Lombard (IMAC XXII, 2004) as values: what scenes/paper.toml
//! says, on the ready mesh, at three frequencies about the peak.
//!
//!     cargo run --release --package dovetail-solver --example paper_without_toml

use std::error::Error;
use std::f64::consts::{PI, TAU};
use std::path::PathBuf;

use dovetail_numerics::newton::NewtonOptions;
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::dlft::static_state::static_state;
use dovetail_solver::dlft::sweep::{SweepSettings, sweep};
use dovetail_solver::dlft::{PairStatus, Response, StaticState};
use dovetail_solver::fem::assemble;
use dovetail_solver::model::{
    Assembly, BodyMesh, BodySpec, ContactLaw, ContactSpec, ExcitationKind, ExcitationSpec,
    Material, ObservationSpec, Prestress, RotationSpec, bind,
};
use dovetail_solver::model::{MeshKind, MeshSource};
use dovetail_solver::problem::Problem;
use dovetail_solver::reduction::damping::{DampingSpec, rayleigh};
use dovetail_solver::reduction::{Highest, StuckModes, reduce};

/// Gmsh files carry no unit: this one is in millimetres.
const METRES_PER_UNIT: f64 = 1e-3;

fn main() -> Result<(), Box<dyn Error>> {
    let answer = solve()?;
    println!("first stuck mode {:.2} Hz", answer.first_stuck_hz);
    let sliding = |s: &&PairStatus| **s == PairStatus::Slipping;
    let statuses = &answer.state.status;
    println!(
        "static state: {} of {} pairs slide",
        statuses.iter().filter(sliding).count(),
        statuses.len()
    );
    for (orbit, stuck) in answer.response.orbits.iter().zip(&answer.response.linear) {
        println!(
            "{:.4} Hz: {}, tip {:.3} mm, {:.3} mm with all pairs stuck, friction {:.2} W",
            orbit.frequency_hz,
            orbit.outcome.word(),
            1e3 * orbit.observed_amplitude_m[0],
            1e3 * stuck.observed_amplitude_m[0],
            orbit.friction_power_w
        );
    }
    Ok(())
}

/// What comes out.
pub struct Answer {
    pub first_stuck_hz: f64,
    pub state: StaticState,
    pub response: Response,
}

/// From the mesh to the response.
pub fn solve() -> Result<Answer, Box<dyn Error>> {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../meshes/dovetail.msh");
    let mesh = dovetail_mesh::parse(std::fs::read(&file)?, METRES_PER_UNIT)?;
    let model = bind(&assembly(file), &mesh)?;
    let structure = assemble(&model)?;
    let wanted = StuckModes {
        count: None,
        excited: Highest::OfFirstStuckMode(1.02),
        kept: Highest::OfFirstStuckMode(1.02),
    };
    let problem = Problem::new(reduce(&model, &structure, wanted)?.model, &model);
    let ratio = DampingSpec::Ratio {
        ratio: 0.001,
        linear_mode: 1,
    };
    let damping = rayleigh(&ratio, problem.reduced.stuck_omega2())?;
    let newton = NewtonOptions {
        tolerance: 1e-10,
        max_iterations: 100,
    };
    let state = static_state(&problem, 10, newton);
    let resolution = Resolution::Fixed {
        harmonics: 3,
        samples: 128,
    };
    let settings = SweepSettings::new(vec![449.5, 450.0977, 451.0], resolution);
    let response = sweep(&problem, damping, &state, &settings, &[], &|_| ());
    Ok(Answer {
        first_stuck_hz: problem.reduced.omega2[0].sqrt() / TAU,
        state,
        response,
    })
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
        springs: Vec::new(),
        loads: Vec::new(),
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
        }],
    }
}

/// Titanium; the names are those of the volume and of the groups that do not move.
fn body(name: &str, fixed: &[&str]) -> BodySpec {
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
        fixed: fixed.iter().map(ToString::to_string).collect(),
        fixed_along: Default::default(),
        fixed_interface_modes: None,
    }
}

fn contact(side: &str) -> ContactSpec {
    ContactSpec {
        name: side.into(),
        first: format!("blade_flank_{side}"),
        second: Some(format!("jaw_flank_{side}")),
        law: ContactLaw::UnilateralCoulomb,
        friction: 0.3,
        stiffness: None,
        gap_m: 0.0,
        gap_from_mesh: false,
        search_distance_m: None,
        slave: None,
        crown: None,
    }
}
