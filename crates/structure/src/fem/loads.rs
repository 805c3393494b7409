//! Loads of the scene as consistent nodal loads, and supports along one axis.
//!
//! A uniform traction t on a facet gives node a the force t int N_a dA, a pressure p the force
//! -p int N_a n dA, with n dA = (dx/dr x dx/ds) dr ds outwards. On a plane 6-node facet with
//! straight edges that is nothing at the corners and a third of the facet at each mid-edge node.

use nalgebra_sparse::CscMatrix;

use super::element::MOST_NODES;
use super::elements::element_mass;
use super::given;
use crate::model::{AppliedLoad, Body, MatrixOrigin, Traction};
use dovetail_mesh::facet::{Share, shares};
use dovetail_numerics::space::add_scaled;

/// Adds a load on a body to `load_n` (free degrees of freedom). Loads on fixed nodes go to their
/// support.
pub(crate) fn add_load(body: &Body, load: &AppliedLoad, load_n: &mut [f64]) {
    match load {
        AppliedLoad::Point { node, vector_n } => add_at(body, *node, *vector_n, load_n),
        AppliedLoad::Surface { facets, traction } => {
            add_on_surface(body, facets, *traction, load_n);
        }
        AppliedLoad::Acceleration { vector_m_s2 } => {
            let material = match &body.matrices {
                MatrixOrigin::Elements(material) => material,
                MatrixOrigin::Given(placed) => {
                    return given::add_inertia(body, placed, *vector_m_s2, load_n);
                }
            };
            let everywhere = vec![*vector_m_s2; body.nodes_m.len()];
            add_inertia(
                body,
                |e, out| element_mass(body, material.density_kg_m3, e, out),
                &everywhere,
                load_n,
            );
        }
    }
}

fn add_on_surface(body: &Body, facets: &[Vec<u32>], traction: Traction, load_n: &mut [f64]) {
    let coords = |facet: &Vec<u32>| -> Vec<[f64; 3]> {
        facet.iter().map(|&n| body.nodes_m[n as usize]).collect()
    };
    let parts = facets.iter().flat_map(|facet| shares(&coords(facet)));
    let nodes = facets.iter().flatten().copied();
    let parts: Vec<(u32, Share)> = nodes.zip(parts).collect();
    let area: f64 = parts.iter().map(|(_, share)| share.area_m2).sum();
    for (node, share) in parts {
        let force = match traction {
            Traction::Total(vector_n) => vector_n.map(|f| f * share.area_m2 / area),
            Traction::Uniform(vector_pa) => vector_pa.map(|t| t * share.area_m2),
            Traction::Pressure(p) => share.normal_m2.map(|n| -p * n),
        };
        add_at(body, node, force, load_n);
    }
}

/// Adds the force M a of the mass in a field of acceleration, which has a value for each node and
/// is interpolated like the elements. `element_mass` writes the mass of an element. Fixed nodes
/// have mass, too: their own part goes to the support, the part that other nodes carry is added
/// here.
pub(crate) fn add_inertia(
    body: &Body,
    element_mass: impl Fn(usize, &mut [[f64; 1]]),
    acceleration_m_s2: &[[f64; 3]],
    load_n: &mut [f64],
) {
    let mut mass = vec![[0.0]; MOST_NODES * MOST_NODES];
    for (e, nodes) in body.elements.iter().enumerate() {
        element_mass(e, &mut mass[..nodes.len().pow(2)]);
        for (a, &node) in nodes.iter().enumerate() {
            let mut force = [0.0; 3];
            for (b, &other) in nodes.iter().enumerate() {
                let weight = mass[a * nodes.len() + b][0];
                add_scaled(&mut force, weight, acceleration_m_s2[other as usize]);
            }
            add_at(body, node, force, load_n);
        }
    }
}

/// Uncouples the held degrees of freedom of a symmetric matrix: their rows and columns keep only
/// the diagonal. Without a load they then do not move, and the matrix stays positive definite where
/// it was.
pub(crate) fn uncouple(matrix: &mut CscMatrix<f64>, held_dofs: &[u32]) {
    if held_dofs.is_empty() {
        return;
    }
    let mut is_held = vec![false; matrix.ncols()];
    for &dof in held_dofs {
        is_held[dof as usize] = true;
    }
    for (j, mut column) in matrix.col_iter_mut().enumerate() {
        let (rows, values) = column.rows_and_values_mut();
        for (&i, v) in rows.iter().zip(values) {
            if i != j && (is_held[i] || is_held[j]) {
                *v = 0.0;
            }
        }
    }
}

