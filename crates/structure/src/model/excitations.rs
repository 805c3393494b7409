//! Excitations of the assembly, tied to nodes and facets.

use std::f64::consts::FRAC_PI_2;

use super::builder::BodyBuilder;
use super::loads::{applied_load, surface};
use super::mapping::{self, Facets, FieldMap, NodalForces};
use super::{AppliedLoad, ModelError, ModelExcitation};
use crate::model::{
    Assembly, BaseMotion, ExcitationKind, ExcitationSpec, FieldSource, SurfaceFields,
};
use dovetail_dynamics::excitation::{Excitation as InTime, Growth};
use dovetail_mesh::Mesh;
use dovetail_mesh::surface_field::{FieldValues, SurfaceField};
use dovetail_numerics::space::diagonal;

/// Excitations of the scene, and the reports of how its fields were mapped.
pub(super) fn excitations(
    assembly: &Assembly,
    mesh: &Mesh,
    bodies: &[BodyBuilder],
    fields: Option<&SurfaceFields>,
) -> Result<(Vec<ModelExcitation>, Vec<FieldMap>), ModelError> {
    let (mut all, mut maps) = (Vec::new(), Vec::new());
    for (number, spec) in assembly.excitations.iter().enumerate() {
        let used_by = format!("excitation {}", number + 1);
        let of = |loads, lead_rad: f64| ModelExcitation {
            loads,
            in_time: InTime {
                amplitude: spec.amplitude,
                harmonic: spec.harmonic,
                phase_rad: spec.phase_rad - lead_rad,
                growth: Growth::Constant,
            },
        };
        match &spec.kind {
            ExcitationKind::Load(load) => {
                all.push(of(applied_load(mesh, bodies, load, &used_by)?, 0.0));
            }
            ExcitationKind::Base { direction, motion } => {
                // In the frame of the base all mass is pushed against its acceleration, which is
                // -w^2 times its displacement.
                let (sign, growth) = match motion {
                    BaseMotion::Acceleration => (-1.0, Growth::Constant),
                    BaseMotion::Displacement => (1.0, Growth::Squared),
                };
                let vector_m_s2 = direction.map(|d| sign * d);
                let load = |body| (body, AppliedLoad::Acceleration { vector_m_s2 });
                let loads = (0..bodies.len()).map(load).collect();
                let mut excitation = of(loads, 0.0);
                excitation.in_time.growth = growth;
                all.push(excitation);
            }
            ExcitationKind::Field { on, field } => {
                let named = named_field(field, fields, &used_by)?;
                if let FieldValues::Friction(_) = named.1.values {
                    return Err(ModelError::FieldKind {
                        used_by,
                        field: named.0,
                        found: "coefficients of friction",
                        wanted: "pressures or forces",
                    });
                }
                let (body, [re, im], map) = field_forces(mesh, bodies, on, named, &used_by, spec)?;
                let loads = |forces: Vec<(u32, [f64; 3])>| {
                    let point = |(node, vector_n)| (body, AppliedLoad::Point { node, vector_n });
                    forces.into_iter().map(point).collect()
                };
                // Re((a + i b) exp(i w t)) = a cos(w t) + b cos(w t + 90 degrees)
                all.push(of(loads(re), 0.0));
                if im.iter().any(|(_, force)| *force != [0.0; 3]) {
                    all.push(of(loads(im), FRAC_PI_2));
                }
                maps.push(map);
            }
        }
    }
    Ok((all, maps))
}

/// Field of a source, and its name in messages.
pub(super) fn named_field<'a>(
    source: &'a FieldSource,
    fields: Option<&'a SurfaceFields>,
    used_by: &str,
) -> Result<(String, &'a SurfaceField), ModelError> {
    match source {
        FieldSource::Points(field) => Ok(("the field".to_owned(), field)),
        FieldSource::File(path) => {
            let read = fields.and_then(|fields| fields.get(path));
            let read = read.ok_or_else(|| ModelError::FieldMissing {
                used_by: used_by.to_owned(),
                path: path.clone(),
            })?;
            Ok((path.display().to_string(), read))
        }
    }
}

/// Body that a field acts on, the forces of its real and of its imaginary part on nodes of that
/// body, and the report of the mapping.
fn field_forces(
    mesh: &Mesh,
    bodies: &[BodyBuilder],
    on: &str,
    (name, field): (String, &SurfaceField),
    used_by: &str,
    spec: &ExcitationSpec,
) -> Result<(usize, [NodalForces; 2], FieldMap), ModelError> {
    let (body, facets) = surface(mesh, bodies, on, [1.0; 3], used_by)?;
    let builder = &bodies[body];
    let facets = Facets::new(facets, |node| builder.nodes_m()[node as usize]);
    let size_m = diagonal(builder.nodes_m());
    let points = field.points_m.len();
    let far = |(count, distance_m)| ModelError::FieldFar {
        used_by: used_by.to_owned(),
        group: on.to_owned(),
        field: name.clone(),
        count,
        points,
        distance_m,
        size_m,
    };
    if let Some(found) = mapping::farthest_outlier(&field.points_m, &facets, size_m) {
        return Err(far(found));
    }
    let (forces, mut map) = mapping::map(field, &facets);
    let count = map.farther_than(size_m);
    if count > 0 {
        return Err(far((count, map.largest_distance_m)));
    }
    map.field = name;
    map.surface = on.to_owned();
    map.scale(spec.amplitude);
    Ok((body, forces, map))
}
