//! Determines which meshes several scenes can share, from their descriptions, before any of them is
//! made.

use std::path::PathBuf;

use crate::gmsh::inputs;
use dovetail_solver::description::Scene;
use dovetail_solver::model::MeshKind;

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
