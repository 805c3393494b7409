//! Structured box meshes: no file, no mesher, every node known.
//!
//! Each cell is one hexahedron, two wedges, six pyramids about its middle, or six tetrahedra along its
//! main diagonal (Kuhn); neighbouring cells match.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use dovetail_mesh::formats::Content;
use dovetail_mesh::{Connectivity, ElementOrder, ElementType, Group, Mesh, Shape};
use dovetail_numerics::space;

/// Group of all elements.
pub const VOLUME: &str = "volume";
/// Groups of the faces, two per direction.
pub const FACES: [[&str; 2]; 3] = [["x_min", "x_max"], ["y_min", "y_max"], ["z_min", "z_max"]];

/// The box `[0, size_m]` of `cells` cells per direction (at least one each), all of one type of element.
/// Groups: [`VOLUME`], the six [`FACES`], and the corner points `corner_000` ... `corner_111` (x, y, z; 0
/// low, 1 high). Tags count from 1 in the order of the nodes, elements and facets.
pub fn block(element: ElementType, cells: [usize; 3], size_m: [f64; 3]) -> Mesh {
    let cell = |_| match element.shape {
        Shape::Tetrahedron => tetrahedra(),
        Shape::Pyramid => pyramids(false),
        Shape::Wedge => wedges(),
        Shape::Hexahedron => hexahedron(),
    };
    filled(element.order, cells, size_m, cell)
}

/// The same as [`block`], with elements of all shapes: along x a third hexahedra, a sixth wedges, a
/// third pyramids (in the last cells of these with two tetrahedra) and a sixth tetrahedra. Six
/// cells or more have all.
pub fn mixed_block(order: ElementOrder, cells: [usize; 3], size_m: [f64; 3]) -> Mesh {
    let sixth = |x: usize| 6 * x / cells[0].max(1);
    filled(order, cells, size_m, |x| match sixth(x) {
        0 | 1 => hexahedron(),
        2 => wedges(),
        3 | 4 => pyramids(sixth(x + 1) == 5),
        _ => tetrahedra(),
    })
}

/// Corners of an element, in halves of a cell.
type Corners = Vec<[usize; 3]>;

/// Points of a cell, in halves of it: the corners as those of a hexahedron.
const CELL: [[usize; 3]; 8] = [
    [0, 0, 0],
    [2, 0, 0],
    [2, 2, 0],
    [0, 2, 0],
    [0, 0, 2],
    [2, 0, 2],
    [2, 2, 2],
    [0, 2, 2],
];

fn hexahedron() -> Vec<Corners> {
    vec![CELL.to_vec()]
}

/// Two, cut along the diagonal of their triangles.
fn wedges() -> Vec<Corners> {
    [[0, 1, 2, 4, 5, 6], [0, 2, 3, 4, 6, 7]]
        .map(|wedge| wedge.map(|i| CELL[i]).to_vec())
        .to_vec()
}

/// One on each face, with the apex in the middle; where the next cell along x is of tetrahedra the last
/// one is two of them.
fn pyramids(before_tetrahedra: bool) -> Vec<Corners> {
    const TOWARDS_X: usize = 3;
    let mut pyramids = Vec::new();
    for (i, face) in Shape::Hexahedron.faces().iter().enumerate() {
        // The base is seen from inside, and so is that of a tetrahedron.
        let base: Corners = face.iter().rev().map(|&corner| CELL[corner]).collect();
        let mut with_apex = |base: &[usize], corners: &Corners| {
            let mut element: Corners = base.iter().map(|&i| corners[i]).collect();
            element.push([1, 1, 1]);
            pyramids.push(element);
        };
        if before_tetrahedra && i == TOWARDS_X {
            let from = base.iter().position(|p| *p == [2, 0, 0]).unwrap_or(0);
            for [p, q] in [[1, 2], [2, 3]] {
                with_apex(&[from, (from + p) % 4, (from + q) % 4], &base);
            }
        } else {
            with_apex(&[0, 1, 2, 3], &base);
        }
    }
    pyramids
}

/// Six, along the main diagonal.
fn tetrahedra() -> Vec<Corners> {
    let of_path = |path: [usize; 3]| {
        let mut corners = vec![[0; 3]; 4];
        for (k, direction) in path.iter().enumerate() {
            for corner in &mut corners[k + 1..] {
                corner[*direction] += 2;
            }
        }
        // Odd permutations of the directions turn the tetrahedron inside out.
        if is_odd(path) {
            corners.swap(1, 2);
        }
        corners
    };
    PATHS.map(of_path).to_vec()
}

