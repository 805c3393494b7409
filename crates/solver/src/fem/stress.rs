//! Displacements -> stresses, for export. Order xx, yy, zz, xy, yz, xz, in Pa.

use rayon::prelude::*;

use super::elasticity::{Lame, determinant, map_gradients, stress_at};
use super::elements::values;
use super::quadrature::Tables;
use super::{tet4, tet10};
use crate::mesh::ElementOrder;
use crate::model::Body;

/// Stress of each element at its centroid, from the displacement of every node of the body.
pub fn stress(body: &Body, displacement_m: &[[f64; 3]]) -> Vec<[f64; 6]> {
    match body.order {
        ElementOrder::Linear => centroid_stress(body, displacement_m, &tet4::tables()),
        ElementOrder::Quadratic => centroid_stress(body, displacement_m, &tet10::tables()),
    }
}

/// Stress at each node: the mean over the elements that meet there of their stress at the node,
/// weighted by their volumes. Nodes of no element get zero.
pub fn nodal_stress(body: &Body, displacement_m: &[[f64; 3]]) -> Vec<[f64; 6]> {
    match body.order {
        ElementOrder::Linear => averaged_stress(body, displacement_m, &tet4::tables()),
        ElementOrder::Quadratic => averaged_stress(body, displacement_m, &tet10::tables()),
    }
}

/// Von Mises' equivalent stress.
pub fn von_mises(s: [f64; 6]) -> f64 {
    let normal = (s[0] - s[1]).powi(2) + (s[1] - s[2]).powi(2) + (s[2] - s[0]).powi(2);
    let shear = s[3] * s[3] + s[4] * s[4] + s[5] * s[5];
    (0.5 * normal + 3.0 * shear).sqrt()
}

fn centroid_stress<const N: usize>(
    body: &Body,
    displacement_m: &[[f64; 3]],
    tables: &Tables<N>,
) -> Vec<[f64; 6]> {
    let lame = Lame::from(body.material);
    (0..body.tet_count())
        .into_par_iter()
        .map(|e| {
            let coords = values(body, e, &body.nodes_m);
            let (_, gradients) = map_gradients(&coords, &tables.centroid.gradients[0]);
            stress_at::<N>(&gradients, &values(body, e, displacement_m), lame)
        })
        .collect()
}

fn averaged_stress<const N: usize>(
    body: &Body,
    displacement_m: &[[f64; 3]],
    tables: &Tables<N>,
) -> Vec<[f64; 6]> {
    let lame = Lame::from(body.material);
    let mut sums = vec![[0.0; 6]; body.nodes_m.len()];
    let mut volumes = vec![0.0; body.nodes_m.len()];
    for e in 0..body.tet_count() {
        let coords = values(body, e, &body.nodes_m);
        let u = values(body, e, displacement_m);
        let volume = determinant(&coords, &tables.centroid.gradients[0]);
        for (reference, &node) in tables.nodes.gradients.iter().zip(body.tet(e)) {
            let (det, gradients) = map_gradients(&coords, reference);
            // A curved element may be pinched at a node, though sound at its quadrature points.
            let (_, gradients) = if det > 1e-3 * volume {
                (det, gradients)
            } else {
                map_gradients(&coords, &tables.centroid.gradients[0])
            };
            let s = stress_at::<N>(&gradients, &u, lame);
            for k in 0..6 {
                sums[node as usize][k] += volume * s[k];
            }
            volumes[node as usize] += volume;
        }
    }
    for (sum, volume) in sums.iter_mut().zip(&volumes) {
        if *volume > 0.0 {
            *sum = sum.map(|s| s / volume);
        }
    }
    sums
}
