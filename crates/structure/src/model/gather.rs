//! Union of the meshes of all bodies.

use std::collections::BTreeMap;
use std::path::Path;

use super::{Assembly, BodyMesh, BodySpec, ModelError};
use dovetail_mesh::parts::Placement;
use dovetail_mesh::text::list;
use dovetail_mesh::units::Units;
use dovetail_mesh::{Group, Mesh};

/// Adds the bodies that have meshes of their own to the mesh that the others share. `read` gives
/// the mesh of a file; each file is read once.
///
/// # Errors
/// The errors of `read`, and [`ModelError`] where a volume or the original of a copy is missing.
pub fn gather<E: From<ModelError>>(
    assembly: &Assembly,
    shared: Option<Mesh>,
    read: &mut dyn FnMut(&Path, Units) -> Result<Mesh, E>,
) -> Result<Mesh, E> {
    let mut whole = shared.unwrap_or_default();
    let mut files: Vec<(&Path, Units, Mesh)> = Vec::new();
    let mut parts: BTreeMap<&str, Mesh> = BTreeMap::new();
    for body in &assembly.bodies {
        let part = match &body.mesh {
            BodyMesh::Shared => continue,
            BodyMesh::File {
                path,
                units,
                placement,
            } => {
                let known = files.iter().position(|(p, u, _)| p == path && u == units);
                let at = match known {
                    Some(at) => at,
                    None => {
                        files.push((path, *units, read(path, *units)?));
                        files.len() - 1
                    }
                };
                placed(&files[at].2, body, placement)?
            }
            BodyMesh::CopyOf {
                body: original,
                placement,
            } => match parts.get(original.as_str()) {
                Some(part) => placed(part, body, placement)?,
                None => {
                    let is_shared =
                        |b: &&BodySpec| b.name == *original && b.mesh == BodyMesh::Shared;
                    if !assembly.bodies.iter().any(|b| is_shared(&b)) {
                        return Err(missing_original_error(assembly, body, original).into());
                    }
                    placed(&whole, body, placement)?
                }
            },
        };
        parts.insert(&body.name, part);
    }
    // Copies of shared bodies are taken from the shared mesh alone: parts come afterwards.
    for body in &assembly.bodies {
        if let Some(part) = parts.get(body.name.as_str()) {
            whole.add_part(&body.name, part);
        }
    }
    add_short_names(&mut whole, &parts);
    Ok(whole)
}

fn missing_original_error(assembly: &Assembly, body: &BodySpec, original: &str) -> ModelError {
    let others = assembly.bodies.iter().map(|b| b.name.clone());
    ModelError::UnknownBody {
        used_by: format!("body `{}`, copy_of", body.name),
        name: original.to_owned(),
        available: others.take_while(|name| *name != body.name).collect(),
    }
}

fn placed(mesh: &Mesh, body: &BodySpec, placement: &Placement) -> Result<Mesh, ModelError> {
    let Some(mut part) = mesh.part(&body.volume) else {
        let volumes = mesh.groups.iter().filter(|(_, group)| group.dimension == 3);
        return Err(ModelError::UnknownGroup {
            used_by: format!("body `{}`", body.name),
            name: body.volume.clone(),
            wanted: "volume",
            available: volumes.map(|(name, _)| name.clone()).collect(),
        });
    };
    part.place(placement);
    Ok(part)
}

/// Gives short names, without that of the part, to groups that one part alone has.
fn add_short_names(mesh: &mut Mesh, parts: &BTreeMap<&str, Mesh>) {
    let mut owners: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for (body, part) in parts {
        for group in part.groups.keys() {
            owners.entry(group).or_default().push(body);
        }
    }
    let mut short: Vec<(String, Group)> = Vec::new();
    for (name, bodies) in owners {
        if let ([body], None) = (bodies.as_slice(), mesh.groups.get(name)) {
            let group = mesh.groups.get(&format!("{body}.{name}"));
            short.extend(group.map(|group| (name.to_owned(), group.clone())));
        }
    }
    mesh.groups.extend(short);
}

/// Name of a group from the view of a body: a group of its own mesh comes before that of another.
pub fn name_for<'a>(mesh: &Mesh, body: &str, name: &'a str) -> std::borrow::Cow<'a, str> {
    let qualified = format!("{body}.{name}");
    if mesh.groups.contains_key(&qualified) {
        qualified.into()
    } else {
        name.into()
    }
}

/// Names of the materials of a mesh, for messages.
pub(super) fn materials(mesh: &Mesh) -> String {
    let names: Vec<String> = mesh.materials.iter().map(|m| m.name.clone()).collect();
    list(&names)
}