/// The box, each cell filled with the elements of its place along x.
fn filled(
    order: ElementOrder,
    cells: [usize; 3],
    size_m: [f64; 3],
    cell: impl Fn(usize) -> Vec<Corners>,
) -> Mesh {
    let grid = Grid {
        order,
        last: cells.map(|c| c.max(1) * STEP),
    };
    let (mut elements, mut facets) = (Connectivity::default(), Connectivity::default());
    let mut face_facets: [[Vec<u32>; 2]; 3] = Default::default();
    for place in points(cells.map(|c| c.max(1))) {
        for corners in cell(place[0]) {
            let at = |p: &[usize; 3]| [0, 1, 2].map(|k| place[k] * STEP + p[k] * STEP / 2);
            let corners: Corners = corners.iter().map(at).collect();
            let (element, nodes) = grid.element(&corners);
            for (direction, sides) in face_facets.iter_mut().enumerate() {
                for (side, on_face) in sides.iter_mut().enumerate() {
                    let level = side * grid.last[direction];
                    for (f, face) in element.shape.faces().iter().enumerate() {
                        if face.iter().all(|&i| corners[i][direction] == level) {
                            on_face.push(facets.len() as u32);
                            facets.push(facets.len() as u64 + 1, element.face_of(f, &nodes));
                        }
                    }
                }
            }
            elements.push(elements.len() as u64 + 1, nodes);
        }
    }
    let volume = group(3, (0..elements.len() as u32).collect(), &elements);
    let mut groups = BTreeMap::from([(VOLUME.to_string(), volume)]);
    for (names, sides) in FACES.iter().zip(face_facets) {
        for (name, on_face) in names.iter().zip(sides) {
            groups.insert(name.to_string(), group(2, on_face, &facets));
        }
    }
    groups.extend((0..8).map(|corner| grid.corner(corner)));
    let points = grid.nodes_m(size_m);
    let content = Content {
        node_tags: (1..=points.len() as u64).collect(),
        nodes: points,
        elements,
        facets,
        groups,
        ..Content::default()
    };
    // Without the points that no element has.
    let mut mesh = content
        .into_mesh(1.0.into())
        .expect("a box of elements is a mesh");
    mesh.node_tags = (1..=mesh.nodes_m.len() as u64).collect();
    mesh
}

/// Points of the grid from one end of a cell to the other: the middle of any edge is one, also of those
/// to the middle of the cell.
const STEP: usize = 4;

/// The points of a block, of which its nodes are some.
struct Grid {
    order: ElementOrder,
    /// Last point in each direction; the first is 0.
    last: [usize; 3],
}

impl Grid {
    fn index(&self, p: [usize; 3]) -> u32 {
        let [x, y] = [0, 1].map(|k| self.last[k] + 1);
        (p[0] + x * (p[1] + y * p[2])) as u32
    }

    fn nodes_m(&self, size_m: [f64; 3]) -> Vec<[f64; 3]> {
        let point =
            |p: [usize; 3]| [0, 1, 2].map(|k| size_m[k] * p[k] as f64 / self.last[k] as f64);
        points(self.last.map(|n| n + 1)).map(point).collect()
    }

    /// Type and nodes of the element with these corners.
    fn element(&self, corners: &[[usize; 3]]) -> (ElementType, Vec<u32>) {
        let linear =
            ElementType::from_node_count(corners.len()).expect("corners are those of a shape");
        let element = ElementType::new(linear.shape, self.order);
        let edges = match self.order {
            ElementOrder::Linear => &[],
            ElementOrder::Quadratic => element.shape.edges(),
        };
        let middle = |&[a, b]: &[usize; 2]| [0, 1, 2].map(|k| (corners[a][k] + corners[b][k]) / 2);
        let nodes = corners.iter().copied().chain(edges.iter().map(middle));
        (element, nodes.map(|p| self.index(p)).collect())
    }

