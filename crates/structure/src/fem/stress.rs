//! Stresses from displacements, for export. Order xx, yy, zz, xy, yz, xz, in Pa.

use rayon::prelude::*;

use super::elasticity::Lame;
use super::element::{Deformed, MOST_NODES};
use super::elements::{integrals, values};
use crate::model::Body;

pub use super::recovered::nodal_stress_error;

/// Stress of each element in its middle, from the displacement of every node of the body. Zero
/// where the matrices of the body come from another program, which has its stresses.
pub fn stress(body: &Body, displacement_m: &[[f64; 3]]) -> Vec<[f64; 6]> {
    let Some(material) = body.material() else {
        return vec![[0.0; 6]; body.elements.len()];
    };
    let lame = Lame::from(material);
    let of = |e: usize| {
        let [coords, u] = [&body.nodes_m[..], displacement_m].map(|field| values(body, e, field));
        integrals(body, e).centre_stress(&Deformed::new(&coords, &u, lame))
    };
    (0..body.elements.len()).into_par_iter().map(of).collect()
}

/// Stress at each node: the mean over the elements that meet there of their stress at the node,
/// weighted by their volumes. Nodes of no element get zero, as do bodies whose matrices come from
/// another program.
pub fn nodal_stress(body: &Body, displacement_m: &[[f64; 3]]) -> Vec<[f64; 6]> {
    let Some(material) = body.material() else {
        return vec![[0.0; 6]; body.nodes_m.len()];
    };
    let lame = Lame::from(material);
    let mut sums = vec![[0.0; 6]; body.nodes_m.len()];
    let mut volumes = vec![0.0; body.nodes_m.len()];
    let mut stress = [[0.0; 6]; MOST_NODES];
    for (e, nodes) in body.elements.iter().enumerate() {
        let [coords, u] = [&body.nodes_m[..], displacement_m].map(|field| values(body, e, field));
        let deformed = Deformed::new(&coords, &u, lame);
        let element = integrals(body, e);
        let volume = element.form(&coords).volume_m3;
        element.nodal_stress(&deformed, &mut stress[..nodes.len()]);
        for (&node, s) in nodes.iter().zip(&stress) {
            for (sum, s) in sums[node as usize].iter_mut().zip(s) {
                *sum += volume * s;
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

/// Positions of the integration points of each element of a body, m. Empty where its matrices come
/// from another program.
pub fn points_m(body: &Body) -> Vec<Vec<[f64; 3]>> {
    if body.material().is_none() {
        return Vec::new();
    }
    let elements = 0..body.elements.len();
    let of = |e: usize| integrals(body, e).points_m(&values(body, e, &body.nodes_m));
    elements.map(of).collect()
}

/// Stress at each of [`points_m`], Pa, element by element, from the displacement of every node of
/// the body.
pub fn point_stress(body: &Body, displacement_m: &[[f64; 3]]) -> Vec<[f64; 6]> {
    let Some(material) = body.material() else {
        return Vec::new();
    };
    let lame = Lame::from(material);
    let of = |e: usize| {
        let [coords, u] = [&body.nodes_m[..], displacement_m].map(|field| values(body, e, field));
        integrals(body, e).point_stress(&Deformed::new(&coords, &u, lame))
    };
    let elements = (0..body.elements.len()).into_par_iter();
    elements.map(of).collect::<Vec<_>>().concat()
}

/// Von Mises equivalent stress, Pa.
pub fn von_mises(s: [f64; 6]) -> f64 {
    let normal = (s[0] - s[1]).powi(2) + (s[1] - s[2]).powi(2) + (s[2] - s[0]).powi(2);
    let shear = s[3] * s[3] + s[4] * s[4] + s[5] * s[5];
    (0.5 * normal + 3.0 * shear).sqrt()
}
