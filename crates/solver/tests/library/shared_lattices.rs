//! A small assembly of two spring lattices, for tests: a free bar on a held block, five pairs.

use dovetail_mesh::Mesh;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::excitation::{Excitation as InTime, Growth};
use dovetail_solver::fem::join;
use dovetail_solver::model::{
    AppliedLoad, Body, BodyNode, ContactPair, Model, ModelExcitation, NodeMotion, Observation,
    Side, Slave,
};
use dovetail_solver::reduced::ObservedQuantity;
use dovetail_solver::structure::{BodyMatrices, Structure};
use dovetail_testkit::lattice::{Lattice, scattered};
use faer::{Mat, c64};

use crate::elements::bodies::{STEEL, body_of};

/// The bar's flank is five nodes of its face x = 0, the block's the same of its face x = 2. The bar
/// has an observed point at its tip and two tied nodes besides; the block an observed point and its
/// face x = 0 held.
pub fn assembly(modes: [Option<usize>; 2]) -> (Model, Structure) {
    let bar = Lattice::new([4, 3, 3], 3e7, 0.05, 0.3);
    let block = Lattice::new([3, 3, 3], 8e7, 0.08, 0.5);
    let spots = [[0, 0], [2, 1], [1, 2], [0, 2], [1, 1]];
    let flanks = [
        spots.map(|[j, k]| bar.node([0, j, k])),
        spots.map(|[j, k]| block.node([2, j, k])),
    ];
    let held: Vec<usize> = (0..9).collect();
    let (bar_body, bar_matrices) = body("bar", &bar, &flanks[0], &[], modes[0], 7);
    let (block_body, block_matrices) = body("block", &block, &flanks[1], &held, modes[1], 8000);
    let at = |body, node: usize| BodyNode {
        body,
        node: node as u32,
    };
    let pairs = (0..5)
        .map(|i| ContactPair {
            contact: 0,
            slave: Slave {
                ahead: 0,
                node: at(0, flanks[0][i]),
                masters: vec![(at(1, flanks[1][i]), 1.0)],
            },
            side: Side::First,
            position_m: [0.0; 3],
            frame: frame(i),
            area_m2: 1e-6,
            law: PairLaw::rigid(0.3, 1e-7 * i as f64),
        })
        .collect();
    let (tip, tied) = (bar.node([3, 2, 2]), bar.nodes());
    let force = |body, node, direction, harmonic, phase_rad| ModelExcitation {
        loads: vec![(
            body,
            AppliedLoad::Point {
                node: node as u32,
                vector_n: direction,
            },
        )],
        in_time: InTime {
            amplitude: 1.5,
            harmonic,
            phase_rad,
            growth: Growth::Constant,
        },
    };
    let model = Model {
        bodies: vec![bar_body, block_body],
        rotation: None,
        cyclic: None,
        pairs,
        bonded: Vec::new(),
        flank_facets: Vec::new(),
        contact_names: vec!["flank".into()],
        excitations: vec![
            force(0, tip, [1.0, -2.0, 0.5], 1, 0.7),
            force(0, tied, [3.0, 1.0, 0.0], 1, -0.4),
            force(1, block.node([1, 0, 0]), [0.3, 0.2, 5.0], 1, 2.0),
            force(1, flanks[1][3], [0.0, 4.0, 1.0], 3, 0.0),
        ],
        maps: Vec::new(),
        dashpots: Vec::new(),
        friction_maps: Vec::new(),
        observations: vec![
            Observation {
                name: "tip".into(),
                quantity: ObservedQuantity::Displacement,
                terms: vec![(at(0, tip), [0.0, 0.6, 0.8])],
            },
            Observation {
                name: "mixed".into(),
                quantity: ObservedQuantity::Displacement,
                terms: vec![
                    (at(0, tied), [1.0, 0.0, -1.0]),
                    (at(1, flanks[1][0]), [0.0, 2.0, 0.0]),
                ],
            },
        ],
        matches: Vec::new(),
        straightened: Vec::new(),
    };
    let structure = join(&model, vec![bar_matrices, block_matrices]).unwrap();
    (model, structure)
}

