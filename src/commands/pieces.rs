//! Determines which meshes and reduced models several scenes can share, from their descriptions
//! alone, before any of them is made.

use std::path::PathBuf;

use dovetail_solver::contact::PairLaw;
use dovetail_solver::description::{Scene, Subject};
use dovetail_solver::model::{Assembly, MeshKind, Prestress};
use dovetail_solver::reduction::StuckModes;
use dovetail_solver::run::{StaticOptions, static_options, stuck_modes};

use crate::gmsh::inputs;

/// Inputs of a reduced model, as far as scenes differ in them. They correspond to the key of the
/// cache, but describe the model as the scene does.
#[derive(Debug, Clone, PartialEq)]
pub struct ReductionInputs {
    assembly: Assembly,
    wanted: StuckModes,
    /// Load path, tolerance and iterations of the static state that the prestress comes from.
    statics: Option<StaticOptions>,
}

/// Inputs of the mesh of a scene: its script and parameters, sorted by name. `None` if no mesh is
/// made, or if it cannot be kept for later runs.
pub fn mesh_inputs(scene: &Scene) -> Option<(PathBuf, Vec<(String, f64)>)> {
    let MeshKind::Geometry {
        script, parameters, ..
    } = &scene.assembly()?.mesh.as_ref()?.kind
    else {
        return None;
    };
    inputs::inputs(script)?;
    let mut parameters = parameters.clone();
    parameters.sort_by(|a, b| a.0.cmp(&b.0));
    Some((script.clone(), parameters))
}

/// Inputs of the reduced model of a scene; `None` if nothing is reduced.
pub fn reduction_inputs(scene: &Scene) -> Option<ReductionInputs> {
    let Subject::Assembly(assembly) = &scene.subject else {
        return None;
    };
    let mut assembly = Assembly::clone(assembly);
    let rotation = assembly.rotation.as_ref();
    let of_contact = rotation.is_some_and(|r| r.prestress == Prestress::Contact);
    if !of_contact {
        for contact in &mut assembly.contacts {
            (contact.pair_law, contact.crown) = (PairLaw::rigid(0.0, 0.0), None);
            contact.friction_at = None;
        }
    }
    for excitation in &mut assembly.excitations {
        (excitation.amplitude, excitation.phase_rad) = (0.0, 0.0);
        excitation.harmonic = 0;
    }
    let statics = of_contact.then(|| static_options(scene));
    Some(ReductionInputs {
        assembly,
        wanted: stuck_modes(scene),
        statics,
    })
}
