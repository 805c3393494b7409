//! Volume, mass and centre of gravity of a body, and the centrifugal force on all of it. These
//! figures show at a glance whether the units are right.

use super::element::MOST_NODES;
use super::elements::Elements;
use super::{FemError, given, spin};
use crate::model::{Body, MatrixOrigin, Rotation};
use dovetail_numerics::space::add_scaled;

/// Mass properties of one body, computed from its finite elements or its matrices.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassProperties {
    /// Volume of the elements, m3; `None` where the matrices come from another program.
    pub volume_m3: Option<f64>,
    /// Mass, kg, including that of nodes that do not move; of matrices of another program, the mass
    /// that their rows carry.
    pub mass_kg: f64,
    /// Centre of gravity, m; `None` where the mesh lacks nodes of matrices of another program.
    pub centre_m: Option<[f64; 3]>,
    /// Centrifugal force Omega^2 m r, N, with r from the axis to the centre of gravity; `None`
    /// where the body does not rotate.
    pub centrifugal_force_n: Option<[f64; 3]>,
}

/// Mass properties of a body; `rotation` counts only if the body rotates.
///
/// # Errors
/// [`FemError::Inverted`] or [`FemError::Degenerate`].
pub fn mass_properties(
    body: &Body,
    rotation: Option<&Rotation>,
) -> Result<MassProperties, FemError> {
    let rotation = rotation.filter(|r| body.rotates && r.speed_rad_s != 0.0);
    let material = match &body.matrices {
        MatrixOrigin::Elements(material) => *material,
        MatrixOrigin::Given(placed) => {
            let (mass_kg, centre_m) = given::mass_and_centre(body, placed);
            return Ok(MassProperties {
                volume_m3: None,
                mass_kg,
                centre_m,
                centrifugal_force_n: None,
            });
        }
    };
    let elements = Elements::new(body, material)?;
    let (mut sum, mut moment) = (0.0, [0.0; 3]);
    let mut mass = vec![[0.0]; MOST_NODES * MOST_NODES];
    for e in 0..body.elements.len() {
        let coords = elements.coords_m(e);
        let mass = &mut mass[..coords.len().pow(2)];
        elements.mass(e, mass);
        // The sum of a row is what the consistent mass matrix gives its node.
        for (row, x) in mass.chunks_exact(coords.len()).zip(coords.iter()) {
            let at_node: f64 = row.iter().flatten().sum();
            sum += at_node;
            add_scaled(&mut moment, at_node, *x);
        }
    }
    let centre_m = moment.map(|moment| moment / sum);
    let mass_kg = elements.volume_m3() * material.density_kg_m3;
    let centrifugal_force_n = rotation.map(|rotation| {
        let omega2 = rotation.speed_rad_s * rotation.speed_rad_s;
        spin::radius_m(centre_m, rotation).map(|r| omega2 * mass_kg * r)
    });
    Ok(MassProperties {
        volume_m3: Some(elements.volume_m3()),
        mass_kg,
        centre_m: Some(centre_m),
        centrifugal_force_n,
    })
}
