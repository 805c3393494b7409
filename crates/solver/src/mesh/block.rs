//! Structured box meshes for tests and examples: no file, no mesher, every node known.
//!
//! Each cell is cut into six tetrahedra along its main diagonal (Kuhn), so neighbouring cells match.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use super::{ElementOrder, FACET_EDGES, Group, Mesh, TET_EDGES};
use dovetail_numerics::space;

/// Group of all tetrahedra.
pub const VOLUME: &str = "volume";
/// Groups of the faces, two per direction.
pub const FACES: [[&str; 2]; 3] = [["x_min", "x_max"], ["y_min", "y_max"], ["z_min", "z_max"]];

/// The box `[0, size_m]` of `cells` cells per direction (at least one each). Groups: [`VOLUME`], the
/// six [`FACES`], and the corner points `corner_000` ... `corner_111` (x, y, z; 0 low, 1 high).
/// Tags count from 1 in the order of the nodes, tetrahedra and facets.
pub fn block(order: ElementOrder, cells: [usize; 3], size_m: [f64; 3]) -> Mesh {
    let grid = Grid::new(order, cells);
    let nodes_m = grid.nodes_m(size_m);
    let (mut tets, mut facets) = (Vec::new(), Vec::new());
    let mut face_facets: [[Vec<u32>; 2]; 3] = Default::default();
    for corners in grid.tets() {
        tets.extend(grid.element(&corners, &TET_EDGES));
        for (direction, sides) in face_facets.iter_mut().enumerate() {
            for (side, on_face) in sides.iter_mut().enumerate() {
                let level = side * grid.last[direction];
                let faces = TET_FACES.map(|face| face.map(|v| corners[v]));
                for face in faces
                    .iter()
                    .filter(|f| f.iter().all(|p| p[direction] == level))
                {
                    on_face.push((facets.len() / order.nodes_per_facet()) as u32);
                    facets.extend(grid.element(face, &FACET_EDGES));
                }
            }
        }
    }
    let (tet_count, facet_count) = (
        tets.len() / order.nodes_per_tet(),
        facets.len() / order.nodes_per_facet(),
    );
    let all = (0..tet_count as u32).collect();
    let volume = group(3, all, &tets, order.nodes_per_tet());
    let mut groups = BTreeMap::from([(VOLUME.to_string(), volume)]);
    for (names, sides) in FACES.iter().zip(face_facets) {
        for (name, elements) in names.iter().zip(sides) {
            let face = group(2, elements, &facets, order.nodes_per_facet());
            groups.insert(name.to_string(), face);
        }
    }
    groups.extend((0..8).map(|corner| grid.corner(corner)));
    Mesh {
        order,
        node_tags: (1..=nodes_m.len() as u64).collect(),
        nodes_m,
        tets,
        tet_tags: (1..=tet_count as u64).collect(),
        facets,
        facet_tags: (1..=facet_count as u64).collect(),
        groups,
    }
}

/// The points of a block: its nodes.
struct Grid {
    order: ElementOrder,
    /// Points from one end of a cell to the other: quadratic meshes use the grid of half the
    /// spacing, where the middle of any edge of a tetrahedron is a point.
    step: usize,
    /// Last point in each direction; the first is 0.
    last: [usize; 3],
}

impl Grid {
    fn new(order: ElementOrder, cells: [usize; 3]) -> Self {
        let step = match order {
            ElementOrder::Linear => 1,
            ElementOrder::Quadratic => 2,
        };
        Self {
            order,
            step,
            last: cells.map(|c| c.max(1) * step),
        }
    }

    fn index(&self, p: [usize; 3]) -> u32 {
        let [x, y] = [0, 1].map(|k| self.last[k] + 1);
        (p[0] + x * (p[1] + y * p[2])) as u32
    }

    fn nodes_m(&self, size_m: [f64; 3]) -> Vec<[f64; 3]> {
        let point =
            |p: [usize; 3]| [0, 1, 2].map(|k| size_m[k] * p[k] as f64 / self.last[k] as f64);
        points(self.last.map(|n| n + 1)).map(point).collect()
    }