    /// Corner 0 to 7 of the block, with its name.
    fn corner(&self, corner: usize) -> (String, Group) {
        let high = [corner >> 2 & 1, corner >> 1 & 1, corner & 1];
        let group = Group {
            nodes: vec![self.index([0, 1, 2].map(|k| high[k] * self.last[k]))],
            ..Group::empty(0)
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
    for (ElementType { shape, .. }, nodes) in mesh.elements.solids() {
        for (&middle, &[a, b]) in nodes[shape.corners()..].iter().zip(shape.edges()) {
            let [a, b] = [a, b].map(|i| mesh.nodes_m[nodes[i] as usize]);
            mesh.nodes_m[middle as usize] = space::middle(a, b);
        }
    }
}

/// Both meshes in one, nothing welded: a two-body mesh as a mesher would write it. Group `g` of the
/// first becomes `<first name>_g`; likewise the second, whose tags go on where the first's end.
pub fn side_by_side(first: (&str, &Mesh), second: (&str, &Mesh)) -> Mesh {
    let after = |list: &Connectivity| list.tags().iter().max().copied().unwrap_or(0);
    let mut both = Mesh::default();
    for (name, mesh) in [first, second] {
        let mut mesh = mesh.clone();
        let last = both.node_tags.iter().max().copied().unwrap_or(0);
        mesh.node_tags.iter_mut().for_each(|tag| *tag += last);
        mesh.elements.shift_tags(after(&both.elements));
        mesh.facets.shift_tags(after(&both.facets));
        both.add_part(name, &mesh);
    }
    let groups = std::mem::take(&mut both.groups).into_iter();
    both.groups = groups
        .map(|(name, group)| (name.replacen('.', "_", 1), group))
        .collect();
    both
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

fn is_odd(path: [usize; 3]) -> bool {
    (path[1] + 3 - path[0]) % 3 == 2
}

fn group(dimension: u8, elements: Vec<u32>, list: &Connectivity) -> Group {
    let nodes = elements
        .iter()
        .flat_map(|&e| list.element_nodes(e as usize));
    let mut nodes: Vec<u32> = nodes.copied().collect();
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

    use dovetail_numerics::space::{cross, distance, norm, sub};

    #[test]
    fn elements_fill_the_box_and_point_outwards_even_when_distorted() {
        let size = [2.0, 3.0, 0.5];
        let of_one_type = ElementType::ALL.map(|element| {
            let per_cell = match element.shape {
                Shape::Tetrahedron | Shape::Pyramid => 6,
                Shape::Wedge => 2,
                Shape::Hexahedron => 1,
            };
            (block(element, [5, 2, 4], size), 5 * 2 * 4 * per_cell)
        });
        let mixed = [ElementOrder::Linear, ElementOrder::Quadratic].map(|order| {
            (
                mixed_block(order, [6, 2, 4], size),
                2 * 4 * (1 + 1 + 2 + 6 + 7 + 6),
            )
        });
        for (mut mesh, count) in of_one_type.into_iter().chain(mixed) {
            assert_eq!(mesh.elements.len(), count);
            for amplitude in [0.0, 0.03] {
                distort(&mut mesh, size, amplitude);
                // Inside out, folded, joined badly: all of that is an error.
                let found = dovetail_mesh::quality::check(&mesh).unwrap();
                assert!((found.volume_m3 - 3.0).abs() < 1e-13, "{found:?}");
            }
        }
    }

    #[test]
    fn distortion_moves_inner_nodes_and_keeps_the_boundary() {
        let size = [1.0, 1.0, 1.0];
        let straight = block(ElementType::TET10, [3, 3, 3], size);
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
    fn mid_edge_nodes_are_halfway() {
        let mesh = block(ElementType::TET10, [2, 1, 2], [1.0, 2.0, 3.0]);
        let at = |n: u32| mesh.nodes_m[n as usize];
        let halfway = |m: u32, a: u32, b: u32| {
            let mean = space::middle(at(a), at(b));
            assert!(distance(at(m), mean) < 1e-15);
        };
        for e in 0..mesh.elements.len() {
            let t = mesh.elements.element_nodes(e);
            halfway(t[8], t[1], t[3]);
            halfway(t[9], t[2], t[3]);
            halfway(t[6], t[0], t[2]);
        }
        for f in 0..mesh.facets.len() {
            let t = mesh.facets.element_nodes(f);
            halfway(t[3], t[0], t[1]);
            halfway(t[4], t[1], t[2]);
            halfway(t[5], t[0], t[2]);
        }
    }

    #[test]
    fn groups_name_faces_and_corners() {
        for (element, face_nodes) in [(ElementType::TET4, 12), (ElementType::TET10, 35)] {
            let mesh = block(element, [4, 2, 3], [4.0, 2.0, 3.0]);
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
                    let [a, b, c] = [0, 1, 2]
                        .map(|v| mesh.nodes_m[mesh.facets.element_nodes(f as usize)[v] as usize]);
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
        let a = block(ElementType::TET10, [1, 1, 1], [1.0; 3]);
        let mut b = block(ElementType::TET10, [2, 1, 1], [1.0; 3]);
        map_nodes(&mut b, |p| [p[0] + 1.0, p[1], p[2]]);
        let both = side_by_side(("blade", &a), ("jaw", &b));
        assert_eq!(both.elements.len(), 18);
        let jaw = &both.groups["jaw_x_min"];
        assert!(
            jaw.nodes
                .iter()
                .all(|&n| both.nodes_m[n as usize][0] == 1.0 && n >= 27)
        );
        assert!(jaw.elements.iter().all(|&f| {
            both.facets
                .element_nodes(f as usize)
                .iter()
                .all(|n| jaw.nodes.binary_search(n).is_ok())
        }));
        assert_eq!(both.groups["blade_volume"].elements.len(), 6);
        assert_eq!(both.node_tags.last(), Some(&(27 + 45)));
    }
}