/// Rows of a rotation matrix, another one for each pair.
fn frame(pair: usize) -> [[f64; 3]; 3] {
    let [(s, c), (t, d)] = [0.3 + 0.9 * pair as f64, 1.1 - 0.5 * pair as f64].map(f64::sin_cos);
    [[c, s, 0.0], [-s * d, c * d, t], [s * t, -c * t, d]]
}

fn body(
    name: &str,
    lattice: &Lattice,
    flank: &[usize],
    held: &[usize],
    modes: Option<usize>,
    seed: usize,
) -> (Body, BodyMatrices) {
    let mut number = vec![None; lattice.nodes()];
    let interior: Vec<usize> = (0..lattice.nodes())
        .filter(|n| !flank.contains(n) && !held.contains(n))
        .collect();
    let free: Vec<usize> = interior.iter().chain(flank).copied().collect();
    for (new, &old) in free.iter().enumerate() {
        number[old] = Some(new);
    }
    let (stiffness, mass) = lattice.matrices(&number, free.len());
    let mut nodes: Vec<NodeMotion> = number
        .iter()
        .map(|n| n.map_or(NodeMotion::Fixed, |n| NodeMotion::Free(n as u32)))
        .collect();
    nodes.push(NodeMotion::Tied([flank[0] as u32, flank[1] as u32]));
    let mesh = Mesh {
        nodes_m: vec![[0.0; 3]; nodes.len()],
        node_tags: (0..nodes.len() as u64).map(|n| 1000 + n).collect(),
        ..Mesh::default()
    };
    let body = Body {
        name: name.into(),
        fixed_interface_modes: modes,
        ..body_of(&mesh, STEEL, nodes, flank.len())
    };
    let load_n = (0..3 * free.len())
        .map(|i| 100.0 * scattered(seed + i))
        .collect();
    let matrices = BodyMatrices {
        name: body.name.clone(),
        stiffness,
        mass,
        load_n,
        centrifugal_n_s2: Vec::new(),
        interior_nodes: body.dofs.interior_nodes,
        held_dofs: Vec::new(),
        fixed_interface_modes: modes,
        node_tags: body.free_node_tags(),
    };
    (body, matrices)
}

/// Complex amplitudes of the forces of one harmonic on the free degrees of freedom (`cos - i sin`).
pub fn forces(model: &Model, harmonic: usize) -> [Mat<c64>; 2] {
    let mut f = [0, 1].map(|b| Mat::zeros(3 * model.bodies[b].dofs.free_nodes(), 1));
    for force in model
        .excitations
        .iter()
        .filter(|f| f.in_time.harmonic == harmonic)
    {
        let phase = c64::new(0.0, -force.in_time.phase_rad).exp();
        for (body, load) in &force.loads {
            let AppliedLoad::Point { node, vector_n } = load else {
                panic!("the excitations are forces on nodes");
            };
            for (free, weight) in model.bodies[*body].dofs.weights(*node as usize) {
                for axis in 0..3 {
                    f[*body][(3 * free + axis, 0)] +=
                        phase * weight * force.in_time.amplitude * vector_n[axis];
                }
            }
        }
    }
    f
}

/// Displacement of an observed point, given those of the free degrees of freedom of each body.
pub fn observed(model: &Model, observation: usize, at: impl Fn(usize, usize) -> c64) -> c64 {
    let mut sum = c64::new(0.0, 0.0);
    for &(BodyNode { body, node }, direction) in &model.observations[observation].terms {
        for (free, weight) in model.bodies[body].dofs.weights(node as usize) {
            for (axis, along) in direction.iter().enumerate() {
                sum += at(body, 3 * free + axis) * weight * along;
            }
        }
    }
    sum
}
