//! Blocks as bodies: free, held at a flank, distorted, bent.

use dovetail_solver::mesh::block::{block, distort, map_nodes};
use dovetail_solver::mesh::{ElementOrder, Mesh};
use dovetail_solver::model::{Body, DofMap, NodeMotion, Rotation};
use dovetail_solver::model::{Material, Prestress};

pub const ORDERS: [ElementOrder; 2] = [ElementOrder::Linear, ElementOrder::Quadratic];
pub const STEEL: Material = Material {
    young_pa: 2.1e11,
    poisson: 0.29,
    density_kg_m3: 7850.0,
};
/// No symmetric numbers: a wrong index cannot hide.
pub const GRADIENT: [[f64; 3]; 3] = [
    [1.3e-3, -0.4e-3, 0.7e-3],
    [0.2e-3, -0.9e-3, 1.1e-3],
    [-0.6e-3, 0.5e-3, 0.8e-3],
];
pub const SIZE: [f64; 3] = [0.03, 0.02, 0.015];
pub const SPIN: f64 = 700.0;

pub fn body_of(
    mesh: &Mesh,
    material: Material,
    nodes: Vec<NodeMotion>,
    flank_nodes: usize,
) -> Body {
    let free = nodes
        .iter()
        .filter(|m| matches!(m, NodeMotion::Free(_)))
        .count();
    Body {
        name: "block".into(),
        material,
        rotates: true,
        fixed_interface_modes: None,
        order: mesh.order,
        nodes_m: mesh.nodes_m.clone(),
        mesh_nodes: (0..mesh.nodes_m.len() as u32).collect(),
        node_tags: mesh.node_tags.clone(),
        tets: mesh.tets.clone(),
        tet_tags: mesh.tet_tags.clone(),
        held_dofs: Vec::new(),
        loads: Vec::new(),
        dofs: DofMap {
            nodes,
            interior_nodes: free - flank_nodes,
            contact_nodes: flank_nodes,
        },
    }
}

/// Every node free, in the order of the mesh.
pub fn free_body(mesh: &Mesh) -> Body {
    let nodes = (0..mesh.nodes_m.len() as u32)
        .map(NodeMotion::Free)
        .collect();
    body_of(mesh, STEEL, nodes, 0)
}

/// The corner nodes of group `flank` are flank nodes, its mid-edge nodes tied to them.
pub fn body_with_flank(mesh: &Mesh, material: Material, flank: &str) -> Body {
    let mut motion: Vec<Option<NodeMotion>> = vec![None; mesh.nodes_m.len()];
    let mut corners: Vec<u32> = Vec::new();
    for &f in &mesh.groups[flank].elements {
        let facet = mesh.facets.of(f as usize);
        corners.extend(&facet[..3]);
        for (edge, [a, b]) in [[0, 1], [1, 2], [0, 2]].iter().enumerate() {
            if let Some(&middle) = facet.get(3 + edge) {
                motion[middle as usize] = Some(NodeMotion::Tied([facet[*a], facet[*b]]));
            }
        }
    }
    corners.sort_unstable();
    corners.dedup();
    let tied = motion.iter().flatten().count();
    let interior = mesh.nodes_m.len() - tied - corners.len();
    for (k, &corner) in corners.iter().enumerate() {
        motion[corner as usize] = Some(NodeMotion::Free((interior + k) as u32));
    }
    let mut interior_nodes = 0..interior as u32;
    let motion = motion
        .into_iter()
        .map(|m| m.unwrap_or_else(|| NodeMotion::Free(interior_nodes.next().unwrap())))
        .collect();
    body_of(mesh, material, motion, corners.len())
}

pub fn distorted(order: ElementOrder, cells: [usize; 3], size: [f64; 3]) -> Mesh {
    let mut mesh = block(order, cells, size);
    distort(&mut mesh, size, 0.08 * size[0] / cells[0] as f64);
    mesh
}

/// A box bent into an arc and sheared: quadratic meshes have curved edges everywhere.
pub fn bent(order: ElementOrder) -> Mesh {
    let mut mesh = block(order, [3, 2, 2], SIZE);
    map_nodes(&mut mesh, |p| {
        let (angle, radius) = (p[0] / 0.05, 0.05 + p[1]);
        [
            radius * angle.sin() + 0.2,
            radius * angle.cos(),
            p[2] + 3.0 * p[0] * p[1],
        ]
    });
    mesh
}

pub fn meshes() -> Vec<Mesh> {
    ORDERS
        .into_iter()
        .flat_map(|order| [distorted(order, [3, 3, 2], SIZE), bent(order)])
        .collect()
}

pub fn rotation(prestress: Prestress) -> Rotation {
    let axis = [0.36, 0.48, 0.8];
    Rotation {
        point_m: [0.01, -0.3, 0.02],
        axis,
        speed_rad_s: SPIN,
        prestress,
    }
}
