//! Springs as small elements of a body.
//!
//! A spring of stiffness k from a surface of area A to ground is the foundation of Winkler, k / A
//! int N_a N_b dA between the nodes a and b of a facet; from n nodes it is k / n at each. With a
//! direction d these act along it alone: they are multiplied by P = d d^T, else P is the identity.
//!
//! A spring on a weighted sum sum_j a_j u_j of n displacements would fill a block of all its nodes.
//! Auxiliary nodes r_j spare that. With r_0 = 0 each link has the energy
//!
//! ```text
//! c/2 |r_j - r_(j-1) - a_j P u_j|^2        c = n k
//! ```
//!
//! and n springs of stiffness c in series are one of stiffness c / n: with the r between them
//! eliminated the energy is k/2 |r_n - P sum_j a_j u_j|^2, exactly. The last node r_n is the end of
//! another such chain, of another body, or it is zero. Across d the auxiliary nodes stay where they
//! are.

use crate::model::{Body, Spring, SpringChain, SpringSupport};
use dovetail_mesh::facet::products;
use dovetail_numerics::space::{add_scaled, dot};

/// Local nodes of a body, including auxiliary ones, and the symmetric matrix between them (3 x 3
/// blocks row by row, N/m).
#[derive(Debug, Clone)]
pub(crate) struct SpringElement {
    /// Nodes of the element.
    pub nodes: Vec<u32>,
    /// Block for each pair of nodes.
    pub matrix: Vec<[f64; 9]>,
}

/// Spring elements of a body.
pub(crate) fn spring_elements(body: &Body) -> Vec<SpringElement> {
    let springs = body.springs.iter();
    springs
        .flat_map(|spring| elements_of(body, spring))
        .collect()
}

/// Elements of one spring of a body.
pub(crate) fn elements_of(body: &Body, spring: &Spring) -> Vec<SpringElement> {
    match &spring.on {
        SpringSupport::Nodes(nodes) => {
            let block = scaled(projector(spring), spring.stiffness_n_m / nodes.len() as f64);
            let one = |&node: &u32| SpringElement {
                nodes: vec![node],
                matrix: vec![block],
            };
            nodes.iter().map(one).collect()
        }
        SpringSupport::Surface(facets) => foundation(body, spring, facets),
        SpringSupport::Chain(chain) => links(spring, chain),
    }
}

/// Forces by which a spring to ground pushes the nodes that it acts on, N, in a motion of the free
/// degrees of freedom of its body, m. A node has an entry for each element of the spring.
pub fn forces_n(body: &Body, spring: &Spring, free: &[f64]) -> Vec<(u32, [f64; 3])> {
    let moved = |&node: &u32| {
        let mut u = [0.0; 3];
        for (n, weight) in body.dofs.weights(node as usize) {
            add_scaled(&mut u, weight, [0, 1, 2].map(|k| free[3 * n + k]));
        }
        u
    };
    let mut forces = Vec::new();
    for element in elements_of(body, spring) {
        let motion: Vec<[f64; 3]> = element.nodes.iter().map(moved).collect();
        let rows = element.matrix.chunks_exact(motion.len());
        for (&node, row) in element.nodes.iter().zip(rows) {
            let mut force = [0.0; 3];
            for (block, u) in row.iter().zip(&motion) {
                for (i, k) in block.iter().enumerate() {
                    force[i / 3] -= k * u[i % 3];
                }
            }
            forces.push((node, force));
        }
    }
    forces
}

fn foundation(body: &Body, spring: &Spring, facets: &[Vec<u32>]) -> Vec<SpringElement> {
    let of_facet = |facet: &Vec<u32>| {
        let coords: Vec<[f64; 3]> = facet.iter().map(|&n| body.nodes_m[n as usize]).collect();
        products(&coords)
    };
    let facet_springs: Vec<Vec<f64>> = facets.iter().map(of_facet).collect();
    // The shape functions add up to one.
    let area: f64 = facet_springs.iter().flatten().sum();
    let one = |(facet, products): (&Vec<u32>, Vec<f64>)| {
        let block = |product: f64| scaled(projector(spring), spring.stiffness_n_m * product / area);
        SpringElement {
            nodes: facet.clone(),
            matrix: products.into_iter().map(block).collect(),
        }
    };
    facets.iter().zip(facet_springs).map(one).collect()
}

fn links(spring: &Spring, chain: &SpringChain) -> Vec<SpringElement> {
    let stiffness_n_m = chain.links.len() as f64 * spring.stiffness_n_m;
    let behind = |j: usize| {
        chain
            .nodes
            .get(j)
            .map(|node| (*node, LinkFactor::Whole(1.0)))
    };
    let before = |j: usize| {
        Some((
            *chain.nodes.get(j.checked_sub(1)?)?,
            LinkFactor::Whole(-1.0),
        ))
    };
    let link = |(j, &(node, weight)): (usize, &(u32, f64))| {
        let on = Some((node, LinkFactor::Along(-weight)));
        let ends: Vec<(u32, LinkFactor)> =
            [behind(j), before(j), on].into_iter().flatten().collect();
        let mut matrix = Vec::new();
        for (_, a) in &ends {
            for (_, b) in &ends {
                let block = match (a, b) {
                    (LinkFactor::Whole(a), LinkFactor::Whole(b)) => scaled(IDENTITY, a * b),
                    (
                        LinkFactor::Whole(a) | LinkFactor::Along(a),
                        LinkFactor::Whole(b) | LinkFactor::Along(b),
                    ) => scaled(projector(spring), a * b),
                };
                matrix.push(scaled(block, stiffness_n_m));
            }
        }
        SpringElement {
            nodes: ends.into_iter().map(|(node, _)| node).collect(),
            matrix,
        }
    };
    chain.links.iter().enumerate().map(link).collect()
}

/// Contribution of a node to the length of a link: all of its displacement, or that along the
/// spring.
enum LinkFactor {
    Whole(f64),
    Along(f64),
}

const IDENTITY: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// Projector d d^T, or the identity.
fn projector(spring: &Spring) -> [f64; 9] {
    let Some(d) = spring.direction else {
        return IDENTITY;
    };
    let d = d.map(|x| x / dot(d, d).sqrt());
    std::array::from_fn(|i| d[i / 3] * d[i % 3])
}

fn scaled(block: [f64; 9], factor: f64) -> [f64; 9] {
    block.map(|v| factor * v)
}
