//! Blocks as bodies: free, held at a flank, distorted, bent.

use dovetail_mesh::element::facet_corners;
use dovetail_mesh::{Connectivity, ElementOrder, ElementType, Mesh};
use dovetail_solver::model::{Body, DofMap, NodeMotion, Rotation};
use dovetail_solver::model::{BodyPrestress, Material, MatrixOrigin};
use dovetail_testkit::block::{block, distort, map_nodes, mixed_block};

/// Elements of a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Filling {
    /// Elements of one type.
    Of(ElementType),
    /// Elements of all shapes, of one order.
    Mixed(ElementOrder),
}

/// Elements of each type, and those of all shapes of each order.
pub fn fillings() -> impl Iterator<Item = Filling> {
    let mixed = [ElementOrder::Linear, ElementOrder::Quadratic].map(Filling::Mixed);
    ElementType::ALL.map(Filling::Of).into_iter().chain(mixed)
}

impl Filling {
    pub fn order(self) -> ElementOrder {
        match self {
            Self::Of(element) => element.order,
            Self::Mixed(order) => order,
        }
    }

    /// Block of these elements, of six cells or more along x where it is mixed.
    pub fn block(self, cells: [usize; 3], size_m: [f64; 3]) -> Mesh {
        match self {
            Self::Of(element) => block(element, cells, size_m),
            Self::Mixed(order) => mixed_block(order, [cells[0].max(6), cells[1], cells[2]], size_m),
        }
    }
}

pub const STEEL: Material = Material {
    young_pa: 2.1e11,
    poisson: 0.29,
    density_kg_m3: 7850.0,
};
/// Gradient without symmetries, so that a wrong index shows.
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
        matrices: MatrixOrigin::Elements(material),
        rotates: true,
        fixed_interface_modes: None,
        nodes_m: mesh.nodes_m.clone(),
        mesh_nodes: (0..mesh.nodes_m.len() as u32).collect(),
        node_tags: mesh.node_tags.clone(),
        elements: mesh.elements.clone(),
        facets: Connectivity::default(),
        held_dofs: Vec::new(),
        supports: Vec::new(),
        loads: Vec::new(),
        springs: Vec::new(),
        dofs: DofMap {
            nodes,
            auxiliary: Vec::new(),
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
        let facet = mesh.facets.element_nodes(f as usize);
        let (own, middles) = facet.split_at(facet_corners(facet.len()));
        corners.extend(own);
        for (i, &middle) in middles.iter().enumerate() {
            let ends = [own[i], own[(i + 1) % own.len()]];
            motion[middle as usize] = Some(NodeMotion::Tied(ends));
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

pub fn distorted(filling: Filling, cells: [usize; 3], size: [f64; 3]) -> Mesh {
    let mut mesh = filling.block(cells, size);
    distort(&mut mesh, size, 0.08 * size[0] / cells[0] as f64);
    mesh
}

/// A box bent into an arc and sheared: quadratic meshes have curved edges everywhere.
pub fn bent(filling: Filling) -> Mesh {
    let mut mesh = filling.block([3, 2, 2], SIZE);
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
    fillings()
        .flat_map(|filling| [distorted(filling, [3, 3, 2], SIZE), bent(filling)])
        .collect()
}

pub fn rotation(prestress: BodyPrestress) -> Rotation {
    let axis = [0.36, 0.48, 0.8];
    Rotation {
        point_m: [0.01, -0.3, 0.02],
        axis,
        speed_rad_s: SPIN,
        prestress,
        prestress_of_contact: false,
    }
}