    /// Corners of the tetrahedra, cell by cell.
    fn tets(&self) -> impl Iterator<Item = [[usize; 3]; 4]> {
        let step = self.step;
        points(self.last.map(|n| n / step)).flat_map(move |cell| {
            PATHS.map(|path| {
                let mut corners = [cell.map(|c| c * step); 4];
                for (k, direction) in path.iter().enumerate() {
                    for corner in &mut corners[k + 1..] {
                        corner[*direction] += step;
                    }
                }
                // Odd permutations of the directions turn the tetrahedron inside out.
                if is_odd(path) {
                    corners.swap(1, 2);
                }
                corners
            })
        })
    }

    /// Nodes of an element with these corners, and of its edges where it is quadratic.
    fn element(&self, corners: &[[usize; 3]], edges: &[[usize; 2]]) -> Vec<u32> {
        let edges = match self.order {
            ElementOrder::Linear => &[],
            ElementOrder::Quadratic => edges,
        };
        let middle = |&[a, b]: &[usize; 2]| [0, 1, 2].map(|k| (corners[a][k] + corners[b][k]) / 2);
        let nodes = corners.iter().copied().chain(edges.iter().map(middle));
        nodes.map(|p| self.index(p)).collect()
    }

    /// Corner 0 to 7 of the block, with its name.
    fn corner(&self, corner: usize) -> (String, Group) {
        let high = [corner >> 2 & 1, corner >> 1 & 1, corner & 1];
        let group = Group {
            dimension: 0,
            elements: Vec::new(),
            nodes: vec![self.index([0, 1, 2].map(|k| high[k] * self.last[k]))],
        };
        (format!("corner_{}{}{}", high[0], high[1], high[2]), group)
    }
}

/// The points below `count` in each direction, the first one fastest.
fn points(count: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    let plane = count[0] * count[1];
    (0..plane * count[2]).map(move |i| [i % count[0], i / count[0] % count[1], i / plane])
}

/// Moves the inner nodes of a [`block`] of size `size_m` by a smooth field of at most `amplitude_m` in
/// each direction; the boundary stays. Edges stay straight: mid-edge nodes follow their corners.
pub fn distort(mesh: &mut Mesh, size_m: [f64; 3], amplitude_m: f64) {
    map_nodes(mesh, |p| {
        let s = [0, 1, 2].map(|k| p[k] / size_m[k]);
        let bubble: f64 = s.iter().map(|s| (PI * s).sin()).product();
        let wave = [
            (3.0 * s[1] + 5.0 * s[2]).cos(),
            (4.0 * s[2] + 2.0 * s[0] + 1.0).sin(),
            (6.0 * s[0] - 3.0 * s[1]).cos(),
        ];
        [0, 1, 2].map(|k| p[k] + amplitude_m * bubble * wave[k])
    });
    straighten(mesh);
}

/// Moves every node to `map(position)`; edges of quadratic elements become curves.
pub fn map_nodes(mesh: &mut Mesh, map: impl Fn([f64; 3]) -> [f64; 3]) {
    for p in &mut mesh.nodes_m {
        *p = map(*p);
    }
}

/// Puts the mid-edge nodes of quadratic elements back on the middle of their corners.
pub fn straighten(mesh: &mut Mesh) {
    if mesh.order == ElementOrder::Linear {
        return;
    }
    for tet in mesh.tets.chunks_exact(10) {
        for (edge, [a, b]) in TET_EDGES.iter().enumerate() {
            let (a, b) = (
                mesh.nodes_m[tet[*a] as usize],
                mesh.nodes_m[tet[*b] as usize],
            );
            mesh.nodes_m[tet[4 + edge] as usize] = space::middle(a, b);
        }
    }
}

