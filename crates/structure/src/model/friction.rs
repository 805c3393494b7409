//! Coefficients of friction at points in space, which the pairs of a contact take.
//!
//! A pair has the coefficient of the point that is nearest to it. Between points the coefficient
//! therefore has steps and no value that no point has.

use serde::{Deserialize, Serialize};

use super::excitations::named_field;
use super::neighbours::PointTree;
use super::{ContactPair, ContactSpec, ModelError, SurfaceFields};
use dovetail_mesh::surface_field::FieldValues;
use dovetail_numerics::space::diagonal;

/// Report of the coefficients that the pairs of a contact have from a field.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct FrictionMap {
    /// Name of the contact.
    pub contact: String,
    /// Source of the coefficients.
    pub field: String,
    /// Number of its points that some pair is nearest to.
    pub points: usize,
    /// Smallest and largest coefficient of a pair.
    pub range: [f64; 2],
    /// Mean over the area of the contact.
    pub mean: f64,
    /// Largest distance of a pair from the point whose coefficient it has, m.
    pub largest_distance_m: f64,
}

/// Gives the pairs of a contact their coefficients of friction, where it has a field of them.
pub(super) fn set_friction(
    pairs: &mut [ContactPair],
    spec: &ContactSpec,
    fields: Option<&SurfaceFields>,
) -> Result<Option<FrictionMap>, ModelError> {
    let Some(source) = &spec.friction_at else {
        return Ok(None);
    };
    let used_by = format!("contact `{}`", spec.name);
    let (name, field) = named_field(source, fields, &used_by)?;
    let FieldValues::Friction(friction) = &field.values else {
        return Err(ModelError::FieldKind {
            used_by,
            field: name,
            found: "pressures or forces",
            wanted: "coefficients of friction",
        });
    };
    let positions: Vec<[f64; 3]> = pairs.iter().map(|pair| pair.position_m).collect();
    let area_m2: f64 = pairs.iter().map(|pair| pair.area_m2).sum();
    let size_m = diagonal(&positions).max(area_m2.sqrt());
    let tree = PointTree::new(&field.points_m);
    let mut taken = Vec::with_capacity(pairs.len());
    let (mut range, mut sum, mut farthest) = ([f64::INFINITY, 0.0], 0.0, 0.0_f64);
    for pair in pairs {
        let nearest = tree.nearest(pair.position_m).next();
        let (point, square) = nearest.unwrap_or((0, f64::INFINITY));
        farthest = farthest.max(square.sqrt());
        if farthest > size_m {
            return Err(ModelError::FrictionFar {
                contact: spec.name.clone(),
                field: name,
                distance_m: farthest,
                size_m,
            });
        }
        let friction = friction[point];
        pair.law.friction = friction;
        range = [range[0].min(friction), range[1].max(friction)];
        sum += friction * pair.area_m2;
        taken.push(point);
    }
    taken.sort_unstable();
    taken.dedup();
    Ok(Some(FrictionMap {
        contact: spec.name.clone(),
        field: name,
        points: taken.len(),
        range,
        mean: sum / area_m2,
        largest_distance_m: farthest,
    }))
}
