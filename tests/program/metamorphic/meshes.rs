//! Small dovetail with changes that must not affect the result, written as MSH 4.1.

use std::fmt::Write;

use dovetail::mesh_files;
use dovetail_mesh::{Connectivity, Group, Mesh};
use dovetail_testkit::block::map_nodes;
use dovetail_testkit::folder::root;

/// Groups of the small dovetail that the scene names.
const GROUPS: [&str; 9] = [
    "blade",
    "jaw",
    "blade_flank_left",
    "blade_flank_right",
    "jaw_flank_left",
    "jaw_flank_right",
    "jaw_base",
    "excitation",
    "tip_trailing_edge",
];

/// Mesh in its own unit, millimetres.
pub fn small() -> Mesh {
    let path = root().join("meshes/dovetail_small.msh");
    mesh_files::read(&path, 1.0).unwrap()
}

pub fn scaled(mesh: &Mesh, factor: f64) -> Mesh {
    let mut mesh = mesh.clone();
    map_nodes(&mut mesh, |p| p.map(|x| factor * x));
    mesh
}

pub fn rotated(mesh: &Mesh, q: [[f64; 3]; 3]) -> Mesh {
    let mut mesh = mesh.clone();
    map_nodes(&mut mesh, |p| {
        q.map(|row| row[0] * p[0] + row[1] * p[1] + row[2] * p[2])
    });
    mesh
}

/// Nodes and elements in another order, with other tags; elements begin at another corner.
pub fn renumbered(mesh: &Mesh) -> Mesh {
    let place = permutation(mesh.nodes_m.len(), 1);
    let mut other = mesh.clone();
    for (old, &new) in place.iter().enumerate() {
        other.nodes_m[new as usize] = mesh.nodes_m[old];
    }
    let tags = permutation(mesh.nodes_m.len(), 2);
    other.node_tags = tags.iter().map(|&t| 10 + 3 * u64::from(t)).collect();
    // Even permutations of the corners, with the mid-edge nodes that go with them.
    let tet = [1, 2, 0, 3, 5, 6, 4, 8, 9, 7];
    let facet = [1, 2, 0, 4, 5, 3];
    let shuffled = |elements: &Connectivity, cycle: &[usize], places: &[u32]| {
        let mut turned = vec![Vec::new(); elements.len()];
        for (e, nodes) in elements.iter().enumerate() {
            let mut nodes: Vec<u32> = nodes.iter().map(|&n| place[n as usize]).collect();
            for _ in 0..e % 3 {
                nodes = cycle[..nodes.len()].iter().map(|&a| nodes[a]).collect();
            }
            turned[places[e] as usize] = nodes;
        }
        let mut out = Connectivity::default();
        for (nodes, &tag) in turned.into_iter().zip(elements.tags()) {
            out.push(tag, nodes);
        }
        out
    };
    let tets = permutation(mesh.elements.len(), 3);
    let facets = permutation(mesh.facets.len(), 4);
    other.elements = shuffled(&mesh.elements, &tet, &tets);
    other.facets = shuffled(&mesh.facets, &facet, &facets);
    for group in other.groups.values_mut() {
        let places = if group.dimension == 3 { &tets } else { &facets };
        group
            .elements
            .iter_mut()
            .for_each(|e| *e = places[*e as usize]);
        group.elements.sort_unstable();
        group.nodes.iter_mut().for_each(|n| *n = place[*n as usize]);
        group.nodes.sort_unstable();
    }
    other
}

/// Numbers 0..n in arbitrary order (Fisher and Yates, with a linear congruential generator).
fn permutation(n: usize, seed: u64) -> Vec<u32> {
    let mut order: Vec<u32> = (0..n as u32).collect();
    let mut state = seed;
    for i in (1..n).rev() {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        order.swap(i, ((state >> 33) % (i as u64 + 1)) as usize);
    }
    order
}

/// Mesh as MSH 4.1, ASCII: one entity per group, all digits of every coordinate.
pub fn write(mesh: &Mesh) -> String {
    let groups = GROUPS.map(|name| (name, &mesh.groups[name]));
    let mut text = String::from("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n");
    writeln!(text, "{}", groups.len()).unwrap();
    for (i, (name, group)) in groups.iter().enumerate() {
        writeln!(text, "{} {} \"{name}\"", group.dimension, i + 1).unwrap();
    }
    text += "$EndPhysicalNames\n$Entities\n";
    let counts = [0, 1, 2, 3].map(|d| groups.iter().filter(|(_, g)| g.dimension == d).count());
    writeln!(text, "{}", counts.map(|n| n.to_string()).join(" ")).unwrap();
    for dimension in 0..4 {
        for (i, _) in groups
            .iter()
            .enumerate()
            .filter(|(_, (_, g))| g.dimension == dimension)
        {
            let (bounds, boundary) = match dimension {
                0 => ("0 0 0", ""),
                _ => ("0 0 0 0 0 0", " 0"),
            };
            writeln!(text, "{0} {bounds} 1 {0}{boundary}", i + 1).unwrap();
        }
    }
    text += "$EndEntities\n$Nodes\n";
    let (n, last) = (mesh.nodes_m.len(), mesh.node_tags.iter().max().unwrap());
    writeln!(text, "1 {n} 1 {last}\n3 1 0 {n}").unwrap();
    mesh.node_tags
        .iter()
        .for_each(|t| writeln!(text, "{t}").unwrap());
    for [x, y, z] in &mesh.nodes_m {
        writeln!(text, "{x:?} {y:?} {z:?}").unwrap();
    }
    text += "$EndNodes\n$Elements\n";
    let total: usize = groups.iter().map(|(_, g)| elements(mesh, g).len()).sum();
    writeln!(text, "{} {total} 1 {total}", groups.len()).unwrap();
    let mut tag = 0;
    for (i, (_, group)) in groups.iter().enumerate() {
        let elements = elements(mesh, group);
        let kind = match (group.dimension, elements[0].len()) {
            (0, _) => 15,
            (2, 3) => 2,
            (2, _) => 9,
            (_, 4) => 4,
            (_, _) => 11,
        };
        writeln!(
            text,
            "{} {} {kind} {}",
            group.dimension,
            i + 1,
            elements.len()
        )
        .unwrap();
        for nodes in elements {
            tag += 1;
            write!(text, "{tag}").unwrap();
            // Gmsh has the last two middles of a tetrahedron the other way round.
            let mut nodes = nodes.to_vec();
            if nodes.len() == 10 {
                nodes.swap(8, 9);
            }
            for node in nodes {
                write!(text, " {}", mesh.node_tags[node as usize]).unwrap();
            }
            text.push('\n');
        }
    }
    text + "$EndElements\n"
}

/// Node indices of the elements of a group; the nodes themselves of a group of points.
fn elements<'a>(mesh: &'a Mesh, group: &'a Group) -> Vec<&'a [u32]> {
    match group.dimension {
        0 => group.nodes.chunks_exact(1).collect(),
        2 => group
            .elements
            .iter()
            .map(|&f| mesh.facets.element_nodes(f as usize))
            .collect(),
        _ => group
            .elements
            .iter()
            .map(|&e| mesh.elements.element_nodes(e as usize))
            .collect(),
    }
}