/// Both meshes in one, nothing welded: a two-body mesh as a mesher would write it. Group `g` of the
/// first becomes `<first name>_g`; likewise the second, whose tags go on where the first's end.
///
/// # Panics
/// If the orders of the two meshes differ.
pub fn side_by_side(first: (&str, &Mesh), second: (&str, &Mesh)) -> Mesh {
    let (name_a, a) = first;
    let (name_b, b) = second;
    assert_eq!(a.order, b.order, "both meshes must have the same order");
    let after = |tags: &[u64]| tags.iter().max().copied().unwrap_or(0);
    let mut joined = a.clone();
    joined.nodes_m.extend(&b.nodes_m);
    joined
        .node_tags
        .extend(b.node_tags.iter().map(|t| t + after(&a.node_tags)));
    let shift = a.nodes_m.len() as u32;
    joined.tets.extend(b.tets.iter().map(|n| n + shift));
    joined
        .tet_tags
        .extend(b.tet_tags.iter().map(|t| t + after(&a.tet_tags)));
    joined.facets.extend(b.facets.iter().map(|n| n + shift));
    joined
        .facet_tags
        .extend(b.facet_tags.iter().map(|t| t + after(&a.facet_tags)));
    joined.groups = a
        .groups
        .iter()
        .map(|(g, v)| (format!("{name_a}_{g}"), v.clone()))
        .collect();
    for (name, group) in &b.groups {
        let first_element = match group.dimension {
            3 => a.tet_tags.len(),
            _ => a.facet_tags.len(),
        } as u32;
        let group = Group {
            dimension: group.dimension,
            elements: group.elements.iter().map(|e| e + first_element).collect(),
            nodes: group.nodes.iter().map(|n| n + shift).collect(),
        };
        joined.groups.insert(format!("{name_b}_{name}"), group);
    }
    joined
}

/// Orders in which the three directions are walked from one end of a cell's diagonal to the other.
const PATHS: [[usize; 3]; 6] = [
    [0, 1, 2],
    [1, 2, 0],
    [2, 0, 1],
    [0, 2, 1],
    [1, 0, 2],
    [2, 1, 0],
];
/// Corners of the faces, normals outwards.
const TET_FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

fn is_odd(path: [usize; 3]) -> bool {
    (path[1] + 3 - path[0]) % 3 == 2
}