fn add_at(body: &Body, node: u32, force_n: [f64; 3], load_n: &mut [f64]) {
    for (free, weight) in body.dofs.weights(node as usize) {
        for (k, f) in force_n.iter().enumerate() {
            load_n[3 * free + k] += weight * f;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Material;
    use crate::model::{DofMap, NodeMotion};
    use dovetail_mesh::{Connectivity, ElementOrder};
    use dovetail_numerics::space::middle;

    fn body(nodes_m: Vec<[f64; 3]>, loads: Vec<AppliedLoad>) -> Body {
        let n = nodes_m.len();
        Body {
            name: "facet".into(),
            matrices: MatrixOrigin::Elements(Material {
                young_pa: 1.0,
                poisson: 0.0,
                density_kg_m3: 1.0,
            }),
            rotates: false,
            fixed_interface_modes: None,
            nodes_m,
            mesh_nodes: (0..n as u32).collect(),
            node_tags: (0..n as u64).collect(),
            elements: Connectivity::default(),
            facets: Connectivity::default(),
            dofs: DofMap {
                nodes: (0..n as u32).map(NodeMotion::Free).collect(),
                auxiliary: Vec::new(),
                interior_nodes: n,
                contact_nodes: 0,
            },
            held_dofs: Vec::new(),
            supports: Vec::new(),
            loads: loads.into_iter().map(|load| (0, load)).collect(),
            springs: Vec::new(),
        }
    }

    /// A right triangle of legs 3 and 2 in the plane x + z = 1, outward normal (1, 0, 1) / sqrt 2.
    fn triangle() -> [[f64; 3]; 3] {
        let h = 0.5f64.sqrt();
        [
            [1.0, 0.0, 0.0],
            [1.0, 3.0, 0.0],
            [1.0 - 2.0 * h, 0.0, 2.0 * h],
        ]
    }

    fn load(order: ElementOrder, traction: Traction) -> Vec<f64> {
        let [a, b, c] = triangle();
        let mut nodes = vec![a, b, c];
        if order == ElementOrder::Quadratic {
            nodes.extend([middle(a, b), middle(b, c), middle(a, c)]);
        }
        let facets = vec![(0..nodes.len() as u32).collect()];
        let loads = vec![AppliedLoad::Surface { facets, traction }];
        let mut load = vec![0.0; 3 * nodes.len()];
        let body = body(nodes, loads);
        add_load(&body, &body.loads[0].1, &mut load);
        load
    }

    #[test]
    fn pressure_pushes_inwards_with_the_weights_of_the_element() {
        let third = 7.0 / 3.0 * 3.0 * 0.5f64.sqrt();
        let inward = [-third, 0.0, -third];
        let linear = load(ElementOrder::Linear, Traction::Pressure(7.0));
        let quadratic = load(ElementOrder::Quadratic, Traction::Pressure(7.0));
        for node in 0..6 {
            for k in 0..3 {
                if node < 3 {
                    assert!((linear[3 * node + k] - inward[k]).abs() < 1e-13);
                }
                let expected = if node < 3 { 0.0 } else { inward[k] };
                assert!((quadratic[3 * node + k] - expected).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn a_force_is_spread_whole_and_without_a_moment_about_the_centroid() {
        let force = [1.0, -2.0, 5.0];
        for order in [ElementOrder::Linear, ElementOrder::Quadratic] {
            let load = load(order, Traction::Total(force));
            for (k, expected) in force.into_iter().enumerate() {
                let sum: f64 = load.iter().skip(k).step_by(3).sum();
                assert!((sum - expected).abs() < 1e-13);
            }
        }
    }

    /// int n dA over a facet is half the integral of x cross dx along its rim, however it bulges.
    #[test]
    fn pressure_on_a_curved_facet_has_the_resultant_of_its_rim() {
        let [a, b, c] = triangle();
        let bulge = |p: [f64; 3], d: [f64; 3]| [0, 1, 2].map(|k| p[k] + d[k]);
        let middles = [
            bulge(middle(a, b), [0.1, 0.0, 0.2]),
            bulge(middle(b, c), [-0.1, 0.1, 0.05]),
            bulge(middle(a, c), [0.0, -0.2, 0.1]),
        ];
        let nodes = vec![a, b, c, middles[0], middles[1], middles[2]];
        let loads = vec![AppliedLoad::Surface {
            facets: vec![(0..6).collect()],
            traction: Traction::Pressure(1.0),
        }];
        let mut found = [0.0; 3];
        let mut load = vec![0.0; 18];
        let body = body(nodes, loads);
        add_load(&body, &body.loads[0].1, &mut load);
        for (i, f) in load.iter().enumerate() {
            found[i % 3] -= f;
        }
        // Each edge is a parabola through three points; Simpson's rule is exact for x cross dx
        // (degree 3).
        let mut rim = [0.0; 3];
        for (p, m, q) in [(a, middles[0], b), (b, middles[1], c), (c, middles[2], a)] {
            for (t, weight) in [(0.0, 1.0 / 6.0), (0.5, 4.0 / 6.0), (1.0, 1.0 / 6.0)] {
                let x = [0, 1, 2].map(|k| {
                    let (l, r) = (1.0 - t, t);
                    p[k] * l * (2.0 * l - 1.0) + 4.0 * m[k] * l * r + q[k] * r * (2.0 * r - 1.0)
                });
                let d = [0, 1, 2].map(|k| {
                    p[k] * (4.0 * t - 3.0) + 4.0 * m[k] * (1.0 - 2.0 * t) + q[k] * (4.0 * t - 1.0)
                });
                for (k, sum) in rim.iter_mut().enumerate() {
                    let (i, j) = ((k + 1) % 3, (k + 2) % 3);
                    *sum += 0.5 * weight * (x[i] * d[j] - x[j] * d[i]);
                }
            }
        }
        for k in 0..3 {
            assert!((found[k] - rim[k]).abs() < 1e-13, "{found:?} {rim:?}");
        }
    }
}
