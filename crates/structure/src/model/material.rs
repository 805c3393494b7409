//! Material of a body whose mesh defines it.

use std::collections::BTreeSet;

use super::gather::materials;
use super::{Material, MaterialSpec, ModelError};
use dovetail_mesh::{Mesh, MeshMaterial};

/// Material of the body `body`, whose elements are `elements`. `volume_m3` is called where the body
/// has a mass instead of a density.
pub(super) fn material(
    spec: &MaterialSpec,
    mesh: &Mesh,
    body: &str,
    elements: &[u32],
    volume_m3: impl FnOnce() -> f64,
) -> Result<Material, ModelError> {
    let name = match spec {
        MaterialSpec::Given(material) => return Ok(*material),
        MaterialSpec::OfMass {
            young_pa,
            poisson,
            mass_kg,
        } => {
            return Ok(Material {
                young_pa: *young_pa,
                poisson: *poisson,
                density_kg_m3: mass_kg / volume_m3(),
            });
        }
        MaterialSpec::OfMesh(name) => name,
    };
    let elements: BTreeSet<u32> = elements.iter().copied().collect();
    let share = |m: &MeshMaterial| m.elements.iter().filter(|e| elements.contains(e)).count();
    let material = match name {
        Some(name) => {
            let of_body = format!("{body}.{name}");
            let is_meant = |m: &&MeshMaterial| m.name == of_body || m.name == *name;
            mesh.materials.iter().find(is_meant)
        }
        None => {
            let used: Vec<&MeshMaterial> = mesh.materials.iter().filter(|m| share(m) > 0).collect();
            if used.len() > 1 {
                return Err(ModelError::SeveralMaterials {
                    body: body.to_owned(),
                    names: used.iter().map(|m| m.name.clone()).collect(),
                });
            }
            let first = used.first().copied();
            first.filter(|m| share(m) == elements.len())
        }
    };
    let Some(material) = material else {
        return Err(ModelError::NoMaterial {
            body: body.to_owned(),
            name: name.clone(),
            available: materials(mesh),
        });
    };
    mesh_material(material, body)
}

fn mesh_material(found: &MeshMaterial, body: &str) -> Result<Material, ModelError> {
    let wrong = |reason: String| ModelError::BadMaterial {
        body: body.to_owned(),
        name: found.name.clone(),
        reason,
    };
    if !found.has_units {
        let reason = "its units are not known: give `units` (\"m-kg-s\", \"mm-t-s\" or \"in-lbf-s\") in place of metres_per_unit";
        return Err(wrong(reason.to_owned()));
    }
    let given = |value: Option<f64>, what: &str| {
        value.ok_or_else(|| wrong(format!("the mesh file gives it no {what}: add it there")))
    };
    let material = Material {
        young_pa: given(
            found.young_pa,
            "isotropic Young's modulus (*ELASTIC, EX, MAT1)",
        )?,
        poisson: given(found.poisson, "Poisson's ratio (*ELASTIC, NUXY, MAT1)")?,
        density_kg_m3: given(found.density_kg_m3, "density (*DENSITY, DENS, MAT1)")?,
    };
    let positive = |value: f64| value.is_finite() && value > 0.0;
    if !positive(material.young_pa) || !positive(material.density_kg_m3) {
        return Err(wrong(
            "Young's modulus and density must be positive".to_owned(),
        ));
    }
    if !(material.poisson > -1.0 && material.poisson < 0.5) {
        let nu = material.poisson;
        return Err(wrong(format!(
            "Poisson's ratio is {nu}, not between -1 and 0.5"
        )));
    }
    Ok(material)
}
