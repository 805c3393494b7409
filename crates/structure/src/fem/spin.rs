//! Rotation about an axis at Omega: centrifugal load, geometric stiffness, spin softening.
//!
//! In the rotating frame, with P = I - a a^T the projector perpendicular to the axis a:
//!
//!   f = Omega^2 M P (x - point)            consistent mass, x interpolated as the element does
//!   K := K + G(stress of u0) - Omega^2 P M
//!
//! where u0 is the linear static displacement under f with the contact nodes held, with all pairs
//! stuck, or that of the static state with contact. The Coriolis (gyroscopic) force is left out, as
//! in the source paper. (Geradin and Kapania, and Bathe 6.2, for the initial stress stiffness;
//! Charleux et al. 2004, section 2, for the procedure.)

use super::assembly::{LowerBlocks, NodePattern, sum_elements};
use super::elements::Elements;
use super::loads::add_inertia;
use crate::model::{Body, Rotation};
use dovetail_numerics::space::scaled;

/// Vector from the axis to a point, perpendicular to the axis, m.
pub(crate) fn radius_m(point_m: [f64; 3], rotation: &Rotation) -> [f64; 3] {
    let d = [0, 1, 2].map(|k| point_m[k] - rotation.point_m[k]);
    perpendicular(rotation.axis).map(|row| row[0] * d[0] + row[1] * d[1] + row[2] * d[2])
}

/// Centrifugal load, N (free dofs), where the square of the speed is `omega2`, rad2/s2.
pub(crate) fn centrifugal_load(
    body: &Body,
    elements: &Elements<'_>,
    rotation: &Rotation,
    omega2: f64,
) -> Vec<f64> {
    let mut load_n = vec![0.0; 3 * body.dofs.free_nodes()];
    let nodes = body.nodes_m.iter();
    let acceleration: Vec<[f64; 3]> = nodes
        .map(|x| scaled(radius_m(*x, rotation), omega2))
        .collect();
    add_inertia(
        body,
        |e, out| elements.mass(e, out),
        &acceleration,
        &mut load_n,
    );
    load_n
}

/// Geometric stiffness of the stress of `displacement_m` (every node of the body), N/m.
pub(crate) fn geometric_stiffness(
    body: &Body,
    elements: &Elements<'_>,
    pattern: &NodePattern,
    displacement_m: &[[f64; 3]],
) -> LowerBlocks<1> {
    sum_elements::<1>(body, pattern, |e, out| {
        elements.geometric_stiffness(e, displacement_m, out);
    })
}

/// Computes K := K - Omega^2 P M on lower blocks.
pub(crate) fn add_softening(
    stiffness: &mut LowerBlocks<9>,
    mass: &LowerBlocks<1>,
    rotation: &Rotation,
) {
    let omega2 = rotation.speed_rad_s * rotation.speed_rad_s;
    let projector = perpendicular(rotation.axis);
    for (k, m) in stiffness.iter_mut().zip(mass) {
        for r in 0..3 {
            for c in 0..3 {
                k[3 * r + c] -= omega2 * m[0] * projector[r][c];
            }
        }
    }
}

/// Computes K := K + G on lower blocks.
pub(crate) fn add_geometric(stiffness: &mut LowerBlocks<9>, geometric: &LowerBlocks<1>) {
    for (k, g) in stiffness.iter_mut().zip(geometric) {
        for r in 0..3 {
            k[4 * r] += g[0];
        }
    }
}

/// Projector I - a a^T, for a of unit length.
fn perpendicular(axis: [f64; 3]) -> [[f64; 3]; 3] {
    [0, 1, 2].map(|r| [0, 1, 2].map(|c| f64::from(r == c) - axis[r] * axis[c]))
}