fn group(dimension: u8, elements: Vec<u32>, connectivity: &[u32], per_element: usize) -> Group {
    let mut nodes: Vec<u32> = elements
        .iter()
        .flat_map(|&e| &connectivity[e as usize * per_element..(e as usize + 1) * per_element])
        .copied()
        .collect();
    nodes.sort_unstable();
    nodes.dedup();
    Group {
        dimension,
        elements,
        nodes,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use dovetail_numerics::space::{cross, distance, dot, norm, sub};

    /// Volume of the straight tetrahedron, positive when its corners are in Gmsh's order.
    fn volume(mesh: &Mesh, e: usize) -> f64 {
        let [o, a, b, c] = [0, 1, 2, 3].map(|v| mesh.nodes_m[mesh.tet(e)[v] as usize]);
        dot(cross(sub(a, o), sub(b, o)), sub(c, o)) / 6.0
    }

    #[test]
    fn tets_fill_the_box_and_point_outwards_even_when_distorted() {
        for order in [ElementOrder::Linear, ElementOrder::Quadratic] {
            let size = [2.0, 3.0, 0.5];
            let mut mesh = block(order, [3, 2, 4], size);
            for amplitude in [0.0, 0.03] {
                distort(&mut mesh, size, amplitude);
                let volumes: Vec<f64> = (0..mesh.tet_count()).map(|e| volume(&mesh, e)).collect();
                assert_eq!(volumes.len(), 3 * 2 * 4 * 6);
                assert!(volumes.iter().all(|&v| v > 0.0));
                assert!((volumes.iter().sum::<f64>() - 3.0).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn distortion_moves_inner_nodes_and_keeps_the_boundary() {
        let size = [1.0, 1.0, 1.0];
        let straight = block(ElementOrder::Quadratic, [3, 3, 3], size);
        let mut moved = straight.clone();
        distort(&mut moved, size, 0.05);
        let mut inner = 0;
        for (a, b) in straight.nodes_m.iter().zip(&moved.nodes_m) {
            let at_face = a.iter().any(|&x| x == 0.0 || x == 1.0);
            let distance = distance(*a, *b);
            if at_face {
                assert!(distance < 1e-15);
            } else {
                inner += usize::from(distance > 1e-3);
            }
        }
        assert!(inner > 50, "{inner} inner nodes moved");
    }

    #[test]
    fn mid_edge_nodes_are_halfway_in_gmsh_order() {
        let mesh = block(ElementOrder::Quadratic, [2, 1, 2], [1.0, 2.0, 3.0]);
        let at = |n: u32| mesh.nodes_m[n as usize];
        let halfway = |m: u32, a: u32, b: u32| {
            let mean = space::middle(at(a), at(b));
            assert!(distance(at(m), mean) < 1e-15);
        };
        for e in 0..mesh.tet_count() {
            let t = mesh.tet(e);
            halfway(t[8], t[2], t[3]);
            halfway(t[9], t[1], t[3]);
            halfway(t[6], t[0], t[2]);
        }
        for f in 0..mesh.facet_tags.len() {
            let t = mesh.facet(f);
            halfway(t[3], t[0], t[1]);
            halfway(t[4], t[1], t[2]);
            halfway(t[5], t[0], t[2]);
        }
    }

    #[test]
    fn groups_name_faces_and_corners() {
        for (order, face_nodes) in [(ElementOrder::Linear, 12), (ElementOrder::Quadratic, 35)] {
            let mesh = block(order, [4, 2, 3], [4.0, 2.0, 3.0]);
            let face = &mesh.groups["x_max"];
            assert_eq!(
                (face.dimension, face.elements.len(), face.nodes.len()),
                (2, 12, face_nodes)
            );
            assert!(
                face.nodes
                    .iter()
                    .all(|&n| mesh.nodes_m[n as usize][0] == 4.0)
            );
            let area: f64 = face
                .elements
                .iter()
                .map(|&f| {
                    let [a, b, c] =
                        [0, 1, 2].map(|v| mesh.nodes_m[mesh.facet(f as usize)[v] as usize]);
                    let normal = cross(sub(b, a), sub(c, a));
                    assert!(normal[0] > 0.0, "facet normals point outwards");
                    0.5 * norm(normal)
                })
                .sum();
            assert!((area - 6.0).abs() < 1e-14);
            let corner = mesh.groups["corner_101"].nodes[0] as usize;
            assert_eq!(mesh.nodes_m[corner], [4.0, 0.0, 3.0]);
            assert_eq!(mesh.groups[VOLUME].nodes.len(), mesh.nodes_m.len());
        }
    }

    #[test]
    fn side_by_side_keeps_both_meshes_apart() {
        let a = block(ElementOrder::Quadratic, [1, 1, 1], [1.0; 3]);
        let mut b = block(ElementOrder::Quadratic, [2, 1, 1], [1.0; 3]);
        map_nodes(&mut b, |p| [p[0] + 1.0, p[1], p[2]]);
        let both = side_by_side(("blade", &a), ("jaw", &b));
        assert_eq!(both.tet_count(), 18);
        let jaw = &both.groups["jaw_x_min"];
        assert!(
            jaw.nodes
                .iter()
                .all(|&n| both.nodes_m[n as usize][0] == 1.0 && n >= 27)
        );
        assert!(jaw.elements.iter().all(|&f| {
            both.facet(f as usize)
                .iter()
                .all(|n| jaw.nodes.binary_search(n).is_ok())
        }));
        assert_eq!(both.groups["blade_volume"].elements.len(), 6);
        assert_eq!(both.node_tags.last(), Some(&(27 + 45)));
    }
}
