//! Binding of an assembly to a mesh: looks up groups, numbers bodies, and ties contacts, forces and
//! observed points to nodes.

use super::builder::{BodyBuilder, MatrixContents};
use super::cyclic::cyclic;
use super::excitations::excitations;
use super::groups::first_tags;
use super::joints::joints;
use super::loads::applied_load;
use super::matrices::axes_of;
use super::observations::observation;
use super::springs::{add_spring, dashpots_of, sprung_axes};
use super::{BodyPrestress, Prestress};
use super::{Model, ModelError, Rotation};
use crate::model::{Assembly, BodySpec, MatrixSource, NamedFiles};
use dovetail_mesh::Mesh;

/// Resolves every name of an assembly against the mesh. `files` has what was read from the files
/// that its excitations and bodies name, and is not needed where they name none.
///
/// Pairs are ordered contact by contact, each along the slot and then across it, whatever the
/// numbering of the mesh.
///
/// # Errors
/// A name that the mesh does not have, a group of the wrong kind, or a file that `files` lacks:
/// see [`ModelError`].
pub fn bind(
    assembly: &Assembly,
    mesh: &Mesh,
    files: Option<&NamedFiles>,
) -> Result<Model, ModelError> {
    if assembly.bodies.is_empty() {
        return Err(ModelError::NoBody);
    }
    let rotation = assembly.rotation.as_ref();
    for name in rotation.iter().flat_map(|r| &r.bodies) {
        if !assembly.bodies.iter().any(|b| b.name == *name) {
            return Err(ModelError::UnknownBody {
                used_by: "rotation".to_string(),
                name: name.clone(),
                available: assembly.bodies.iter().map(|b| b.name.clone()).collect(),
            });
        }
    }
    let sprung = sprung_axes(mesh, &assembly.springs);
    let builders = assembly.bodies.iter();
    let builders =
        builders.map(|spec| BodyBuilder::new(spec, mesh, source(assembly, spec, files)?, &sprung));
    let mut bodies: Vec<BodyBuilder> = builders.collect::<Result<_, _>>()?;
    check_disjoint(&bodies, mesh)?;
    for (body, spec) in bodies.iter_mut().zip(&assembly.bodies) {
        body.fix(spec, mesh)?;
    }
    let fields = files.map(|f| &f.fields);
    let mut joints = joints(assembly, mesh, &mut bodies, fields)?;
    let symmetry = assembly.cyclic.as_ref();
    let read = files.and_then(|f| f.influence.as_deref());
    let symmetry = symmetry.map(|spec| cyclic(spec, mesh, &mut bodies, read));
    let symmetry = symmetry.transpose()?;
    let mut straightened = Vec::new();
    for body in &mut bodies {
        straightened.extend(body.straighten_flanks(mesh)?);
    }
    for spec in &assembly.springs {
        joints.bonded.extend(add_spring(mesh, &mut bodies, spec)?);
    }

    let (excitations, maps) = excitations(assembly, mesh, &bodies, fields)?;
    let mut dashpots = Vec::new();
    for spec in &assembly.dashpots {
        dashpots.extend(dashpots_of(mesh, &bodies, spec)?);
    }
    let observations = assembly.observations.iter();
    let observations = observations.map(|spec| observation(mesh, &bodies, spec));
    let observations = observations.collect::<Result<_, _>>()?;

    for (number, spec) in assembly.loads.iter().enumerate() {
        let used_by = format!("load {}", number + 1);
        for (body, load) in applied_load(mesh, &bodies, spec, &used_by)? {
            bodies[body].add_load(number, load);
        }
    }

    let finished = bodies.into_iter().zip(&assembly.bodies);
    let finished = finished.map(|(body, spec)| body.finish(spec, rotation, mesh));
    Ok(Model {
        bodies: finished.collect::<Result<_, _>>()?,
        rotation: rotation.map(|r| Rotation {
            point_m: r.point_m,
            axis: r.axis,
            speed_rad_s: r.speed_rad_s,
            prestress: match r.prestress {
                Prestress::HeldFlanks if r.speed_rad_s != 0.0 => BodyPrestress::HeldFlanks,
                _ => BodyPrestress::None,
            },
            prestress_of_contact: r.prestress == Prestress::Contact && r.speed_rad_s != 0.0,
        }),
        cyclic: symmetry,
        pairs: joints.pairs,
        bonded: joints.bonded,
        flank_facets: joints.facets,
        contact_names: joints.names,
        excitations,
        maps,
        friction_maps: joints.friction_maps,
        observations,
        dashpots,
        matches: joints.matches,
        straightened,
    })
}

/// Source of the matrices of a body.
fn source<'a>(
    assembly: &Assembly,
    spec: &'a BodySpec,
    files: Option<&'a NamedFiles>,
) -> Result<MatrixContents<'a>, ModelError> {
    let given = match &spec.matrices {
        MatrixSource::Elements(material) => return Ok(MatrixContents::Elements(material)),
        MatrixSource::Given(given) => given,
        MatrixSource::Files(named) => {
            let read = files.and_then(|files| files.matrices.get(&spec.name));
            read.ok_or_else(|| ModelError::MatricesMissing {
                body: spec.name.clone(),
                path: named.stiffness.path.clone(),
            })?
        }
    };
    Ok(MatrixContents::Given(given, axes_of(assembly, spec)))
}

fn check_disjoint(bodies: &[BodyBuilder], mesh: &Mesh) -> Result<(), ModelError> {
    for (b, second) in bodies.iter().enumerate() {
        for first in &bodies[..b] {
            let shared = first.mesh_nodes().iter().filter(|&&n| second.has(n));
            let (count, tags) = first_tags(mesh, shared);
            if count > 0 {
                return Err(ModelError::SharedNodes {
                    first: first.name().to_string(),
                    second: second.name().to_string(),
                    count,
                    tags,
                });
            }
        }
    }
    Ok(())
}
